//! From experiments to rounds of trials: which cells and runs, in which order, and how long it will take.

use std::path::Path;

use anyhow::Result;

use crate::base::input::{Check, InputError};
use crate::engine::particles::InitialParticle;
use crate::experiment::calibration::Calibration;
use crate::experiment::factors::{Factors, Usable};
use crate::experiment::machine::{Topology, allowed_cpus};
use crate::experiment::memory;
use crate::experiment::observed::ObservedRun;
use crate::experiment::peaks::PeaksRequest;
use crate::experiment::record::{Stage, Variant, Window};
use crate::experiment::rounds::RoundPlanner;
use crate::experiment::selection::CellSettings;
use crate::experiment::spec::{Experiment, Mode, Paired, Windows, scene_sets};
use crate::experiment::states::States;
use crate::experiment::twin::{self, plan::TwinWork};
use crate::experiment::validation::ValidationRequest;
use crate::scene::{Scene, library};

/// Everything a run will do, in order.
#[derive(Debug, Clone)]
pub struct Plan {
    pub mode: Mode,
    pub experiments: Vec<PlannedExperiment>,
    /// States that windows start from, each left by one run for all experiments that need it.
    pub states: Vec<States>,
    pub rounds: Vec<PlannedRound>,
    /// What this machine offers to threads.
    pub usable: Usable,
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
    /// The variants to measure on each number of threads that this machine has the hardware threads for.
    pub cells: Vec<(usize, Vec<Variant>)>,
    /// Numbers of threads that it has not.
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
    Twin(TwinWork),
    Validation(ValidationRequest),
    Peaks(PeaksRequest),
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

impl Plan {
    /// Plans `experiments` for this machine.
    pub fn new(experiments: Vec<Experiment>, mode: Mode, calibration: Calibration) -> Result<Plan> {
        let topology = Topology::read(Path::new("/"), &allowed_cpus());
        Plan::on(Usable::of(&topology), experiments, mode, calibration)
    }

    /// Plans them for any machine.
    pub fn on(
        usable: Usable,
        experiments: Vec<Experiment>,
        mode: Mode,
        calibration: Calibration,
    ) -> Result<Plan> {
        let mut states = Vec::new();
        let experiments = experiments
            .into_iter()
            .map(|spec| PlannedExperiment::new(spec, mode, usable, &mut states))
            .collect::<Result<Vec<_>, InputError>>()?;
        let mut rounds = Vec::new();
        let mut left = vec![false; states.len()];
        for (index, experiment) in experiments.iter().enumerate() {
            let planner = RoundPlanner { experiment, index, calibration, states: &states };
            rounds.extend(planner.rounds(mode, usable, &mut left));
        }
        Ok(Plan { mode, experiments, states, rounds, usable })
    }

    /// Seconds that all rounds will take.
    pub fn estimate_s(&self) -> f64 {
        self.rounds.iter().map(PlannedRound::estimate_s).fold(0.0, |sum, next| sum + next)
    }
}

impl PlannedTrial {
    /// The ways to compute, or the one run to observe.
    pub fn cells(&self) -> usize {
        match &self.work {
            Work::Timed(timed) => timed.variants.len(),
            Work::Observed(_) | Work::Twin(_) | Work::Validation(_) | Work::Peaks(_) => 1,
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

    pub fn saves_states(&self) -> bool {
        self.trials.iter().any(PlannedTrial::saves_states)
    }
}

impl PlannedExperiment {
    fn new(
        spec: Experiment,
        mode: Mode,
        usable: Usable,
        states: &mut Vec<States>,
    ) -> Result<Self, InputError> {
        let mut groups = spec
            .groups(mode)
            .map(|factors| Group::new(&spec, factors, mode, usable, states))
            .collect::<Result<Vec<_>, _>>()?;
        groups.extend(twin::plan::group(&spec, mode, usable, states)?);
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
        usable: Usable,
        states: &mut Vec<States>,
    ) -> Result<Self, InputError> {
        let measurement = spec.measurement(mode);
        let sets = scene_sets([&measurement.scene, &factors.scene]);
        let load =
            |sets: &[String]| library::load(&spec.scene, sets).map_err(|error| error.in_experiment(&spec.id));
        let scene = load(&sets)?;
        let (variants, initial) = (spec.variants(factors), scene.particles(&spec.scene)?);
        for variant in variants.iter().filter(|variant| !variant.scene_changes.is_empty()) {
            let changed = load(&[&sets[..], &variant.scene_changes].concat())?;
            // What fluid carries is in no state that is kept: it starts anew in each variant.
            let kept = |p: &InitialParticle| (p.kind, p.position, p.velocity, p.pressure, p.group);
            let same = changed.particles(&spec.scene)?.iter().map(kept).eq(initial.iter().map(kept))
                && changed.parameters(&initial).domain == scene.parameters(&initial).domain;
            let allowed =
                "variants of a group start from the same states: it may change effects and time step alone";
            Check { file: &spec.id }.require(same, "scheme", format!("`{}`", variant.scheme), allowed)?;
        }
        let available = memory::available_bytes();
        // States on their way to the variants take far less than a simulation does, which the estimate is generous about.
        scene.require_memory_of(&spec.scene, initial.len() as f64, variants.len(), available)?;
        let (applicable, not_applicable): (Vec<usize>, Vec<usize>) =
            factors.thread_counts(usable).into_iter().partition(|&count| count <= usable.threads);
        let measured = |threads: usize| {
            let wanted = |variant: &&Variant| {
                spec.left_out(CellSettings { group: &factors.name, threads, variant }).is_none()
            };
            (threads, variants.iter().filter(wanted).cloned().collect::<Vec<_>>())
        };
        let cells = applicable.into_iter().map(measured).filter(|(_, variants)| !variants.is_empty());
        let cells: Vec<(usize, Vec<Variant>)> = cells.collect();
        let windows = match &measurement.paired {
            Some(paired) if !cells.is_empty() => windows_of(paired, &scene, &spec.id, mode)?,
            _ => Vec::new(),
        };
        Ok(Group {
            name: factors.name.clone(),
            states: States::needed(states, &scene, spec.fixed.cg_tolerance, &windows),
            scene,
            sets,
            particles: initial.len(),
            cells,
            not_applicable,
            windows,
        })
    }
}

impl PlannedRun {
    fn new(run: ObservedRun) -> Result<Self, InputError> {
        let sets = [&run.sets[..], &run.variant.scene_changes].concat();
        let scene = library::load(&run.scene, &sets).map_err(|error| error.in_experiment(&run.id))?;
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::experiment::stopping::Rounds;

    const CALIBRATION: Calibration = Calibration { s_per_particle_step: 1e-6 };

    #[test]
    fn windows_lie_in_the_middle_of_equal_parts() {
        let paired = Paired {
            rounds: Rounds::Fixed(1),
            windows: Windows::Spread(8),
            warmup_steps: 1,
            steps: 6,
            control: false,
        };
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
