//! How often a loop must run to be timed, and what several times say: pure functions of a stopwatch.

use anyhow::{Result, ensure};

use crate::base::statistics::median;

/// More passes than any machine makes in a repetition.
const MOST_PASSES: usize = 1 << 40;

/// What repetitions found, in a unit a second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    pub median: f64,
    pub lowest: f64,
    pub highest: f64,
}

/// The rates of `repetitions` runs, each long enough to take `target_s`. `time` runs so many passes and says how long they
/// took, seconds; a pass does `work`. What is run to find the number of passes warms up, and counts for nothing.
pub fn rates(
    work: f64,
    target_s: f64,
    repetitions: usize,
    mut time: impl FnMut(usize) -> f64,
) -> Result<Rates> {
    let mut passes = 1;
    loop {
        let took_s = time(passes);
        if took_s >= target_s {
            break;
        }
        ensure!(passes < MOST_PASSES, "a loop takes no time");
        passes = more_passes(passes, took_s, target_s);
    }
    let found: Vec<f64> = (0..repetitions).map(|_| work * passes as f64 / time(passes)).collect();
    Rates::of(&found)
}

/// As many passes as should take a little more than the target, and at least twice, at most ten times as many as before:
/// the first ones also pay for pages that nobody had touched.
fn more_passes(passes: usize, took_s: f64, target_s: f64) -> usize {
    let factor = (1.2 * target_s / took_s.max(1e-9)).clamp(2.0, 10.0);
    (passes as f64 * factor).ceil() as usize
}

impl Rates {
    fn of(found: &[f64]) -> Result<Rates> {
        ensure!(found.iter().all(|rate| rate.is_finite()), "a clock stood still");
        let median = median(found);
        ensure!(median.is_some(), "a loop was not repeated");
        Ok(Rates {
            median: median.unwrap_or(f64::NAN),
            lowest: found.iter().copied().fold(f64::INFINITY, f64::min),
            highest: found.iter().copied().fold(0.0, f64::max),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_grow_until_they_take_long_enough() {
        let mut asked = Vec::new();
        let found = rates(8.0, 0.01, 3, |passes| {
            asked.push(passes);
            1e-4 * passes as f64
        });
        let found = found.unwrap();
        assert!(asked[..asked.len() - 3].windows(2).all(|pair| pair[1] >= 2 * pair[0]));
        let last = *asked.last().unwrap();
        assert!(asked[asked.len() - 4..].iter().all(|&passes| passes == last));
        assert!((100..=300).contains(&last), "{asked:?}");
        assert!(
            [found.median, found.lowest, found.highest].iter().all(|rate| (rate / 8e4 - 1.0).abs() < 1e-12)
        );
    }

    #[test]
    fn the_median_stands_between_the_extremes() {
        let mut times = [1.0, 1.0, 2.0, 4.0].into_iter();
        let found = rates(4.0, 0.5, 3, |_| times.next().unwrap()).unwrap();
        assert_eq!(found, Rates { median: 2.0, lowest: 1.0, highest: 4.0 });
    }

    #[test]
    fn a_clock_that_stands_still_is_an_error() {
        assert!(rates(1.0, 0.01, 3, |_| 0.0).is_err());
        let mut times = [1.0, 0.0].into_iter();
        assert!(rates(1.0, 0.5, 1, |_| times.next().unwrap()).is_err());
    }
}
