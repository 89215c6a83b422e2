use anyhow::Result;
use clap::Args;

use crate::cli::Exit;
use crate::cli::measure::{Measure, every_experiment};

#[derive(Debug, Args)]
pub struct All {
    #[command(flatten)]
    measure: Measure,
}

impl All {
    pub fn run(self) -> Result<Exit> {
        self.measure.run(&every_experiment(), "all")
    }
}
