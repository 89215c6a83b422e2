//! What `all` and `run` share: a plan is run in a folder and reported on.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;

use crate::cli::Exit;
use crate::experiment::calibration::Calibration;
use crate::experiment::library;
use crate::experiment::machine::Machine;
use crate::experiment::plan::Plan;
use crate::experiment::run::{Existing, Run, default_folder};
use crate::experiment::spec::{Experiment, Mode};
use crate::report::claim::Verdict;
use crate::report::page;

#[derive(Debug, Args)]
pub struct ModeFlags {
    /// Minutes, on a coarser scene; stamped "not for citation"
    #[arg(long, conflicts_with = "full")]
    quick: bool,
    /// Hours: whole runs in interleaved rounds
    #[arg(long)]
    full: bool,
}

impl ModeFlags {
    pub fn mode(&self) -> Mode {
        match (self.quick, self.full) {
            (true, _) => Mode::Quick,
            (_, true) => Mode::Full,
            _ => Mode::Default,
        }
    }
}

#[derive(Debug, Args)]
pub struct Measure {
    #[command(flatten)]
    mode: ModeFlags,
    /// The run folder [default: results/<UTC time>-<machine>]. An unfinished run in it goes on
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Remove the run in the folder and start anew
    #[arg(long)]
    fresh: bool,
    /// A name for this machine in tables and folders [default: from the processor]
    #[arg(long)]
    alias: Option<String>,
    /// Exit with 1 if a claim fails
    #[arg(long)]
    strict: bool,
}

impl Measure {
    /// Runs `experiments` and reports on them; `verb` stands in the record as the command.
    pub fn run(&self, experiments: &[String], verb: &str) -> Result<Exit> {
        let mode = self.mode.mode();
        let experiments: Vec<Experiment> = load(experiments)?;
        let machine = Machine::observe(std::path::Path::new("/"), self.alias.as_deref());
        let plan = Plan::new(experiments, mode, Calibration::measure()?)?;
        let folder = self.output.clone().unwrap_or_else(|| default_folder(&machine));
        let existing = if self.fresh { Existing::Fresh } else { Existing::Resume };
        let command = match mode {
            Mode::Default => format!("repro {verb}"),
            other => format!("repro {verb} --{}", other.name()),
        };
        let mut run = Run::open(&folder, &plan, &machine, &command, existing)?;
        eprintln!("{}: {command}, about {:.0} min", folder.display(), (plan.estimate_s() / 60.0).ceil());
        run.complete(&plan)?;
        let written = page::write(&folder)?;
        let mut out = std::io::stdout().lock();
        for file in &written.files {
            writeln!(out, "{}", folder.join(file).display()).context("cannot print")?;
        }
        Ok(exit(&written, self.strict))
    }
}

/// How a verb ends that has reported on a run; with `strict`, a claim that fails counts.
pub fn exit(written: &page::Written, strict: bool) -> Exit {
    if written.ok_trials == 0 {
        Exit::NothingMeasured
    } else if written.failed_trials > 0 {
        Exit::Incomplete
    } else if strict && written.judged.iter().any(|j| j.verdict == Verdict::Fails) {
        Exit::ClaimFails
    } else {
        Exit::Done
    }
}

/// The named experiments.
pub fn load(names: &[String]) -> Result<Vec<Experiment>> {
    Ok(names.iter().map(|name| library::load(name)).collect::<Result<Vec<_>, _>>()?)
}

/// The names of all embedded experiments.
pub fn every_experiment() -> Vec<String> {
    library::names().map(String::from).collect()
}
