//! What `all` and `run` share: a plan is run in a folder and reported on.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use crate::cli::Exit;
use crate::cli::output::Output;
use crate::experiment::calibration::Calibration;
use crate::experiment::library;
use crate::experiment::machine::Machine;
use crate::experiment::plan::Plan;
use crate::experiment::run::{Existing, Run, default_folder};
use crate::experiment::selection::Selection;
use crate::experiment::spec::{Experiment, Mode};
use crate::report::claim::Judged;
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
    /// Run again, as a whole, the rounds of the run in the folder in which a trial failed
    #[arg(long, conflicts_with = "fresh")]
    retry_failed: bool,
    /// Measure only timed cells with these values of a setting, as in `threads=1,2`; may be given several times
    #[arg(long, value_name = "SETTING=VALUES")]
    filter: Vec<Selection>,
    /// A name for this machine in tables and folders [default: from the processor]
    #[arg(long)]
    alias: Option<String>,
    /// Exit with 1 if a claim fails
    #[arg(long)]
    strict: bool,
}

impl Measure {
    /// Runs `experiments` and reports on them; `verb` stands in the record as the command.
    pub fn run(&self, experiments: &[String], verb: &str, output: Output) -> Result<Exit> {
        self.run_loaded(load(experiments)?, verb, output)
    }

    /// The same for experiments that are in no file.
    pub fn run_loaded(&self, mut experiments: Vec<Experiment>, verb: &str, output: Output) -> Result<Exit> {
        let mode = self.mode.mode();
        for experiment in &mut experiments {
            experiment.filter = self.filter.clone();
        }
        let machine = Machine::observe(std::path::Path::new("/"), self.alias.as_deref());
        let plan = Plan::new(experiments, mode, Calibration::measure()?)?;
        let folder = self.output.clone().unwrap_or_else(|| default_folder(&machine));
        let existing = match (self.fresh, self.retry_failed) {
            (true, _) => Existing::Fresh,
            (_, true) => Existing::RetryFailed,
            _ => Existing::Resume,
        };
        let command = self.command(verb);
        let mut run = Run::open(&folder, &plan, &machine, &command, existing)?;
        eprintln!("{}: {command}, about {:.0} min", folder.display(), (plan.estimate_s() / 60.0).ceil());
        run.complete(&plan)?;
        let written = page::write(&folder)?;
        output.show(&Shown::of(&written), |out| {
            written.files.iter().try_for_each(|file| writeln!(out, "{}", folder.join(file).display()))
        })?;
        Ok(exit(&written, self.strict))
    }

    /// The command as a run records it: without paths, and without what changes no number.
    fn command(&self, verb: &str) -> String {
        let mut command = format!("repro {verb}");
        if self.mode.mode() != Mode::Default {
            command += &format!(" --{}", self.mode.mode().name());
        }
        for filter in &self.filter {
            command += &format!(" --filter {}", filter.in_words());
        }
        command
    }
}

/// How a verb ends that has reported on a run; with `strict`, a claim that fails counts.
pub fn exit(written: &page::Written, strict: bool) -> Exit {
    if written.ok_trials == 0 {
        Exit::NothingMeasured
    } else if written.failed_trials > 0 {
        Exit::Incomplete
    } else if strict && written.has_failing_claim() {
        Exit::ClaimFails
    } else {
        Exit::Done
    }
}

/// What a run came to, as JSON.
#[derive(Debug, Serialize)]
pub struct Shown<'a> {
    /// Below the run folder.
    files: &'a [String],
    ok_trials: usize,
    failed_trials: usize,
    claims: Vec<ShownClaim<'a>>,
}

#[derive(Debug, Serialize)]
struct ShownClaim<'a> {
    claim: &'a str,
    judged_by: &'a str,
    verdict: &'a str,
    reason: &'a str,
}

impl<'a> Shown<'a> {
    pub fn of(written: &'a page::Written) -> Shown<'a> {
        let claim = |judged: &'a Judged| ShownClaim {
            claim: &judged.claim.id,
            judged_by: &judged.judgement.name,
            verdict: judged.verdict.name(),
            reason: judged.verdict.reason(),
        };
        Shown {
            files: &written.files,
            ok_trials: written.ok_trials,
            failed_trials: written.failed_trials,
            claims: written.judged.iter().map(claim).collect(),
        }
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
