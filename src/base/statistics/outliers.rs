//! Times that stand apart from the others: they are flagged, and stay in every estimate.

use super::median;

/// How many standard deviations from the median a sample must lie; the deviation is estimated from medians, so that
/// outliers do not hide one another.
const DEVIATIONS: f64 = 5.0;

/// The samples below which none is flagged.
const LEAST: usize = 6;

/// The standard deviation of normal samples over the median of their absolute deviations, and over their mean.
const PER_MEDIAN_DEVIATION: f64 = 1.4826;
const PER_MEAN_DEVIATION: f64 = 1.2533;

/// The places of those times, all in the same unit, whose logarithm lies more than five robust standard deviations from
/// the median of all logarithms, and of those that are no positive numbers.
///
/// The deviation is 1.4826 times the median absolute one. Where that is zero, since most times are equal to the clock's
/// last digit, it is 1.2533 times the mean absolute one, as Iglewicz and Hoaglin propose: then one time of six that
/// is another tick is no outlier, one of thirty is. Of fewer than six times none is flagged but what is no time: so few
/// tell nothing about their deviation. Of normal noise, 1.3 % of the samples are flagged in series of six, 0.3 % in series
/// of thirteen.
pub fn outliers(times: &[f64]) -> Vec<usize> {
    let logarithms: Vec<f64> = times.iter().map(|time| time.ln()).collect();
    let finite: Vec<f64> = logarithms.iter().copied().filter(|x| x.is_finite()).collect();
    let centre = median(&finite).unwrap_or(f64::NAN);
    let far = far_from(centre, &finite);
    let stands_apart = |x: f64| !x.is_finite() || (x - centre).abs() > far;
    (0..times.len()).filter(|&k| stands_apart(logarithms[k])).collect()
}

/// The distance from the centre beyond which samples stand apart.
fn far_from(centre: f64, samples: &[f64]) -> f64 {
    if samples.len() < LEAST {
        return f64::INFINITY;
    }
    let deviations: Vec<f64> = samples.iter().map(|x| (x - centre).abs()).collect();
    let of_median = median(&deviations).unwrap_or(0.0);
    let mean = deviations.iter().sum::<f64>() / deviations.len() as f64;
    let deviation =
        if of_median > 0.0 { PER_MEDIAN_DEVIATION * of_median } else { PER_MEAN_DEVIATION * mean };
    DEVIATIONS * deviation
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_is_flagged_by_its_place() {
        assert_eq!(outliers(&[1.00, 1.01, 0.99, 1.02, 3.0, 1.00]), [4]);
        assert_eq!(outliers(&[1.00, 1.01, 0.99, 1.02, 0.2, 1.00]), [4]);
        assert_eq!(outliers(&[1.00, 1.01, 0.99, 1.02, 0.98, 1.03]), [0usize; 0]);
    }

    /// The standard deviation of these is so large that no sample lies five of them away.
    #[test]
    fn outliers_do_not_hide_one_another() {
        assert_eq!(outliers(&[1.00, 1.01, 9.0, 0.99, 1.02, 9.1, 1.00, 0.98]), [2, 5]);
    }

    /// Four logarithms -a, four a and one far one: the median is a, the deviations 0 (four), 2a (four) and the far one,
    /// so that the bound lies 5 x 1.4826 x 2a = 14.8 a above a.
    #[test]
    fn the_bound_is_five_robust_deviations_of_the_logarithm() {
        let a: f64 = 0.01;
        let with = |far: f64| [-a, a, -a, a, -a, a, -a, a, far].map(f64::exp);
        assert_eq!(outliers(&with(15.8 * a)), [0usize; 0]);
        assert_eq!(outliers(&with(15.9 * a)), [8]);
    }

    #[test]
    fn a_unit_changes_nothing() {
        let seconds = [1.00, 1.01, 0.99, 1.02, 3.0, 1.00];
        assert_eq!(outliers(&seconds.map(|s| s * 1e9)), outliers(&seconds));
    }

    /// n deviations of which one is d have the mean d/n: flagged for n > 5 x 1.2533, from seven samples on.
    #[test]
    fn equal_times_judge_by_the_mean_deviation() {
        let with_a_tick = |n: usize| {
            let mut times = vec![0.010; n];
            times[1] = 0.011;
            times
        };
        assert_eq!(outliers(&with_a_tick(6)), [0usize; 0]);
        assert_eq!(outliers(&with_a_tick(7)), [1]);
        assert_eq!(outliers(&[0.010; 8]), [0usize; 0]);
    }

    #[test]
    fn what_is_no_time_is_flagged_and_few_times_are_not() {
        assert_eq!(outliers(&[1.0, f64::NAN, 1.1, 0.0, 0.9, -1.0, 1.0, f64::INFINITY]), [1, 3, 5, 7]);
        assert_eq!(outliers(&[1.0, 1.1, 0.9, 1.0, 50.0]), [0usize; 0]);
        assert_eq!(outliers(&[]), [0usize; 0]);
    }
}
