use std::path::Path;

use anyhow::Result;
use clap::Args;

use crate::cli::Exit;
use crate::cli::output::Output;
use crate::experiment::machine::Machine;

#[derive(Debug, Args)]
pub struct MachineVerb {}

impl MachineVerb {
    pub fn run(self, output: Output) -> Result<Exit> {
        let machine = Machine::observe(Path::new("/"), None);
        output.show(&machine, |out| {
            writeln!(out, "{} ({})", machine.alias, machine.machine_id)?;
            for fact in &machine.facts {
                writeln!(out, "{:<8} {:<28} {} {}", fact.group, fact.key, fact.value, fact.unit)?;
            }
            Ok(())
        })?;
        Ok(Exit::Done)
    }
}
