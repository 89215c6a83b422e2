//! `repro`: parse, run, exit code.

use std::process::ExitCode;

use clap::Parser;
use repro::cli::{Cli, exit_code};
use repro::experiment::interrupt;

fn main() -> ExitCode {
    let cli = Cli::parse();
    interrupt::listen();
    match cli.run() {
        Ok(exit) => exit.into(),
        Err(error) => {
            eprintln!("repro: {error:#}");
            exit_code(&error).into()
        }
    }
}
