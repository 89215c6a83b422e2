use std::collections::BTreeSet;
use std::io::Write;

use anyhow::Result;
use clap::Args;

use crate::cli::Exit;
use crate::cli::measure::{ModeFlags, every_experiment, load};
use crate::experiment::calibration::Calibration;
use crate::experiment::plan::{Plan, PlannedRound, PlannedTrial};
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
        let names = if self.experiments.is_empty() { every_experiment() } else { self.experiments };
        let plan = Plan::new(load(&names)?, self.mode.mode(), Calibration::measure()?)?;
        let mut out = std::io::stdout().lock();
        writeln!(out, "{:<16} {:<8} {:>6} {:>6} {:>9}", "experiment", "stage", "rounds", "cells", "seconds")?;
        for k in 0..plan.experiments.len() {
            for stage in Stage::ALL {
                if let Some(line) = line(&plan, k, stage) {
                    writeln!(out, "{line}")?;
                }
            }
        }
        writeln!(out, "about {:.1} minutes in all, from a few steps just timed", plan.estimate_s() / 60.0)?;
        for experiment in &plan.experiments {
            let missing = experiment.groups.iter().flat_map(|group| &group.not_applicable);
            let missing: BTreeSet<&usize> = missing.collect();
            if !missing.is_empty() {
                let id = &experiment.spec.id;
                writeln!(out, "{id}: not applicable here, too few hardware threads for {missing:?}")?;
            }
        }
        Ok(Exit::Done)
    }
}

/// What one stage of an experiment comes to; `None` where the plan has none.
fn line(plan: &Plan, experiment: usize, stage: Stage) -> Option<String> {
    let of_stage = |round: &&PlannedRound| round.experiment == experiment && round.stage == stage;
    let rounds: Vec<&PlannedRound> = plan.rounds.iter().filter(of_stage).collect();
    let cells: usize = rounds.first()?.trials.iter().map(PlannedTrial::cells).sum();
    let seconds: f64 = rounds.iter().map(|round| round.estimate_s()).sum();
    let id = &plan.experiments[experiment].spec.id;
    let (stage, rounds) = (stage.name(), rounds.len());
    Some(format!("{id:<16} {stage:<8} {rounds:>6} {cells:>6} {seconds:>9.0}"))
}
