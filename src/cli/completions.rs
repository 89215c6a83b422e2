use std::io::Write;

use anyhow::{Context, Result};
use clap::{Args, CommandFactory};
use clap_complete::Shell;

use crate::cli::{Cli, Exit};

#[derive(Debug, Args)]
pub struct Completions {
    /// The shell, for example `bash`: `source <(repro completions bash)`
    shell: Shell,
}

impl Completions {
    pub fn run(self) -> Result<Exit> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "repro", &mut script);
        std::io::stdout().write_all(&script).context("cannot print")?;
        Ok(Exit::Done)
    }
}
