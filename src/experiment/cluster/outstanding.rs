//! What a run still lacks, read from its folder alone.

use std::path::Path;

use anyhow::Result;

use crate::experiment::calibration::Calibration;
use crate::experiment::cluster::blocks::Block;
use crate::experiment::cluster::submission::{Submission, plan_of};
use crate::experiment::plan::Plan;
use crate::experiment::run::RunInfo;

/// The jobs that would complete a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outstanding {
    /// Whether the first job has to run, once more or for the first time.
    pub first: bool,
    /// Numbers of the blocks without a record.
    pub blocks: Vec<usize>,
}

impl Outstanding {
    pub fn find(folder: &Path, submission: &Submission) -> Result<Outstanding> {
        let blocks = submission.blocks().into_iter().enumerate();
        let missing = blocks.filter(|(_, block)| !block.path(folder).is_file());
        let blocks: Vec<usize> = missing.map(|(number, _)| number).collect();
        Ok(Outstanding { first: !is_ready(folder, blocks.is_empty())?, blocks })
    }

    pub fn is_nothing(&self) -> bool {
        !self.first && self.blocks.is_empty()
    }
}

/// Whether the first job has done its work. Without missing blocks, nobody needs the states that it left.
fn is_ready(folder: &Path, complete: bool) -> Result<bool> {
    if !folder.join("run.json").is_file() {
        return Ok(false);
    }
    let plan = plan_of(&RunInfo::read(folder)?, Calibration::TIMELESS)?;
    Ok(if complete { states_are_recorded(&plan, folder) } else { states_are_left(&plan, folder) })
}

/// Whether all states lie in the folder, and the rounds that left them are recorded.
pub fn states_are_left(plan: &Plan, folder: &Path) -> bool {
    states_are_recorded(plan, folder) && plan.states.iter().all(|states| states.are_in(folder))
}

fn states_are_recorded(plan: &Plan, folder: &Path) -> bool {
    let mut savers = plan.rounds.iter().filter(|round| round.saves_states());
    savers.all(|round| Block::of(round, plan).path(folder).is_file())
}
