//! Statistics of a few noisy times: pure functions, free of any assumption about how the noise is distributed.

use serde::{Deserialize, Serialize};

/// The confidence that intervals are asked for.
pub const CONFIDENCE: f64 = 0.95;

/// The median, halfway between the middle two of an even number; `None` without samples.
pub fn median(samples: &[f64]) -> Option<f64> {
    let sorted = ascending(samples);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => None,
        n if n % 2 == 1 => Some(sorted[middle]),
        _ => Some(0.5 * (sorted[middle - 1] + sorted[middle])),
    }
}

/// A range that covers the true median with at least the stated confidence.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

/// The interval between the k-th smallest and the k-th largest sample for the largest `k` whose coverage,
/// `1 - 2 P(Binomial(n, 1/2) < k)`, is at least [`CONFIDENCE`]. It holds for independent samples of any distribution.
/// `None` below six samples, where even smallest to largest covers less.
pub fn median_interval(samples: &[f64]) -> Option<Interval> {
    let sorted = ascending(samples);
    let n = sorted.len();
    let mut probability = 0.5f64.powi(n as i32);
    let (mut below, mut rank) = (0.0, 0);
    // `below` is P(Binomial(n, 1/2) <= rank) once the term of `rank` is added.
    while rank < n.div_ceil(2) && 1.0 - 2.0 * (below + probability) >= CONFIDENCE {
        below += probability;
        probability *= (n - rank) as f64 / (rank + 1) as f64;
        rank += 1;
    }
    let k = rank.checked_sub(1)?;
    Some(Interval { low: sorted[k], high: sorted[n - 1 - k] })
}

/// The standard deviation of samples, with `n - 1` in the denominator; `None` below two samples.
pub fn standard_deviation(samples: &[f64]) -> Option<f64> {
    let n = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / n;
    let squares: f64 = samples.iter().map(|x| (x - mean) * (x - mean)).sum();
    (samples.len() > 1).then(|| (squares / (n - 1.0)).sqrt())
}

fn ascending(samples: &[f64]) -> Vec<f64> {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// A median with what is known about it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    pub median: f64,
    /// `None` where there are too few samples for one.
    pub interval: Option<Interval>,
    /// The number of independent samples: rounds, each in processes of their own.
    pub samples: usize,
}

impl Estimate {
    /// `None` without samples.
    pub fn of(samples: &[f64]) -> Option<Estimate> {
        let median = median(samples)?;
        Some(Estimate { median, interval: median_interval(samples), samples: samples.len() })
    }

    /// The same in another unit.
    pub fn scaled(self, factor: f64) -> Estimate {
        let interval = self.interval.map(|i| Interval { low: i.low * factor, high: i.high * factor });
        Estimate { median: self.median * factor, interval, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standard_deviation_is_that_of_a_sample() {
        assert_eq!(standard_deviation(&[1.0]), None);
        assert_eq!(
            standard_deviation(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]),
            Some((32.0f64 / 7.0).sqrt())
        );
    }

    #[test]
    fn medians() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[3.0]), Some(3.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 9.0]), Some(3.0));
    }

    /// The ranks of Hahn & Meeker's tables of distribution-free intervals: 6 to 8 samples need the extremes, 9 to 11
    /// may leave one out on each side, 12 to 14 two, 25 seven.
    #[test]
    fn intervals_take_the_tabulated_ranks() {
        for (n, rank) in [(6, 1), (8, 1), (9, 2), (11, 2), (12, 3), (14, 3), (15, 4), (20, 6), (25, 8)] {
            let samples: Vec<f64> = (1..=n).map(f64::from).collect();
            let interval = median_interval(&samples).unwrap();
            assert_eq!((interval.low, interval.high), (f64::from(rank), f64::from(n + 1 - rank)), "{n}");
        }
        for n in 0..6 {
            assert_eq!(median_interval(&vec![1.0; n]), None);
        }
    }

    /// Coverage on a skewed, heavy-tailed distribution: at least 95 %, and not absurdly more.
    #[test]
    fn intervals_cover_the_true_median() {
        let mut random = fastrand::Rng::with_seed(1);
        for n in [6, 9, 12, 25] {
            let trials = 4000;
            let covered = (0..trials)
                .filter(|_| {
                    let samples: Vec<f64> = (0..n).map(|_| (-random.f64().ln()).powi(3)).collect();
                    let interval = median_interval(&samples).unwrap();
                    let truth = 2f64.ln().powi(3);
                    interval.low <= truth && truth <= interval.high
                })
                .count();
            let coverage = covered as f64 / trials as f64;
            assert!((0.94..0.995).contains(&coverage), "{n}: {coverage}");
        }
    }
}
