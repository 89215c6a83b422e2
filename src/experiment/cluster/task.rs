//! What the jobs of a run do on their nodes.

use std::fs::{self, File, TryLockError};
use std::path::Path;

use anyhow::{Context, Result, ensure};

use crate::experiment::cluster::blocks::Block;
use crate::experiment::cluster::outstanding::states_are_left;
use crate::experiment::cluster::submission::Submission;
use crate::experiment::execute::execute_only;
use crate::experiment::plan::PlannedRound;
use crate::experiment::run::{Existing, Run, RunInfo};

/// How a task ended that did not fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// It ran its block.
    Recorded,
    /// The block was there already.
    WasThere,
    /// Another task is running the block.
    Elsewhere,
    /// No cell of the block can run on machines of the run's kind.
    NotApplicable,
}

/// The first job: opens the run for machines of this node's kind, and runs the rounds that leave states.
pub fn first(folder: &Path) -> Result<()> {
    let submission = Submission::read(folder)?;
    let (machine, plan) = submission.here()?;
    if folder.join("run.json").is_file() {
        RunInfo::read(folder)?.require_same_plan(folder, &plan, &machine)?;
    }
    let run = Run::open(folder, &plan, &machine, &submission.command, Existing::Reopen)?;
    execute_only(&plan, &run.folder, PlannedRound::saves_states)
}

/// A task of an array: runs the block of that number, whole, unless it is recorded.
pub fn block(folder: &Path, number: usize) -> Result<(Block, Ended)> {
    let submission = Submission::read(folder)?;
    let mut blocks = submission.blocks();
    let count = blocks.len();
    ensure!(number < count, "{}: there is no block {number}, only {count} from 0 on", folder.display());
    let block = blocks.swap_remove(number);
    let run = Run::share(folder)?;
    let Some(_claim) = claim(folder, &block)? else {
        return Ok((block, Ended::Elsewhere));
    };
    if block.path(folder).is_file() {
        return Ok((block, Ended::WasThere));
    }
    let (machine, plan) = submission.here()?;
    run.info.require_same_plan(folder, &plan, &machine)?;
    if !plan.rounds.iter().any(|round| Block::of(round, &plan) == block) {
        return Ok((block, Ended::NotApplicable));
    }
    let left = states_are_left(&plan, folder);
    ensure!(left, "{}: the states that blocks start from are not there; submit again", folder.display());
    // The rounds that left states are only read: their digests are what the block must meet.
    execute_only(&plan, folder, |round| round.saves_states() || Block::of(round, &plan) == block)?;
    Ok((block, Ended::Recorded))
}

/// A lock on one block, which a process that dies gives back; `None` where another process holds it.
fn claim(folder: &Path, block: &Block) -> Result<Option<File>> {
    let locks = folder.join("slurm").join("locks");
    let path = locks.join(format!("{}-{}-{:03}.lock", block.experiment, block.stage.name(), block.round));
    let failed = || format!("cannot lock {}", path.display());
    fs::create_dir_all(&locks).with_context(failed)?;
    let lock = File::create(&path).with_context(failed)?;
    match lock.try_lock() {
        Ok(()) => Ok(Some(lock)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(error)) => Err(error).with_context(failed),
    }
}
