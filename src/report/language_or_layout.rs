//! Whether list over relocated is the language's or the layout's: words for what intervals resolve.

use crate::base::statistics::{Estimate, Interval};
use crate::report::table::show;

/// List over relocated in C beside that in Rust.
#[derive(Debug, Clone)]
pub struct Compared {
    pub name: String,
    pub gain: Estimate,
    /// C's gain over Rust's, paired by round.
    pub over_rust: Estimate,
}

/// What an interval says about a gain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Gain {
    /// It lies above 1.
    Some,
    /// It lies at or below 1.
    None,
    /// It reaches both sides of 1, or there are too few rounds for one.
    Unresolved,
}

impl Gain {
    fn of(estimate: &Estimate) -> Gain {
        match estimate.interval {
            Some(interval) if interval.low > 1.0 => Gain::Some,
            Some(interval) if interval.high <= 1.0 => Gain::None,
            _ => Gain::Unresolved,
        }
    }
}

/// Whose the ratio is, as far as the intervals resolve it.
pub fn verdict(in_rust: &Estimate, in_c: &[Compared]) -> String {
    if in_c.is_empty() {
        return "No program in C ran, so nothing tells language and layout apart.".to_string();
    }
    if std::iter::once(in_rust).chain(in_c.iter().map(|c| &c.gain)).any(|gain| gain.interval.is_none()) {
        return "Too few rounds to tell language and layout apart.".to_string();
    }
    let unresolved = in_c.iter().filter(|c| Gain::of(&c.gain) == Gain::Unresolved);
    let mut unresolved: Vec<&str> = unresolved.map(|c| c.name.as_str()).collect();
    if Gain::of(in_rust) == Gain::Unresolved {
        unresolved.insert(0, "Rust");
    }
    if !unresolved.is_empty() {
        return format!("Not resolved whether there is a gain in {}.", unresolved.join(" and in "));
    }
    let gaining = in_c.iter().filter(|c| Gain::of(&c.gain) == Gain::Some).count();
    match (Gain::of(in_rust) == Gain::Some, gaining) {
        (true, all) if all == in_c.len() => {
            format!("Both languages gain: the gain is the layout's, not the language's{}", how_alike(in_c))
        }
        (false, 0) => "Neither language gains.".to_string(),
        (true, 0) => "Only Rust gains: the gain is the language's or its compiler's.".to_string(),
        (false, all) if all == in_c.len() => {
            "Only C gains: the gain is the language's or its compilers'.".to_string()
        }
        _ => "Some gain and some do not: the gain depends on compiler and target.".to_string(),
    }
}

/// By how much C's gains differ from Rust's.
fn how_alike(in_c: &[Compared]) -> String {
    let apart =
        |c: &&Compared| c.over_rust.interval.is_some_and(|Interval { low, high }| low > 1.0 || high < 1.0);
    let different: Vec<String> = in_c
        .iter()
        .filter(apart)
        .map(|c| format!("{} times Rust's in {}", show(&c.over_rust, 3), c.name))
        .collect();
    if different.is_empty() {
        return ", and no difference between the two is resolved.".to_string();
    }
    format!("; its size also depends on the compiler: {}.", different.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(low: f64, high: f64) -> Estimate {
        Estimate {
            interval: Some(Interval { low, high }),
            samples: 7,
            ..Estimate::single(0.5 * (low + high))
        }
    }

    fn compared(gain: [f64; 2], over_rust: [f64; 2]) -> Compared {
        let (gain, over_rust) = (estimate(gain[0], gain[1]), estimate(over_rust[0], over_rust[1]));
        Compared { name: "C (gcc), native".to_string(), gain, over_rust }
    }

    #[test]
    fn a_gain_in_both_languages_is_the_layouts() {
        let gain = estimate(1.2, 1.3);
        let alike = verdict(&gain, &[compared([1.25, 1.35], [0.99, 1.05])]);
        assert!(alike.contains("layout's, not the language's") && alike.contains("no difference"), "{alike}");
        let larger = verdict(&gain, &[compared([1.5, 1.6], [1.2, 1.3])]);
        assert!(
            larger.contains("layout's") && larger.contains("1.250 [1.200, 1.300] times Rust's"),
            "{larger}"
        );
    }

    #[test]
    fn a_gain_in_one_language_is_that_languages_only_where_the_other_has_none() {
        let (gain, none) = (estimate(1.2, 1.3), estimate(0.9, 0.99));
        let with = |in_rust: &Estimate, gains: &[[f64; 2]]| {
            let in_c: Vec<Compared> = gains.iter().map(|&gain| compared(gain, [0.5, 2.0])).collect();
            verdict(in_rust, &in_c)
        };
        assert!(with(&none, &[[1.5, 1.6]]).contains("Only C gains"));
        assert!(with(&gain, &[[0.8, 0.9]]).contains("Only Rust gains"));
        assert!(with(&gain, &[[0.8, 0.9], [1.2, 1.3]]).contains("depends on compiler"));
        assert!(with(&none, &[[0.8, 0.9]]).contains("Neither"));
        assert!(
            with(&estimate(0.9, 1.1), &[[1.2, 1.3]])
                .contains("Not resolved whether there is a gain in Rust.")
        );
        let both = with(&gain, &[[0.9, 1.1], [1.2, 1.3]]);
        assert_eq!(both, "Not resolved whether there is a gain in C (gcc), native.");
    }

    #[test]
    fn too_little_gives_no_verdict() {
        let gain = estimate(1.2, 1.3);
        assert!(verdict(&gain, &[]).contains("No program in C ran"));
        let few = Estimate { interval: None, samples: 5, ..gain };
        assert!(verdict(&few, &[compared([1.2, 1.3], [0.9, 1.1])]).contains("Too few rounds"));
    }
}
