use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::Path;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use crate::cli::Exit;
use crate::cli::measure::{ModeFlags, every_experiment, load};
use crate::cli::output::Output;
use crate::experiment::calibration::Calibration;
use crate::experiment::machine::{Topology, allowed_cpus};
use crate::experiment::placement::{describe, place};
use crate::experiment::plan::{Plan, PlannedRound, PlannedTrial, Work};
use crate::experiment::record::Stage;

#[derive(Debug, Args)]
pub struct PlanVerb {
    /// Experiments by name or file [default: all of `repro all`]
    experiments: Vec<String>,
    #[command(flatten)]
    mode: ModeFlags,
    /// Print every trial in the order in which it would run
    #[arg(long)]
    order: bool,
}

/// What a run would do here.
#[derive(Debug, Serialize)]
struct Shown {
    mode: &'static str,
    machine: String,
    stages: Vec<ShownStage>,
    threads: Vec<ShownThreads>,
    not_applicable: Vec<String>,
    estimate_s: f64,
    /// In the order in which they would run; empty unless asked for.
    trials: Vec<ShownTrial>,
}

#[derive(Debug, Serialize)]
struct ShownStage {
    experiment: String,
    stage: &'static str,
    /// Fewest rounds and most.
    rounds: (usize, usize),
    cells: usize,
    /// For the most rounds.
    estimate_s: f64,
}

#[derive(Debug, Serialize)]
struct ShownThreads {
    threads: usize,
    pin: String,
    /// Where they run.
    place: Option<String>,
}

#[derive(Debug, Serialize)]
struct ShownTrial {
    experiment: String,
    stage: &'static str,
    round: usize,
    position: usize,
    threads: usize,
    cells: Vec<String>,
    estimate_s: f64,
}

impl PlanVerb {
    pub fn run(self, output: Output) -> Result<Exit> {
        let names = if self.experiments.is_empty() { every_experiment() } else { self.experiments };
        let plan = Plan::new(load(&names)?, self.mode.mode(), Calibration::measure()?)?;
        let topology = Topology::read(Path::new("/"), &allowed_cpus());
        let shown = Shown {
            mode: plan.mode.name(),
            machine: describe(&topology),
            stages: stages(&plan),
            threads: threads(&plan, &topology),
            not_applicable: not_applicable(&plan),
            estimate_s: plan.estimate_s(),
            trials: if self.order { trials(&plan) } else { Vec::new() },
        };
        output.show(&shown, |out| shown.print(out))?;
        Ok(Exit::Done)
    }
}

impl Shown {
    fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "machine: {}", self.machine)?;
        for ShownThreads { threads, pin, place } in &self.threads {
            let place = place.as_deref().unwrap_or("wherever the system puts them");
            writeln!(out, "  {threads} thread(s), pinned {pin}: {place}")?;
        }
        writeln!(out, "{:<16} {:<8} {:>7} {:>6} {:>9}", "experiment", "stage", "rounds", "cells", "seconds")?;
        for ShownStage { experiment, stage, rounds: (least, most), cells, estimate_s } in &self.stages {
            let rounds = if least == most { most.to_string() } else { format!("{least}-{most}") };
            writeln!(out, "{experiment:<16} {stage:<8} {rounds:>7} {cells:>6} {estimate_s:>9.0}")?;
        }
        for trial in &self.trials {
            let ShownTrial { experiment, stage, round, position, threads, cells, estimate_s } = trial;
            let cells = cells.join(" ");
            writeln!(
                out,
                "{experiment} {stage} round {} trial {}: {threads} thread(s), {estimate_s:.1} s: {cells}",
                round, position
            )?;
        }
        let minutes = self.estimate_s / 60.0;
        writeln!(out, "about {minutes:.1} minutes in all, from a few steps just timed")?;
        self.not_applicable.iter().try_for_each(|line| writeln!(out, "{line}"))
    }
}

/// Every stage of every experiment that has rounds.
fn stages(plan: &Plan) -> Vec<ShownStage> {
    let mut stages = Vec::new();
    for (place, experiment) in plan.experiments.iter().enumerate() {
        for stage in Stage::ALL {
            let of_stage = |round: &&PlannedRound| round.experiment == place && round.stage == stage;
            let rounds: Vec<&PlannedRound> = plan.rounds.iter().filter(of_stage).collect();
            let Some(first) = rounds.first() else {
                continue;
            };
            let most = rounds.len();
            let least = experiment.spec.rounds(plan.mode, stage).map_or(most, |rounds| rounds.least());
            stages.push(ShownStage {
                experiment: experiment.spec.id.clone(),
                stage: stage.name(),
                rounds: (least, most),
                cells: first.trials.iter().map(PlannedTrial::cells).sum(),
                estimate_s: rounds.iter().map(|round| round.estimate_s()).sum(),
            });
        }
    }
    stages
}

/// Where the threads of each count and kind of pinning would run.
fn threads(plan: &Plan, topology: &Topology) -> Vec<ShownThreads> {
    let pinned = plan.experiments.iter().flat_map(|experiment| {
        let counts = experiment.groups.iter().flat_map(|group| &group.cells);
        counts.map(|(threads, _)| (*threads, experiment.spec.pin.clone()))
    });
    let pinned: BTreeSet<(usize, String)> = pinned.collect();
    let shown = |(threads, pin): (usize, String)| ShownThreads {
        threads,
        place: place(topology, &pin, threads),
        pin,
    };
    pinned.into_iter().map(shown).collect()
}

fn not_applicable(plan: &Plan) -> Vec<String> {
    let mut lines = Vec::new();
    for experiment in &plan.experiments {
        let id = &experiment.spec.id;
        let missing: BTreeSet<&usize> = experiment.groups.iter().flat_map(|g| &g.not_applicable).collect();
        if !missing.is_empty() {
            lines.push(format!("{id}: not applicable here, too few hardware threads for {missing:?}"));
        }
        for exclusion in &experiment.spec.exclude {
            lines.push(format!("{id}: without {}: {}", exclusion.cells.in_words(), exclusion.reason));
        }
    }
    lines
}

/// All trials in their order.
fn trials(plan: &Plan) -> Vec<ShownTrial> {
    let mut trials = Vec::new();
    for round in &plan.rounds {
        let experiment = &plan.experiments[round.experiment];
        for (position, trial) in round.trials.iter().enumerate() {
            let cells = match &trial.work {
                Work::Timed(timed) => timed.variants.iter().map(|variant| variant.label()).collect(),
                Work::Observed(run) => vec![experiment.runs[*run].run.id.clone()],
                Work::Twin(work) => vec![work.cell.label()],
                Work::Validation(request) => vec![request.case.clone()],
                Work::Peaks(_) => vec!["peaks".to_string()],
            };
            trials.push(ShownTrial {
                experiment: experiment.spec.id.clone(),
                stage: round.stage.name(),
                round: round.round,
                position,
                threads: trial.threads,
                cells,
                estimate_s: trial.estimate_s,
            });
        }
    }
    trials
}
