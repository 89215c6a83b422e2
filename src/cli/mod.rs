//! The command line: one verb a file. Only here is anything printed.

mod all;
mod archive;
mod collect;
mod compare;
mod completions;
mod effects;
mod engine_options;
mod export;
mod list;
mod machine;
mod measure;
mod output;
mod plan;
mod report;
mod run;
mod schema;
mod simulate;
mod status;
mod submit;
mod task;
mod trial;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::base::input::InputError;
use crate::base::parallel::ThreadsUnavailable;
use crate::cli::output::Output;
use crate::engine::search::grid::BadDomain;
use crate::experiment::gate::MachineRefused;
use crate::experiment::interrupt::Interrupted;
use crate::experiment::run::AnotherMachine;

/// Reruns, measures and judges a published speed-up of the neighbour search in the MPS particle method.
#[derive(Debug, Parser)]
#[command(version, about, after_help = EXIT_CODES)]
pub struct Cli {
    #[command(subcommand)]
    verb: Verb,
    /// Print one JSON document instead of text
    #[arg(long, global = true)]
    json: bool,
}

const EXIT_CODES: &str = "\
Exit codes: 0 done; 1 a claim fails or a run is slower (only with --strict); 2 the command or a file cannot be used; 3 incomplete: a trial \
failed, a simulation broke down, rounds are missing or something could not be written; 4 the machine is refused: too busy for \
the experiment's gate, or not the run's; 5 nothing was measured; 6 no cell of the runs can be compared; 130 interrupted.";

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
    /// Says how far a run is: what is missing of it, and what failed.
    Status(status::Status),
    /// Shows what this machine is, as a run records it.
    Machine(machine::MachineVerb),
    /// Renders a run folder's tables, figures, claims and report anew from its records.
    Report(report::Report),
    /// Spreads a run over the nodes of a cluster, a whole round a task; run again, it sends only what is missing.
    Submit(submit::Submit),
    /// Gathers what a cluster has run, reports on it, and says what is missing.
    Collect(collect::Collect),
    /// Compares run folders, from any machines: ratios within each, times beside them, what differs.
    Compare(compare::Compare),
    /// Packs a run with its experiments, scenes and claims into one file for reviewers.
    Archive(archive::Archive),
    /// Writes a run's tables for spreadsheets, statistics programs and notebooks.
    Export(export::Export),
    /// Simulates one scene.
    Simulate(Box<simulate::Simulate>),
    /// Takes a scene's effects apart: what each costs, and what it changes.
    Effects(Box<effects::Effects>),
    /// Prints the JSON Schema of experiment or scene files.
    Schema(schema::Schema),
    /// Prints a shell's completions of this command.
    Completions(completions::Completions),
    /// Runs one trial, described on standard input: how this program starts itself.
    #[command(hide = true)]
    Trial(trial::Trial),
    /// Runs a part of a submitted run: what jobs of a cluster do.
    #[command(hide = true)]
    Task(task::Task),
}

/// How the program ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    Done = 0,
    ClaimFails = 1,
    Usage = 2,
    Incomplete = 3,
    MachineRefused = 4,
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
        let output = Output { json: self.json };
        match self.verb {
            Verb::All(verb) => verb.run(output),
            Verb::Run(verb) => verb.run(output),
            Verb::List(verb) => verb.run(output),
            Verb::Plan(verb) => verb.run(output),
            Verb::Status(verb) => verb.run(output),
            Verb::Machine(verb) => verb.run(output),
            Verb::Report(verb) => verb.run(output),
            Verb::Compare(verb) => verb.run(output),
            Verb::Archive(verb) => verb.run(output),
            Verb::Export(verb) => verb.run(),
            Verb::Simulate(verb) => verb.run(output),
            Verb::Effects(verb) => verb.run(output),
            Verb::Schema(verb) => verb.run(),
            Verb::Completions(verb) => verb.run(),
            Verb::Trial(verb) => verb.run(),
            Verb::Submit(verb) => verb.run(output),
            Verb::Collect(verb) => verb.run(output),
            Verb::Task(verb) => verb.run(),
        }
    }
}

/// The exit code that an error asks for.
pub fn exit_code(error: &anyhow::Error) -> Exit {
    if error.is::<Interrupted>() {
        Exit::Interrupted
    } else if error.is::<MachineRefused>() || error.is::<AnotherMachine>() {
        Exit::MachineRefused
    } else if error.is::<InputError>() || error.is::<BadDomain>() || error.is::<ThreadsUnavailable>() {
        Exit::Usage
    } else {
        Exit::Incomplete
    }
}
