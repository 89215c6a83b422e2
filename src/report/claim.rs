//! The paper's claims, each with its estimator, its rule and a verdict.

use serde::Deserialize;

use crate::base::input::{Check, InputError};
use crate::base::statistics::{Estimate, NoInterval};
use crate::experiment::factors::Usable;
use crate::experiment::library;
use crate::experiment::record::{Stage, WindowSample};
use crate::experiment::spec::Mode;
use crate::report::measured::{ByRound, Cell, Measured, Quantity, by_round, seconds_a_step};

/// A claim as `paper/claims.toml` states it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    pub id: String,
    pub statement: String,
    /// The printed number.
    pub quote: String,
    /// Where in the paper.
    pub source: String,
    pub estimate: Estimator,
    pub judge: Vec<Judgement>,
}

/// How the claimed quantity is estimated.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimator {
    pub kind: EstimatorKind,
    pub experiment: String,
    pub quantity: Quantity,
    pub of: Cell,
    pub over: Option<Cell>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EstimatorKind {
    /// Seconds of `of`, for the paper's number of steps.
    RunTime,
    /// Time of `of` over time of `over`.
    Ratio,
    /// Time of `of` in the last quarter of the windows over that in the first; with `over`, divided by the same of it.
    LateOverEarly,
    /// The part of `of`'s whole time.
    Share,
    /// Time of `of` minus that of `over`, milliseconds a step.
    Gain,
}

impl EstimatorKind {
    fn unit(self) -> &'static str {
        match self {
            EstimatorKind::RunTime => "s",
            EstimatorKind::Gain => "ms/step",
            EstimatorKind::Share => "of total",
            EstimatorKind::Ratio | EstimatorKind::LateOverEarly => "x",
        }
    }
}

/// One way to judge a claim.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Judgement {
    pub name: String,
    pub rule: Rule,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Rule {
    /// The interval lies above `value`.
    Above { value: f64 },
    /// `value` lies in the interval, or the median within `tolerance` (relative) of it.
    Near { value: f64, tolerance: f64 },
    /// The whole interval lies within `tolerance` (relative) of `value`.
    Equal { value: f64, tolerance: f64 },
    /// Nothing to judge.
    Information {},
}

impl Rule {
    pub fn in_words(self) -> String {
        match self {
            Rule::Above { value } => format!("interval above {value}"),
            Rule::Near { value, tolerance } => {
                format!("{value} in the interval, or median within {:.0} %", 100.0 * tolerance)
            }
            Rule::Equal { value, tolerance } => {
                format!("interval within {:.0} % of {value}", 100.0 * tolerance)
            }
            Rule::Information {} => "information only".to_string(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    Holds,
    Fails,
    NotResolved { why: String },
    NotTestableHere { why: String },
}

impl Verdict {
    pub fn name(&self) -> &'static str {
        match self {
            Verdict::Holds => "holds",
            Verdict::Fails => "fails",
            Verdict::NotResolved { .. } => "not resolved",
            Verdict::NotTestableHere { .. } => "not testable here",
        }
    }

    pub fn reason(&self) -> &str {
        match self {
            Verdict::Holds | Verdict::Fails => "",
            Verdict::NotResolved { why } | Verdict::NotTestableHere { why } => why,
        }
    }
}

/// A claim judged by one of its rules.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    pub claim: Claim,
    pub judgement: Judgement,
    pub estimate: Option<Estimate>,
    pub unit: &'static str,
    pub verdict: Verdict,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Claims {
    claim: Vec<Claim>,
}

/// All claims, in the order of the file.
pub fn load() -> Vec<Claim> {
    parse(include_str!("../../paper/claims.toml"), "paper/claims.toml")
        .expect("the embedded claims are valid")
}

/// Reads claims, and refuses one that names a cell which no experiment measures; `file` names them in errors.
pub fn parse(text: &str, file: &str) -> Result<Vec<Claim>, InputError> {
    let claims: Claims = toml::from_str(text).map_err(|error| {
        let text = error.to_string().trim().replace('\n', " ");
        InputError::new(file, "claim", "not a valid claim", text)
    })?;
    for claim in &claims.claim {
        let experiment = library::embedded(&claim.estimate.experiment)?;
        let groups = || Mode::ALL.into_iter().flat_map(|mode| experiment.groups(mode));
        for cell in claim.estimate.cells() {
            let threads = groups()
                .any(|group| group.thread_counts(Usable { threads: 1, cores: 1 }).contains(&cell.threads));
            let variants = groups().flat_map(|group| experiment.variants(group));
            let known = threads && variants.into_iter().any(|variant| cell.is_of(&variant));
            let allowed = format!("allowed are cells of the experiment {}", experiment.id);
            Check { file }.require(known, &format!("claim {}", claim.id), cell.in_words(), allowed)?;
        }
    }
    Ok(claims.claim)
}

/// Judges every claim whose experiment the run holds.
pub fn judge_all(measured: &Measured) -> Vec<Judged> {
    let mut judged = Vec::new();
    for claim in load() {
        if measured.experiment(&claim.estimate.experiment).is_none() {
            continue;
        }
        let estimate = claim.estimate.evaluate(measured);
        for judgement in claim.judge.clone() {
            let verdict = match &estimate {
                Ok(estimate) => judge(judgement.rule, estimate),
                Err(verdict) => verdict.clone(),
            };
            judged.push(Judged {
                unit: claim.estimate.kind.unit(),
                estimate: estimate.clone().ok(),
                claim: claim.clone(),
                judgement,
                verdict,
            });
        }
    }
    judged
}

/// How many verdicts there are of each kind, as a sentence.
pub fn in_short(judged: &[Judged]) -> String {
    let why = String::new;
    let open = [Verdict::NotResolved { why: why() }, Verdict::NotTestableHere { why: why() }];
    let kinds = [Verdict::Holds, Verdict::Fails].into_iter().chain(open);
    let counted = kinds.filter_map(|kind| {
        let name = kind.name();
        let count = judged.iter().filter(|judged| judged.verdict.name() == name).count();
        (count > 0).then(|| format!("{name} {count}"))
    });
    format!("{} verdicts: {}.", judged.len(), counted.collect::<Vec<_>>().join(", "))
}

/// The verdict of a rule on an estimate.
pub fn judge(rule: Rule, estimate: &Estimate) -> Verdict {
    if let Rule::Information {} = rule {
        return Verdict::NotTestableHere { why: "absolute times belong to a machine".to_string() };
    }
    let Some(interval) = estimate.interval else {
        let why = match estimate.why_no_interval() {
            Some(NoInterval::DependentRounds) => "the rounds depend on one another".to_string(),
            _ => format!("{} rounds are too few for an interval", estimate.samples),
        };
        return Verdict::NotResolved { why };
    };
    let (low, high) = (interval.low, interval.high);
    let straddles = |what: String| Verdict::NotResolved { why: format!("the interval straddles {what}") };
    let outside = |least: f64, most: f64| Verdict::NotResolved {
        why: format!("the interval lies partly outside {least:.3} to {most:.3}"),
    };
    match rule {
        Rule::Above { value } if low > value => Verdict::Holds,
        Rule::Above { value } if high < value => Verdict::Fails,
        Rule::Above { value } => straddles(value.to_string()),
        Rule::Near { value, tolerance } => {
            let close = (estimate.median / value - 1.0).abs() <= tolerance;
            let (least, most) = (value * (1.0 - tolerance), value * (1.0 + tolerance));
            if close || (low <= value && value <= high) {
                Verdict::Holds
            } else if high < least || low > most {
                Verdict::Fails
            } else {
                outside(least, most)
            }
        }
        Rule::Equal { value, tolerance } => {
            let (least, most) = (value * (1.0 - tolerance), value * (1.0 + tolerance));
            if low >= least && high <= most {
                Verdict::Holds
            } else if high < least || low > most {
                Verdict::Fails
            } else {
                outside(least, most)
            }
        }
        Rule::Information {} => unreachable!("handled above"),
    }
}

impl Estimator {
    /// The estimate, or the verdict where there can be none. A claim about cores is not judged on hardware threads that
    /// share them.
    fn evaluate(&self, measured: &Measured) -> Result<Estimate, Verdict> {
        let measured_cells = measured.cells(&self.experiment);
        for cell in self.cells() {
            let (needed, there) = (cell.threads, measured.info.usable_cores);
            if needed > there {
                let why = format!("needs {needed} cores, {there} may be used here");
                return Err(Verdict::NotTestableHere { why });
            }
            if !measured_cells.iter().any(|c| c.threads == needed && cell.is_of(&c.variant)) {
                let why = format!("the run's {} has no {}", self.experiment, cell.in_words());
                return Err(Verdict::NotResolved { why });
            }
        }
        let values = self.values(measured);
        let why = "no round gave a value for its cells".to_string();
        let estimate = match self.kind {
            EstimatorKind::RunTime => Estimate::of_times(&values),
            _ => Estimate::of_rounds(&values),
        };
        estimate.ok_or(Verdict::NotResolved { why })
    }

    /// The cells that the estimate compares.
    fn cells(&self) -> impl Iterator<Item = &Cell> {
        std::iter::once(&self.of).chain(&self.over)
    }

    /// One value a round.
    fn values(&self, measured: &Measured) -> Vec<f64> {
        let stage = measured.stage_for_tables(&self.experiment);
        let per_step = |cell: &Cell| measured.per_step(&self.experiment, stage, cell, self.quantity);
        let of = per_step(&self.of);
        let over = self.over.as_ref().map(per_step).unwrap_or_default();
        match self.kind {
            EstimatorKind::RunTime => {
                let steps = crate::report::published::Published::load().steps as f64;
                of.values().map(|s| s * steps).collect()
            }
            EstimatorKind::Ratio => by_round(&of, &over, |a, b| a / b),
            EstimatorKind::Gain => by_round(&of, &over, |a, b| 1e3 * (a - b)),
            EstimatorKind::Share => {
                let total: ByRound = measured.per_step(&self.experiment, stage, &self.of, Quantity::Total);
                by_round(&of, &total, |part, whole| part / whole)
            }
            EstimatorKind::LateOverEarly => {
                let by_round = |cell: &Cell| -> ByRound {
                    let windows = measured.windows(&self.experiment, Stage::Paired, cell);
                    let late = |w: &[WindowSample]| late_over_early(w, self.quantity);
                    windows.into_iter().filter_map(|(round, w)| Some((round, late(w)?))).collect()
                };
                match &self.over {
                    Some(over) => {
                        crate::report::measured::by_round(&by_round(&self.of), &by_round(over), |a, b| a / b)
                    }
                    None => by_round(&self.of).into_values().collect(),
                }
            }
        }
    }
}

/// The last quarter of the windows over the first; `None` where there are fewer than four.
fn late_over_early(windows: &[WindowSample], quantity: Quantity) -> Option<f64> {
    let quarter = windows.len() / 4;
    if quarter == 0 {
        return None;
    }
    let late = seconds_a_step(&windows[windows.len() - quarter..], quantity);
    Some(late / seconds_a_step(&windows[..quarter], quantity))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::statistics::Interval;

    fn estimate(low: f64, median: f64, high: f64) -> Estimate {
        Estimate { interval: Some(Interval { low, high }), samples: 9, ..Estimate::single(median) }
    }

    #[test]
    fn rules_hold_fail_or_stay_open() {
        let above = Rule::Above { value: 1.0 };
        assert_eq!(judge(above, &estimate(1.1, 1.2, 1.3)), Verdict::Holds);
        assert_eq!(judge(above, &estimate(0.7, 0.8, 0.9)), Verdict::Fails);
        assert_eq!(judge(above, &estimate(0.9, 1.1, 1.3)).name(), "not resolved");
        let near = Rule::Near { value: 1.17, tolerance: 0.05 };
        assert_eq!(judge(near, &estimate(1.10, 1.16, 1.25)), Verdict::Holds);
        assert_eq!(judge(near, &estimate(1.195, 1.20, 1.21)), Verdict::Holds);
        assert_eq!(judge(near, &estimate(1.30, 1.33, 1.36)), Verdict::Fails);
        assert_eq!(judge(near, &estimate(1.20, 1.30, 1.36)).name(), "not resolved");
        let equal = Rule::Equal { value: 1.0, tolerance: 0.02 };
        assert_eq!(judge(equal, &estimate(0.99, 1.0, 1.01)), Verdict::Holds);
        assert_eq!(judge(equal, &estimate(0.97, 1.0, 1.01)).name(), "not resolved");
        assert_eq!(judge(equal, &estimate(1.05, 1.06, 1.07)), Verdict::Fails);
    }

    #[test]
    fn too_few_rounds_are_said_so() {
        let few = Estimate { samples: 3, ..Estimate::single(2.0) };
        let verdict = judge(Rule::Above { value: 1.0 }, &few);
        assert_eq!(verdict.reason(), "3 rounds are too few for an interval");
        let dependent = Estimate { samples: 12, ..few };
        assert_eq!(
            judge(Rule::Above { value: 1.0 }, &dependent).reason(),
            "the rounds depend on one another"
        );
    }

    #[test]
    fn experiments_name_the_claims_that_they_feed() {
        for name in crate::experiment::library::names() {
            let fed: Vec<String> = load()
                .into_iter()
                .filter(|claim| claim.estimate.experiment == name)
                .map(|claim| claim.id)
                .collect();
            assert_eq!(crate::experiment::library::load(name).unwrap().claims, fed, "{name}");
        }
    }

    #[test]
    fn a_claim_about_a_cell_that_nobody_measures_is_refused() {
        let text = include_str!("../../paper/claims.toml");
        for (from, to, words) in [
            (
                "\"paper-linked-list\"",
                "\"paper-magic\"",
                "claim T2` is `paper-magic` with `sqrt` on 1 thread(s)",
            ),
            (
                "threads = 32",
                "threads = 31",
                "claim C4a` is `paper-aos-relocation` with `sqrt` on 31 thread(s)",
            ),
            ("\"table2\"", "\"table9\"", "`table9`"),
            ("\"table2\"", "\"../table2\"", "`../table2`"),
            ("tolerance = 0.05", "tolerance = \"<b>\"", "claims.toml"),
        ] {
            let error = parse(&text.replacen(from, to, 1), "claims.toml").unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
