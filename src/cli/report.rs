use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;

use crate::base::files::write_whole;
use crate::cli::Exit;
use crate::cli::measure::Shown;
use crate::cli::output::Output;
use crate::report::measured::Measured;
use crate::report::{page, write_up};

#[derive(Debug, Args)]
pub struct Report {
    /// A run folder
    run: PathBuf,
    /// Exit with 1 if a claim fails
    #[arg(long)]
    strict: bool,
    /// Also write the reproduction's short write-up, such as paper/reproduction.md
    #[arg(long, value_name = "FILE")]
    write_up: Option<PathBuf>,
}

impl Report {
    pub fn run(self, output: Output) -> Result<Exit> {
        let written = page::write(&self.run)?;
        if let Some(file) = &self.write_up {
            let text = write_up::text(&Measured::read(&self.run)?)?;
            write_whole(file, text.as_bytes()).with_context(|| format!("cannot write {}", file.display()))?;
        }
        output.show(&Shown::of(&written), |out| {
            let files = written.files.iter().map(|file| self.run.join(file));
            files.chain(self.write_up.clone()).try_for_each(|file| writeln!(out, "{}", file.display()))
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
