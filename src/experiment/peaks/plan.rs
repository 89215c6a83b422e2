//! The one round that measures peaks: a process for one thread, and one for all.

use crate::experiment::factors::Usable;
use crate::experiment::peaks::PeaksRequest;
use crate::experiment::plan::{PlannedExperiment, PlannedRound, PlannedTrial, Work};
use crate::experiment::record::Stage;
use crate::experiment::spec::Mode;

/// What the records call it.
pub const SUBJECT: &str = "machine";

/// One thread, and as many as may be used.
pub fn thread_counts(usable: Usable) -> Vec<usize> {
    let mut counts = vec![1, usable.threads];
    counts.dedup();
    counts
}

pub fn round(
    experiment: &PlannedExperiment,
    index: usize,
    mode: Mode,
    usable: Usable,
) -> Option<PlannedRound> {
    let measurement = experiment.spec.measurement(mode).peaks?;
    let trial = |threads: usize| PlannedTrial {
        threads,
        estimate_s: measurement.estimate_s(),
        work: Work::Peaks(PeaksRequest { threads, pin: experiment.spec.pin.clone(), measurement }),
    };
    let trials = thread_counts(usable).into_iter().map(trial).collect();
    Some(PlannedRound { experiment: index, stage: Stage::Peaks, round: 0, trials })
}
