use std::io::Write;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;

use crate::cli::Exit;
use crate::cli::measure::exit;
use crate::experiment::cluster::blocks::in_words;
use crate::experiment::cluster::gather::gather;
use crate::experiment::cluster::job::quoted;
use crate::experiment::cluster::submission::Submission;
use crate::report::page;

#[derive(Debug, Args)]
pub struct Collect {
    /// The run folder that was submitted
    run: PathBuf,
    /// Exit with 1 if a claim fails
    #[arg(long)]
    strict: bool,
}

impl Collect {
    pub fn run(self) -> Result<Exit> {
        Submission::read(&self.run)?;
        let mut out = std::io::stdout().lock();
        if !self.run.join("run.json").is_file() {
            writeln!(out, "nothing is there yet: the first job has not begun")?;
            return Ok(Exit::NothingMeasured);
        }
        let gathered = gather(&self.run)?;
        let written = page::write(&self.run)?;
        for file in &written.files {
            writeln!(out, "{}", self.run.join(file).display())?;
        }
        if gathered.missing.is_empty() {
            writeln!(out, "complete: all {} rounds are there", gathered.recorded)?;
            return Ok(exit(&written, self.strict));
        }
        let (missing, all) = (gathered.missing.len(), gathered.missing.len() + gathered.recorded);
        writeln!(out, "missing are {missing} of {all} rounds (experiment, stage, rounds):")?;
        for words in in_words(&gathered.missing) {
            writeln!(out, "  {words}")?;
        }
        let folder = quoted(&self.run.to_string_lossy());
        writeln!(out, "`repro submit --slurm --now --output {folder}` sends only what is missing")?;
        Ok(if written.ok_trials == 0 { Exit::NothingMeasured } else { Exit::Incomplete })
    }
}
