//! From experiments to rounds of trials: which cells and runs, in which order, and how long it will take.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};

use crate::base::input::{Check, InputError};
use crate::base::parallel::Workers;
use crate::engine::phase::NoProbe;
use crate::engine::preset::Preset;
use crate::engine::simulation::{self, Start};
use crate::experiment::factors::Factors;
use crate::experiment::machine::{Topology, allowed_cpus};
use crate::experiment::memory;
use crate::experiment::observed::ObservedRun;
use crate::experiment::record::{Stage, Variant, Window};
use crate::experiment::spec::{Experiment, Mode, Paired, Whole, Windows, scene_sets};
use crate::experiment::states::{States, StatesKey};
use crate::scene::{Scene, library};

/// Everything a run will do, in order.
#[derive(Debug, Clone)]
pub struct Plan {
    pub mode: Mode,
    pub experiments: Vec<PlannedExperiment>,
    /// States that windows start from, each left by one run for all experiments that need it.
    pub states: Vec<States>,
    pub rounds: Vec<PlannedRound>,
    /// Hardware threads that may be used here.
    pub usable_threads: usize,
    /// Physical cores among them.
    pub usable_cores: usize,
}

/// An experiment as this mode sees it.
#[derive(Debug, Clone)]
pub struct PlannedExperiment {
    pub spec: Experiment,
    pub groups: Vec<Group>,
    pub runs: Vec<PlannedRun>,
}

/// A group of timed cells with its scene.
#[derive(Debug, Clone)]
pub struct Group {
    pub name: String,
    pub scene: Scene,
    pub sets: Vec<String>,
    pub particles: usize,
    pub variants: Vec<Variant>,
    /// Thread counts that this machine has the cores for.
    pub threads: Vec<usize>,
    /// Those that it has not.
    pub not_applicable: Vec<usize>,
    pub windows: Vec<Window>,
    /// Index into [`Plan::states`].
    pub states: usize,
}

/// A run to observe with its size.
#[derive(Debug, Clone)]
pub struct PlannedRun {
    pub run: ObservedRun,
    pub scene: Scene,
    pub particles: usize,
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
    pub estimate_s: f64,
    pub work: Work,
}

/// What a trial does.
#[derive(Debug, Clone)]
pub enum Work {
    Timed(TimedWork),
    /// Index into [`PlannedExperiment::runs`].
    Observed(usize),
}

#[derive(Debug, Clone)]
pub struct TimedWork {
    /// Index into [`PlannedExperiment::groups`].
    pub group: usize,
    pub variants: Vec<Variant>,
    pub windows: Vec<Window>,
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

    /// Seconds for `steps` steps of `particles` particles each.
    fn stepping_s(self, particles: usize, threads: usize, steps: usize) -> f64 {
        let speed_up = 0.3 + 0.7 * threads as f64;
        (steps * particles) as f64 * self.s_per_particle_step / speed_up
    }

    /// Steps cost what was measured; each process and window pays a little to start.
    fn timed_s(self, particles: usize, threads: usize, variants: usize, windows: &[Window]) -> f64 {
        let steps: usize = windows.iter().map(|w| w.warmup_steps + w.steps).sum();
        let starting = 0.1 + (windows.len() * (variants + 2) * particles) as f64 * 1e-6;
        self.stepping_s(particles, threads, steps * variants) + starting
    }
}

impl Plan {
    /// Plans `experiments` for this machine.
    pub fn new(experiments: Vec<Experiment>, mode: Mode, calibration: Calibration) -> Result<Plan> {
        let topology = Topology::read(Path::new("/"), &allowed_cpus());
        let usable_threads = topology.usable_cores();
        let usable_cores = topology.physical_cores().min(usable_threads);
        let mut states = Vec::new();
        let experiments = experiments
            .into_iter()
            .map(|spec| PlannedExperiment::new(spec, mode, usable_threads, &mut states))
            .collect::<Result<Vec<_>, InputError>>()?;
        let mut rounds = Vec::new();
        let mut left = vec![false; states.len()];
        for (index, experiment) in experiments.iter().enumerate() {
            let planner = RoundPlanner { experiment, index, calibration, states: &states };
            rounds.extend(planner.rounds(mode, usable_threads, &mut left));
        }
        Ok(Plan { mode, experiments, states, rounds, usable_threads, usable_cores })
    }

    /// Seconds that all rounds will take.
    pub fn estimate_s(&self) -> f64 {
        self.rounds.iter().map(PlannedRound::estimate_s).sum()
    }
}

impl PlannedTrial {
    /// The ways to compute, or the one run to observe.
    pub fn cells(&self) -> usize {
        match &self.work {
            Work::Timed(timed) => timed.variants.len(),
            Work::Observed(_) => 1,
        }
    }

    pub fn saves_states(&self) -> bool {
        matches!(&self.work, Work::Timed(timed) if timed.saves_states)
    }
}

impl PlannedRound {
    pub fn estimate_s(&self) -> f64 {
        self.trials.iter().map(|trial| trial.estimate_s).sum()
    }
}

impl PlannedExperiment {
    fn new(
        spec: Experiment,
        mode: Mode,
        usable_threads: usize,
        states: &mut Vec<States>,
    ) -> Result<Self, InputError> {
        let groups = spec
            .groups(mode)
            .map(|factors| Group::new(&spec, factors, mode, usable_threads, states))
            .collect::<Result<Vec<_>, _>>()?;
        let runs =
            spec.observed_runs(mode).into_iter().map(PlannedRun::new).collect::<Result<Vec<_>, _>>()?;
        Ok(PlannedExperiment { spec, groups, runs })
    }
}

impl Group {
    fn new(
        spec: &Experiment,
        factors: &Factors,
        mode: Mode,
        usable_threads: usize,
        states: &mut Vec<States>,
    ) -> Result<Self, InputError> {
        let measurement = spec.measurement(mode);
        let sets = scene_sets([&measurement.scene, &factors.scene]);
        let scene = library::load(&spec.scene, &sets)?;
        let variants = spec.variants(factors);
        for variant in &variants {
            library::load(&spec.scene, &[&sets[..], &variant.scene_changes].concat())?;
        }
        scene.require_memory(&spec.scene, variants.len(), memory::available_bytes())?;
        let particles = scene.particles(&spec.scene)?.len();
        let windows = match &measurement.paired {
            Some(paired) => windows_of(paired, &scene, &spec.id, mode)?,
            None => Vec::new(),
        };
        let key =
            StatesKey { scene: spec.scene.clone(), sets: sets.clone(), tolerance: spec.fixed.cg_tolerance };
        let (applicable, not_applicable) =
            factors.thread_counts(usable_threads).into_iter().partition(|&count| count <= usable_threads);
        Ok(Group {
            name: factors.name.clone(),
            states: States::needed(states, key, &scene, &windows),
            scene,
            sets,
            particles,
            variants,
            threads: applicable,
            not_applicable,
            windows,
        })
    }
}

impl PlannedRun {
    fn new(run: ObservedRun) -> Result<Self, InputError> {
        let sets = [&run.sets[..], &run.variant.scene_changes].concat();
        let scene = library::load(&run.scene, &sets)?;
        scene.require_memory(&run.scene, 1, memory::available_bytes())?;
        Ok(PlannedRun { particles: scene.particles(&run.scene)?.len(), scene, run })
    }
}

/// The windows of a mode, checked against the scene's length.
fn windows_of(paired: &Paired, scene: &Scene, id: &str, mode: Mode) -> Result<Vec<Window>, InputError> {
    let (there, length) = (scene.steps(), paired.warmup_steps + paired.steps);
    let windows = windows(paired, there);
    let apart = windows.windows(2).all(|pair| pair[0].end_step() <= pair[1].start_step);
    let inside = windows.last().is_none_or(|last| last.end_step() <= there);
    let key = format!("mode.{}.paired.windows", mode.name());
    let allowed = format!(
        "windows of {length} steps, warm-up included, must follow one another within the scene's {there} steps"
    );
    Check { file: id }.require(apart && inside, &key, format!("{:?}", paired.windows), allowed)?;
    Ok(windows)
}

/// Makes the rounds of one experiment.
struct RoundPlanner<'a> {
    experiment: &'a PlannedExperiment,
    index: usize,
    calibration: Calibration,
    states: &'a [States],
}

impl RoundPlanner<'_> {
    /// The rounds of every stage. The first whole run of a scene leaves the states from which windows start; where there
    /// is none, a run of its own does. `left` says whose states lie there already.
    fn rounds(&self, mode: Mode, usable_threads: usize, left: &mut [bool]) -> Vec<PlannedRound> {
        let measurement = self.experiment.spec.measurement(mode);
        let mut rounds = Vec::new();
        if let Some(whole) = &measurement.whole {
            rounds.extend((0..whole.rounds).map(|round| self.whole(whole, round)));
        }
        for (k, group) in self.experiment.groups.iter().enumerate() {
            if group.windows.is_empty() || std::mem::replace(&mut left[group.states], true) {
                continue;
            }
            let answer = self.states[group.states].variant();
            let can_save = |trial: &&mut PlannedTrial| match &trial.work {
                Work::Timed(timed) => timed.group == k && timed.variants[0].has_answer_of(&answer),
                Work::Observed(_) => false,
            };
            let first = rounds.first_mut().and_then(|round| round.trials.iter_mut().find(can_save));
            match first.map(|trial| &mut trial.work) {
                Some(Work::Timed(timed)) => timed.saves_states = true,
                _ => rounds.push(self.states(k, usable_threads)),
            }
        }
        if let Some(paired) = &measurement.paired {
            rounds.extend((0..paired.rounds).map(|round| self.paired(round)));
        }
        if let Some(observed) = &measurement.observed {
            rounds.extend((0..observed.rounds).map(|round| self.observed(round, usable_threads)));
        }
        rounds
    }

    /// The random order of one round: the same whenever and wherever it is planned.
    fn random(&self, stage: Stage, round: usize) -> fastrand::Rng {
        fastrand::Rng::with_seed(self.experiment.spec.seed ^ ((stage as u64) << 32) ^ round as u64)
    }

    fn timed(&self, threads: usize, work: TimedWork) -> PlannedTrial {
        let particles = self.experiment.groups[work.group].particles;
        let estimate_s = self.calibration.timed_s(particles, threads, work.variants.len(), &work.windows);
        PlannedTrial { threads, estimate_s, work: Work::Timed(work) }
    }

    fn round(&self, stage: Stage, round: usize, trials: Vec<PlannedTrial>) -> PlannedRound {
        PlannedRound { experiment: self.index, stage, round, trials }
    }

    /// One whole run a variant and thread count.
    fn whole(&self, whole: &Whole, round: usize) -> PlannedRound {
        let mut random = self.random(Stage::Whole, round);
        let mut trials = Vec::new();
        for (k, group) in self.experiment.groups.iter().enumerate() {
            let wanted = |variant: &&Variant| {
                whole.distance_test.as_ref().is_none_or(|tests| tests.contains(&variant.distance_test))
            };
            for variant in group.variants.iter().filter(wanted) {
                for &threads in &group.threads {
                    let work = TimedWork {
                        group: k,
                        variants: vec![variant.clone()],
                        windows: steps_up_to(group.scene.steps()),
                        seed: random.u64(..),
                        saves_states: false,
                    };
                    trials.push(self.timed(threads, work));
                }
            }
        }
        random.shuffle(&mut trials);
        self.round(Stage::Whole, round, trials)
    }

    /// One trial a group and thread count, with all variants in lock step.
    fn paired(&self, round: usize) -> PlannedRound {
        let mut random = self.random(Stage::Paired, round);
        let mut trials = Vec::new();
        for (k, group) in self.experiment.groups.iter().enumerate() {
            for &threads in &group.threads {
                let work = TimedWork {
                    group: k,
                    variants: group.variants.clone(),
                    windows: group.windows.clone(),
                    seed: random.u64(..),
                    saves_states: false,
                };
                trials.push(self.timed(threads, work));
            }
        }
        random.shuffle(&mut trials);
        self.round(Stage::Paired, round, trials)
    }

    /// One run on all cores, up to the last state that is needed, that nobody times: it only leaves states.
    fn states(&self, group: usize, usable_threads: usize) -> PlannedRound {
        let states = &self.states[self.experiment.groups[group].states];
        let variant = Variant {
            preset: Preset::PAPER_AOS_RELOCATION.name().to_string(),
            distance_test: "squared".to_string(),
            storage: "csr".to_string(),
            ..states.variant()
        };
        let work = TimedWork {
            group,
            variants: vec![variant],
            windows: steps_up_to(states.last_step()),
            seed: 0,
            saves_states: true,
        };
        self.round(Stage::States, group, vec![self.timed(usable_threads, work)])
    }

    /// Every observed run once, on all cores.
    fn observed(&self, round: usize, usable_threads: usize) -> PlannedRound {
        let mut random = self.random(Stage::Observed, round);
        let trial = |(k, planned): (usize, &PlannedRun)| PlannedTrial {
            threads: usable_threads,
            estimate_s: 0.1
                + self.calibration.stepping_s(planned.particles, usable_threads, planned.scene.steps()),
            work: Work::Observed(k),
        };
        let mut trials: Vec<PlannedTrial> = self.experiment.runs.iter().enumerate().map(trial).collect();
        random.shuffle(&mut trials);
        self.round(Stage::Observed, round, trials)
    }
}

/// One window over all steps up to `last`.
fn steps_up_to(last: usize) -> Vec<Window> {
    vec![Window { start_step: 0, warmup_steps: 0, steps: last }]
}

/// Windows after the stated steps or, spread evenly, one in the middle of each equal part of a run.
fn windows(paired: &Paired, steps: usize) -> Vec<Window> {
    let length = paired.warmup_steps + paired.steps;
    let starts: Vec<usize> = match &paired.windows {
        Windows::After(starts) => starts.clone(),
        Windows::Spread(count) => {
            let part = steps as f64 / *count as f64;
            let middle = |k: usize| (k as f64 + 0.5) * part;
            let last_start = steps.saturating_sub(length);
            let start = |k| ((middle(k) - 0.5 * length as f64).max(0.0) as usize).min(last_start);
            (0..*count).map(start).collect()
        }
    };
    let Paired { warmup_steps, steps, .. } = *paired;
    starts.into_iter().map(|start_step| Window { start_step, warmup_steps, steps }).collect()
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    const CALIBRATION: Calibration = Calibration { s_per_particle_step: 1e-6 };

    #[test]
    fn windows_lie_in_the_middle_of_equal_parts() {
        let paired = Paired { rounds: 1, windows: Windows::Spread(8), warmup_steps: 1, steps: 6 };
        let windows = windows(&paired, 667);
        assert_eq!(windows[0].start_step, 38);
        assert_eq!(windows[7].start_step, 621);
        assert!(windows.iter().all(|w| w.end_step() <= 667));
    }

    #[test]
    fn a_plan_is_the_same_every_time() {
        let plan = || {
            let experiments = vec![crate::experiment::library::load("table2").unwrap()];
            Plan::new(experiments, Mode::Default, CALIBRATION).unwrap()
        };
        assert_eq!(format!("{:?}", plan().rounds), format!("{:?}", plan().rounds));
    }

    #[test]
    fn one_run_leaves_the_states_that_several_experiments_need() {
        for mode in Mode::ALL {
            let names = ["table2", "figure4"].map(|name| crate::experiment::library::load(name).unwrap());
            let plan = Plan::new(names.to_vec(), mode, CALIBRATION).unwrap();
            assert_eq!(plan.states.len(), 1);
            let savers = plan.rounds.iter().flat_map(|round| &round.trials).filter(|t| t.saves_states());
            assert_eq!(savers.count(), 1);
            let needed = plan.experiments.iter().flat_map(|e| &e.groups).flat_map(|g| &g.windows);
            let starts: BTreeSet<usize> = needed.map(|w| w.start_step).filter(|&step| step > 0).collect();
            assert!(starts.is_subset(&plan.states[0].start_steps));
        }
    }
}
