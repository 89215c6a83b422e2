use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use crate::cli::Exit;
use crate::cli::measure::Shown;
use crate::cli::output::Output;
use crate::report::page;

#[derive(Debug, Args)]
pub struct Report {
    /// A run folder
    run: PathBuf,
    /// Exit with 1 if a claim fails
    #[arg(long)]
    strict: bool,
}

impl Report {
    pub fn run(self, output: Output) -> Result<Exit> {
        let written = page::write(&self.run)?;
        output.show(&Shown::of(&written), |out| {
            written.files.iter().try_for_each(|file| writeln!(out, "{}", self.run.join(file).display()))
        })?;
        Ok(if written.ok_trials == 0 {
            Exit::NothingMeasured
        } else if self.strict && written.has_failing_claim() {
            Exit::ClaimFails
        } else {
            Exit::Done
        })
    }
}
