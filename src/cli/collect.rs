use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use crate::cli::Exit;
use crate::cli::measure::{Shown, exit};
use crate::cli::output::Output;
use crate::experiment::cluster::blocks::in_words;
use crate::experiment::cluster::gather::gather;
use crate::experiment::cluster::job::quoted;
use crate::experiment::cluster::submission::Submission;
use crate::report::page::{self, Written};

#[derive(Debug, Args)]
pub struct Collect {
    /// The run folder that was submitted
    run: PathBuf,
    /// Exit with 1 if a claim fails
    #[arg(long)]
    strict: bool,
}

/// What is there of a run, and what is missing.
#[derive(Debug, Serialize)]
struct Gathering<'a> {
    /// `None` before the first job has begun.
    report: Option<Shown<'a>>,
    recorded: usize,
    missing: usize,
    /// By experiment and stage.
    missing_rounds: Vec<String>,
}

impl Collect {
    pub fn run(self, output: Output) -> Result<Exit> {
        Submission::read(&self.run)?;
        if !self.run.join("run.json").is_file() {
            let nothing = Gathering { report: None, recorded: 0, missing: 0, missing_rounds: Vec::new() };
            output
                .show(&nothing, |out| writeln!(out, "nothing is there yet: the first job has not begun"))?;
            return Ok(Exit::NothingMeasured);
        }
        let gathered = gather(&self.run)?;
        let written = page::write(&self.run)?;
        let gathering = Gathering {
            report: Some(Shown::of(&written)),
            recorded: gathered.recorded,
            missing: gathered.missing.len(),
            missing_rounds: in_words(&gathered.missing),
        };
        output.show(&gathering, |out| self.print(out, &written, &gathering))?;
        Ok(if gathering.missing == 0 {
            exit(&written, self.strict)
        } else if written.ok_trials == 0 {
            Exit::NothingMeasured
        } else {
            Exit::Incomplete
        })
    }

    fn print(&self, out: &mut dyn Write, written: &Written, gathering: &Gathering<'_>) -> io::Result<()> {
        for file in &written.files {
            writeln!(out, "{}", self.run.join(file).display())?;
        }
        let (recorded, missing) = (gathering.recorded, gathering.missing);
        if missing == 0 {
            return writeln!(out, "complete: all {recorded} rounds are there");
        }
        writeln!(out, "missing are {missing} of {} rounds (experiment, stage, rounds):", missing + recorded)?;
        gathering.missing_rounds.iter().try_for_each(|block| writeln!(out, "  {block}"))?;
        let folder = quoted(&self.run.to_string_lossy());
        writeln!(out, "`repro submit --slurm --now --output {folder}` sends only what is missing")
    }
}
