use std::io::Write;

use anyhow::Result;
use clap::Args;

use crate::cli::Exit;
use crate::cli::measure::{ModeFlags, every_experiment, load};
use crate::experiment::plan::{Calibration, Plan, not_applicable};
use crate::experiment::record::Stage;

#[derive(Debug, Args)]
pub struct PlanVerb {
    /// Experiments by name or file [default: all of `repro all`]
    experiments: Vec<String>,
    #[command(flatten)]
    mode: ModeFlags,
}

impl PlanVerb {
    pub fn run(self) -> Result<Exit> {
        let names = if self.experiments.is_empty() {
            every_experiment()
        } else {
            self.experiments
        };
        let plan = Plan::new(load(&names)?, self.mode.mode(), Calibration::measure()?)?;
        let mut out = std::io::stdout().lock();
        writeln!(
            out,
            "{:<16} {:<8} {:>6} {:>6} {:>12} {:>9}",
            "experiment", "stage", "rounds", "cells", "steps/round", "seconds"
        )?;
        for (k, experiment) in plan.experiments.iter().enumerate() {
            for stage in [Stage::States, Stage::Whole, Stage::Paired] {
                let rounds: Vec<_> = plan
                    .rounds
                    .iter()
                    .filter(|r| r.experiment == k && r.stage == stage)
                    .collect();
                let Some(first) = rounds.first() else {
                    continue;
                };
                let cells: usize = first.trials.iter().map(|t| t.variants.len()).sum();
                let steps: usize = first
                    .trials
                    .iter()
                    .flat_map(|t| {
                        t.windows
                            .iter()
                            .map(|w| (w.warmup_steps + w.steps) * t.variants.len())
                    })
                    .sum();
                let seconds: f64 = rounds.iter().map(|r| r.estimate_s()).sum();
                writeln!(
                    out,
                    "{:<16} {:<8} {:>6} {:>6} {:>12} {:>9.0}",
                    experiment.spec.id,
                    stage.name(),
                    rounds.len(),
                    cells,
                    steps,
                    seconds
                )?;
            }
        }
        writeln!(
            out,
            "about {:.1} minutes in all, from a few steps just timed",
            plan.estimate_s() / 60.0
        )?;
        for (experiment, threads) in not_applicable(&plan) {
            if !threads.is_empty() {
                writeln!(
                    out,
                    "{experiment}: not applicable here, too few cores: {threads:?} threads"
                )?;
            }
        }
        Ok(Exit::Done)
    }
}
