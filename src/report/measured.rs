//! What a run measured, by cell and round.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde::Deserialize;

use crate::base::statistics::Estimate;
use crate::engine::phase::Phase;
use crate::experiment::machine::Machine;
use crate::experiment::record::{RoundRecord, Stage, Status, TrialRecord, WindowSample};
use crate::experiment::run::RunInfo;
use crate::experiment::spec::{Experiment, Mode};
use crate::report::published::Published;

/// Rounds of whole runs from which their own interval is worth more than that of paired trials.
const ENOUGH_WHOLE_ROUNDS: usize = 6;

/// Everything in a run folder that others are derived from.
#[derive(Debug)]
pub struct Measured {
    pub info: RunInfo,
    pub machine: Machine,
    pub rounds: Vec<RoundRecord>,
}

/// Which part of a step's time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    Total,
    Cg,
    NonCg,
    /// All phases that walk the neighbouring buckets.
    Walks,
    /// The walks, and the copying that should speed them up.
    WalksAndRelocation,
}

/// One way to compute on one number of threads.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    pub preset: String,
    #[serde(default = "paper_test")]
    pub distance_test: String,
    pub threads: usize,
}

/// The distance test of the paper's Figure 3.
fn paper_test() -> String {
    "sqrt".to_string()
}

impl Cell {
    pub fn new(preset: &str, distance_test: &str, threads: usize) -> Cell {
        Cell { preset: preset.to_string(), distance_test: distance_test.to_string(), threads }
    }
}

/// Seconds a step by round; a round is missing where its trial failed.
pub type ByRound = BTreeMap<usize, f64>;

impl Measured {
    /// Reads a run folder. Files that are not what they should be are refused by name.
    pub fn read(folder: &Path) -> Result<Measured> {
        let info = RunInfo::read(folder)?;
        let path = folder.join("machine.json");
        let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let machine = serde_json::from_str(&text)
            .with_context(|| format!("{} is not a machine's description", path.display()))?;
        let mut paths: Vec<_> = fs::read_dir(folder.join("rounds"))
            .with_context(|| format!("cannot list {}", folder.join("rounds").display()))?
            .flatten()
            .map(|entry| entry.path())
            .filter(|path| path.extension().is_some_and(|e| e == "json"))
            .collect();
        paths.sort();
        let mut rounds = paths.iter().map(|path| RoundRecord::read(path)).collect::<Result<Vec<_>>>()?;
        let place = |id: &str| info.experiments.iter().position(|e| e.id == id);
        rounds.sort_by_key(|r| (place(&r.experiment), r.stage, r.round));
        Ok(Measured { info, machine, rounds })
    }

    pub fn experiment(&self, id: &str) -> Option<&Experiment> {
        self.info.experiments.iter().find(|experiment| experiment.id == id)
    }

    /// All trials of an experiment's stage, with their round.
    pub fn trials(&self, experiment: &str, stage: Stage) -> impl Iterator<Item = (usize, &TrialRecord)> {
        self.rounds
            .iter()
            .filter(move |round| round.experiment == experiment && round.stage == stage)
            .flat_map(|round| round.trials.iter().map(|trial| (round.round, trial)))
    }

    /// The windows of one cell, by round.
    pub fn windows(&self, experiment: &str, stage: Stage, cell: &Cell) -> BTreeMap<usize, &[WindowSample]> {
        let mut windows = BTreeMap::new();
        for (round, trial) in self.trials(experiment, stage) {
            let Some(outcome) = trial.outcome.as_ref().filter(|_| trial.status == Status::Ok) else {
                continue;
            };
            let wanted = trial.variants.iter().position(|variant| {
                variant.preset == cell.preset && variant.distance_test == cell.distance_test
            });
            if let Some(variant) = wanted.filter(|_| trial.threads == cell.threads) {
                windows.insert(round, outcome.samples[variant].as_slice());
            }
        }
        windows
    }

    /// Mean seconds a step of one cell, by round.
    pub fn per_step(&self, experiment: &str, stage: Stage, cell: &Cell, quantity: Quantity) -> ByRound {
        let windows = self.windows(experiment, stage, cell);
        windows.into_iter().map(|(round, windows)| (round, seconds_a_step(windows, quantity))).collect()
    }

    /// Particles of the first trial that succeeded.
    pub fn particles(&self) -> Option<usize> {
        let trials = self.rounds.iter().flat_map(|round| &round.trials);
        trials.filter_map(|trial| trial.outcome.as_ref()).map(|o| o.particles).next()
    }

    /// What stands on every page and figure of a quick run.
    pub fn stamp(&self) -> Option<String> {
        let scene = match self.particles() {
            Some(count) => format!("{count} particles, the paper has {}", Published::load().particles),
            None => "nothing measured".to_string(),
        };
        (self.info.mode == Mode::Quick).then(|| format!("quick: not for citation ({scene})"))
    }

    /// The number of rounds of a stage in which every trial succeeded.
    pub fn succeeded(&self, experiment: &str, stage: Stage) -> usize {
        let rounds = self.rounds.iter().filter(|r| r.experiment == experiment && r.stage == stage);
        rounds.filter(|round| round.trials.iter().all(|trial| trial.status == Status::Ok)).count()
    }

    /// The stage whose intervals tables use: whole runs where there are enough of them, paired trials otherwise.
    pub fn stage_for_tables(&self, experiment: &str) -> Stage {
        if self.succeeded(experiment, Stage::Whole) >= ENOUGH_WHOLE_ROUNDS {
            Stage::Whole
        } else {
            Stage::Paired
        }
    }

    /// The thread counts of an experiment that were measured.
    pub fn threads(&self, experiment: &str) -> Vec<usize> {
        let factors = self.experiment(experiment).map(|e| e.factors.threads.clone()).unwrap_or_default();
        factors.into_iter().filter(|&threads| threads <= self.info.usable_threads).collect()
    }
}

/// Mean seconds a step over all steps of some windows.
pub fn seconds_a_step(windows: &[WindowSample], quantity: Quantity) -> f64 {
    let steps: usize = windows.iter().map(|w| w.steps.len()).sum();
    let seconds: f64 = windows.iter().map(|window| seconds(window, quantity)).sum();
    seconds / steps as f64
}

fn seconds(window: &WindowSample, quantity: Quantity) -> f64 {
    let total = || window.steps.iter().map(|s| s.total_s).sum::<f64>();
    let cg = || window.steps.iter().map(|s| s.cg_s).sum::<f64>();
    let phases = |wanted: fn(Phase) -> bool| -> f64 {
        let named = Phase::ALL.into_iter().filter(|&phase| wanted(phase));
        named.map(|phase| phase_seconds(window, phase.name())).sum()
    };
    match quantity {
        Quantity::Total => total(),
        Quantity::Cg => cg(),
        Quantity::NonCg => total() - cg(),
        Quantity::Walks => phases(Phase::walks_neighbors),
        Quantity::WalksAndRelocation => phases(|phase| phase.walks_neighbors() || phase == Phase::Relocation),
    }
}

/// Seconds of one phase in a window; zero where it did not take place.
pub fn phase_seconds(window: &WindowSample, phase: &str) -> f64 {
    window.phases.iter().filter(|sample| sample.phase == phase).map(|sample| sample.time_s).sum()
}

/// Combines two cells round by round: only rounds that both have count, since only those share their disturbances.
pub fn by_round(a: &ByRound, b: &ByRound, combine: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    a.iter().filter_map(|(round, &a)| b.get(round).map(|&b| combine(a, b))).collect()
}

/// The estimate of all rounds' values.
pub fn estimate(values: &ByRound) -> Option<Estimate> {
    let values: Vec<f64> = values.values().copied().collect();
    Estimate::of(&values)
}

/// The estimate of the ratio of two cells, paired by round.
pub fn ratio(of: &ByRound, over: &ByRound) -> Option<Estimate> {
    Estimate::of(&by_round(of, over, |a, b| a / b))
}
