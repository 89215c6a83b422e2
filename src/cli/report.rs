use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;

use crate::base::files::write_whole;
use crate::cli::Exit;
use crate::report::measured::Measured;
use crate::report::{page, write_up};

#[derive(Debug, Args)]
pub struct Report {
    /// A run folder
    run: PathBuf,
    /// Also write the reproduction's short write-up, such as paper/reproduction.md
    #[arg(long, value_name = "FILE")]
    write_up: Option<PathBuf>,
}

impl Report {
    pub fn run(self) -> Result<Exit> {
        let written = page::write(&self.run)?;
        let mut out = std::io::stdout().lock();
        for file in &written.files {
            writeln!(out, "{}", self.run.join(file).display())?;
        }
        if let Some(file) = &self.write_up {
            let text = write_up::text(&Measured::read(&self.run)?)?;
            write_whole(file, text.as_bytes()).with_context(|| format!("cannot write {}", file.display()))?;
            writeln!(out, "{}", file.display())?;
        }
        Ok(if written.ok_trials == 0 { Exit::NothingMeasured } else { Exit::Done })
    }
}
