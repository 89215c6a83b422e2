use anyhow::Result;
use clap::Args;

use crate::cli::Exit;
use crate::cli::measure::{Measure, load};
use crate::cli::output::Output;

#[derive(Debug, Args)]
pub struct Run {
    /// An experiment's name (see `repro list`) or file
    experiment: String,
    #[command(flatten)]
    measure: Measure,
}

impl Run {
    pub fn run(self, output: Output) -> Result<Exit> {
        let names = [self.experiment];
        let id = load(&names)?.remove(0).id;
        self.measure.run(&names, &format!("run {id}"), output)
    }
}
