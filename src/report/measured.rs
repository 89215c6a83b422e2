//! What a run measured, by cell and round.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Context, Result, anyhow, ensure};
use serde::Deserialize;

use crate::base::statistics::Estimate;
use crate::engine::phase::Phase;
use crate::engine::preset::Preset;
use crate::experiment::cluster::blocks::Block;
use crate::experiment::foreign;
use crate::experiment::machine::{self, Machine};
use crate::experiment::progress::{StageProgress, progress};
use crate::experiment::record::{
    Observation, Outcome, RoundRecord, Stage, Status, TrialRecord, Variant, WindowSample,
};
use crate::experiment::run::RunInfo;
use crate::experiment::selection::CellSettings;
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
    /// Buckets, and the copies or lists that are made of them.
    Build,
    /// Making the pressure's matrix.
    Matrix,
}

/// Chooses one cell among all that a stage measured.
pub trait Pick {
    fn fits(&self, trial: &TrialRecord, variant: &Variant) -> bool;
}

/// One search on one number of threads, where an experiment varies nothing else.
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

    /// Whether a variant computes what the cell names.
    pub fn is_of(&self, variant: &Variant) -> bool {
        variant.preset == self.preset && variant.distance_test == self.distance_test
    }

    pub fn in_words(&self) -> String {
        format!("`{}` with `{}` on {} thread(s)", self.preset, self.distance_test, self.threads)
    }
}

impl Pick for Cell {
    fn fits(&self, trial: &TrialRecord, variant: &Variant) -> bool {
        trial.threads == self.threads && self.is_of(variant)
    }
}

/// Everything that tells a timed cell from the others of its experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedCell {
    /// The group.
    pub subject: String,
    pub threads: usize,
    pub variant: Variant,
}

impl Pick for TimedCell {
    fn fits(&self, trial: &TrialRecord, variant: &Variant) -> bool {
        trial.threads == self.threads && trial.subject == self.subject && *variant == self.variant
    }
}

impl TimedCell {
    /// The same cell but for its variant.
    pub fn with(&self, change: impl FnOnce(&mut Variant)) -> TimedCell {
        let mut cell = self.clone();
        change(&mut cell.variant);
        cell
    }

    pub fn with_preset(&self, preset: Preset) -> TimedCell {
        self.with(|variant| variant.preset = preset.name().to_string())
    }

    /// The paper's linked list beside the cell, with the same distance test, which solves as the paper does.
    pub fn beside_list(&self) -> TimedCell {
        let usual = Variant::default();
        self.with_preset(Preset::PAPER_LINKED_LIST).with(|variant| {
            variant.preconditioner = usual.preconditioner;
            variant.matrix_values = usual.matrix_values;
        })
    }
}

/// Seconds a step by round; a round is missing where its trial failed.
pub type ByRound = BTreeMap<usize, f64>;

impl Measured {
    /// Reads a run folder. Files that are not what they should be are refused by name.
    pub fn read(folder: &Path) -> Result<Measured> {
        // Before anything is opened: nothing that a link names is read, or written over by a report.
        let files = foreign::plain_files(folder)?;
        let info = RunInfo::read(folder)?;
        let what = "a machine's description";
        let machine = foreign::read_record(&folder.join("machine.json"), what, machine::SCHEMA_VERSION)?;
        let mut rounds = Vec::new();
        for name in files.iter().filter(|name| name.starts_with("rounds/") && name.ends_with(".json")) {
            let path = folder.join(name);
            let round = RoundRecord::read(&path)?;
            let place = RoundRecord::path(Path::new(""), &round.experiment, round.stage, round.round);
            ensure!(Path::new(name) == place, "{} is not where it belongs", path.display());
            info.check_round(&round).map_err(|error| {
                anyhow!("{}: {}", path.display(), foreign::presentable(&format!("{error:#}")))
            })?;
            rounds.push(round);
        }
        info.check_complete(&rounds).with_context(|| folder.display().to_string())?;
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
    pub fn windows(
        &self,
        experiment: &str,
        stage: Stage,
        cell: &impl Pick,
    ) -> BTreeMap<usize, &[WindowSample]> {
        let mut windows = BTreeMap::new();
        for (round, trial) in self.trials(experiment, stage) {
            let Some(outcome) = trial.outcome.as_ref().filter(|_| trial.status == Status::Ok) else {
                continue;
            };
            if let Some(variant) = trial.variants.iter().position(|variant| cell.fits(trial, variant)) {
                windows.insert(round, outcome.samples[variant].as_slice());
            }
        }
        windows
    }

    /// Mean seconds a step of one cell, by round.
    pub fn per_step(&self, experiment: &str, stage: Stage, cell: &impl Pick, quantity: Quantity) -> ByRound {
        self.per_step_in(experiment, stage, cell, quantity, |_| true)
    }

    /// The same over those windows alone whose place, counted from 0, is `wanted`.
    pub fn per_step_in(
        &self,
        experiment: &str,
        stage: Stage,
        cell: &impl Pick,
        quantity: Quantity,
        wanted: impl Fn(usize) -> bool,
    ) -> ByRound {
        let mean = |windows: &[WindowSample]| {
            let chosen = windows.iter().enumerate().filter(|(k, _)| wanted(*k));
            seconds_a_step(chosen.map(|(_, window)| window), quantity)
        };
        let windows = self.windows(experiment, stage, cell).into_iter();
        windows.map(|(round, windows)| (round, mean(windows))).collect()
    }

    /// The timed cells of an experiment's paired trials, in the order of its file.
    pub fn cells(&self, experiment: &str) -> Vec<TimedCell> {
        let mut cells = Vec::new();
        let Some(spec) = self.experiment(experiment) else {
            return cells;
        };
        for group in spec.groups(self.info.mode) {
            for threads in group.thread_counts(self.info.usable()) {
                let variants = spec.variants(group).into_iter();
                let subject = &group.name;
                cells.extend(variants.map(|variant| TimedCell {
                    subject: subject.clone(),
                    threads,
                    variant,
                }));
            }
        }
        let measured = |cell: &TimedCell| {
            let TimedCell { subject, threads, variant } = cell;
            let settings = CellSettings { group: subject, threads: *threads, variant };
            *threads <= self.info.usable_threads && spec.left_out(settings).is_none()
        };
        cells.retain(measured);
        cells
    }

    /// What the trials of a cell's group met, by round.
    pub fn outcomes(&self, experiment: &str, cell: &TimedCell) -> Vec<&Outcome> {
        let trials = self.trials(experiment, Stage::Paired).map(|(_, trial)| trial);
        let of_group = trials.filter(|t| t.subject == cell.subject && t.threads == cell.threads);
        of_group.filter_map(|trial| trial.outcome.as_ref()).collect()
    }

    /// What was seen of an observed run, by round.
    pub fn observations(&self, experiment: &str, run: &str) -> Vec<&Observation> {
        let trials = self.trials(experiment, Stage::Observed).map(|(_, trial)| trial);
        let of_run = trials.filter(|trial| trial.subject == run);
        of_run.filter_map(|trial| trial.observation.as_ref()).collect()
    }

    /// Observed runs whose rounds did not all end in the same state.
    pub fn disagreeing(&self, experiment: &str) -> Vec<String> {
        let mut digests: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for (_, trial) in self.trials(experiment, Stage::Observed) {
            if let Some(observation) = &trial.observation {
                digests.entry(&trial.subject).or_default().insert(&observation.digest);
            }
        }
        digests.into_iter().filter(|(_, found)| found.len() > 1).map(|(run, _)| run.to_string()).collect()
    }

    /// Rounds of an experiment that an unfinished run lacks; where their number is not fixed, the next one of a stage.
    pub fn missing(&self, experiment: &str) -> Vec<Block> {
        if self.info.finished_utc.is_some() {
            return Vec::new();
        }
        let stages = progress(&self.info, &self.rounds).into_iter().filter(|p| p.experiment == experiment);
        let blocks = |StageProgress { experiment, stage, missing, .. }: StageProgress| {
            missing.into_iter().map(move |round| Block { experiment: experiment.clone(), stage, round })
        };
        stages.flat_map(blocks).collect()
    }

    /// Particles of an experiment's timed trials, where they all have as many.
    pub fn particles(&self, experiment: &str) -> Option<usize> {
        let rounds = self.rounds.iter().filter(|round| round.experiment == experiment);
        let outcomes = rounds.flat_map(|round| &round.trials).filter_map(|trial| trial.outcome.as_ref());
        let counts: BTreeSet<usize> = outcomes.map(|outcome| outcome.particles).collect();
        counts.first().copied().filter(|_| counts.len() == 1)
    }

    /// What stands on every page and figure of a quick run.
    pub fn stamp(&self) -> Option<String> {
        let paper = Published::load().particles;
        let words = || format!("quick: not for citation (coarser scenes; the paper has {paper} particles)");
        (self.info.mode == Mode::Quick).then(words)
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

    /// All thread counts of an experiment, measured or not.
    pub fn thread_counts(&self, experiment: &str) -> Vec<usize> {
        let Some(spec) = self.experiment(experiment) else {
            return Vec::new();
        };
        let groups = spec.groups(self.info.mode);
        let counts = groups.flat_map(|group| group.thread_counts(self.info.usable()));
        counts.collect::<BTreeSet<usize>>().into_iter().collect()
    }

    /// Those that were measured.
    pub fn threads(&self, experiment: &str) -> Vec<usize> {
        let there = self.info.usable_threads;
        self.thread_counts(experiment).into_iter().filter(|&threads| threads <= there).collect()
    }
}

/// Mean seconds a step over all steps of some windows.
pub fn seconds_a_step<'a>(windows: impl IntoIterator<Item = &'a WindowSample>, quantity: Quantity) -> f64 {
    let (mut time_s, mut steps) = (0.0, 0);
    for window in windows {
        time_s += seconds(window, quantity);
        steps += window.steps.len();
    }
    time_s / steps as f64
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
        Quantity::Build => phases(|phase| [Phase::BucketBuild, Phase::Relocation].contains(&phase)),
        Quantity::Matrix => phases(|phase| phase == Phase::Matrix),
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

/// The times of all rounds, with their spread.
pub fn times(values: &ByRound) -> Option<Estimate> {
    let values: Vec<f64> = values.values().copied().collect();
    Estimate::of_times(&values)
}

/// The estimate of a quantity in which what disturbs a whole round cancels, such as a ratio.
pub fn estimate(values: &ByRound) -> Option<Estimate> {
    let values: Vec<f64> = values.values().copied().collect();
    Estimate::of_rounds(&values)
}

/// The estimate of the ratio of two cells, paired by round.
pub fn ratio(of: &ByRound, over: &ByRound) -> Option<Estimate> {
    Estimate::of_rounds(&by_round(of, over, |a, b| a / b))
}
