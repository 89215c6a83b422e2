//! Time limits of jobs that follow from an estimate.

use std::path::Path;

use anyhow::Result;

use crate::experiment::calibration::Calibration;
use crate::experiment::cluster::submission::{Submission, plan_of};
use crate::experiment::plan::{Plan, PlannedRound};
use crate::experiment::record::Stage;
use crate::experiment::run::RunInfo;

/// A job may take this many times its estimate, since nodes may be slower than the machine that made it ...
const FACTOR: f64 = 3.0;
/// ... and so many minutes more, to start.
const SPARE_MINUTES: f64 = 5.0;

/// What the first job and the longest block take, estimated with this machine's speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    pub first_s: f64,
    pub block_s: f64,
}

impl Estimate {
    /// Until a node has begun the run, nodes are taken to have so many `processors` or, where nobody says, as many as any
    /// cell wants.
    pub fn of(folder: &Path, submission: &Submission, processors: Option<usize>) -> Result<Estimate> {
        let calibration = Calibration::measure()?;
        let plan: Plan = if folder.join("run.json").is_file() {
            plan_of(&RunInfo::read(folder)?, calibration)?
        } else {
            submission.ahead(processors, calibration)?
        };
        let savers = plan.rounds.iter().filter(|round| round.saves_states());
        let blocks = plan.rounds.iter().filter(|round| round.stage != Stage::States);
        Ok(Estimate {
            first_s: savers.map(PlannedRound::estimate_s).sum(),
            block_s: blocks.map(PlannedRound::estimate_s).fold(0.0, f64::max),
        })
    }
}

/// A job's time limit as Slurm takes it, whole minutes.
pub fn time_limit(estimate_s: f64) -> String {
    format!("{:.0}", (FACTOR * estimate_s / 60.0 + SPARE_MINUTES).ceil())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_is_generous_and_in_whole_minutes() {
        assert_eq!(time_limit(0.0), "5");
        assert_eq!(time_limit(61.0), "9");
        assert_eq!(time_limit(7200.0), "365");
    }
}
