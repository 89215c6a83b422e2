//! The noise floor of a machine: how far two identical cells, measured in the same rounds, seem to differ.

use serde::{Deserialize, Serialize};

use super::{Estimate, median};

/// What control cells say: two that do the same work by the same code.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NoiseFloor {
    /// The median over the rounds of `|ln(a/b)|`: how far apart two equal cells typically are in one round.
    pub typical: f64,
    /// The largest of them.
    pub largest: f64,
    /// The ratio of the two, which should be one.
    pub ratio: Estimate,
}

impl NoiseFloor {
    /// Whether the interval of the ratio contains one; `None` where there is no interval. `false` means that the place
    /// of a cell in its round, or something else that is not its work, changes its time.
    pub fn contains_one(&self) -> Option<bool> {
        self.ratio.interval.map(|interval| interval.contains(1.0))
    }

    /// `|ln(ratio)|` below which an effect is not resolved: the end of the interval that is farther from one, since two
    /// equal cells may differ by as much; the largest difference seen where there are too few rounds for an interval.
    pub fn level(&self) -> f64 {
        match self.ratio.interval {
            Some(interval) => interval.low.ln().abs().max(interval.high.ln().abs()),
            None => self.largest,
        }
    }
}

/// The noise floor from the times of two identical cells, paired by round. `None` where there is no pair, where not
/// every time has its partner, or where one is no positive number.
pub fn noise_floor(a: &[f64], b: &[f64]) -> Option<NoiseFloor> {
    let times = || a.iter().chain(b);
    if a.len() != b.len() || !times().all(|&time| time > 0.0 && time.is_finite()) {
        return None;
    }
    let logarithms: Vec<f64> = a.iter().zip(b).map(|(a, b)| (a / b).ln()).collect();
    let distances: Vec<f64> = logarithms.iter().map(|x| x.abs()).collect();
    Some(NoiseFloor {
        typical: median(&distances)?,
        largest: distances.iter().copied().fold(0.0, f64::max),
        ratio: Estimate::of_rounds(&logarithms)?.map(f64::exp),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-12, "{found} instead of {expected}");
    }

    /// Logarithms -3, -2, -1, 1, 2, 3 hundredths: the interval of six rounds is smallest to largest.
    #[test]
    fn the_level_is_the_far_end_of_the_interval() {
        let a = [-0.03f64, -0.02, -0.01, 0.01, 0.02, 0.03].map(f64::exp);
        let floor = noise_floor(&a, &[1.0; 6]).unwrap();
        close(floor.typical, 0.02);
        close(floor.ratio.median, 1.0);
        close(floor.level(), 0.03);
        assert_eq!(floor.contains_one(), Some(true));
    }

    #[test]
    fn a_place_that_is_always_slower_shows() {
        let floor = noise_floor(&[1.01, 1.02, 1.03, 1.01, 1.02, 1.03], &[1.0; 6]).unwrap();
        assert_eq!(floor.contains_one(), Some(false));
        close(floor.level(), 1.03f64.ln());
    }

    #[test]
    fn few_rounds_have_a_floor_but_no_interval() {
        let floor = noise_floor(&[1.0, 2.0, 1.0], &[1.0, 1.0, 4.0]).unwrap();
        assert_eq!((floor.contains_one(), floor.ratio.interval), (None, None));
        close(floor.level(), 4f64.ln());
        close(floor.typical, 2f64.ln());
    }

    #[test]
    fn what_cannot_be_paired_has_no_floor() {
        assert_eq!(noise_floor(&[], &[]), None);
        assert_eq!(noise_floor(&[1.0, 1.0], &[1.0]), None);
        assert_eq!(noise_floor(&[1.0, 0.0], &[1.0, 1.0]), None);
        assert_eq!(noise_floor(&[1.0, f64::NAN], &[1.0, 1.0]), None);
    }
}
