//! `validation.csv`: what each validating case found, a row a comparison.

use std::path::Path;

use anyhow::Result;
use serde::Serialize;

use crate::experiment::record::{SCHEMA, Stage, Status, TrialRecord};
use crate::experiment::validation::Found;
use crate::report::measured::Measured;
use crate::report::samples::write_csv;

/// One comparison with a known answer. A case that could not be computed is a row without numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ValidationRow<'a> {
    schema_version: u32,
    run_id: &'a str,
    mode: &'static str,
    experiment_id: &'a str,
    pub validating_case: &'a str,
    pub effect: &'a str,
    pub simulated: &'a str,
    pub quantity: &'a str,
    pub value: Option<f64>,
    pub reference: Option<f64>,
    pub error: Option<f64>,
    pub gate: Option<f64>,
    /// `pass`, `fail`, `reported` for what has no gate, or `none` for a case that could not be computed.
    pub verdict: &'static str,
    pub source: &'a str,
    status: &'static str,
    pub reason: &'a str,
    wall_s: f64,
    started_utc: &'a str,
    machine_id: &'a str,
    source_hash: &'a str,
}

/// The rows of all experiments of a run.
pub fn rows(measured: &Measured) -> Vec<ValidationRow<'_>> {
    measured.info.experiments.iter().flat_map(|experiment| rows_of(measured, &experiment.id)).collect()
}

/// The rows of one experiment, in the order of the program's list of cases.
pub fn rows_of<'a>(measured: &'a Measured, experiment: &'a str) -> Vec<ValidationRow<'a>> {
    let trials = measured.trials(experiment, Stage::Validation).map(|(_, trial)| trial);
    trials.flat_map(|trial| trial_rows(measured, experiment, trial)).collect()
}

/// Writes the file; none where no experiment of the run validates.
pub fn write(measured: &Measured, folder: &Path) -> Result<()> {
    write_csv(&folder.join("validation.csv"), &rows(measured))
}

fn trial_rows<'a>(
    measured: &'a Measured,
    experiment: &'a str,
    trial: &'a TrialRecord,
) -> Vec<ValidationRow<'a>> {
    let error = trial.validated.as_ref().map_or("", |validated| &validated.error);
    let row = |found: Option<&'a Found>| ValidationRow {
        schema_version: SCHEMA,
        run_id: &measured.info.run_id,
        mode: measured.info.mode.name(),
        experiment_id: experiment,
        validating_case: &trial.subject,
        effect: found.map_or("", |found| &found.effect),
        simulated: found.map_or("", |found| &found.case),
        quantity: found.map_or("", |found| &found.quantity),
        value: found.map(|found| found.value),
        reference: found.map(|found| found.reference),
        error: found.map(|found| found.error),
        gate: found.and_then(|found| found.gate),
        verdict: found.map_or("none", Found::verdict),
        source: found.map_or("", |found| &found.source),
        status: trial.status.name(),
        reason: if trial.status == Status::Ok { error } else { &trial.reason },
        wall_s: trial.wall_s,
        started_utc: &trial.started_utc,
        machine_id: &measured.info.machine_id,
        source_hash: &measured.info.source_hash,
    };
    match &trial.validated {
        Some(validated) if !validated.found.is_empty() => {
            validated.found.iter().map(|found| row(Some(found))).collect()
        }
        _ => vec![row(None)],
    }
}
