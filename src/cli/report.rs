use std::io::Write;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use crate::cli::Exit;
use crate::report::page;

#[derive(Debug, Args)]
pub struct Report {
    /// A run folder
    run: PathBuf,
}

impl Report {
    pub fn run(self) -> Result<Exit> {
        let written = page::write(&self.run)?;
        let mut out = std::io::stdout().lock();
        for file in &written.files {
            writeln!(out, "{}", self.run.join(file).display())?;
        }
        Ok(if written.ok_trials == 0 { Exit::NothingMeasured } else { Exit::Done })
    }
}
