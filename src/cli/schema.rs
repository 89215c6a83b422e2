use std::io::Write;

use anyhow::{Context, Result};
use clap::Args;

use crate::cli::Exit;
use crate::experiment::schema;

#[derive(Debug, Args)]
pub struct Schema {}

impl Schema {
    pub fn run(self) -> Result<Exit> {
        std::io::stdout().write_all(schema::experiment().as_bytes()).context("cannot print")?;
        Ok(Exit::Done)
    }
}
