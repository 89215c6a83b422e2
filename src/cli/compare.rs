use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;

use crate::base::files::write_whole;
use crate::base::input::InputError;
use crate::cli::Exit;
use crate::cli::output::Output;
use crate::report::chart::svg_to_png;
use crate::report::compare::Comparison;
use crate::report::measured::Measured;
use crate::report::page::PNG_WIDTH;
use crate::report::samples::write_csv;

#[derive(Debug, Args)]
pub struct Compare {
    /// Run folders, two or more, from any machines
    #[arg(required = true, num_args = 2..)]
    runs: Vec<PathBuf>,
    /// Folder for compare.md, compare.csv and the figure
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Exit with 1 if a later run is slower than the first on the same machine
    #[arg(long)]
    strict: bool,
}

impl Compare {
    pub fn run(self, output: Output) -> Result<Exit> {
        let runs = self.read()?;
        let comparison = Comparison::new(&runs);
        let text = markdown(&comparison);
        output.show(&comparison.rows(), |out| write!(out, "{text}"))?;
        for odd in comparison.odd_states() {
            eprintln!("repro: {odd}");
        }
        let regressions = comparison.regressions();
        for regression in &regressions {
            eprintln!("repro: slower: {regression}");
        }
        if let Some(folder) = &self.output {
            std::fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
            write_whole(&folder.join("compare.md"), text.as_bytes())?;
            write_csv(&folder.join("compare.csv"), &comparison.rows())?;
            if let Some(figure) = comparison.figure() {
                let svg = figure.legible().to_svg()?;
                write_whole(&folder.join("compare.svg"), svg.as_bytes())?;
                write_whole(&folder.join("compare.png"), &svg_to_png(&svg, PNG_WIDTH)?)?;
            }
        }
        Ok(if comparison.comparable() == 0 {
            Exit::Incomparable
        } else if self.strict && !regressions.is_empty() {
            Exit::ClaimFails
        } else {
            Exit::Done
        })
    }

    /// The runs with names that tell them apart.
    fn read(&self) -> Result<Vec<(String, Measured)>> {
        let mut runs: Vec<(String, Measured)> = Vec::new();
        for folder in &self.runs {
            if !folder.join("run.json").is_file() {
                let found = format!("`{}`, which holds no run.json", folder.display());
                return Err(InputError::new("command line", "RUN", found, "allowed are run folders").into());
            }
            let measured = Measured::read(folder)?;
            let alias = &measured.info.machine_alias;
            let same = runs.iter().filter(|(_, other)| other.info.machine_alias == *alias).count();
            let name = if same == 0 { alias.clone() } else { format!("{alias} ({})", same + 1) };
            runs.push((name, measured));
        }
        Ok(runs)
    }
}

fn markdown(comparison: &Comparison<'_>) -> String {
    let tables = comparison.tables();
    let texts = tables.iter().map(|table| format!("{}\n\n{}", table.caption, table.to_markdown()));
    texts.collect::<Vec<_>>().join("\n")
}
