use std::io::Write;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};

use crate::cli::Exit;
use crate::experiment::schema;

#[derive(Debug, Args)]
pub struct Schema {
    /// The kind of file that the schema describes
    #[arg(value_enum, default_value_t = Of::Experiment)]
    of: Of,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Of {
    Experiment,
    Scene,
}

impl Schema {
    pub fn run(self) -> Result<Exit> {
        let text = match self.of {
            Of::Experiment => schema::experiment(),
            Of::Scene => schema::scene(),
        };
        std::io::stdout().write_all(text.as_bytes()).context("cannot print")?;
        Ok(Exit::Done)
    }
}
