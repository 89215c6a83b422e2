//! How far a run is: which rounds are there, which are missing, and what failed.

use serde::Serialize;

use crate::experiment::fit::planned_cells;
use crate::experiment::record::{RoundRecord, Stage};
use crate::experiment::run::RunInfo;

/// How far one stage of an experiment is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StageProgress {
    pub experiment: String,
    pub stage: Stage,
    /// Rounds on disk.
    pub recorded: usize,
    /// The most rounds it may take; fewer where its intervals are narrow enough before.
    pub most: usize,
    /// Whether it needs no more of them.
    pub complete: bool,
    /// Rounds that are missing, from 0; where their number is not fixed, only the next one is known to be.
    pub missing: Vec<usize>,
    /// Trials that ended without an answer.
    pub failed_trials: usize,
}

/// The progress of every stage that has rounds, from what a run folder holds.
pub fn progress(info: &RunInfo, rounds: &[RoundRecord]) -> Vec<StageProgress> {
    let mut stages = Vec::new();
    for experiment in &info.experiments {
        for stage in Stage::ALL {
            let cells = planned_cells(experiment, info.mode, info.usable(), stage, 0);
            let Some(planned) = experiment.rounds(info.mode, stage).filter(|_| !cells.is_empty()) else {
                continue;
            };
            let mut recorded: Vec<RoundRecord> = rounds
                .iter()
                .filter(|r| r.experiment == experiment.id && r.stage == stage)
                .cloned()
                .collect();
            recorded.sort_by_key(|round| round.round);
            let there = |number: usize| recorded.iter().any(|round| round.round == number);
            let first_gap = (0..planned.most()).find(|&number| !there(number)).unwrap_or(planned.most());
            let unbroken = &recorded[..first_gap.min(recorded.len())];
            // A stage ends at the first round that is enough; rounds beyond it, as nodes of a cluster leave, add to it.
            let complete =
                (planned.least()..=unbroken.len()).any(|count| planned.are_enough(&unbroken[..count]));
            let missing = match complete {
                true => Vec::new(),
                false if planned.least() == planned.most() => {
                    (0..planned.most()).filter(|&number| !there(number)).collect()
                }
                false => vec![first_gap],
            };
            let trials = recorded.iter().flat_map(|round| &round.trials);
            stages.push(StageProgress {
                experiment: experiment.id.clone(),
                stage,
                most: planned.most(),
                complete,
                missing,
                failed_trials: trials.filter(|trial| trial.status.is_failure()).count(),
                recorded: recorded.len(),
            });
        }
    }
    stages
}
