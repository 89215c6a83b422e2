//! Which of several variants differ in speed from a base, without being fooled by their number.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::interval::sign_test;
use super::{CONFIDENCE, Estimate, NoiseFloor, median, samples_needed, variance_inflation};

/// A variant's time over the base's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// With the interval that this comparison would have if it were the only one; `None` without a round that has both.
    pub ratio: Option<Estimate>,
    /// Of the sign test that the ratio is one, corrected for the number of comparisons.
    pub p_value: f64,
    pub verdict: Verdict,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The variant takes less time than the base.
    Faster,
    /// It takes more.
    Slower,
    /// No difference was resolved, which does not mean that there is none.
    NotResolved { why: Unresolved },
    /// So many comparisons cannot be resolved with so few rounds, however clear they are.
    TooFewRounds { needed: usize },
}

/// Why a difference is not resolved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Unresolved {
    /// The interval contains one.
    ContainsOne,
    /// The interval excludes one, but one of so many comparisons may do so by chance.
    SeveralComparisons,
    /// It would be resolved if the rounds were independent, but they do not show that they are.
    DependentRounds,
    /// Two identical cells differ by as much.
    BelowNoiseFloor,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let why = match self {
            Verdict::Faster => return write!(f, "faster"),
            Verdict::Slower => return write!(f, "slower"),
            Verdict::TooFewRounds { needed } => return write!(f, "too few rounds: {needed} needed"),
            Verdict::NotResolved { why } => match why {
                Unresolved::ContainsOne => "the interval contains 1",
                Unresolved::SeveralComparisons => "by chance, one of so many comparisons may differ as much",
                Unresolved::DependentRounds => "neighbouring rounds resemble one another",
                Unresolved::BelowNoiseFloor => "two identical cells differ as much",
            },
        };
        write!(f, "not resolved: {why}")
    }
}

/// Compares variants with a base from the log-ratios, variant over base, of each variant's rounds in their order.
///
/// The probability that any of the verdicts `Faster` and `Slower` is wrong is at most `1 - CONFIDENCE`: sign tests, which
/// hold for noise of any distribution, corrected by Holm's method, which holds however the comparisons depend on one
/// another, as those with the same base do. What makes rounds depend on one another seldom stops at one variant, so that no
/// test assumes less dependence than half of the variants show. Variants without rounds count among the comparisons, so that a failed cell
/// makes no other verdict easier.
pub fn compare<S: AsRef<[f64]>>(log_ratios: &[S], floor: Option<&NoiseFloor>) -> Vec<Comparison> {
    let inflations: Vec<f64> = log_ratios.iter().map(|ratios| variance_inflation(ratios.as_ref())).collect();
    let common = median(&inflations).unwrap_or(1.0);
    let alone: Vec<f64> = log_ratios
        .iter()
        .zip(&inflations)
        .map(|(ratios, &own)| sign_test(ratios.as_ref(), own.max(common)))
        .collect();
    let corrected = holm(&alone);
    let comparison = |(k, ratios): (usize, &S)| Comparison {
        ratio: Estimate::of_rounds(ratios.as_ref()).map(|estimate| estimate.map(f64::exp)),
        p_value: corrected[k],
        verdict: verdict(ratios.as_ref(), alone[k], corrected[k], log_ratios.len(), floor),
    };
    log_ratios.iter().enumerate().map(comparison).collect()
}

/// From the p-value of the sign test alone, and corrected for the number of comparisons.
fn verdict(
    log_ratios: &[f64],
    alone: f64,
    corrected: f64,
    comparisons: usize,
    floor: Option<&NoiseFloor>,
) -> Verdict {
    let wrong = 1.0 - CONFIDENCE;
    let needed = samples_needed(wrong / comparisons as f64);
    let difference = median(log_ratios).filter(|_| corrected <= wrong);
    let why = match difference {
        Some(difference) if floor.is_some_and(|floor| difference.abs() <= floor.level()) => {
            Unresolved::BelowNoiseFloor
        }
        Some(difference) if difference < 0.0 => return Verdict::Faster,
        Some(_) => return Verdict::Slower,
        None if log_ratios.len() < needed => return Verdict::TooFewRounds { needed },
        None if alone <= wrong => Unresolved::SeveralComparisons,
        None if sign_test(log_ratios, 1.0) <= wrong => Unresolved::DependentRounds,
        None => Unresolved::ContainsOne,
    };
    Verdict::NotResolved { why }
}

/// Holm's corrected p-values, in the order given: the smallest is multiplied by the number of tests, the next by one
/// less, and so on; none is smaller than one before it, none exceeds 1 (Scandinavian Journal of Statistics 6, 1979).
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let mut ascending: Vec<usize> = (0..p_values.len()).collect();
    ascending.sort_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    let mut corrected = vec![1.0; p_values.len()];
    let mut largest: f64 = 0.0;
    for (before, test) in ascending.into_iter().enumerate() {
        largest = largest.max((p_values.len() - before) as f64 * p_values[test]);
        corrected[test] = largest.min(1.0);
    }
    corrected
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::statistics::noise_floor;

    /// 4 x 0.005, 3 x 0.01, 2 x 0.03, and 0.04 not below the one before it.
    #[test]
    fn holm_corrects_step_by_step() {
        let corrected = holm(&[0.01, 0.04, 0.03, 0.005]);
        for (found, expected) in corrected.iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((found - expected).abs() < 1e-12, "{corrected:?}");
        }
        assert_eq!(holm(&[0.6, 0.7]), [1.0, 1.0]);
        assert_eq!(holm(&[]), [0.0; 0]);
    }

    /// Rounds about an effect in an order without trend, all on the effect's side if it is larger than 0.04.
    fn about(effect: f64, rounds: usize) -> Vec<f64> {
        (0..rounds).map(|k| effect + 0.01 * ((k * 5 % 9) as f64 - 4.0)).collect()
    }

    fn verdicts(log_ratios: &[Vec<f64>]) -> Vec<Verdict> {
        compare(log_ratios, None).iter().map(|comparison| comparison.verdict).collect()
    }

    #[test]
    fn a_ratio_below_one_is_faster() {
        assert_eq!(verdicts(&[about(-0.05, 9)]), [Verdict::Faster]);
        assert_eq!(verdicts(&[about(0.05, 9)]), [Verdict::Slower]);
        assert_eq!(verdicts(&[about(0.0, 9)]), [Verdict::NotResolved { why: Unresolved::ContainsOne }]);
        let comparison = compare(&[about(-0.05, 9)], None)[0];
        let ratio = comparison.ratio.unwrap();
        assert!((ratio.median - (-0.05f64).exp()).abs() < 1e-12 && ratio.interval.unwrap().high < 1.0);
        assert!((comparison.p_value - 2.0 / 512.0).abs() < 1e-12);
    }

    /// Six rounds on one side have p = 1/32: enough for one comparison, and for the last of two, not for three.
    #[test]
    fn several_comparisons_need_more_rounds() {
        let six = about(-0.05, 6);
        assert_eq!(verdicts(std::slice::from_ref(&six)), [Verdict::Faster]);
        assert_eq!(verdicts(&vec![six.clone(); 3]), [Verdict::TooFewRounds { needed: 7 }; 3]);
        assert_eq!(verdicts(&vec![six.clone(); 7]), [Verdict::TooFewRounds { needed: 9 }; 7]);
        assert_eq!(verdicts(&[about(-0.05, 9), six]), [Verdict::Faster; 2]);
        assert_eq!(verdicts(&[vec![-0.1; 5]]), [Verdict::TooFewRounds { needed: 6 }]);
    }

    /// 11 of 13 on one side: p = 2 (1 + 13 + 78) / 8192 = 0.0225, alone resolved, as one of three not.
    #[test]
    fn chance_has_more_tickets_in_several_comparisons() {
        let mut ratios = about(-0.05, 13);
        ratios[3] = 0.01;
        ratios[8] = 0.01;
        assert_eq!(verdicts(std::slice::from_ref(&ratios)), [Verdict::Faster]);
        let three = [ratios, about(0.0, 13), about(0.0, 13)];
        assert_eq!(verdicts(&three)[0], Verdict::NotResolved { why: Unresolved::SeveralComparisons });
    }

    #[test]
    fn rounds_that_drift_resolve_nothing() {
        let trend = |first: i32| (first..first + 12).map(|k| -0.01 * f64::from(k)).collect::<Vec<_>>();
        for first in [-1, 1] {
            let comparison = compare(&[trend(first)], None)[0];
            assert_eq!(comparison.verdict, Verdict::NotResolved { why: Unresolved::DependentRounds });
            assert_eq!((comparison.p_value, comparison.ratio.unwrap().interval), (1.0, None));
        }
    }

    /// Nine rounds worth 9 / 1.5 = 6 have p = 2 / 64 at the least: of three variants, two that show so much dependence
    /// hold the third to it.
    #[test]
    fn variants_share_their_dependence() {
        let alike: Vec<f64> = [1, 2, 5, 6, 8, 9, 3, 4, 7].iter().map(|&k| -0.01 * f64::from(k)).collect();
        assert!(variance_inflation(&alike) > 1.3 && variance_inflation(&about(-0.05, 9)) == 1.0);
        let alone = compare(&[about(-0.05, 9)], None)[0].p_value;
        let beside = compare(&[about(-0.05, 9), alike.clone(), alike], None)[0].p_value;
        assert!(beside > 3.0 * alone, "{beside} and {alone}");
    }

    #[test]
    fn effects_below_the_noise_floor_are_not_resolved() {
        let equal: Vec<f64> = about(0.0, 9).iter().map(|x| (2.0 * x).exp()).collect();
        let floor = noise_floor(&equal, &[1.0; 9]).unwrap();
        let below = compare(&[about(-0.05, 9)], Some(&floor))[0];
        assert_eq!(below.verdict, Verdict::NotResolved { why: Unresolved::BelowNoiseFloor });
        assert_eq!(compare(&[about(-0.2, 9)], Some(&floor))[0].verdict, Verdict::Faster);
    }

    #[test]
    fn a_variant_without_rounds_has_no_ratio() {
        let comparisons = compare(&[about(-0.05, 9), Vec::new()], None);
        assert_eq!(comparisons[0].verdict, Verdict::Faster);
        assert_eq!((comparisons[1].ratio, comparisons[1].p_value), (None, 1.0));
        assert_eq!(comparisons[1].verdict, Verdict::TooFewRounds { needed: 7 });
    }

    #[test]
    fn verdicts_can_be_read() {
        assert_eq!(Verdict::TooFewRounds { needed: 9 }.to_string(), "too few rounds: 9 needed");
        let verdict = Verdict::NotResolved { why: Unresolved::ContainsOne };
        assert_eq!(verdict.to_string(), "not resolved: the interval contains 1");
    }
}
