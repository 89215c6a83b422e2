use std::io::Write;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use crate::cli::Exit;
use crate::experiment::cluster::task::{self, Ended};

#[derive(Debug, Args)]
pub struct Task {
    /// A run folder in which something was submitted
    run: PathBuf,
    /// The block's number [default: the first job's work]
    block: Option<usize>,
}

impl Task {
    pub fn run(self) -> Result<Exit> {
        let mut out = std::io::stdout().lock();
        let Some(number) = self.block else {
            task::first(&self.run)?;
            writeln!(out, "the run is open, and the states are there")?;
            return Ok(Exit::Done);
        };
        let (block, ended) = task::block(&self.run, number)?;
        let ended = match ended {
            Ended::Recorded => "is recorded",
            Ended::WasThere => "was there already",
            Ended::NotApplicable => "has no cell that can run here",
            Ended::Elsewhere => "is being run by another task",
        };
        writeln!(out, "block {number}, {block}, {ended}")?;
        Ok(Exit::Done)
    }
}
