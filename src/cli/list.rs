use std::io::{self, Write};

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use crate::cli::Exit;
use crate::cli::output::Output;
use crate::engine::preset::Preset;
use crate::experiment::library as experiments;
use crate::scene::library as scenes;

#[derive(Debug, Args)]
pub struct List {}

/// Everything that has a name.
#[derive(Debug, Serialize)]
struct Shown {
    experiments: Vec<Named>,
    scenes: Vec<Named>,
    presets: Vec<Named>,
}

#[derive(Debug, Serialize)]
struct Named {
    name: String,
    description: String,
}

impl List {
    pub fn run(self, output: Output) -> Result<Exit> {
        let named = |name: &str, description: String| Named { name: name.to_string(), description };
        let shown = Shown {
            experiments: experiments::names()
                .map(|name| Ok(named(name, experiments::load(name)?.question)))
                .collect::<Result<_>>()?,
            scenes: scenes::names()
                .map(|name| Ok(named(name, scenes::load(name, &[])?.description)))
                .collect::<Result<_>>()?,
            presets: Preset::all().map(|preset| named(&preset.to_string(), String::new())).collect(),
        };
        output.show(&shown, |out| {
            print(out, "experiments", &shown.experiments)?;
            print(out, "scenes", &shown.scenes)?;
            print(out, "presets", &shown.presets)
        })?;
        Ok(Exit::Done)
    }
}

fn print(out: &mut dyn Write, title: &str, list: &[Named]) -> io::Result<()> {
    writeln!(out, "{title}")?;
    for Named { name, description } in list {
        writeln!(out, "{}", format!("  {name:<22} {description}").trim_end())?;
    }
    Ok(())
}
