//! The rounds of a twin experiment.

use crate::base::input::{Check, InputError};
use crate::experiment::calibration::Calibration;
use crate::experiment::factors::Usable;
use crate::experiment::memory;
use crate::experiment::plan::{Group, PlannedExperiment, PlannedRound, PlannedTrial, Work};
use crate::experiment::record::{Stage, Window};
use crate::experiment::spec::{Experiment, Mode, scene_sets};
use crate::experiment::states::States;
use crate::experiment::twin::outcome::{Language, TwinCell};
use crate::experiment::twin::toolchain;
use crate::scene::{Scene, library};

/// What a pass over both layouts costs in steps of the paper's preset.
const STEPS_A_PASS: f64 = 0.4;
/// Seconds that a process needs to start, and for each particle that it reads.
const STARTING_S: f64 = 0.02;
const READING_S: f64 = 2e-6;

/// The name of the group that stands for the twin's state.
pub const GROUP: &str = "twin";

/// A trial of the twin.
#[derive(Debug, Clone)]
pub struct TwinWork {
    /// Index into [`PlannedExperiment::groups`]: whose scene and state it starts from.
    pub group: usize,
    pub cell: TwinCell,
    pub passes: usize,
    pub seed: u32,
}

/// A group without cells, whose only window is the twin's state: so the state is left like that of any other window.
pub fn group(
    spec: &Experiment,
    mode: Mode,
    usable: Usable,
    states: &mut Vec<States>,
) -> Result<Option<Group>, InputError> {
    let measurement = spec.measurement(mode);
    let Some(twin) = spec.twin.as_ref().filter(|_| measurement.twin.is_some()) else {
        return Ok(None);
    };
    let sets = scene_sets([&measurement.scene]);
    let scene: Scene = library::load(&spec.scene, &sets).map_err(|error| error.in_experiment(&spec.id))?;
    scene.require_memory(&spec.scene, 1, memory::available_bytes())?;
    let there = scene.steps();
    let allowed = format!("allowed are states of the scene's {there} steps");
    let inside = twin.after_step <= there;
    Check { file: &spec.id }.require(inside, "twin.after_step", twin.after_step, allowed)?;
    let windows = vec![Window { start_step: twin.after_step, warmup_steps: 0, steps: 0 }];
    Ok(Some(Group {
        name: GROUP.to_string(),
        states: States::needed(states, &scene, spec.fixed.cg_tolerance, &windows),
        particles: scene.particles(&spec.scene)?.len(),
        scene,
        sets,
        cells: Vec::new(),
        not_applicable: twin.thread_counts(usable).into_iter().filter(|&c| c > usable.threads).collect(),
        windows,
    }))
}

/// The rounds: every cell and thread count once, in a random order that is the same whenever it is planned.
pub fn rounds(
    experiment: &PlannedExperiment,
    index: usize,
    mode: Mode,
    usable: Usable,
    calibration: Calibration,
) -> Vec<PlannedRound> {
    let spec = &experiment.spec;
    let (Some(twin), Some(measurement)) = (&spec.twin, spec.measurement(mode).twin) else {
        return Vec::new();
    };
    let Some(group) = experiment.groups.iter().position(is_twin) else {
        return Vec::new();
    };
    let particles = experiment.groups[group].particles;
    let round = |round: usize| {
        let seed = spec.seed ^ ((Stage::Twin as u64) << 32) ^ round as u64;
        let mut random = fastrand::Rng::with_seed(seed);
        let mut trials = Vec::new();
        for cell in twin.cells() {
            for threads in twin.thread_counts(usable) {
                let runs = threads <= usable.threads
                    && (cell.language == Language::Rust || toolchain::is_there(&cell.compiler));
                let passes = measurement.passes;
                let estimate_s = if runs { trial_s(calibration, particles, threads, passes) } else { 0.0 };
                let seed = random.u32(1..=i32::MAX as u32);
                let work = TwinWork { group, cell: cell.clone(), passes, seed };
                trials.push(PlannedTrial { threads, estimate_s, work: Work::Twin(work) });
            }
        }
        random.shuffle(&mut trials);
        PlannedRound { experiment: index, stage: Stage::Twin, round, trials }
    };
    (0..measurement.rounds).map(round).collect()
}

/// Whether a group is there for the twin's state alone.
fn is_twin(group: &Group) -> bool {
    group.cells.is_empty() && !group.windows.is_empty()
}

/// Seconds of a trial; the first pass warms up.
fn trial_s(calibration: Calibration, particles: usize, threads: usize, passes: usize) -> f64 {
    let walking = STEPS_A_PASS * calibration.stepping_s(particles, threads, passes + 1);
    STARTING_S + READING_S * particles as f64 + walking
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::plan::Plan;

    const CALIBRATION: Calibration = Calibration { s_per_particle_step: 5e-6 };

    fn plan(mode: Mode) -> Plan {
        let experiments = vec![crate::experiment::library::load("twin").unwrap()];
        Plan::new(experiments, mode, CALIBRATION).unwrap()
    }

    #[test]
    fn a_round_holds_every_cell_once_in_an_order_of_its_own() {
        let plan = plan(Mode::Quick);
        let rounds: Vec<&PlannedRound> = plan.rounds.iter().filter(|r| r.stage == Stage::Twin).collect();
        let labels = |round: &PlannedRound| -> Vec<String> {
            let label = |trial: &PlannedTrial| match &trial.work {
                Work::Twin(work) => format!("{}/{}", work.cell.label(), trial.threads),
                _ => panic!("a twin round holds twin trials alone"),
            };
            round.trials.iter().map(label).collect()
        };
        let twin = plan.experiments[0].spec.twin.as_ref().unwrap();
        let counts = twin.thread_counts(plan.usable).len();
        assert_eq!(rounds[0].trials.len(), twin.cells().len() * counts);
        let (mut first, mut second) = (labels(rounds[0]), labels(rounds[1]));
        assert_ne!(first, second, "each round is shuffled anew");
        first.sort();
        second.sort();
        assert_eq!(first, second);
        assert!(first.windows(2).all(|pair| pair[0] != pair[1]));
    }

    /// The state comes from a run of its own where no other experiment leaves it.
    #[test]
    fn one_run_leaves_the_twins_state() {
        let plan = plan(Mode::Default);
        let savers: Vec<&PlannedTrial> =
            plan.rounds.iter().flat_map(|round| &round.trials).filter(|t| t.saves_states()).collect();
        assert_eq!((savers.len(), plan.rounds[0].stage), (1, Stage::States));
        let after = plan.experiments[0].spec.twin.as_ref().unwrap().after_step;
        assert!(plan.states[0].start_steps.contains(&after));
    }

    #[test]
    fn a_state_beyond_the_scenes_end_is_refused() {
        let mut experiment = crate::experiment::library::load("twin").unwrap();
        experiment.twin.as_mut().unwrap().after_step = 100_000;
        let error = Plan::new(vec![experiment], Mode::Quick, CALIBRATION).unwrap_err().to_string();
        assert!(error.contains("twin.after_step") && error.contains("667"), "{error}");
    }
}
