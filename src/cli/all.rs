use anyhow::Result;
use clap::Args;

use crate::cli::Exit;
use crate::cli::measure::{Measure, every_experiment};
use crate::cli::output::Output;

#[derive(Debug, Args)]
pub struct All {
    #[command(flatten)]
    measure: Measure,
}

impl All {
    pub fn run(self, output: Output) -> Result<Exit> {
        self.measure.run(&every_experiment(), "all", output)
    }
}
