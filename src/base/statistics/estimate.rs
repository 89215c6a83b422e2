//! A median with what is known about it.

use serde::{Deserialize, Serialize};

use super::{Interval, NoInterval, interval_of_rounds, median, median_interval};

/// A median with what is known about it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    pub median: f64,
    /// Covers the true median with the stated confidence. `None` where there are too few samples for one, where they depend
    /// on one another too much, and of absolute times.
    pub interval: Option<Interval>,
    /// The smallest and the largest of at least two rounds: of absolute times, in place of an interval.
    #[serde(default)]
    pub spread: Option<Interval>,
    /// The number of samples: rounds, each in processes of their own.
    pub samples: usize,
}

impl Estimate {
    /// From independent samples in any order; `None` without samples.
    pub fn of(samples: &[f64]) -> Option<Estimate> {
        let median = median(samples)?;
        Some(Estimate { median, interval: median_interval(samples), spread: None, samples: samples.len() })
    }

    /// From rounds in the order in which they were measured: the interval is wider where neighbouring rounds resemble
    /// one another, and missing where they do so much. `None` without rounds.
    pub fn of_rounds(rounds: &[f64]) -> Option<Estimate> {
        let median = median(rounds)?;
        let interval = interval_of_rounds(rounds).ok();
        Some(Estimate { median, interval, spread: None, samples: rounds.len() })
    }

    /// From absolute times of rounds, with the smallest and the largest of them. What the machine did meanwhile does not
    /// cancel in them: where it drifts or wanders there is no true median to cover, and no few rounds tell a machine that
    /// wanders from one with a memory, so that no interval is claimed. `None` without rounds.
    pub fn of_times(rounds: &[f64]) -> Option<Estimate> {
        let median = median(rounds)?;
        let ends = Interval {
            low: rounds.iter().copied().fold(f64::INFINITY, f64::min),
            high: rounds.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        };
        let spread = (rounds.len() > 1).then_some(ends);
        Some(Estimate { median, interval: None, spread, samples: rounds.len() })
    }

    /// A number that was found once.
    pub fn single(value: f64) -> Estimate {
        Estimate { median: value, interval: None, spread: None, samples: 1 }
    }

    /// What is drawn and written beside the median: the interval, or the spread of absolute times.
    pub fn bounds(&self) -> Option<Interval> {
        self.interval.or(self.spread)
    }

    /// Why there is no interval, where there is none. Rounds that are enough for one lack it only if they depend on one
    /// another.
    pub fn why_no_interval(&self) -> Option<NoInterval> {
        self.interval.is_none().then(|| NoInterval::of(self.samples))
    }

    /// The same in another unit.
    pub fn scaled(self, factor: f64) -> Estimate {
        self.map(|value| value * factor)
    }

    /// The same of another quantity, which grows with this one.
    pub fn map(self, increasing: impl Fn(f64) -> f64) -> Estimate {
        let ends = |i: Interval| Interval { low: increasing(i.low), high: increasing(i.high) };
        Estimate {
            median: increasing(self.median),
            interval: self.interval.map(ends),
            spread: self.spread.map(ends),
            samples: self.samples,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_estimate_may_change_its_unit_and_its_scale() {
        let seconds = Estimate::of(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]).unwrap();
        let milliseconds = seconds.scaled(1e3);
        assert_eq!((milliseconds.median, milliseconds.samples), (4e3, 7));
        assert_eq!(milliseconds.interval, Some(Interval { low: 1e3, high: 7e3 }));
        assert_eq!(seconds.map(f64::exp).interval.unwrap().high, 7f64.exp());
    }

    /// However steady they are: steadiness of few rounds proves nothing about a machine that wanders.
    #[test]
    fn absolute_times_have_a_spread_and_no_interval() {
        let times = Estimate::of_times(&[3.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0]).unwrap().scaled(1e3);
        assert_eq!((times.median, times.interval), (2e3, None));
        assert_eq!(times.bounds(), Some(Interval { low: 1e3, high: 3e3 }));
        assert_eq!(Estimate::of_times(&[3.0]), Some(Estimate::single(3.0)));
        assert_eq!(Estimate::of_times(&[]), None);
    }

    #[test]
    fn rounds_in_a_trend_have_no_interval() {
        let trend: Vec<f64> = (0..12).map(f64::from).collect();
        let (of_rounds, of) = (Estimate::of_rounds(&trend).unwrap(), Estimate::of(&trend).unwrap());
        assert_eq!(of_rounds.why_no_interval(), Some(NoInterval::DependentRounds));
        assert_eq!(of.interval, Some(Interval { low: 2.0, high: 9.0 }));
        assert_eq!(of.why_no_interval(), None);
        let few = Estimate::of_rounds(&trend[..5]).unwrap();
        assert_eq!(few.why_no_interval(), Some(NoInterval::TooFewRounds { needed: 6 }));
    }
}
