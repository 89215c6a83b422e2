use std::io::Write;

use anyhow::Result;
use clap::Args;

use crate::cli::Exit;
use crate::engine::preset::Preset;
use crate::experiment::library as experiments;
use crate::scene::library as scenes;

#[derive(Debug, Args)]
pub struct List {}

impl List {
    pub fn run(self) -> Result<Exit> {
        let mut out = std::io::stdout().lock();
        writeln!(out, "experiments")?;
        for name in experiments::names() {
            writeln!(out, "  {name:<22} {}", experiments::load(name)?.question)?;
        }
        writeln!(out, "scenes")?;
        for name in scenes::names() {
            writeln!(out, "  {name:<22} {}", scenes::load(name, &[])?.description)?;
        }
        writeln!(out, "presets")?;
        for preset in Preset::all() {
            writeln!(out, "  {preset}")?;
        }
        Ok(Exit::Done)
    }
}
