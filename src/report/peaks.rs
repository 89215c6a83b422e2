//! `peaks.csv`: what the machine moved and computed at most, a row a loop and number of threads.

use std::path::Path;

use anyhow::Result;
use serde::Serialize;

use crate::experiment::peaks::{Peak, Peaks};
use crate::experiment::record::{SCHEMA, Stage, Status, TrialRecord};
use crate::report::measured::Measured;
use crate::report::samples::write_csv;

/// One peak. A trial without any is a row without numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PeakRow<'a> {
    schema_version: u32,
    run_id: &'a str,
    mode: &'static str,
    experiment_id: &'a str,
    threads_requested: usize,
    instructions: &'a str,
    kind: &'static str,
    working_set_bytes: Option<u64>,
    unit: &'static str,
    median: Option<f64>,
    lowest: Option<f64>,
    highest: Option<f64>,
    repetitions: Option<usize>,
    status: &'static str,
    reason: &'a str,
    started_utc: &'a str,
    machine_id: &'a str,
    source_hash: &'a str,
}

/// What an experiment measured of the machine, the fewest threads first.
pub fn of<'a>(measured: &'a Measured, experiment: &'a str) -> Vec<&'a Peaks> {
    let trials = measured.trials(experiment, Stage::Peaks).map(|(_, trial)| trial);
    let mut found: Vec<&Peaks> = trials.filter_map(|trial| trial.peaks.as_ref()).collect();
    found.sort_by_key(|peaks| peaks.threads);
    found
}

/// The rows of all experiments of a run.
pub fn rows(measured: &Measured) -> Vec<PeakRow<'_>> {
    let mut rows = Vec::new();
    for experiment in &measured.info.experiments {
        for (_, trial) in measured.trials(&experiment.id, Stage::Peaks) {
            rows.extend(trial_rows(measured, &experiment.id, trial));
        }
    }
    rows
}

/// Writes the file; none where no experiment of the run measures peaks.
pub fn write(measured: &Measured, folder: &Path) -> Result<()> {
    write_csv(&folder.join("peaks.csv"), &rows(measured))
}

fn trial_rows<'a>(measured: &'a Measured, experiment: &'a str, trial: &'a TrialRecord) -> Vec<PeakRow<'a>> {
    let row = |found: Option<(&'a Peaks, &Peak)>| {
        let rate = |value: fn(&Peak) -> f64| found.map(|(_, peak)| value(peak) / 1e9);
        PeakRow {
            schema_version: SCHEMA,
            run_id: &measured.info.run_id,
            mode: measured.info.mode.name(),
            experiment_id: experiment,
            threads_requested: trial.threads,
            instructions: found.map_or("", |(peaks, _)| &peaks.instructions),
            kind: found.map_or("", |(_, peak)| peak.kind.name()),
            working_set_bytes: found.map(|(_, peak)| peak.working_set_bytes),
            unit: found.map_or("", |(_, peak)| peak.kind.unit()),
            median: rate(|peak| peak.median_per_s),
            lowest: rate(|peak| peak.lowest_per_s),
            highest: rate(|peak| peak.highest_per_s),
            repetitions: found.map(|(peaks, _)| peaks.repetitions),
            status: trial.status.name(),
            reason: &trial.reason,
            started_utc: &trial.started_utc,
            machine_id: &measured.info.machine_id,
            source_hash: &measured.info.source_hash,
        }
    };
    match trial.peaks.as_ref().filter(|_| trial.status == Status::Ok) {
        Some(peaks) => peaks.peaks.iter().map(|peak| row(Some((peaks, peak)))).collect(),
        None => vec![row(None)],
    }
}
