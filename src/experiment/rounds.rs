//! The rounds of an experiment: which trials, in which random order.

use crate::engine::preset::Preset;
use crate::experiment::calibration::Calibration;
use crate::experiment::factors::Usable;
use crate::experiment::plan::{PlannedExperiment, PlannedRound, PlannedRun, PlannedTrial, TimedWork, Work};
use crate::experiment::record::{Stage, Variant, Window};
use crate::experiment::spec::{Mode, Paired, Whole};
use crate::experiment::states::States;
use crate::experiment::{peaks, twin, validation};

/// Makes the rounds of one experiment.
pub struct RoundPlanner<'a> {
    pub experiment: &'a PlannedExperiment,
    /// Its place in the plan.
    pub index: usize,
    pub calibration: Calibration,
    pub states: &'a [States],
}

impl RoundPlanner<'_> {
    /// The rounds of every stage. The first whole run of a scene leaves the states from which windows start; where there
    /// is none, a run of its own does. `left` says whose states lie there already.
    pub fn rounds(&self, mode: Mode, usable: Usable, left: &mut [bool]) -> Vec<PlannedRound> {
        let measurement = self.experiment.spec.measurement(mode);
        let mut rounds = Vec::new();
        if let Some(whole) = &measurement.whole {
            rounds.extend((0..whole.rounds.most()).map(|round| self.whole(whole, round)));
        }
        for (k, group) in self.experiment.groups.iter().enumerate() {
            if group.windows.is_empty() || std::mem::replace(&mut left[group.states], true) {
                continue;
            }
            let answer = self.states[group.states].variant();
            let can_save = |trial: &&mut PlannedTrial| match &trial.work {
                Work::Timed(timed) => timed.group == k && timed.variants[0].has_answer_of(&answer),
                Work::Observed(_) | Work::Twin(_) | Work::Validation(_) | Work::Peaks(_) => false,
            };
            let first = rounds.first_mut().and_then(|round| round.trials.iter_mut().find(can_save));
            match first.map(|trial| &mut trial.work) {
                Some(Work::Timed(timed)) => timed.saves_states = true,
                _ => rounds.push(self.states(k, usable.threads)),
            }
        }
        if let Some(paired) = &measurement.paired {
            rounds.extend((0..paired.rounds.most()).map(|round| self.paired(paired, round)));
        }
        if let Some(observed) = &measurement.observed {
            rounds.extend((0..observed.rounds).map(|round| self.observed(round, usable.threads)));
        }
        rounds.extend(validation::round(self.experiment, self.index, mode));
        rounds.extend(twin::plan::rounds(self.experiment, self.index, mode, usable, self.calibration));
        rounds.extend(peaks::round(self.experiment, self.index, mode, usable));
        rounds.retain(|round| !round.trials.is_empty());
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
            for (threads, variants) in &group.cells {
                for variant in variants.iter().filter(wanted) {
                    let work = TimedWork {
                        group: k,
                        variants: vec![variant.clone()],
                        windows: steps_up_to(group.scene.steps()),
                        seed: random.u64(..),
                        saves_states: false,
                    };
                    trials.push(self.timed(*threads, work));
                }
            }
        }
        random.shuffle(&mut trials);
        self.round(Stage::Whole, round, trials)
    }

    /// One trial a group and thread count, with all variants in lock step.
    fn paired(&self, paired: &Paired, round: usize) -> PlannedRound {
        let mut random = self.random(Stage::Paired, round);
        let mut trials = Vec::new();
        for (k, group) in self.experiment.groups.iter().enumerate() {
            for (threads, variants) in &group.cells {
                let work = TimedWork {
                    group: k,
                    variants: paired.with_control(variants.clone()),
                    windows: group.windows.clone(),
                    seed: random.u64(..),
                    saves_states: false,
                };
                trials.push(self.timed(*threads, work));
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
