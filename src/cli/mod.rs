//! The command line: one verb a file. Only here is anything printed.

mod all;
mod compare;
mod engine_options;
mod export;
mod list;
mod machine;
mod measure;
mod plan;
mod report;
mod run;
mod simulate;
mod trial;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::base::input::InputError;
use crate::base::parallel::ThreadsUnavailable;
use crate::engine::search::grid::TooManyBuckets;
use crate::experiment::interrupt::Interrupted;

/// Reruns, measures and judges a published speed-up of the neighbour search in the MPS particle method.
#[derive(Debug, Parser)]
#[command(version, about, after_help = EXIT_CODES)]
pub struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

const EXIT_CODES: &str = "\
Exit codes: 0 done; 1 a claim fails (only with --strict); 2 the command or a file cannot be used; 3 incomplete: a trial \
failed, a simulation broke down or something could not be written; 5 nothing was measured; 6 no cell of the runs can be \
compared; 130 interrupted.";

#[derive(Debug, Subcommand)]
enum Verb {
    /// Reruns the paper: all experiments, tables, figures, claims and the report.
    All(all::All),
    /// Runs one experiment and reports on it.
    Run(run::Run),
    /// Lists experiments, scenes and presets.
    List(list::List),
    /// Shows what a run would do and how long it would take, without running it.
    Plan(plan::PlanVerb),
    /// Shows what this machine is, as a run records it.
    Machine(machine::MachineVerb),
    /// Renders a run folder's tables, figures, claims and report anew from its records.
    Report(report::Report),
    /// Compares run folders, from any machines: ratios within each, times beside them, what differs.
    Compare(compare::Compare),
    /// Writes a run's tables for spreadsheets, statistics programs and notebooks.
    Export(export::Export),
    /// Simulates one scene.
    Simulate(Box<simulate::Simulate>),
    /// Runs one trial, described on standard input: how this program starts itself.
    #[command(hide = true)]
    Trial(trial::Trial),
}

/// How the program ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    Done = 0,
    ClaimFails = 1,
    Usage = 2,
    Incomplete = 3,
    NothingMeasured = 5,
    Incomparable = 6,
    Interrupted = 130,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> ExitCode {
        ExitCode::from(exit as u8)
    }
}

impl Cli {
    pub fn run(self) -> Result<Exit> {
        match self.verb {
            Verb::All(verb) => verb.run(),
            Verb::Run(verb) => verb.run(),
            Verb::List(verb) => verb.run(),
            Verb::Plan(verb) => verb.run(),
            Verb::Machine(verb) => verb.run(),
            Verb::Report(verb) => verb.run(),
            Verb::Compare(verb) => verb.run(),
            Verb::Export(verb) => verb.run(),
            Verb::Simulate(verb) => verb.run(),
            Verb::Trial(verb) => verb.run(),
        }
    }
}

/// The exit code that an error asks for.
pub fn exit_code(error: &anyhow::Error) -> Exit {
    if error.is::<Interrupted>() {
        Exit::Interrupted
    } else if error.is::<InputError>() || error.is::<TooManyBuckets>() || error.is::<ThreadsUnavailable>() {
        Exit::Usage
    } else {
        Exit::Incomplete
    }
}
