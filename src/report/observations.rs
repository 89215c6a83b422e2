//! `observations.csv` and `fronts.csv`: what was seen of every observed run, one number a row.

use std::path::Path;

use anyhow::Result;
use serde::Serialize;

use crate::experiment::observed::Criterion;
use crate::experiment::record::{Observation, SCHEMA, Stage, TrialRecord};
use crate::experiment::spec::Experiment;
use crate::report::measured::Measured;
use crate::report::samples::write_csv;

/// One number of one run. A run without any, since its process failed, is a row too.
#[derive(Debug, Clone, Serialize)]
pub struct ObservationRow<'a> {
    schema_version: u32,
    run_id: &'a str,
    mode: &'static str,
    experiment_id: &'a str,
    observed_run: &'a str,
    round: usize,
    position: usize,
    threads_requested: usize,
    preset: &'a str,
    distance_test: &'a str,
    storage: &'a str,
    cg_tolerance: f64,
    particles: Option<usize>,
    time_step_s: Option<f64>,
    steps: Option<usize>,
    ended: &'a str,
    error: &'a str,
    quantity: &'static str,
    value: Option<f64>,
    unit: &'static str,
    at_least: Option<f64>,
    at_most: Option<f64>,
    status: &'static str,
    reason: &'a str,
    started_utc: &'a str,
    machine_id: &'a str,
    source_hash: &'a str,
    digest: &'a str,
}

/// Where the front of a run was.
#[derive(Debug, Clone, Serialize)]
pub struct FrontRow<'a> {
    run_id: &'a str,
    experiment_id: &'a str,
    observed_run: &'a str,
    round: usize,
    time_s: f64,
    front_p99_m: f64,
}

/// Writes both files; without a row where a run observed nothing.
pub fn write(measured: &Measured, folder: &Path) -> Result<()> {
    write_csv(&folder.join("observations.csv"), &rows(measured))?;
    write_csv(&folder.join("fronts.csv"), &front_rows(measured))
}

/// All observed numbers of a run.
pub fn rows(measured: &Measured) -> Vec<ObservationRow<'_>> {
    let of_trial = |(experiment, round, trial)| numbers(measured, experiment, round, trial);
    observed(measured).flat_map(of_trial).collect()
}

/// Where the fronts of all observed runs were.
pub fn front_rows(measured: &Measured) -> Vec<FrontRow<'_>> {
    let mut rows = Vec::new();
    for (experiment, round, trial) in observed(measured) {
        let samples = trial.observation.iter().flat_map(|observation| &observation.front);
        rows.extend(samples.map(|sample| FrontRow {
            run_id: &measured.info.run_id,
            experiment_id: &experiment.id,
            observed_run: &trial.subject,
            round,
            time_s: sample.time_s,
            front_p99_m: sample.front_p99_m,
        }));
    }
    rows
}

/// The trials of all observed runs, with their experiment and round.
fn observed(measured: &Measured) -> impl Iterator<Item = (&Experiment, usize, &TrialRecord)> {
    measured.info.experiments.iter().flat_map(|experiment| {
        let trials = measured.trials(&experiment.id, Stage::Observed);
        trials.map(move |(round, trial)| (experiment, round, trial))
    })
}

fn numbers<'a>(
    measured: &'a Measured,
    experiment: &'a Experiment,
    round: usize,
    trial: &'a TrialRecord,
) -> Vec<ObservationRow<'a>> {
    let base = empty_row(measured, experiment, round, trial);
    let Some(observation) = &trial.observation else {
        return vec![base];
    };
    let base = with_observation(base, observation);
    let criteria = criteria(experiment, &trial.subject);
    let time = ObservationRow {
        quantity: "stepping_time",
        value: Some(observation.stepping_s),
        unit: "s",
        ..base.clone()
    };
    let quantities = observation.quantities.iter().map(|(&quantity, &value)| {
        let bound = criteria.iter().find(|criterion| criterion.quantity == quantity);
        ObservationRow {
            quantity: quantity.name(),
            value: Some(value),
            unit: quantity.unit(),
            at_least: bound.and_then(|bound| bound.at_least),
            at_most: bound.and_then(|bound| bound.at_most),
            ..base.clone()
        }
    });
    std::iter::once(time).chain(quantities).collect()
}

fn empty_row<'a>(
    measured: &'a Measured,
    experiment: &'a Experiment,
    round: usize,
    trial: &'a TrialRecord,
) -> ObservationRow<'a> {
    let variant = trial.variants.first().unwrap_or(&experiment.fixed);
    ObservationRow {
        schema_version: SCHEMA,
        run_id: &measured.info.run_id,
        mode: measured.info.mode.name(),
        experiment_id: &experiment.id,
        observed_run: &trial.subject,
        round,
        position: trial.position,
        threads_requested: trial.threads,
        preset: &variant.preset,
        distance_test: &variant.distance_test,
        storage: &variant.storage,
        cg_tolerance: variant.cg_tolerance,
        particles: None,
        time_step_s: None,
        steps: None,
        ended: "",
        error: "",
        quantity: "",
        value: None,
        unit: "",
        at_least: None,
        at_most: None,
        status: trial.status.name(),
        reason: &trial.reason,
        started_utc: &trial.started_utc,
        machine_id: &measured.info.machine_id,
        source_hash: &measured.info.source_hash,
        digest: "",
    }
}

fn with_observation<'a>(row: ObservationRow<'a>, observation: &'a Observation) -> ObservationRow<'a> {
    ObservationRow {
        particles: Some(observation.particles),
        time_step_s: Some(observation.time_step_s),
        steps: Some(observation.steps),
        ended: &observation.ended,
        error: &observation.error,
        digest: &observation.digest,
        ..row
    }
}

/// What the case of an observed run asks of it.
fn criteria<'a>(experiment: &'a Experiment, run: &str) -> &'a [Criterion] {
    let case = experiment.case.iter().find(|case| run.split('/').next() == Some(&case.id));
    case.map_or(&[], |case| &case.pass)
}
