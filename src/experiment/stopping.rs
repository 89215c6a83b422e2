//! How many rounds a stage takes: a fixed number, or as many as its intervals need.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::base::statistics::stopping::{Decision, Rule, enough};
use crate::experiment::record::{RoundRecord, Status, WindowSample};

/// A number of rounds, or when to end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number of rounds, or a table with `min`, `max` and `target_interval`")]
pub enum Rounds {
    Fixed(usize),
    Adaptive(AdaptiveRounds),
}

/// Rounds are added until the interval of every ratio is as narrow as asked, or there are enough of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveRounds {
    /// Fewest rounds; intervals need six.
    pub min: usize,
    /// Most rounds.
    pub max: usize,
    /// The width, as a part of the median, that the interval of the ratio of each cell to one of its group is to have at
    /// most: of the whole step and of the part outside CG.
    pub target_interval: f64,
    /// No round begins once the trials of the stage have taken this many seconds.
    pub budget_s: Option<f64>,
}

impl Rounds {
    pub fn most(self) -> usize {
        match self {
            Rounds::Fixed(count) => count,
            Rounds::Adaptive(adaptive) => adaptive.max,
        }
    }

    pub fn in_words(self) -> String {
        match (self.least(), self.most()) {
            (least, most) if least == most => format!("{most} rounds"),
            (least, most) => format!("{least} to {most} rounds"),
        }
    }

    pub fn least(self) -> usize {
        match self {
            Rounds::Fixed(count) => count,
            Rounds::Adaptive(adaptive) => adaptive.min,
        }
    }

    /// Whether the rounds so far are enough. It depends on nothing but what they recorded, so a run that is interrupted and
    /// goes on ends after the same round.
    pub fn are_enough(self, so_far: &[RoundRecord]) -> bool {
        let Rounds::Adaptive(adaptive) = self else {
            return so_far.len() >= self.most();
        };
        if so_far.len() < adaptive.min || so_far.len() >= adaptive.max {
            return so_far.len() >= adaptive.max;
        }
        let spent_s: f64 = so_far.iter().flat_map(|round| &round.trials).map(|trial| trial.wall_s).sum();
        let rule = Rule { least: adaptive.min, most: adaptive.max, target: adaptive.target_interval };
        let spent = adaptive.budget_s.is_some_and(|budget_s| spent_s >= budget_s);
        spent || !matches!(enough(&comparisons(so_far), &rule), Decision::Continue { .. })
    }

    pub(super) fn check(self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let allowed = "allowed are 1 to 10000";
        check.require((1..=10_000).contains(&self.most()), key, self.most(), allowed)?;
        let Rounds::Adaptive(adaptive) = self else {
            return Ok(());
        };
        let AdaptiveRounds { min, max, target_interval, budget_s } = adaptive;
        let allowed = format!("allowed are 6, below which there is no interval, to `max`, here {max}");
        check.require((6..=max).contains(&min), &format!("{key}.min"), min, allowed)?;
        check.positive(&format!("{key}.target_interval"), target_interval)?;
        check.positive(&format!("{key}.budget_s"), budget_s.unwrap_or(1.0))
    }
}

/// A cell within a stage: its group, threads and variant's label.
type CellName = (String, usize, String);

/// The logarithms, round by round, of the ratio of each cell's time to that of one cell of its group and thread count, the
/// first by name, for the whole step and for the part outside CG; of the time itself where a group has but one cell.
/// Rounds in which either failed are left out.
fn comparisons(rounds: &[RoundRecord]) -> Vec<Vec<f64>> {
    let mut times: BTreeMap<CellName, Vec<Option<[f64; 2]>>> = BTreeMap::new();
    let mut bases: BTreeMap<(String, usize), CellName> = BTreeMap::new();
    for (place, round) in rounds.iter().enumerate() {
        for trial in &round.trials {
            let outcome = trial.outcome.as_ref().filter(|_| trial.status == Status::Ok);
            for (k, variant) in trial.variants.iter().enumerate() {
                let name = (trial.subject.clone(), trial.threads, variant.label());
                let of_cell = times.entry(name).or_insert_with(|| vec![None; rounds.len()]);
                of_cell[place] = outcome.map(|outcome| logarithms(&outcome.samples[k]));
            }
        }
    }
    for name in times.keys() {
        bases.entry((name.0.clone(), name.1)).or_insert_with(|| name.clone());
    }
    let mut compared = Vec::new();
    for (name, of_cell) in &times {
        let base = &bases[&(name.0.clone(), name.1)];
        let alone = times.keys().filter(|other| (&other.0, other.1) == (&name.0, name.1)).count() == 1;
        if name == base && !alone {
            continue;
        }
        for part in 0..2 {
            let pairs = of_cell.iter().zip(&times[base]);
            let ratio = |(cell, base): (&Option<[f64; 2]>, &Option<[f64; 2]>)| {
                Some((*cell)?[part] - if alone { 0.0 } else { (*base)?[part] })
            };
            compared.push(pairs.filter_map(ratio).collect());
        }
    }
    compared
}

/// Of the time of the whole steps, and of their part outside CG.
fn logarithms(windows: &[WindowSample]) -> [f64; 2] {
    let steps = || windows.iter().flat_map(|window| &window.steps);
    let total: f64 = steps().map(|step| step.total_s).sum();
    let non_cg: f64 = steps().map(|step| step.total_s - step.cg_s).sum();
    [total.ln(), non_cg.ln()]
}
