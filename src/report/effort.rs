//! What repeating a part of a run takes: the command, the time of its trials and the size of their records.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

use crate::experiment::ablation;
use crate::experiment::library;
use crate::experiment::record::RoundRecord;
use crate::experiment::spec::{Experiment, Mode};
use crate::report::claim::Judged;
use crate::report::measured::Measured;
use crate::report::table::TableView;

/// What an experiment of a run took.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Effort {
    pub experiment: String,
    pub command: String,
    pub trials: usize,
    /// Wall time of the trials' processes, seconds.
    pub wall_s: f64,
    /// Size of the records, bytes.
    pub bytes: u64,
}

/// A row of `effort.csv`: an experiment, or a claim with what its experiment took.
#[derive(Debug, Serialize)]
pub struct EffortRow<'a> {
    kind: &'static str,
    id: &'a str,
    experiment_id: &'a str,
    command: &'a str,
    commit: &'a str,
    trials: usize,
    wall_s: f64,
    record_bytes: u64,
}

/// The experiments of a run, in its order.
pub fn of(measured: &Measured, folder: &Path) -> Result<Vec<Effort>> {
    measured.info.experiments.iter().map(|experiment| of_experiment(measured, experiment, folder)).collect()
}

fn of_experiment(measured: &Measured, experiment: &Experiment, folder: &Path) -> Result<Effort> {
    let mut effort = Effort {
        experiment: experiment.id.clone(),
        command: command(experiment, measured.info.mode),
        trials: 0,
        wall_s: 0.0,
        bytes: 0,
    };
    for round in measured.rounds.iter().filter(|round| round.experiment == experiment.id) {
        let path = RoundRecord::path(folder, &round.experiment, round.stage, round.round);
        let file = std::fs::metadata(&path).with_context(|| format!("cannot look at {}", path.display()))?;
        effort.bytes += file.len();
        effort.trials += round.trials.len();
        effort.wall_s += round.trials.iter().map(|trial| trial.wall_s).sum::<f64>();
    }
    Ok(effort)
}

/// The command that runs an experiment alone, with the program that ran it. One that takes a scene's effects apart is made
/// from the scene, unless it is one of the program's. Any other that does not come with the program, whose names no other
/// experiment may have, is a file of the archive.
fn command(experiment: &Experiment, mode: Mode) -> String {
    let id = &experiment.id;
    let unfiltered = Experiment { filter: Vec::new(), ..experiment.clone() };
    let is_the_programs = library::embedded(id).is_ok_and(|known| known == unfiltered);
    let command = match ablation::command(experiment).filter(|_| !is_the_programs) {
        Some(command) => command,
        None if library::text(id).is_some() => format!("repro run {id}"),
        None => format!("repro run experiments/{id}.toml"),
    };
    match mode {
        Mode::Default => command,
        mode => format!("{command} --{}", mode.name()),
    }
}

impl Effort {
    pub fn in_words(&self) -> String {
        format!("{} trials in {}, {} of records", self.trials, minutes(self.wall_s), megabytes(self.bytes))
    }

    fn row<'a>(&'a self, kind: &'static str, id: &'a str, commit: &'a str) -> EffortRow<'a> {
        EffortRow {
            kind,
            id,
            experiment_id: &self.experiment,
            command: &self.command,
            commit,
            trials: self.trials,
            wall_s: self.wall_s,
            record_bytes: self.bytes,
        }
    }
}

/// The rows of `effort.csv`: experiments first, then claims.
pub fn rows<'a>(measured: &'a Measured, efforts: &'a [Effort], judged: &'a [Judged]) -> Vec<EffortRow<'a>> {
    let commit = &measured.info.commit;
    let mut rows: Vec<EffortRow<'_>> =
        efforts.iter().map(|effort| effort.row("experiment", &effort.experiment, commit)).collect();
    let mut seen = BTreeSet::new();
    for Judged { claim, .. } in judged.iter().filter(|judged| seen.insert(&judged.claim.id)) {
        let effort = efforts.iter().find(|effort| effort.experiment == claim.estimate.experiment);
        rows.extend(effort.map(|effort| effort.row("claim", &claim.id, commit)));
    }
    rows
}

/// The same for people: a row an experiment, with the claims that it judges.
pub fn view(efforts: &[Effort], judged: &[Judged]) -> TableView {
    let mut view = TableView::new(
        "What repeats a part of this run, and what it took here: the processes' wall time and the size of their records. An \
         experiment that is run alone also computes the states from which its windows start, which in one run serve all.",
        &["experiment", "claims", "command", "trials", "time", "records"],
    );
    for effort in efforts {
        let mut claims: Vec<&str> = Vec::new();
        for judged in judged.iter().filter(|j| j.claim.estimate.experiment == effort.experiment) {
            if !claims.contains(&judged.claim.id.as_str()) {
                claims.push(&judged.claim.id);
            }
        }
        view.rows.push(vec![
            effort.experiment.clone(),
            claims.join(", "),
            effort.command.clone(),
            effort.trials.to_string(),
            minutes(effort.wall_s),
            megabytes(effort.bytes),
        ]);
    }
    let (trials, bytes) =
        (efforts.iter().map(|e| e.trials).sum::<usize>(), efforts.iter().map(|e| e.bytes).sum());
    let wall_s = efforts.iter().map(|e| e.wall_s).sum();
    let total = ["all of them", "", "", &trials.to_string(), &minutes(wall_s), &megabytes(bytes)];
    view.rows.push(total.map(String::from).to_vec());
    view
}

/// A time as people say it. Its unit is always the same, so that a column can be sorted.
pub fn minutes(seconds: f64) -> String {
    format!("{:.1} min", seconds / 60.0)
}

pub fn megabytes(bytes: u64) -> String {
    format!("{:.2} MB", bytes as f64 / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_names_what_exists() {
        let mut experiment = library::embedded("effects-of-mud-flow").unwrap();
        assert_eq!(command(&experiment, Mode::Quick), "repro run effects-of-mud-flow --quick");
        experiment.case[0].set.insert("end_time_s".to_string(), toml::Value::Float(0.2));
        let made = "repro effects mud-flow --until 0.2 --set particle_distance_m=0.01 --set time_step_s=0.001 --rounds 9";
        assert_eq!(command(&experiment, Mode::Default), made);
        experiment.id = "effects-of-another".to_string();
        assert_eq!(command(&experiment, Mode::Quick), format!("{made} --quick"));
        let mine = Experiment { id: "mine".to_string(), ..library::embedded("cg").unwrap() };
        assert_eq!(command(&mine, Mode::Default), "repro run experiments/mine.toml");
    }
}
