//! From experiments to rounds of trials: which cells, in which order, and how long it will take.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::base::parallel::Workers;
use crate::engine::phase::NoProbe;
use crate::engine::preset::Preset;
use crate::engine::simulation::{self, Start};
use crate::experiment::machine::{Topology, allowed_cpus};
use crate::experiment::memory;
use crate::experiment::record::{Stage, StateDigest, Variant, Window};
use crate::experiment::spec::{Experiment, Mode, Paired, Whole};
use crate::scene::{Scene, library};

/// Everything a run will do, in order.
#[derive(Debug, Clone)]
pub struct Plan {
    pub mode: Mode,
    pub experiments: Vec<PlannedExperiment>,
    pub rounds: Vec<PlannedRound>,
    /// Hardware threads that may be used here.
    pub usable_threads: usize,
    /// Physical cores among them.
    pub usable_cores: usize,
}

/// An experiment with its scene as this mode sees it.
#[derive(Debug, Clone)]
pub struct PlannedExperiment {
    pub spec: Experiment,
    pub scene: Scene,
    pub sets: Vec<String>,
    pub particles: usize,
    /// Thread counts that this machine has the cores for.
    pub threads: Vec<usize>,
    pub windows: Vec<Window>,
}

/// The trials of one round, in the order in which they run.
#[derive(Debug, Clone)]
pub struct PlannedRound {
    /// Index into [`Plan::experiments`].
    pub experiment: usize,
    pub stage: Stage,
    pub round: usize,
    pub trials: Vec<PlannedTrial>,
}

#[derive(Debug, Clone)]
pub struct PlannedTrial {
    pub threads: usize,
    pub variants: Vec<Variant>,
    pub windows: Vec<Window>,
    pub estimate_s: f64,
    /// Seeds the order of variants within a step.
    pub seed: u64,
    /// Whether the trial leaves the states from which windows start.
    pub saves_states: bool,
}

/// Seconds that a particle takes in a step on this machine: measured, not assumed.
#[derive(Debug, Clone, Copy)]
pub struct Calibration {
    pub s_per_particle_step: f64,
}

impl Calibration {
    /// Times a few steps of a coarse dam break. A later, mixed state takes about a quarter longer than these.
    pub fn measure() -> Result<Self> {
        let scene = library::load("dam-break", &["particle_distance_m=0.0375".to_string()])?;
        let particles = scene.particles("dam-break")?;
        let options = Preset::PAPER_LINKED_LIST.options();
        let workers = Arc::new(Workers::new(1, options.schedule, &[])?);
        let start = Start { particles: &particles, steps_done: 0 };
        let mut simulation = simulation::build(&scene.parameters(&particles), &options, start, workers)?;
        simulation.step(&mut NoProbe)?;
        let began = Instant::now();
        let steps = 4;
        for _ in 0..steps {
            simulation.step(&mut NoProbe)?;
        }
        let per_step = began.elapsed().as_secs_f64() / f64::from(steps);
        Ok(Calibration { s_per_particle_step: 1.25 * per_step / particles.len() as f64 })
    }

    /// Steps cost what was measured; each process and window pays a little to start.
    fn estimate_s(self, particles: usize, threads: usize, variants: usize, windows: &[Window]) -> f64 {
        let steps: usize = windows.iter().map(|w| w.warmup_steps + w.steps).sum();
        let speed_up = 0.3 + 0.7 * threads as f64;
        let stepping = (steps * variants * particles) as f64 * self.s_per_particle_step / speed_up;
        let starting = 0.1 + windows.len() as f64 * particles as f64 * 3e-6;
        stepping + starting
    }
}

impl Plan {
    /// Plans `experiments` for this machine.
    pub fn new(experiments: Vec<Experiment>, mode: Mode, calibration: Calibration) -> Result<Plan> {
        let topology = Topology::read(Path::new("/"), &allowed_cpus());
        let usable_threads = topology.usable_cores();
        let usable_cores = topology.physical_cores().min(usable_threads);
        let experiments = experiments
            .into_iter()
            .map(|spec| PlannedExperiment::new(spec, mode, usable_threads))
            .collect::<Result<Vec<_>, InputError>>()?;
        let mut rounds = Vec::new();
        let mut states: Vec<StatesKey> = Vec::new();
        for (k, experiment) in experiments.iter().enumerate() {
            let key = experiment.states_key();
            let left = if states.contains(&key) { States::LeftByAnother } else { States::MustBeLeft };
            states.push(key);
            rounds.extend(experiment.rounds(k, mode, calibration, left));
        }
        Ok(Plan { mode, experiments, rounds, usable_threads, usable_cores })
    }

    /// Seconds that all rounds will take.
    pub fn estimate_s(&self) -> f64 {
        self.rounds.iter().map(PlannedRound::estimate_s).sum()
    }
}

impl PlannedTrial {
    /// Steps of all variants together, those to warm up included.
    pub fn steps(&self) -> usize {
        let steps: usize = self.windows.iter().map(|w| w.warmup_steps + w.steps).sum();
        steps * self.variants.len()
    }
}

impl PlannedRound {
    pub fn estimate_s(&self) -> f64 {
        self.trials.iter().map(|trial| trial.estimate_s).sum()
    }
}

/// Experiments with the same key can start from the same states.
type StatesKey = (String, Vec<String>, String, Vec<Window>);

impl PlannedExperiment {
    fn new(spec: Experiment, mode: Mode, usable_threads: usize) -> Result<Self, InputError> {
        let sets = spec.measurement(mode).scene_sets();
        let scene = library::load(&spec.scene, &sets)?;
        scene.require_memory(&spec.scene, spec.variants().len(), memory::available_bytes())?;
        let particles = scene.particles(&spec.scene)?.len();
        let threads = spec.factors.threads.iter().copied().filter(|&t| t <= usable_threads).collect();
        let windows = match &spec.measurement(mode).paired {
            Some(paired) => {
                let (asked, there) = (paired.windows * (paired.warmup_steps + paired.steps), scene.steps());
                let key = format!("mode.{}.paired.windows", mode.name());
                let allowed = format!("windows, warm-up included, may cover the scene's {there} steps once");
                Check { file: &spec.id }.require(
                    asked <= there,
                    &key,
                    format!("{asked} steps in all"),
                    allowed,
                )?;
                windows(paired, there)
            }
            None => Vec::new(),
        };
        Ok(PlannedExperiment { spec, scene, sets, particles, threads, windows })
    }

    fn states_key(&self) -> StatesKey {
        let tolerance = format!("cg_tolerance={}", self.spec.fixed.cg_tolerance);
        (self.spec.scene.clone(), self.sets.clone(), tolerance, self.windows.clone())
    }

    /// The folder of the run that holds the states of this experiment's scene.
    pub fn states_folder(&self, run: &Path) -> PathBuf {
        let name = |text: &str| -> String {
            text.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
        };
        let parts: Vec<String> = std::iter::once(&self.scene.name)
            .chain(&self.sets)
            .chain([&self.states_key().2])
            .map(|part| name(part))
            .collect();
        run.join("states").join(parts.join("_"))
    }

    /// The rounds of every stage. The first whole run leaves the states from which windows start; where there is none, a
    /// run of its own does.
    fn rounds(
        &self,
        index: usize,
        mode: Mode,
        calibration: Calibration,
        states: States,
    ) -> Vec<PlannedRound> {
        let measurement = self.spec.measurement(mode);
        let planner = RoundPlanner { experiment: self, index, calibration };
        let mut rounds = Vec::new();
        if let Some(whole) = &measurement.whole {
            rounds.extend((0..whole.rounds).map(|round| planner.whole(whole, round)));
        }
        if states == States::MustBeLeft && !self.windows.is_empty() {
            if rounds.is_empty() {
                rounds.push(planner.states());
            }
            if let Some(first) = rounds[0].trials.first_mut() {
                first.saves_states = true;
            }
        }
        if let Some(paired) = &measurement.paired {
            rounds.extend((0..paired.rounds).map(|round| planner.paired(round)));
        }
        rounds
    }

    /// The random order of one round: the same whenever and wherever it is planned.
    fn random(&self, stage: Stage, round: usize) -> fastrand::Rng {
        fastrand::Rng::with_seed(self.spec.seed ^ ((stage as u64) << 32) ^ round as u64)
    }

    /// Digests of this scene's states that are known before any trial.
    pub fn known_digests(&self) -> Vec<StateDigest> {
        let embedded: KnownDigests = toml::from_str(include_str!("../../experiments/digests.toml"))
            .expect("the embedded digests are valid");
        let same_scene = |known: &KnownDigest| {
            self.spec.scene == known.scene
                && self.scene.particle_distance_m == known.particle_distance_m
                && self.spec.fixed.cg_tolerance == known.cg_tolerance
                && self.sets.iter().all(|set| set.starts_with("particle_distance_m="))
        };
        embedded
            .state
            .into_iter()
            .filter(same_scene)
            .map(|known| StateDigest { step: known.step, digest: known.digest })
            .collect()
    }
}

#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct KnownDigests {
    state: Vec<KnownDigest>,
}

#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct KnownDigest {
    scene: String,
    particle_distance_m: f64,
    cg_tolerance: f64,
    step: usize,
    digest: String,
}

/// Whether an experiment's states lie there already when its turn comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum States {
    MustBeLeft,
    LeftByAnother,
}

/// Makes the rounds of one experiment.
struct RoundPlanner<'a> {
    experiment: &'a PlannedExperiment,
    index: usize,
    calibration: Calibration,
}

impl RoundPlanner<'_> {
    fn trial(&self, threads: usize, variants: Vec<Variant>, windows: Vec<Window>, seed: u64) -> PlannedTrial {
        let particles = self.experiment.particles;
        let estimate_s = self.calibration.estimate_s(particles, threads, variants.len(), &windows);
        PlannedTrial { threads, variants, windows, estimate_s, seed, saves_states: false }
    }

    fn round(&self, stage: Stage, round: usize, trials: Vec<PlannedTrial>) -> PlannedRound {
        PlannedRound { experiment: self.index, stage, round, trials }
    }

    /// All steps of the scene.
    fn every_step(&self) -> Vec<Window> {
        vec![Window { start_step: 0, warmup_steps: 0, steps: self.experiment.scene.steps() }]
    }

    /// One whole run a variant and thread count.
    fn whole(&self, whole: &Whole, round: usize) -> PlannedRound {
        let mut random = self.experiment.random(Stage::Whole, round);
        let mut trials = Vec::new();
        for variant in self.experiment.spec.variants() {
            let tests = whole.distance_test.as_ref();
            if tests.is_none_or(|tests| tests.contains(&variant.distance_test)) {
                for &threads in &self.experiment.threads {
                    trials.push(self.trial(
                        threads,
                        vec![variant.clone()],
                        self.every_step(),
                        random.u64(..),
                    ));
                }
            }
        }
        random.shuffle(&mut trials);
        self.round(Stage::Whole, round, trials)
    }

    /// One trial a thread count, with all variants in lock step.
    fn paired(&self, round: usize) -> PlannedRound {
        let mut random = self.experiment.random(Stage::Paired, round);
        let (variants, windows) = (self.experiment.spec.variants(), &self.experiment.windows);
        let trial = |&threads: &usize, seed| self.trial(threads, variants.clone(), windows.clone(), seed);
        let mut trials: Vec<PlannedTrial> =
            self.experiment.threads.iter().map(|threads| trial(threads, random.u64(..))).collect();
        random.shuffle(&mut trials);
        self.round(Stage::Paired, round, trials)
    }

    /// One whole run on all cores that nobody times: it only leaves states.
    fn states(&self) -> PlannedRound {
        let mut variant = self.experiment.spec.variants()[0].clone();
        variant.preset = Preset::PAPER_AOS_RELOCATION.name().to_string();
        variant.distance_test = "squared".to_string();
        variant.storage = "csr".to_string();
        let threads = self.experiment.threads.iter().copied().max().unwrap_or(1);
        self.round(Stage::States, 0, vec![self.trial(threads, vec![variant], self.every_step(), 0)])
    }
}

/// Windows spread evenly over the run, one in the middle of each equal part of it.
fn windows(paired: &Paired, steps: usize) -> Vec<Window> {
    let length = paired.warmup_steps + paired.steps;
    let part = steps as f64 / paired.windows as f64;
    (0..paired.windows)
        .map(|k| {
            let middle = (k as f64 + 0.5) * part;
            let last_start = steps.saturating_sub(length);
            let start_step = ((middle - 0.5 * length as f64).max(0.0) as usize).min(last_start);
            Window { start_step, warmup_steps: paired.warmup_steps, steps: paired.steps }
        })
        .collect()
}

/// The CPUs to pin to: `off`, `close` or `spread`.
pub fn pin_order(pin: &str) -> Result<Vec<usize>> {
    let topology = Topology::read(Path::new("/"), &allowed_cpus());
    match pin {
        "off" => Ok(Vec::new()),
        "close" => Ok(topology.pin_order_close()),
        "spread" => Ok(topology.pin_order_spread()),
        _ => Err(InputError::new("command line", "pin", pin, "allowed are `off`, `close` or `spread`"))
            .context("pinning"),
    }
}

/// Cells that a run will not measure because the machine has too few hardware threads: thread counts by experiment.
pub fn not_applicable(plan: &Plan) -> BTreeMap<String, Vec<usize>> {
    plan.experiments
        .iter()
        .map(|e| {
            let missing = e.spec.factors.threads.iter().filter(|t| !e.threads.contains(t));
            (e.spec.id.clone(), missing.copied().collect())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_lie_in_the_middle_of_equal_parts() {
        let paired = Paired { rounds: 1, windows: 8, warmup_steps: 1, steps: 6 };
        let windows = windows(&paired, 667);
        assert_eq!(windows[0].start_step, 38);
        assert_eq!(windows[7].start_step, 621);
        assert!(windows.iter().all(|w| w.end_step() <= 667));
    }

    #[test]
    fn a_plan_is_the_same_every_time() {
        let calibration = Calibration { s_per_particle_step: 1e-6 };
        let plan = || {
            let table2 = crate::experiment::library::load("table2").unwrap();
            let figure4 = crate::experiment::library::load("figure4").unwrap();
            Plan::new(vec![table2, figure4], Mode::Quick, calibration).unwrap()
        };
        let (one, two) = (plan(), plan());
        assert_eq!(format!("{:?}", one.rounds), format!("{:?}", two.rounds));
        let savers = one.rounds.iter().flat_map(|r| &r.trials).filter(|t| t.saves_states).count();
        assert_eq!(savers, 1, "one whole run leaves the states that both experiments start from");
    }
}
