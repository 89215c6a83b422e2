use std::io::Write;
use std::path::Path;

use anyhow::Result;
use clap::Args;

use crate::cli::Exit;
use crate::experiment::machine::Machine;

#[derive(Debug, Args)]
pub struct MachineVerb {
    /// As JSON
    #[arg(long)]
    json: bool,
}

impl MachineVerb {
    pub fn run(self) -> Result<Exit> {
        let machine = Machine::observe(Path::new("/"), None);
        let mut out = std::io::stdout().lock();
        if self.json {
            writeln!(out, "{}", serde_json::to_string_pretty(&machine)?)?;
            return Ok(Exit::Done);
        }
        writeln!(out, "{} ({})", machine.alias, machine.machine_id)?;
        for fact in &machine.facts {
            writeln!(out, "{:<8} {:<28} {} {}", fact.group, fact.key, fact.value, fact.unit)?;
        }
        Ok(Exit::Done)
    }
}
