//! `samples.csv` and `steps.csv`: every sample, one observation a row, ready for a spreadsheet.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result};
use polars::prelude::{DataFrame, df};
use serde::Serialize;

use crate::base::files::write_whole;
use crate::base::statistics::outliers;
use crate::experiment::record::{Outcome, RoundRecord, SCHEMA, Stage, Status, TrialRecord, WindowSample};
use crate::experiment::selection::CellSettings;
use crate::experiment::spec::{Experiment, LeftOut};
use crate::report::measured::{Measured, TimedCell};

/// The time of one phase of one variant in one round. The phases `total` and `non_cg` (total minus `cg`) are the steps'
/// wall time; the others are those of the engine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SampleRow {
    pub schema_version: u32,
    pub run_id: String,
    pub mode: &'static str,
    pub experiment_id: String,
    pub stage: &'static str,
    pub cell_id: String,
    pub round: usize,
    pub position: usize,
    /// The group of cells; empty where an experiment has but one.
    pub subject: String,
    pub preset: String,
    pub distance_test: String,
    pub buckets_per_radius: usize,
    pub memory_order: String,
    pub storage: String,
    pub schedule: String,
    pub chunk: Option<usize>,
    pub cg: String,
    pub cg_tolerance: f64,
    pub preconditioner: String,
    pub matrix_values: String,
    pub pair_terms: String,
    pub scheme: String,
    pub threads_requested: usize,
    pub threads_observed: Option<usize>,
    pub particles: Option<usize>,
    pub bytes_per_particle: Option<f64>,
    pub steps: Option<usize>,
    pub warmup_steps: Option<usize>,
    pub phase: String,
    pub calls: Option<u64>,
    pub time_s: Option<f64>,
    /// Whether the time stands apart from the other rounds of its cell and phase; it counts all the same.
    pub outlier: Option<bool>,
    pub status: &'static str,
    pub reason: String,
    pub started_utc: String,
    pub machine_id: String,
    pub source_hash: String,
    pub cpu_pressure_avg10_before: Option<f64>,
    pub cpu_pressure_avg10_after: Option<f64>,
    pub involuntary_switches: Option<u64>,
    pub steal_ticks: Option<u64>,
    pub freq_mhz_before: Option<f64>,
    pub freq_mhz_after: Option<f64>,
    /// The state after the last step.
    pub digest: String,
}

/// One measured step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepRow<'a> {
    run_id: &'a str,
    mode: &'static str,
    experiment_id: &'a str,
    cell_id: String,
    round: usize,
    window_start_step: usize,
    step: usize,
    total_s: f64,
    cg_s: f64,
    non_cg_s: f64,
    cg_iterations: usize,
    cg_residual: f64,
    unknowns: usize,
    matrix_entries: Option<usize>,
    ghosts: usize,
}

/// The name of a cell in every file.
pub fn cell_id(experiment: &str, stage: Stage, cell: &TimedCell) -> String {
    let group = if cell.subject.is_empty() { String::new() } else { format!("{}/", cell.subject) };
    format!("{experiment}/{}/{group}{}/t{}", stage.name(), cell.variant.label(), cell.threads)
}

/// All sample rows of a run, in the order of its rounds; then the cells that nobody tried.
pub fn rows(measured: &Measured) -> Vec<SampleRow> {
    let mut rows = Vec::new();
    let timed = |stage| matches!(stage, Stage::Whole | Stage::Paired);
    for round in measured.rounds.iter().filter(|round| timed(round.stage)) {
        for trial in &round.trials {
            for place in 0..trial.variants.len() {
                rows.extend(variant_rows(measured, round, trial, place));
            }
        }
    }
    for experiment in &measured.info.experiments {
        rows.extend(untried(measured, experiment));
    }
    flag_outliers(&mut rows);
    rows
}

/// Flags the times that stand apart from the other rounds of their cell and phase.
fn flag_outliers(rows: &mut [SampleRow]) {
    let mut alike: BTreeMap<(String, String), Vec<usize>> = BTreeMap::new();
    for (place, row) in rows.iter().enumerate().filter(|(_, row)| row.time_s.is_some()) {
        alike.entry((row.cell_id.clone(), row.phase.clone())).or_default().push(place);
    }
    for places in alike.into_values() {
        let times: Vec<f64> = places.iter().filter_map(|&place| rows[place].time_s).collect();
        let apart = outliers(&times);
        for (k, place) in places.into_iter().enumerate() {
            rows[place].outlier = Some(apart.contains(&k));
        }
    }
}

/// The cells that nobody tried: those that need more hardware threads than may be used, that the experiment excludes or
/// that the command did not ask for.
fn untried(measured: &Measured, experiment: &Experiment) -> Vec<SampleRow> {
    let usable = measured.info.usable();
    let mut rows = Vec::new();
    for group in experiment.groups(measured.info.mode) {
        for threads in group.thread_counts(usable) {
            for variant in experiment.variants(group) {
                let cell = CellSettings { group: &group.name, threads, variant: &variant };
                let (status, reason) = match experiment.left_out(cell) {
                    Some(LeftOut::Excluded(reason)) => (Status::NotApplicable, reason),
                    Some(LeftOut::Skipped(reason)) => (Status::Skipped, reason),
                    None if threads > usable.threads => {
                        let there = usable.threads;
                        let reason = format!("needs {threads} hardware threads, {there} may be used here");
                        (Status::NotApplicable, reason)
                    }
                    None => continue,
                };
                let cell = TimedCell { subject: group.name.clone(), threads, variant };
                rows.push(SampleRow {
                    phase: "total".to_string(),
                    status: status.name(),
                    reason,
                    ..empty_row(measured, &experiment.id, Stage::Paired, &cell)
                });
            }
        }
    }
    rows
}

fn empty_row(measured: &Measured, experiment: &str, stage: Stage, cell: &TimedCell) -> SampleRow {
    let variant = &cell.variant;
    SampleRow {
        schema_version: SCHEMA,
        run_id: measured.info.run_id.clone(),
        mode: measured.info.mode.name(),
        experiment_id: experiment.to_string(),
        stage: stage.name(),
        cell_id: cell_id(experiment, stage, cell),
        round: 0,
        position: 0,
        subject: cell.subject.clone(),
        preset: variant.preset.clone(),
        distance_test: variant.distance_test.clone(),
        buckets_per_radius: variant.buckets_per_radius,
        memory_order: variant.memory_order.clone(),
        storage: variant.storage.clone(),
        chunk: variant.schedule.split_once(':').and_then(|(_, chunk)| chunk.parse().ok()),
        schedule: variant.schedule.clone(),
        cg: variant.cg.clone(),
        cg_tolerance: variant.cg_tolerance,
        preconditioner: variant.preconditioner.clone(),
        matrix_values: variant.matrix_values.clone(),
        pair_terms: variant.pair_terms.clone(),
        scheme: variant.scheme.clone(),
        threads_requested: cell.threads,
        threads_observed: None,
        particles: None,
        bytes_per_particle: None,
        steps: None,
        warmup_steps: None,
        phase: String::new(),
        calls: None,
        time_s: None,
        outlier: None,
        status: "",
        reason: String::new(),
        started_utc: String::new(),
        machine_id: measured.info.machine_id.clone(),
        source_hash: measured.info.source_hash.clone(),
        cpu_pressure_avg10_before: None,
        cpu_pressure_avg10_after: None,
        involuntary_switches: None,
        steal_ticks: None,
        freq_mhz_before: None,
        freq_mhz_after: None,
        digest: String::new(),
    }
}

/// The rows of one variant of a trial: one a phase, or a single one that says why there are none.
fn variant_rows(
    measured: &Measured,
    round: &RoundRecord,
    trial: &TrialRecord,
    place: usize,
) -> Vec<SampleRow> {
    let (subject, variant) = (trial.subject.clone(), trial.variants[place].clone());
    let cell = TimedCell { subject, threads: trial.threads, variant };
    let base = SampleRow {
        round: round.round,
        position: trial.position,
        status: trial.status.name(),
        reason: trial.reason.clone(),
        started_utc: trial.started_utc.clone(),
        ..empty_row(measured, &round.experiment, round.stage, &cell)
    };
    let Some(outcome) = trial.outcome.as_ref().filter(|_| trial.status == Status::Ok) else {
        return vec![SampleRow { phase: "total".to_string(), ..base }];
    };
    let windows = &outcome.samples[place];
    let base = with_outcome(base, outcome, windows, place);
    let sum = |value: fn(&crate::experiment::record::StepSample) -> f64| -> f64 {
        windows.iter().flat_map(|w| &w.steps).map(value).sum()
    };
    let (total, cg) = (sum(|s| s.total_s), sum(|s| s.cg_s));
    let steps = base.steps.map(|steps| steps as u64);
    let row = |phase: &str, calls: Option<u64>, time_s: f64| SampleRow {
        phase: phase.to_string(),
        calls,
        time_s: Some(time_s),
        ..base.clone()
    };
    let mut rows = vec![row("total", steps, total), row("non_cg", steps, total - cg)];
    rows.extend(phases(windows).into_iter().map(|(name, calls, time_s)| row(&name, Some(calls), time_s)));
    rows
}

fn with_outcome(row: SampleRow, outcome: &Outcome, windows: &[WindowSample], place: usize) -> SampleRow {
    let (before, after) = (&outcome.noise_before, &outcome.noise_after);
    let difference = |a: Option<u64>, b: Option<u64>| Some(b?.saturating_sub(a?));
    SampleRow {
        threads_observed: Some(outcome.threads_observed),
        particles: Some(outcome.particles),
        bytes_per_particle: outcome.bytes.get(place).map(|&b| b as f64 / outcome.particles as f64),
        steps: Some(windows.iter().map(|w| w.steps.len()).sum()),
        warmup_steps: Some(windows.iter().map(|w| w.window.warmup_steps).sum()),
        cpu_pressure_avg10_before: before.cpu_pressure_avg10,
        cpu_pressure_avg10_after: after.cpu_pressure_avg10,
        involuntary_switches: difference(before.involuntary_switches, after.involuntary_switches),
        steal_ticks: difference(before.steal_ticks, after.steal_ticks),
        freq_mhz_before: before.frequency_mhz,
        freq_mhz_after: after.frequency_mhz,
        digest: windows.last().map_or_else(String::new, |w| w.digest.clone()),
        ..row
    }
}

/// Calls and seconds of each phase over all windows, in the order of a step.
fn phases(windows: &[WindowSample]) -> Vec<(String, u64, f64)> {
    let mut phases: Vec<(String, u64, f64)> = Vec::new();
    for sample in windows.iter().flat_map(|w| &w.phases) {
        match phases.iter_mut().find(|(name, ..)| *name == sample.phase) {
            Some((_, calls, time_s)) => {
                *calls += sample.calls;
                *time_s += sample.time_s;
            }
            None => phases.push((sample.phase.clone(), sample.calls, sample.time_s)),
        }
    }
    phases
}

/// Writes both files.
pub fn write(measured: &Measured, rows: &[SampleRow], folder: &Path) -> Result<()> {
    write_csv(&folder.join("samples.csv"), rows)?;
    write_csv(&folder.join("steps.csv"), &step_rows(measured))
}

/// A row a measured step of every successful trial.
pub fn step_rows(measured: &Measured) -> Vec<StepRow<'_>> {
    let mut steps = Vec::new();
    for round in measured.rounds.iter().filter(|round| round.stage != Stage::States) {
        for trial in &round.trials {
            let Some(outcome) = trial.outcome.as_ref().filter(|_| trial.status == Status::Ok) else {
                continue;
            };
            for (variant, windows) in trial.variants.iter().zip(&outcome.samples) {
                let (subject, variant) = (trial.subject.clone(), variant.clone());
                let cell = cell_id(
                    &round.experiment,
                    round.stage,
                    &TimedCell { subject, threads: trial.threads, variant },
                );
                for window in windows {
                    steps.extend(window.steps.iter().map(|step| StepRow {
                        run_id: &measured.info.run_id,
                        mode: measured.info.mode.name(),
                        experiment_id: &round.experiment,
                        cell_id: cell.clone(),
                        round: round.round,
                        window_start_step: window.window.start_step,
                        step: step.step,
                        total_s: step.total_s,
                        cg_s: step.cg_s,
                        non_cg_s: step.total_s - step.cg_s,
                        cg_iterations: step.cg_iterations,
                        cg_residual: step.cg_residual,
                        unknowns: step.unknowns,
                        matrix_entries: step.matrix_entries,
                        ghosts: step.ghosts,
                    }));
                }
            }
        }
    }
    steps
}

/// Writes rows with a header, whole or not at all; nothing where there are no rows, whose header nobody knows.
pub fn write_csv<R: Serialize>(path: &Path, rows: &[R]) -> Result<()> {
    if rows.is_empty() {
        return Ok(());
    }
    write_whole(path, &csv_bytes(rows)?).with_context(|| format!("cannot write {}", path.display()))
}

/// Rows with a header, as a CSV file holds them.
pub fn csv_bytes<R: Serialize>(rows: &[R]) -> Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    Ok(writer.into_inner()?)
}

/// The successful rows as a data frame: a row a cell, round and phase, with its milliseconds a step.
pub fn frame(rows: &[SampleRow]) -> Result<DataFrame> {
    let ok: Vec<(&SampleRow, f64)> =
        rows.iter().filter_map(|row| Some((row, 1e3 * row.time_s? / row.steps? as f64))).collect();
    let text =
        |value: fn(&SampleRow) -> &str| -> Vec<&str> { ok.iter().map(|(row, _)| value(row)).collect() };
    Ok(df![
        "experiment" => text(|row| &row.experiment_id),
        "stage" => text(|row| row.stage),
        "cell" => text(|row| &row.cell_id),
        "preset" => text(|row| &row.preset),
        "distance_test" => text(|row| &row.distance_test),
        "threads" => ok.iter().map(|(row, _)| row.threads_requested as u32).collect::<Vec<_>>(),
        "phase" => text(|row| &row.phase),
        "round" => ok.iter().map(|(row, _)| row.round as u32).collect::<Vec<_>>(),
        "ms_per_step" => ok.iter().map(|(_, ms)| *ms).collect::<Vec<_>>(),
    ]?)
}
