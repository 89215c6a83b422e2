//! Statistics of a few noisy times: pure functions, free of any assumption about how the noise is distributed.
//!
//! The samples of a cell are its rounds in the order in which they were measured. Times of two cells are compared by the
//! logarithm of their ratio within each round, so that what disturbs a whole round cancels; the random order of the
//! cells in a round makes what is left independent, even on a machine that drifts. `tests/statistics_coverage` measures
//! on synthetic rounds how often intervals cover and how often a verdict is wrong.

mod comparison;
mod dependence;
mod estimate;
mod interval;
mod noise_floor;
mod outliers;
pub mod stopping;

pub use comparison::{Comparison, Unresolved, Verdict, compare, holm};
pub use dependence::{effective_rounds, variance_inflation};
pub use estimate::Estimate;
pub use interval::{Interval, NoInterval, interval_of_rounds, median_interval, samples_needed};
pub use noise_floor::{NoiseFloor, noise_floor};
pub use outliers::outliers;

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
}
