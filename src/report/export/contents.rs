//! What is exported of a run: its tables, from the same rows as the run folder's own files.

use std::path::Path;

use anyhow::Result;
use serde::Serialize;

use crate::experiment::run::RunInfo;
use crate::report::claim::judge_all;
use crate::report::export::dictionary;
use crate::report::export::figure4::figure4_rows;
use crate::report::export::sheet::Sheet;
use crate::report::export::value::Value;
use crate::report::measured::Measured;
use crate::report::summary::{cell_phases, summary};
use crate::report::table::table2_rows;
use crate::report::{effort, observations, page, peaks, samples, twin, validation};

/// Every table of [`dictionary::TABLES`] of the run in `folder`, in that order; one without a row is a header alone.
pub fn sheets(measured: &Measured, folder: &Path) -> Result<Vec<Sheet>> {
    let samples = samples::rows(measured);
    let phases = cell_phases(&samples::frame(&samples)?)?;
    let judged = judge_all(measured);
    let efforts = effort::of(measured, folder)?;
    Ok(vec![
        Sheet::of(&dictionary::CLAIMS, &page::claim_rows(measured, &judged))?,
        Sheet::of(&dictionary::TABLE2, &table2_rows(measured))?,
        Sheet::of(&dictionary::FIGURE4, &figure4_rows(measured))?,
        Sheet::of(&dictionary::SUMMARY, &summary(&phases, measured.info.mode))?,
        Sheet::of(&dictionary::SAMPLES, &samples)?,
        Sheet::of(&dictionary::STEPS, &samples::step_rows(measured))?,
        Sheet::of(&dictionary::OBSERVATIONS, &observations::rows(measured))?,
        Sheet::of(&dictionary::FRONTS, &observations::front_rows(measured))?,
        Sheet::of(&dictionary::TWIN, &twin::rows(measured))?,
        Sheet::of(&dictionary::VALIDATION, &validation::rows(measured))?,
        Sheet::of(&dictionary::PEAKS, &peaks::rows(measured))?,
        Sheet::of(&dictionary::EFFORT, &effort::rows(measured, &efforts, &judged))?,
        Sheet::of(&dictionary::EXPERIMENTS, &experiment_rows(&measured.info))?,
        machine(measured),
        run(&measured.info),
        dictionary::sheet(),
    ])
}

/// A row of `experiments`.
#[derive(Debug, Serialize)]
struct ExperimentRow<'a> {
    experiment_id: &'a str,
    title: &'a str,
    question: &'a str,
    analysis: &'a str,
    seed: u64,
    pin: &'a str,
}

fn experiment_rows(info: &RunInfo) -> Vec<ExperimentRow<'_>> {
    info.experiments
        .iter()
        .map(|experiment| ExperimentRow {
            experiment_id: &experiment.id,
            title: &experiment.title,
            question: &experiment.question,
            analysis: experiment.analysis.trim(),
            seed: experiment.seed,
            pin: &experiment.pin,
        })
        .collect()
}

fn machine(measured: &Measured) -> Sheet {
    let facts = measured.machine.facts.iter().map(|fact| {
        let (value, unit) = (fact.value.to_string(), fact.unit.as_str());
        vec![
            Value::text(&fact.group),
            Value::text(&fact.key),
            Value::quantity(&value, unit),
            Value::text(unit),
        ]
    });
    Sheet { table: &dictionary::MACHINE, rows: facts.collect() }
}

fn run(info: &RunInfo) -> Sheet {
    let whole = |number: usize| i64::try_from(number).map_or(Value::Missing, Value::Integer);
    let finished = info.finished_utc.as_deref().unwrap_or_default();
    let properties = [
        ("run_id", Value::text(&info.run_id), "The name of the run's folder when it was made."),
        ("mode", Value::text(info.mode.name()), "How long the run might take; quick is not for citation."),
        ("command", Value::text(&info.command), "The command, without paths."),
        ("commit", Value::text(&info.commit), "The commit of the program."),
        ("source_hash", Value::text(&info.source_hash), "Hash of the measured sources."),
        (
            "plan_id",
            Value::text(&info.plan_id),
            "Hash of all that was to be measured, the build and the machine.",
        ),
        ("machine_alias", Value::text(&info.machine_alias), "The machine's short name."),
        (
            "machine_id",
            Value::text(&info.machine_id),
            "Stays the same as long as the machine's hardware does.",
        ),
        ("usable_threads", whole(info.usable_threads), "Hardware threads that the run might use."),
        ("usable_cores", whole(info.usable_cores), "Physical cores among them."),
        ("created_utc", Value::time(&info.created_utc), "When the run was started, UTC."),
        (
            "finished_utc",
            Value::time(finished),
            "When it was finished, UTC; missing while rounds are missing.",
        ),
        (
            "schema_version",
            Value::Integer(info.schema_version.into()),
            "The version of the run folder's files.",
        ),
    ];
    let row = |(key, value, description): (&str, Value, &str)| {
        vec![Value::text(key), value, Value::text(description)]
    };
    Sheet { table: &dictionary::RUN, rows: properties.into_iter().map(row).collect() }
}
