//! How much neighbouring rounds resemble one another, as they do where a disturbance outlasts a round.

/// The rounds below which nothing is made of their order.
const LEAST: usize = 9;

/// Larger autocorrelations of a few rounds cannot be told apart.
const LARGEST: f64 = 0.9;

/// By how much the variance of the rounds' median exceeds that of as many independent rounds.
///
/// That is `(1 + r) / (1 - r)` for a disturbance that decays from round to round by the autocorrelation `r` of
/// neighbours (Priestley, Spectral Analysis and Time Series, 5.3.2), and 1 where `r` is negative. Every positive `r`
/// counts, however small: thirty rounds cannot tell 0.3 from 0, so a threshold that independent rounds seldom reach would
/// also pass over much of what depends. Independent rounds pay for it with intervals a tenth wider. For the median of
/// normal noise the factor is too large (2.3 instead of 3 at 0.5), which makes up for `r` being too small on average.
/// Always 1 below nine rounds. `r` is estimated from ranks, so that a single spike hides nothing.
pub fn variance_inflation(rounds: &[f64]) -> f64 {
    let n = rounds.len() as f64;
    if rounds.len() < LEAST {
        return 1.0;
    }
    // Independent rounds show -1/n on average, as each deviates from a mean that it is part of.
    let r = rank_autocorrelation(rounds) + 1.0 / n;
    if r > 0.0 { (1.0 + r.min(LARGEST)) / (1.0 - r.min(LARGEST)) } else { 1.0 }
}

/// How many independent rounds tell as much about the median: fewer where neighbours resemble one another.
pub fn effective_rounds(rounds: usize, variance_inflation: f64) -> f64 {
    rounds as f64 / variance_inflation
}

/// The autocorrelation of the ranks of neighbours; no number where all samples are equal.
fn rank_autocorrelation(samples: &[f64]) -> f64 {
    let middle = 0.5 * samples.len() as f64;
    let deviations: Vec<f64> = samples.iter().map(|&sample| rank(sample, samples) - middle).collect();
    let products: f64 = deviations.windows(2).map(|pair| pair[0] * pair[1]).sum();
    products / deviations.iter().map(|d| d * d).sum::<f64>()
}

/// How many samples lie below one; those equal to it, itself included, count one half.
fn rank(sample: f64, samples: &[f64]) -> f64 {
    let below = samples.iter().filter(|&&other| other < sample).count();
    let equal = samples.iter().filter(|&&other| other == sample).count();
    below as f64 + 0.5 * equal as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Deviations of the ranks -1, 0, 1: neighbours' products sum to 0, squares to 2. In the order -1, 1, 0: -1 / 2.
    #[test]
    fn the_autocorrelation_is_that_of_ranks() {
        assert_eq!(rank_autocorrelation(&[1.0, 2.0, 900.0]), 0.0);
        assert_eq!(rank_autocorrelation(&[1.0, 900.0, 2.0]), -0.5);
        assert!(rank_autocorrelation(&[1.0; 5]).is_nan());
    }

    /// Ranks 1..n in order: r = 1 - 3/n + O(1/n^2), which for ten is 0.7, and the bias 0.1.
    #[test]
    fn a_trend_inflates_the_variance() {
        let trend: Vec<f64> = (0..10).map(|k| f64::from(k).exp()).collect();
        let r = rank_autocorrelation(&trend);
        assert!((r - 0.7).abs() < 1e-12);
        assert!((variance_inflation(&trend) - 1.8 / 0.2).abs() < 1e-9);
    }

    #[test]
    fn alternating_equal_and_few_rounds_inflate_nothing() {
        let alternating: Vec<f64> = (0..20).map(|k| f64::from(k % 2)).collect();
        assert_eq!(variance_inflation(&alternating), 1.0);
        assert_eq!(variance_inflation(&[2.0; 20]), 1.0);
        assert_eq!(variance_inflation(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]), 1.0);
    }

    /// Deviations of the ranks 0.5, 3.5, -2.5, -4.5, 2.5, -0.5, 4.5, 1.5, -1.5, -3.5: neighbours' products sum to -0.75,
    /// squares to 82.5; r = -0.75/82.5 + 1/10 = 1/11, and (1 + r) / (1 - r) = 12/10.
    #[test]
    fn a_small_likeness_counts() {
        let rounds = [5.0, 8.0, 2.0, 0.0, 7.0, 4.0, 9.0, 6.0, 3.0, 1.0];
        let inflation = variance_inflation(&rounds);
        assert!((inflation - 1.2).abs() < 1e-12, "{inflation}");
        assert!((effective_rounds(10, inflation) - 10.0 / 1.2).abs() < 1e-9);
    }
}
