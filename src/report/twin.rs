//! `twin.csv`, and what a run measured of the twin: times by program, layout and round.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use serde::Serialize;

use crate::base::statistics::median;
use crate::experiment::record::{SCHEMA, Stage, Status, TrialRecord};
use crate::experiment::twin::outcome::{Language, TwinAnswer, TwinBuild, TwinCell, TwinOutcome, TwinPass};
use crate::report::measured::{ByRound, Measured};
use crate::report::samples::write_csv;

/// One layout in one trial. A trial without times, since it failed or cannot run here, is two rows, too.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TwinRow<'a> {
    schema_version: u32,
    run_id: &'a str,
    mode: &'static str,
    experiment_id: &'a str,
    round: usize,
    position: usize,
    language: &'static str,
    compiler: &'a str,
    compiler_version: &'a str,
    target_cpu: &'a str,
    threads: usize,
    distance_test: &'a str,
    layout: &'static str,
    particles: Option<usize>,
    passes: Option<usize>,
    /// Seconds of the loop, median of the passes.
    time_s: Option<f64>,
    /// Seconds of the copy before it, median of the passes; none for the list.
    relocation_s: Option<f64>,
    status: &'static str,
    reason: &'a str,
    started_utc: &'a str,
    machine_id: &'a str,
    source_hash: &'a str,
    digest: &'a str,
}

/// One program on a number of threads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    pub cell: TwinCell,
    pub threads: usize,
}

/// Part of a pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The loop along the linked lists.
    List,
    /// The loop along the relocated rows.
    Relocated,
    /// That loop and the copy before it.
    RelocatedWithCopy,
}

impl Part {
    fn seconds(self, pass: &TwinPass) -> f64 {
        match self {
            Part::List => pass.list_s,
            Part::Relocated => pass.relocated_s,
            Part::RelocatedWithCopy => pass.relocation_s + pass.relocated_s,
        }
    }
}

/// The compiler and target as people read them.
pub fn name(cell: &TwinCell) -> String {
    match cell.language {
        Language::Rust => format!("Rust, {}", cell.target_cpu),
        Language::C => format!("C ({}), {}", cell.compiler, cell.target_cpu),
    }
}

/// The programs of an experiment's trials, each once: by distance test and threads, Rust first, portable targets first.
pub fn programs(measured: &Measured, experiment: &str) -> Vec<Program> {
    let trials = measured.trials(experiment, Stage::Twin).map(|(_, trial)| trial);
    let program = |trial: &TrialRecord| {
        Some(Program { cell: trial.twin.as_ref()?.cell.clone(), threads: trial.threads })
    };
    let mut programs: Vec<Program> = trials.filter_map(program).collect();
    programs.sort_by_key(|Program { cell, threads }| {
        let target_cpu = Reverse(cell.target_cpu.clone());
        (cell.distance_test.clone(), *threads, cell.language, cell.compiler.clone(), target_cpu)
    });
    programs.dedup();
    programs
}

/// The successful trials of an experiment's twin, with their round.
pub fn answers<'a>(
    measured: &'a Measured,
    experiment: &'a str,
) -> impl Iterator<Item = (usize, Program, &'a TwinAnswer)> {
    let ok = measured.trials(experiment, Stage::Twin).filter(|(_, trial)| trial.status == Status::Ok);
    ok.filter_map(|(round, trial)| {
        let twin = trial.twin.as_ref()?;
        let program = Program { cell: twin.cell.clone(), threads: trial.threads };
        Some((round, program, twin.answer.as_ref()?))
    })
}

/// Seconds of a part of a pass, the median of a trial's passes, by round.
pub fn by_round(measured: &Measured, experiment: &str, program: &Program, part: Part) -> ByRound {
    let of_program = answers(measured, experiment).filter(|(_, found, _)| found == program);
    let seconds = |(round, _, answer): (usize, Program, &TwinAnswer)| {
        Some((round, median_of(&answer.passes, |p| part.seconds(p))?))
    };
    of_program.filter_map(seconds).collect()
}

fn median_of(passes: &[TwinPass], seconds: impl Fn(&TwinPass) -> f64) -> Option<f64> {
    median(&passes.iter().map(seconds).collect::<Vec<f64>>())
}

/// How the C programs were compiled, by compiler and target.
pub fn builds<'a>(
    measured: &'a Measured,
    experiment: &'a str,
) -> BTreeMap<(&'a str, &'a str), &'a TwinBuild> {
    let twins = measured.trials(experiment, Stage::Twin).filter_map(|(_, trial)| trial.twin.as_ref());
    let build = |twin: &'a TwinOutcome| {
        Some(((twin.cell.compiler.as_str(), twin.cell.target_cpu.as_str()), twin.build.as_ref()?))
    };
    twins.filter_map(build).collect()
}

/// The rows of all twins of a run.
pub fn rows(measured: &Measured) -> Vec<TwinRow<'_>> {
    let mut rows = Vec::new();
    for experiment in &measured.info.experiments {
        for (round, trial) in measured.trials(&experiment.id, Stage::Twin) {
            rows.extend(trial_rows(measured, &experiment.id, round, trial));
        }
    }
    rows
}

/// Writes the file; none where no experiment of the run has a twin.
pub fn write(measured: &Measured, folder: &Path) -> Result<()> {
    write_csv(&folder.join("twin.csv"), &rows(measured))
}

fn trial_rows<'a>(
    measured: &'a Measured,
    experiment: &'a str,
    round: usize,
    trial: &'a TrialRecord,
) -> Vec<TwinRow<'a>> {
    let Some(twin) = &trial.twin else {
        return Vec::new();
    };
    let answer = twin.answer.as_ref().filter(|_| trial.status == Status::Ok);
    let seconds = |part: fn(&TwinPass) -> f64| median_of(&answer?.passes, part);
    let row = |layout, time_s, relocation_s| TwinRow {
        schema_version: SCHEMA,
        run_id: &measured.info.run_id,
        mode: measured.info.mode.name(),
        experiment_id: experiment,
        round,
        position: trial.position,
        language: twin.cell.language.name(),
        compiler: &twin.cell.compiler,
        compiler_version: twin.build.as_ref().map_or("", |build| &build.version),
        target_cpu: &twin.cell.target_cpu,
        threads: trial.threads,
        distance_test: &twin.cell.distance_test,
        layout,
        particles: answer.map(|answer| answer.particles),
        passes: answer.map(|answer| answer.passes.len()),
        time_s,
        relocation_s,
        status: trial.status.name(),
        reason: &trial.reason,
        started_utc: &trial.started_utc,
        machine_id: &measured.info.machine_id,
        source_hash: &measured.info.source_hash,
        digest: answer.map_or("", |answer| &answer.digest),
    };
    vec![
        row("linked_list", seconds(|pass| pass.list_s), None),
        row("relocated", seconds(|pass| pass.relocated_s), seconds(|pass| pass.relocation_s)),
    ]
}
