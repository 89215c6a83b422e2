//! Intervals of a median from order statistics, and the sign test, which asks the same the other way round.
//!
//! A sample lies above the true median with probability 1/2, whatever its distribution; so the number of samples above
//! it is Binomial(n, 1/2), and so are all probabilities here (Hahn and Meeker, Statistical Intervals, 5.2).

use std::fmt;

use serde::{Deserialize, Serialize};

use super::dependence::effective_rounds;
use super::{CONFIDENCE, ascending, variance_inflation};

/// A range that covers the true median with at least the stated confidence.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

impl Interval {
    pub fn width(self) -> f64 {
        self.high - self.low
    }

    pub fn contains(self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// Why there is no interval: even smallest to largest would cover less than [`CONFIDENCE`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NoInterval {
    TooFewRounds {
        needed: usize,
    },
    /// There are enough rounds, but they depend on one another so much that they tell no more than too few do; where
    /// they drift there is not even a median to cover.
    DependentRounds,
}

impl NoInterval {
    /// The reason why so many rounds have none.
    pub fn of(rounds: usize) -> NoInterval {
        match samples_needed(1.0 - CONFIDENCE) {
            needed if rounds < needed => NoInterval::TooFewRounds { needed },
            _ => NoInterval::DependentRounds,
        }
    }
}

impl fmt::Display for NoInterval {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            NoInterval::TooFewRounds { needed } => write!(f, "too few rounds: {needed} needed"),
            NoInterval::DependentRounds => write!(f, "rounds depend on one another"),
        }
    }
}

/// The interval between the k-th smallest and the k-th largest sample for the largest `k` whose coverage,
/// `1 - 2 P(Binomial(n, 1/2) < k)`, is at least [`CONFIDENCE`]. It holds for independent samples of any distribution.
/// `None` below six samples, where even smallest to largest covers less.
pub fn median_interval(samples: &[f64]) -> Option<Interval> {
    interval(samples, interval_rank(samples.len(), 1.0)?)
}

/// The same of rounds in the order in which they were measured. Where neighbours resemble one another, its ends lie
/// further from the middle rank, by the root of the [`variance_inflation`], at most at the smallest and the largest
/// round: the count of rounds above the median varies as much more as the median itself does. There is none where the
/// rounds are worth fewer than six independent ones.
pub fn interval_of_rounds(rounds: &[f64]) -> Result<Interval, NoInterval> {
    let rank = interval_rank(rounds.len(), variance_inflation(rounds));
    rank.and_then(|rank| interval(rounds, rank)).ok_or(NoInterval::of(rounds.len()))
}

/// The p-value of the two-sided sign test that the true median is zero, for a stated inflation of the variance. A sample that
/// is zero speaks for neither side, and counts against both. Where rounds contradict one another, the distance of their
/// count from the middle shrinks by the inflation's root; and nothing is less probable than that as many independent
/// rounds as these are worth all lie on one side. With the inflation of its rounds it is at most `1 - CONFIDENCE` exactly
/// where [`interval_of_rounds`] excludes zero.
pub(super) fn sign_test(samples: &[f64], inflation: f64) -> f64 {
    let n = samples.len();
    let above = samples.iter().filter(|&&sample| sample > 0.0).count();
    let below = samples.iter().filter(|&&sample| sample < 0.0).count();
    let middle = 0.5 * (n as f64 - 1.0);
    let against = match n - above.max(below) {
        0 => 0.0,
        contrary => (middle - (middle - contrary as f64) / inflation.sqrt()).ceil(),
    };
    let counted = 2.0 * binomial_terms(n).take(against as usize + 1).sum::<f64>();
    let all_on_one_side = 2.0 * 0.5f64.powf(effective_rounds(n, inflation).floor());
    counted.max(all_on_one_side).min(1.0)
}

/// The least number of samples with which a two-sided sign test can reach a p-value: all of them lie on one side.
pub fn samples_needed(p_value: f64) -> usize {
    (1.0 - p_value.log2()).ceil().max(1.0) as usize
}

/// The rank, counted from one, of the sample at the lower end of an interval; `None` where there is none.
fn interval_rank(samples: usize, inflation: f64) -> Option<usize> {
    if effective_rounds(samples, inflation) < samples_needed(1.0 - CONFIDENCE) as f64 {
        return None;
    }
    let mut tail = 0.0;
    let covers = |term: &f64| {
        tail += term;
        1.0 - 2.0 * tail >= CONFIDENCE
    };
    let below =
        binomial_terms(samples).take(samples.div_ceil(2)).take_while(covers).count().checked_sub(1)?;
    let middle = 0.5 * (samples as f64 - 1.0);
    let further_out = (middle - (middle - below as f64) * inflation.sqrt()).floor().max(0.0);
    Some(further_out as usize + 1)
}

fn interval(samples: &[f64], rank: usize) -> Option<Interval> {
    let sorted = ascending(samples);
    Some(Interval { low: *sorted.get(rank - 1)?, high: *sorted.get(sorted.len().checked_sub(rank)?)? })
}

/// `P(Binomial(n, 1/2) = k)` for k = 0, 1, .. n, by logarithms, since `0.5^n` is zero beyond a thousand samples.
fn binomial_terms(n: usize) -> impl Iterator<Item = f64> {
    let first = -(n as f64) * std::f64::consts::LN_2;
    (0..=n).scan(first, move |logarithm, k| {
        let term = logarithm.exp();
        *logarithm += ((n - k) as f64 / (k + 1) as f64).ln();
        Some(term)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
            assert_eq!(interval_of_rounds(&vec![1.0; n]), Err(NoInterval::TooFewRounds { needed: 6 }));
        }
    }

    /// For many samples the binomial is normal: k = n/2 - 1.96 sqrt(n)/2, also where `0.5^n` is no number any more.
    #[test]
    fn ranks_of_many_samples_are_those_of_the_normal_limit() {
        for n in [400usize, 1600, 6400] {
            let limit = 0.5 * n as f64 - 0.98 * (n as f64).sqrt();
            let rank = interval_rank(n, 1.0).unwrap() as f64;
            assert!((rank - limit).abs() <= 1.0, "{n}: {rank} and {limit}");
        }
    }

    /// Four times the variance of 400 rounds leaves as much as a hundred independent ones: k = n/2 - 1.96 sqrt(n).
    #[test]
    fn inflated_variances_move_the_ends_out() {
        let rank = interval_rank(400, 4.0).unwrap() as f64;
        assert!((rank - (200.0 - 1.96 * 20.0)).abs() <= 2.0, "{rank}");
        assert_eq!(interval_rank(9, 1.5), Some(1));
        assert_eq!(interval_rank(9, 1.51), None);
    }

    /// A trend of twelve has r = 107.25/143 + 1/12 = 0.83 and is worth 1.1 rounds. For `alike` neighbours' products sum to
    /// 15.25: r = 0.19, the inflation is 1.469, and 5.5 - (5.5 - 2) 1.212 = 1.26 leaves out one on each side, not two.
    #[test]
    fn the_order_of_rounds_widens_their_interval_or_withholds_it() {
        let trend: Vec<f64> = (1..=12).map(f64::from).collect();
        assert_eq!(interval_of_rounds(&trend), Err(NoInterval::DependentRounds));
        let alike = [5.0, 1.0, 3.0, 8.0, 12.0, 10.0, 2.0, 7.0, 11.0, 4.0, 9.0, 6.0];
        assert_eq!(interval_of_rounds(&alike), Ok(Interval { low: 2.0, high: 11.0 }));
        let shuffled = [5.0, 1.0, 12.0, 8.0, 3.0, 10.0, 2.0, 7.0, 11.0, 4.0, 9.0, 6.0];
        assert_eq!(interval_of_rounds(&shuffled), Ok(Interval { low: 3.0, high: 10.0 }));
    }

    /// 8 of 10 on one side: 2 (1 + 10 + 45) / 1024; a zero in place of one of the eight counts against them.
    #[test]
    fn the_sign_test_is_the_binomial_s() {
        let mut samples = [1.0; 10];
        samples[..2].fill(-1.0);
        assert!((sign_test(&samples, 1.0) - 112.0 / 1024.0).abs() < 1e-12);
        samples[2] = 0.0;
        assert!((sign_test(&samples, 1.0) - 352.0 / 1024.0).abs() < 1e-12);
        assert_eq!(sign_test(&[0.0; 10], 1.0), 1.0);
        assert_eq!(sign_test(&[], 1.0), 1.0);
    }

    #[test]
    fn the_sign_test_and_the_interval_say_the_same() {
        for (n, inflation) in (6..=40).flat_map(|n| [(n, 1.0), (n, 1.7), (n, 3.1)]) {
            for above in 0..=n {
                let sign = |k: usize| if k < above { 1.0 } else { -1.0 };
                let samples: Vec<f64> = (0..n).map(|k| sign(k) * (1.0 + k as f64)).collect();
                let rank = interval_rank(n, inflation);
                let excluded = rank.is_some_and(|rank| !interval(&samples, rank).unwrap().contains(0.0));
                let rejected = sign_test(&samples, inflation) <= 1.0 - CONFIDENCE;
                assert_eq!(rejected, excluded, "{above} of {n}, inflation {inflation}");
            }
        }
    }

    /// 2 / 2^n: 1/32 for six samples, 1/64 for seven.
    #[test]
    fn small_p_values_need_many_samples() {
        assert_eq!(samples_needed(0.05), 6);
        assert_eq!(samples_needed(1.0 / 32.0), 6);
        assert_eq!(samples_needed(0.05 / 3.0), 7);
        assert_eq!(samples_needed(0.05 / 7.0), 9);
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
                    median_interval(&samples).unwrap().contains(2f64.ln().powi(3))
                })
                .count();
            let coverage = covered as f64 / trials as f64;
            assert!((0.94..0.995).contains(&coverage), "{n}: {coverage}");
        }
    }
}
