//! What a run still lacks, read from its folder alone.

use std::path::Path;

use anyhow::Result;

use crate::experiment::calibration::Calibration;
use crate::experiment::cluster::blocks::Block;
use crate::experiment::cluster::submission::{Submission, plan_of};
use crate::experiment::plan::Plan;
use crate::experiment::record::Stage;
use crate::experiment::run::RunInfo;

/// The jobs that would complete a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outstanding {
    /// Whether the first job has to run, once more or for the first time.
    pub first: bool,
    /// Numbers of the blocks without a record.
    pub blocks: Vec<usize>,
    /// What the first job takes, estimated seconds.
    pub first_s: f64,
    /// What the longest block takes, estimated seconds.
    pub block_s: f64,
}

impl Outstanding {
    /// What is missing in `folder`. Until a node has begun the run, nodes are taken to have `processors`.
    pub fn find(folder: &Path, submission: &Submission, processors: Option<usize>) -> Result<Outstanding> {
        let begun = folder.join("run.json").is_file();
        let calibration = Calibration::measure()?;
        let plan = if begun {
            plan_of(&RunInfo::read(folder)?, calibration)?
        } else {
            submission.ahead(processors, calibration)?
        };
        let blocks = submission.blocks().into_iter().enumerate();
        let missing: Vec<usize> =
            blocks.filter(|(_, block)| !block.path(folder).is_file()).map(|(number, _)| number).collect();
        let savers = || plan.rounds.iter().filter(|round| round.saves_states());
        let recorded = savers().all(|round| Block::of(round, &plan).path(folder).is_file());
        let ready = begun && recorded && (missing.is_empty() || states_are_left(&plan, folder));
        let timed = plan.rounds.iter().filter(|round| round.stage != Stage::States);
        Ok(Outstanding {
            first: !ready,
            blocks: missing,
            first_s: savers().map(|round| round.estimate_s()).sum(),
            block_s: timed.map(|round| round.estimate_s()).fold(0.0, f64::max),
        })
    }

    pub fn is_nothing(&self) -> bool {
        !self.first && self.blocks.is_empty()
    }
}

/// Whether a run's first job has done its work: all states lie in the folder, and the rounds that left them are recorded.
pub fn states_are_left(plan: &Plan, folder: &Path) -> bool {
    let mut savers = plan.rounds.iter().filter(|round| round.saves_states());
    savers.all(|round| Block::of(round, plan).path(folder).is_file())
        && plan.states.iter().all(|states| states.are_in(folder))
}
