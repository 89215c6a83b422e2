//! Whether records are what their run planned: a cell that nobody planned, a cell recorded twice and a number that no clock
//! or count gives are refused, since every table would take them for measurements.

use std::collections::BTreeSet;

use anyhow::{Context, Result, anyhow, bail, ensure};

use crate::experiment::factors::Usable;
use crate::experiment::foreign;
use crate::experiment::observed::ObservedRun;
use crate::experiment::peaks;
use crate::experiment::progress::{StageProgress, progress};
use crate::experiment::record::{
    FrontSample, Observation, Outcome, RoundRecord, Stage, Status, TrialRecord, Variant, WindowSample,
};
use crate::experiment::run::RunInfo;
use crate::experiment::selection::CellSettings;
use crate::experiment::spec::{Experiment, Mode, Paired};
use crate::experiment::twin;
use crate::experiment::twin::outcome::{Language, TwinCell};
use crate::scene::validation::Case;

/// Seconds, some thirty years: longer than anything here takes, so that sums of times stay finite.
const LONGEST_S: f64 = 1e9;
/// No step of a simulation is shorter, seconds.
const SHORTEST_STEP_S: f64 = 1e-9;

/// A trial that a round must hold once.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cell {
    subject: String,
    threads: usize,
    /// `None` where any one variant will do.
    variants: Option<Vec<Variant>>,
    /// The distance test of the twin's loop in Rust: which processors that was compiled for is the recording program's
    /// affair, and no part of the plan.
    rust_twin: Option<String>,
}

impl RunInfo {
    /// Checks what a run says about itself.
    pub(super) fn check(&self, file: &str) -> Result<()> {
        let mut ids = BTreeSet::new();
        for experiment in &self.experiments {
            // In its own words: a doctored folder is no wrong use of the command.
            experiment.check(file).map_err(|error| anyhow!(foreign::presentable(&error.to_string())))?;
            ensure!(ids.insert(&experiment.id), "{file}: the experiment `{}` is there twice", experiment.id);
        }
        let (threads, cores) = (self.usable_threads, self.usable_cores);
        ensure!(
            cores >= 1 && cores <= threads,
            "{file}: usable_cores is {cores}, usable_threads {threads}; allowed are 1 to as many cores as threads"
        );
        Ok(())
    }

    /// Checks that a round is one of this run's, with every cell once and numbers that can be.
    pub fn check_round(&self, round: &RoundRecord) -> Result<()> {
        let experiment = self.experiments.iter().find(|experiment| experiment.id == round.experiment);
        let experiment = experiment
            .with_context(|| format!("the experiment {:?} is none of the run's", round.experiment))?;
        let mut missing = planned_cells(experiment, self.mode, self.usable(), round.stage, round.round);
        ensure!(!missing.is_empty(), "the run planned no {} trials of it", round.stage.name());
        let mut positions = BTreeSet::new();
        for trial in &round.trials {
            let position = trial.position;
            let single = positions.insert(position) && position < round.trials.len();
            ensure!(single, "trial at position {position}: positions are 0 upwards, each once");
            let place = missing.iter().position(|cell| cell.holds(trial)).with_context(|| {
                let (subject, threads) = (&trial.subject, trial.threads);
                format!("trial at position {position}: {subject:?} on {threads} thread(s) is not planned, or is there twice")
            })?;
            missing.swap_remove(place);
            let paired = experiment.measurement(self.mode).paired.as_ref();
            let paired = paired.filter(|_| round.stage == Stage::Paired);
            trial.check(round.stage, paired).with_context(|| format!("trial at position {position}"))?;
        }
        let first = missing
            .first()
            .map_or(String::new(), |cell| format!("{:?} on {} thread(s)", cell.subject, cell.threads));
        ensure!(missing.is_empty(), "{} planned trials are missing, the first is {first}", missing.len());
        Ok(())
    }

    /// Checks that a finished run has all its rounds.
    pub fn check_complete(&self, rounds: &[RoundRecord]) -> Result<()> {
        if self.finished_utc.is_none() {
            return Ok(());
        }
        for StageProgress { experiment, stage, missing, .. } in progress(self, rounds) {
            if let Some(round) = missing.first() {
                let stage = stage.name();
                bail!("rounds/{experiment}-{stage}-{round:03}.json is missing, though the run is finished");
            }
        }
        Ok(())
    }
}

/// Every cell of a round of that stage; none where there is nothing to measure.
pub(super) fn planned_cells(
    experiment: &Experiment,
    mode: Mode,
    usable: Usable,
    stage: Stage,
    round: usize,
) -> Vec<Cell> {
    let measurement = experiment.measurement(mode);
    match stage {
        Stage::States => states_cell(experiment, mode, usable, round).into_iter().collect(),
        Stage::Whole => {
            let tests = measurement.whole.as_ref().map(|whole| whole.distance_test.as_ref());
            let Some(tests) = tests else { return Vec::new() };
            let wanted = |v: &Variant| tests.is_none_or(|tests| tests.contains(&v.distance_test));
            let alone =
                |variants: Vec<Variant>| variants.into_iter().filter(wanted).map(|v| vec![v]).collect();
            timed_cells(experiment, mode, usable, alone)
        }
        Stage::Paired => {
            let Some(paired) = &measurement.paired else { return Vec::new() };
            timed_cells(experiment, mode, usable, |variants| vec![paired.with_control(variants)])
        }
        Stage::Observed if measurement.observed.is_some() => {
            let cell = |run: ObservedRun| Cell {
                subject: run.id,
                threads: usable.threads,
                variants: Some(vec![run.variant]),
                rust_twin: None,
            };
            experiment.observed_runs(mode).into_iter().map(cell).collect()
        }
        Stage::Twin if measurement.twin.is_some() => twin_cells(experiment, usable),
        Stage::Validation if measurement.validation.is_some() => {
            let cell = |case: &Case| Cell {
                subject: case.name.to_string(),
                threads: 1,
                variants: Some(Vec::new()),
                rust_twin: None,
            };
            experiment.validation.iter().flat_map(|v| v.cases()).map(cell).collect()
        }
        Stage::Peaks if measurement.peaks.is_some() => {
            let cell = |threads: usize| Cell {
                subject: peaks::SUBJECT.to_string(),
                threads,
                variants: Some(Vec::new()),
                rust_twin: None,
            };
            peaks::thread_counts(usable).into_iter().map(cell).collect()
        }
        Stage::Observed | Stage::Twin | Stage::Validation | Stage::Peaks => Vec::new(),
    }
}

/// The run that leaves the states of the group with that place; the twin's comes after those of timed cells.
fn states_cell(experiment: &Experiment, mode: Mode, usable: Usable, place: usize) -> Option<Cell> {
    let names = experiment.groups(mode).map(|group| group.name.as_str());
    let twin = experiment.twin.iter().map(|_| twin::plan::GROUP);
    let subject = names.chain(twin).nth(place)?.to_string();
    Some(Cell { subject, threads: usable.threads, variants: None, rust_twin: None })
}

/// Cells of every group and number of threads that the machine has, as `choices` puts their variants together.
fn timed_cells(
    experiment: &Experiment,
    mode: Mode,
    usable: Usable,
    choices: impl Fn(Vec<Variant>) -> Vec<Vec<Variant>>,
) -> Vec<Cell> {
    let mut cells = Vec::new();
    for group in experiment.groups(mode) {
        for threads in group.thread_counts(usable).into_iter().filter(|&threads| threads <= usable.threads) {
            let mut variants = experiment.variants(group);
            variants.retain(|variant| {
                let cell = CellSettings { group: &group.name, threads, variant };
                experiment.left_out(cell).is_none()
            });
            if variants.is_empty() {
                continue;
            }
            let subject = &group.name;
            let cell = |variants| Cell {
                subject: subject.clone(),
                threads,
                variants: Some(variants),
                rust_twin: None,
            };
            cells.extend(choices(variants).into_iter().map(cell));
        }
    }
    cells
}

fn twin_cells(experiment: &Experiment, usable: Usable) -> Vec<Cell> {
    let Some(twin) = &experiment.twin else { return Vec::new() };
    let mut cells = Vec::new();
    for program in twin.cells() {
        for threads in twin.thread_counts(usable) {
            let rust_twin = (program.language == Language::Rust).then(|| program.distance_test.clone());
            cells.push(Cell { subject: program.label(), threads, variants: Some(Vec::new()), rust_twin });
        }
    }
    cells
}

impl Cell {
    fn holds(&self, trial: &TrialRecord) -> bool {
        let same = match &self.variants {
            Some(variants) => trial.variants == *variants,
            None => trial.variants.len() == 1,
        };
        same && self.names(trial) && trial.threads == self.threads
    }

    fn names(&self, trial: &TrialRecord) -> bool {
        let Some(test) = &self.rust_twin else {
            return trial.subject == self.subject;
        };
        let is_rust = |cell: &TwinCell| cell.language == Language::Rust && cell.distance_test == *test;
        trial.twin.as_ref().is_some_and(|twin| is_rust(&twin.cell) && twin.cell.label() == trial.subject)
    }
}

impl TrialRecord {
    fn check(&self, stage: Stage, paired: Option<&Paired>) -> Result<()> {
        check_time("wall_s", self.wall_s)?;
        let (timed, observed) = (self.outcome.is_some(), self.observation.is_some());
        let expected = match (self.status, stage) {
            (Status::Ok, Stage::Observed) => (false, true),
            (Status::Ok, Stage::Twin | Stage::Validation | Stage::Peaks) => (false, false),
            (Status::Ok, _) => (true, false),
            _ => (false, false),
        };
        let status = self.status.name();
        ensure!(
            (timed, observed) == expected,
            "a trial that is `{status}` in a round of the stage `{}` may not have these results",
            stage.name()
        );
        if let Some(outcome) = &self.outcome {
            outcome.check_counts(self.variants.len())?;
            for (variant, windows) in self.variants.iter().zip(&outcome.samples) {
                check_windows(windows, &outcome.samples[0], paired).with_context(|| variant.label())?;
            }
        }
        self.observation.as_ref().map_or(Ok(()), Observation::check)
    }
}

impl Outcome {
    fn check_counts(&self, variants: usize) -> Result<()> {
        let (particles, fluid) = (self.particles, self.fluid_particles);
        ensure!(particles > 0 && fluid <= particles, "{fluid} fluid particles among {particles} cannot be");
        ensure!(self.threads_observed > 0, "threads_observed is 0");
        let (bytes, samples) = (self.bytes.len(), self.samples.len());
        ensure!(
            bytes == variants && samples == variants && variants > 0,
            "bytes of {bytes} and samples of {samples} variants, not of {variants}"
        );
        Ok(())
    }
}

/// Checks one variant's windows: the same as `first`, its neighbour's, with every step once and times that can be.
fn check_windows(windows: &[WindowSample], first: &[WindowSample], paired: Option<&Paired>) -> Result<()> {
    let same = windows.len() == first.len() && windows.iter().zip(first).all(|(a, b)| a.window == b.window);
    ensure!(same && !windows.is_empty(), "its windows are not those of the trial's other variants");
    if let Some(paired) = paired {
        let planned = windows.len() == paired.windows.count()
            && windows.iter().all(|w| w.window.steps == paired.steps)
            && windows.iter().all(|w| w.window.warmup_steps == paired.warmup_steps);
        ensure!(planned, "its windows are not those that the experiment asks for");
    }
    for WindowSample { window, phases, steps, .. } in windows {
        let before = window.start_step.saturating_add(window.warmup_steps);
        ensure!(steps.len() == window.steps && !steps.is_empty(), "a window without all its steps");
        for (k, step) in steps.iter().enumerate() {
            ensure!(
                step.step == before.saturating_add(k + 1),
                "step {} stands where {} should",
                step.step,
                before.saturating_add(k + 1)
            );
            let place = || format!("step {}", step.step);
            check_time("total_s", step.total_s).with_context(place)?;
            check_time("cg_s", step.cg_s).with_context(place)?;
            let whole = step.total_s >= SHORTEST_STEP_S && step.cg_s <= step.total_s * (1.0 + 1e-9);
            ensure!(whole, "{}: {:e} s in CG of {:e} s cannot be", place(), step.cg_s, step.total_s);
        }
        for phase in phases {
            check_time("time_s", phase.time_s).with_context(|| format!("phase {:?}", phase.phase))?;
        }
    }
    Ok(())
}

impl Observation {
    fn check(&self) -> Result<()> {
        ensure!(self.threads_observed > 0, "threads_observed is 0");
        check_time("stepping_s", self.stepping_s)?;
        check_time("time_step_s", self.time_step_s)?;
        for FrontSample { time_s, front_p99_m } in &self.front {
            check_time("time_s", *time_s).context("front")?;
            ensure!(front_p99_m.is_finite(), "front_p99_m is {front_p99_m}");
        }
        for (quantity, value) in &self.quantities {
            ensure!(value.is_finite(), "{} is {value}", quantity.name());
        }
        Ok(())
    }
}

fn check_time(key: &str, time_s: f64) -> Result<()> {
    ensure!(
        (0.0..=LONGEST_S).contains(&time_s),
        "{key} is {time_s:e}; allowed are 0 to {LONGEST_S:e} seconds"
    );
    Ok(())
}
