//! Which values the ends of the colours stand for, and the round numbers between them.

use std::str::FromStr;

/// The values at the two ends of the colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    pub low: f64,
    pub high: f64,
}

impl Range {
    /// Round numbers around nearly all of the values: the outermost half per cent on either side may lie beyond, or one stray
    /// particle would take the colours from all others. Starts at zero where that is not far.
    pub fn of(values: &[f64]) -> Range {
        let mut ascending: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
        ascending.sort_by(f64::total_cmp);
        let Some(last) = ascending.len().checked_sub(1) else {
            return Range { low: 0.0, high: 1.0 };
        };
        let at = |share: f64| ascending[(share * last as f64).round() as usize];
        let (mut low, mut high) = (at(0.005), at(0.995));
        if low > 0.0 && low < 0.5 * high {
            low = 0.0;
        }
        if high - low <= 1e-9 * high.abs() {
            let beside = if high == 0.0 { 1.0 } else { 0.01 * high.abs() };
            (low, high) = if low == 0.0 { (0.0, beside) } else { (low - beside, high + beside) };
        }
        let step = round_step(high - low);
        // A value that is a round number up to rounding stays at its end.
        let (below, above) = ((low / step + 1e-9).floor(), (high / step - 1e-9).ceil());
        Range { low: below * step, high: above * step }
    }

    /// Where a value lies between the ends: 0 at the lower one, 1 at the upper one.
    pub fn share(&self, value: f64) -> f64 {
        ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }

    /// Round values from end to end, with the text of each.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        let step = round_step(self.high - self.low);
        let first = (self.low / step - 1e-9).ceil();
        let last = (self.high / step + 1e-9).floor();
        let count = (last - first).max(0.0) as usize;
        (0..=count).map(|k| (first + k as f64) * step).map(|value| (value, number(value, step))).collect()
    }
}

/// A step of 1, 2 or 5 times a power of ten that divides `length` into four to ten.
fn round_step(length: f64) -> f64 {
    let power = 10.0_f64.powf(((length / 4.0).log10() + 1e-9).floor());
    let factor =
        [5.0, 2.0].into_iter().find(|factor| factor * power <= (1.0 + 1e-9) * length / 4.0).unwrap_or(1.0);
    factor * power
}

/// A number with the decimals that its step needs; very large and small ones with an exponent.
pub fn number(value: f64, step: f64) -> String {
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    if value != 0.0 && (value.abs() >= 1e6 || decimals > 4) {
        return format!("{value:.2e}");
    }
    // Minus zero would be printed with its sign.
    format!("{:.decimals$}", value + 0.0)
}

impl FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Range, String> {
        let ends = text.split_once(':').and_then(|(low, high)| Some((low.parse().ok()?, high.parse().ok()?)));
        match ends {
            Some((low, high)) if f64::is_finite(low) && f64::is_finite(high) && low < high => {
                Ok(Range { low, high })
            }
            _ => Err("allowed are two finite numbers LOW:HIGH, the first below the second".to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: &[f64]) -> (f64, f64) {
        let Range { low, high } = Range::of(values);
        (low, high)
    }

    #[test]
    fn ranges_are_round_and_hold_the_values() {
        assert_eq!(of(&[0.1, 2.3]), (0.0, 2.5));
        assert_eq!(of(&[293.0, 303.0]), (292.0, 304.0));
        assert_eq!(of(&[]), (0.0, 1.0));
        assert_eq!(of(&[0.0, 0.0]), (0.0, 1.0));
        assert_eq!(of(&[-1.0, 1.0]), (-1.0, 1.0));
        let Range { low, high } = Range::of(&[5.0, 5.0]);
        assert!(low < 5.0 && 5.0 < high);
        let mut stray = vec![1.0; 1000];
        stray[0] = 1e6;
        assert!(Range::of(&stray).high < 2.0, "a stray particle does not take the colours");
    }

    #[test]
    fn ticks_are_round_numbers_from_end_to_end() {
        let texts = |low, high| Range { low, high }.ticks().into_iter().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(texts(0.0, 2.5), ["0.0", "0.5", "1.0", "1.5", "2.0", "2.5"]);
        assert_eq!(texts(0.0, 4000.0), ["0", "1000", "2000", "3000", "4000"]);
        assert_eq!(texts(-0.02, 0.02), ["-0.02", "-0.01", "0.00", "0.01", "0.02"]);
    }

    #[test]
    fn a_range_is_read_from_two_numbers() {
        assert_eq!("0:2.5".parse(), Ok(Range { low: 0.0, high: 2.5 }));
        for wrong in ["2:1", "1", "a:b", "0:inf", "nan:1", "1:1"] {
            assert!(wrong.parse::<Range>().is_err(), "{wrong}");
        }
    }
}
