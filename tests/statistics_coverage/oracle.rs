//! The best interval about a sample's median: by somebody who knows the distribution of the noise.

use std::collections::BTreeMap;

use repro::base::statistics::median;

/// How many medians the oracle has seen for each number of rounds.
const SEEN: usize = 10_000;

/// The errors of the medians of so many rounds, ascending.
pub struct Oracle {
    errors: BTreeMap<usize, Vec<f64>>,
}

impl Oracle {
    pub fn new(rounds: &[usize], truth: f64, mut experiment: impl FnMut() -> Vec<f64>) -> Oracle {
        let mut errors: BTreeMap<usize, Vec<f64>> = rounds.iter().map(|&n| (n, Vec::new())).collect();
        for _ in 0..SEEN {
            let samples = experiment();
            for (&n, errors) in &mut errors {
                errors.push(median(&samples[..n]).unwrap() - truth);
            }
        }
        errors.values_mut().for_each(|errors| errors.sort_by(f64::total_cmp));
        Oracle { errors }
    }

    /// The width of the shortest interval, at fixed distances from the median of so many rounds, that covers the truth
    /// with a probability.
    pub fn width(&self, rounds: usize, coverage: f64) -> f64 {
        let errors = &self.errors[&rounds];
        let covered = ((coverage * SEEN as f64).ceil() as usize).min(SEEN);
        let widths = (0..=SEEN - covered).map(|first| errors[first + covered - 1] - errors[first]);
        widths.fold(f64::INFINITY, f64::min)
    }
}
