//! What a run still lacks, read from its folder alone.

use std::path::Path;

use anyhow::Result;

use crate::experiment::calibration::Calibration;
use crate::experiment::cluster::blocks::Block;
use crate::experiment::cluster::submission::{Submission, plan_of};
use crate::experiment::plan::Plan;
use crate::experiment::progress::progress;
use crate::experiment::record::RoundRecord;
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
        let blocks = missing(folder, submission)?;
        Ok(Outstanding { first: !is_ready(folder, blocks.is_empty())?, blocks })
    }

    pub fn is_nothing(&self) -> bool {
        !self.first && self.blocks.is_empty()
    }
}

/// Numbers of the blocks that are not recorded and, once the run has begun, that what is recorded leaves needed.
fn missing(folder: &Path, submission: &Submission) -> Result<Vec<usize>> {
    let blocks = submission.blocks();
    let is_there = |block: &Block| block.path(folder).is_file();
    let stages = if folder.join("run.json").is_file() {
        let recorded = blocks.iter().filter(|block| is_there(block));
        let records: Result<Vec<RoundRecord>> =
            recorded.map(|b| RoundRecord::read(&b.path(folder))).collect();
        Some(progress(&RunInfo::read(folder)?, &records?))
    } else {
        None
    };
    let needed = |block: &Block| stages.as_ref().is_none_or(|stages| block.is_needed(stages));
    let missing = blocks.iter().enumerate().filter(|(_, block)| !is_there(block) && needed(block));
    Ok(missing.map(|(number, _)| number).collect())
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
