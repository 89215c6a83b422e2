//! What measuring leaves behind: the outcome of each trial, and rounds of trials as files.
//!
//! A round is the unit that is completed, written and resumed. Its file is written whole, and replaced only as a whole; all tables
//! are derived from these files.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::files::write_whole;
use crate::base::input::InputError;
use crate::engine::preset::{MAX_BUCKETS_PER_RADIUS, Options, PairTerms, Preset, Search};
use crate::engine::pressure::conjugate_gradient::{CgMode, CgParams};
use crate::engine::pressure::preconditioner::Preconditioning;
use crate::engine::pressure::values::MatrixValues;
use crate::experiment::foreign;
use crate::experiment::machine::Noise;
use crate::experiment::memory_order::MemoryOrder;
use crate::experiment::peaks::Peaks;
use crate::experiment::quantity::Quantity;
use crate::experiment::twin::outcome::TwinOutcome;
use crate::experiment::validation::Validated;

/// The version of every file of a run folder.
pub const SCHEMA: u32 = 2;

/// One way to compute a step, as recorded: a preset and the options that an experiment sets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Variant {
    pub preset: String,
    pub distance_test: String,
    pub buckets_per_radius: usize,
    /// How the particles of the starting state follow one another in memory.
    pub memory_order: String,
    pub storage: String,
    pub schedule: String,
    /// `serial` or `parallel`.
    pub cg: String,
    pub cg_tolerance: f64,
    /// `none`, `jacobi`, `ssor`, `ic0` or `two-level`.
    pub preconditioner: String,
    /// `f64` or `f32`: what the pressure's matrix keeps its values in.
    pub matrix_values: String,
    /// `separate`, `shared` or `joined`: how often the pairs of one radius are walked for explicit forces and rates.
    pub pair_terms: String,
    /// The id of the scheme that the scene is changed by; empty for the scene as it is.
    pub scheme: String,
    /// What that scheme changes, as `key=value`.
    pub scene_changes: Vec<String>,
    /// Whether it is a second copy of another variant, measured for the noise floor.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub control: bool,
}

/// The paper's settings or, where it is silent, those that ARCHITECTURE.md gives reasons for.
impl Default for Variant {
    fn default() -> Self {
        Variant {
            preset: Preset::PAPER_LINKED_LIST.name().to_string(),
            distance_test: "sqrt".to_string(),
            buckets_per_radius: 1,
            memory_order: MemoryOrder::AsAged.name().to_string(),
            storage: "ell".to_string(),
            schedule: "dynamic:64".to_string(),
            cg: "parallel".to_string(),
            cg_tolerance: CgParams::DEFAULT_TOLERANCE,
            preconditioner: Preconditioning::None.name().to_string(),
            matrix_values: MatrixValues::F64.to_string(),
            pair_terms: PairTerms::Separate.to_string(),
            scheme: String::new(),
            scene_changes: Vec::new(),
            control: false,
        }
    }
}

impl Variant {
    /// The engine's options, or which key names none.
    pub fn options(&self, file: &str) -> Result<Options, InputError> {
        let wrong = |key: &str, error: String| InputError::new(file, key, "not usable", error);
        let preset: Preset = self.preset.parse().map_err(|e| wrong("preset", e))?;
        self.memory_order(file)?;
        Ok(Options {
            search: preset.options().search,
            dry_walls: preset.options().dry_walls,
            pair_terms: self.pair_terms.parse().map_err(|e| wrong("pair_terms", e))?,
            distance_test: self.distance_test.parse().map_err(|e| wrong("distance_test", e))?,
            buckets_per_radius: checked_buckets(file, self.buckets_per_radius)?,
            storage: self.storage.parse().map_err(|e| wrong("storage", e))?,
            matrix_values: self.matrix_values.parse().map_err(|e| wrong("matrix_values", e))?,
            schedule: self
                .schedule
                .parse()
                .map_err(|e: crate::base::schedule::UnknownSchedule| wrong("schedule", e.to_string()))?,
            cg: CgParams {
                tolerance: checked_tolerance(file, self.cg_tolerance)?,
                mode: match self.cg.as_str() {
                    "serial" => CgMode::Serial,
                    "parallel" => CgMode::Parallel,
                    other => {
                        return Err(InputError::new(file, "cg", other, "allowed are `serial` or `parallel`"));
                    }
                },
                preconditioner: self.preconditioner.parse().map_err(|e| wrong("preconditioner", e))?,
                ..CgParams::default()
            },
        })
    }

    pub fn memory_order(&self, file: &str) -> Result<MemoryOrder, InputError> {
        self.memory_order.parse().map_err(|e: String| InputError::new(file, "memory_order", "not usable", e))
    }

    /// The short name in tables and cell names: what differs from the paper's settings, beside preset and distance test.
    pub fn label(&self) -> String {
        let usual = Variant::default();
        let mut parts = vec![self.preset.clone(), self.distance_test.clone()];
        if self.buckets_per_radius != usual.buckets_per_radius {
            parts.push(format!("buckets-per-radius={}", self.buckets_per_radius));
        }
        if self.cg_tolerance != usual.cg_tolerance {
            parts.push(format!("tolerance={:e}", self.cg_tolerance));
        }
        let named = [
            ("order", &self.memory_order, &usual.memory_order),
            ("storage", &self.storage, &usual.storage),
            ("schedule", &self.schedule, &usual.schedule),
            ("cg", &self.cg, &usual.cg),
            ("preconditioner", &self.preconditioner, &usual.preconditioner),
            ("values", &self.matrix_values, &usual.matrix_values),
            ("pair-terms", &self.pair_terms, &usual.pair_terms),
            ("scheme", &self.scheme, &usual.scheme),
        ];
        let differing = named.into_iter().filter(|(_, value, usual)| value != usual);
        parts.extend(differing.map(|(name, value, _)| format!("{name}={value}")));
        if self.control {
            parts.push("control".to_string());
        }
        parts.join("/")
    }

    /// Whether two variants must end in the same state, to the last bit, if they start from the same one.
    pub fn has_answer_of(&self, other: &Variant) -> bool {
        let answer = |v: &Variant| {
            let solve = (v.cg_tolerance.to_bits(), v.preconditioner.clone(), v.matrix_values.clone());
            // Clusters sum in an order of their own, and may leave walls out.
            let options = v.preset.parse().map(Preset::options);
            let engine = options.map(|options| (options.search == Search::Clusters, options.dry_walls)).ok();
            (solve, engine, v.buckets_per_radius, v.memory_order.clone(), v.scene_changes.clone())
        };
        answer(self) == answer(other)
    }
}

/// A number of buckets that a walk can visit.
pub fn checked_buckets(file: &str, count: usize) -> Result<NonZeroUsize, InputError> {
    let allowed = format!("allowed are 1 to {MAX_BUCKETS_PER_RADIUS}");
    NonZeroUsize::new(count)
        .filter(|count| count.get() <= MAX_BUCKETS_PER_RADIUS)
        .ok_or_else(|| InputError::new(file, "buckets_per_radius", count, allowed))
}

/// A tolerance that a solver can meet in double precision.
pub fn checked_tolerance(file: &str, tolerance: f64) -> Result<f64, InputError> {
    let allowed = "allowed are numbers from 1e-13 to 0.1";
    if (1e-13..=0.1).contains(&tolerance) {
        Ok(tolerance)
    } else {
        Err(InputError::new(file, "cg_tolerance", tolerance, allowed))
    }
}

/// Consecutive steps that a trial computes from a known state: first some to warm up, then those that count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Window {
    /// Steps that the starting state has behind it.
    pub start_step: usize,
    pub warmup_steps: usize,
    pub steps: usize,
}

impl Window {
    pub fn end_step(&self) -> usize {
        self.start_step + self.warmup_steps + self.steps
    }
}

/// How a trial ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    Ok,
    Failed,
    Timeout,
    /// The system had no memory left for it.
    OutOfMemory,
    /// The command did not ask for the cell.
    Skipped,
    /// The machine cannot run the cell, or the experiment excludes it, so nobody tried.
    NotApplicable,
}

impl Status {
    /// Whether the trial should have had an answer and has none.
    pub fn is_failure(self) -> bool {
        !matches!(self, Status::Ok | Status::Skipped | Status::NotApplicable)
    }

    pub fn name(self) -> &'static str {
        match self {
            Status::Ok => "ok",
            Status::Failed => "failed",
            Status::Timeout => "timeout",
            Status::OutOfMemory => "out_of_memory",
            Status::Skipped => "skipped",
            Status::NotApplicable => "not_applicable",
        }
    }
}

/// One measured step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepSample {
    pub step: usize,
    pub total_s: f64,
    pub cg_s: f64,
    pub cg_iterations: usize,
    pub cg_residual: f64,
    pub unknowns: usize,
    /// Values of the pressure's matrix beside its diagonal; `None` in records that are older than this number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matrix_entries: Option<usize>,
    pub ghosts: usize,
}

/// Calls and time of one phase over the measured steps of a window.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhaseSample {
    pub phase: String,
    pub calls: u64,
    pub time_s: f64,
}

/// One variant in one window.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WindowSample {
    pub window: Window,
    pub phases: Vec<PhaseSample>,
    pub steps: Vec<StepSample>,
    /// The digest of the state after the last step.
    pub digest: String,
}

/// The digest of a state on the way.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StateDigest {
    pub step: usize,
    pub digest: String,
}

/// What one trial measured: its variants in the order of the request, each in every window.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outcome {
    pub threads_observed: usize,
    /// What else the machine did, just before the first and after the last step.
    pub noise_before: Noise,
    pub noise_after: Noise,
    pub particles: usize,
    pub fluid_particles: usize,
    /// Bytes of all columns of one simulation, a variant.
    pub bytes: Vec<usize>,
    pub samples: Vec<Vec<WindowSample>>,
    /// States that the trial passed and was asked to name; empty but in whole runs.
    pub passed: Vec<StateDigest>,
}

/// Where the front was on the way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrontSample {
    pub time_s: f64,
    /// The 99th percentile of the fluid's x.
    pub front_p99_m: f64,
}

/// What was seen of a run from its start to its end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Observation {
    pub threads_observed: usize,
    pub particles: usize,
    /// `completed`, or the kind of error that ended the run: `coincident`, `not_finite` or `solver`.
    pub ended: String,
    /// The error's own words; empty for a completed run.
    pub error: String,
    pub steps: usize,
    pub time_step_s: f64,
    /// Wall time of the steps alone.
    pub stepping_s: f64,
    pub quantities: BTreeMap<Quantity, f64>,
    pub front: Vec<FrontSample>,
    /// The digest of the last state; empty for a run that broke down.
    pub digest: String,
}

impl Observation {
    pub const COMPLETED: &'static str = "completed";
}

/// One trial of a round.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrialRecord {
    /// Its place in the round's random order, from 0.
    pub position: usize,
    /// The group of timed cells, or the observed run.
    pub subject: String,
    pub threads: usize,
    pub variants: Vec<Variant>,
    pub status: Status,
    /// Why, unless the status is `ok`.
    pub reason: String,
    pub started_utc: String,
    /// Wall time of the whole process, its start and the reading of states included.
    pub wall_s: f64,
    /// What a timed trial measured.
    pub outcome: Option<Outcome>,
    /// What was seen of an observed run.
    pub observation: Option<Observation>,
    /// Which twin ran, and what it measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub twin: Option<TwinOutcome>,
    /// What a validating case found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub validated: Option<Validated>,
    /// What the machine reached.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peaks: Option<Peaks>,
}

/// Which kind of trial a round holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// One run that only leaves states for the windows of paired trials, where no whole run does.
    States,
    /// One variant a process, every step of the scene.
    Whole,
    /// All variants of a group in one process, in lock step through windows of states.
    Paired,
    /// Scenes from their start, one a process.
    Observed,
    /// The loop of the paper's Figure 3 in one language, a program a process.
    Twin,
    /// Cases with known answers, one a process.
    Validation,
    /// What the machine moves and computes at most, a number of threads a process.
    Peaks,
}

impl Stage {
    pub const ALL: [Stage; 7] = [
        Stage::States,
        Stage::Whole,
        Stage::Paired,
        Stage::Observed,
        Stage::Twin,
        Stage::Validation,
        Stage::Peaks,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Stage::States => "states",
            Stage::Whole => "whole",
            Stage::Paired => "paired",
            Stage::Observed => "observed",
            Stage::Twin => "twin",
            Stage::Validation => "validation",
            Stage::Peaks => "peaks",
        }
    }
}

/// A finished round: every cell of its stage once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoundRecord {
    pub schema_version: u32,
    pub experiment: String,
    pub stage: Stage,
    pub round: usize,
    /// What the gate found, where the machine was busier than it allows; empty otherwise.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub warning: String,
    pub trials: Vec<TrialRecord>,
}

impl RoundRecord {
    /// Where the round lies in a run folder.
    pub fn path(folder: &Path, experiment: &str, stage: Stage, round: usize) -> PathBuf {
        folder.join("rounds").join(format!("{experiment}-{}-{round:03}.json", stage.name()))
    }

    /// Whether a trial ended without an answer.
    pub fn has_failures(&self) -> bool {
        self.trials.iter().any(|trial| trial.status.is_failure())
    }

    /// Writes what the round's processes had to say, beside the records.
    pub fn write_log(&self, folder: &Path, text: &str) -> Result<()> {
        let logs = folder.join("logs");
        std::fs::create_dir_all(&logs).with_context(|| format!("cannot create {}", logs.display()))?;
        let name = format!("{}-{}-{:03}.log", self.experiment, self.stage.name(), self.round);
        write_whole(&logs.join(&name), text.as_bytes()).with_context(|| format!("cannot write logs/{name}"))
    }

    pub fn write(&self, folder: &Path) -> Result<()> {
        let path = Self::path(folder, &self.experiment, self.stage, self.round);
        let text = serde_json::to_vec(self)?;
        write_whole(&path, &text).with_context(|| format!("cannot write {}", path.display()))
    }

    /// Reads a round back and checks that it is what its name says.
    pub fn read(path: &Path) -> Result<RoundRecord> {
        let name = path.display();
        let record: RoundRecord = foreign::read_record(path, "a round's record", SCHEMA)?;
        let expected = Self::path(Path::new(""), &record.experiment, record.stage, record.round);
        ensure!(path.file_name() == expected.file_name(), "{name} holds another round than its name says");
        for trial in record.trials.iter().filter(|trial| trial.status == Status::Ok) {
            if record.stage == Stage::Observed {
                ensure!(trial.observation.is_some(), "{name}: an `ok` trial without observation");
                continue;
            }
            if record.stage == Stage::Twin {
                let twin = trial.twin.as_ref().with_context(|| format!("{name}: a trial of no twin"))?;
                twin.check(trial.threads).with_context(|| format!("{name}"))?;
                continue;
            }
            if record.stage == Stage::Validation {
                let found =
                    trial.validated.as_ref().with_context(|| format!("{name}: a trial of no case"))?;
                found.check().with_context(|| format!("{name}"))?;
                continue;
            }
            if record.stage == Stage::Peaks {
                let peaks = trial.peaks.as_ref().with_context(|| format!("{name}: a trial without peaks"))?;
                peaks.check().with_context(|| format!("{name}"))?;
                continue;
            }
            let outcome =
                trial.outcome.as_ref().with_context(|| format!("{name}: an `ok` trial without outcome"))?;
            outcome.check(trial.variants.len()).with_context(|| format!("{name}"))?;
        }
        Ok(record)
    }
}

impl Outcome {
    /// Refuses what no clock can have measured.
    fn check(&self, variants: usize) -> Result<()> {
        ensure!(self.samples.len() == variants, "samples of {} variants, not {variants}", self.samples.len());
        for window in self.samples.iter().flatten() {
            ensure!(window.steps.len() == window.window.steps, "a window without all its steps");
            for step in &window.steps {
                let times = [step.total_s, step.cg_s];
                let valid = times.iter().all(|t| t.is_finite() && *t >= 0.0) && step.total_s > 0.0;
                ensure!(valid, "step {}: times {times:?} cannot be", step.step);
            }
            for phase in &window.phases {
                let valid = phase.time_s.is_finite() && phase.time_s >= 0.0;
                ensure!(valid, "phase {}: time {} cannot be", phase.phase, phase.time_s);
            }
        }
        Ok(())
    }
}
