//! The rows behind Figure 4: time of a step and speed-up against threads.

use serde::Serialize;

use crate::base::statistics::Estimate;
use crate::engine::preset::Preset;
use crate::report::measured::{Cell, Measured, Quantity, ratio, times};
use crate::report::published::Published;

/// The distance test of Figure 4.
const DISTANCE_TEST: &str = "sqrt";

/// One preset on one number of threads, or what the paper prints of its own.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Figure4Row {
    pub source: String,
    pub mode: &'static str,
    pub particles: Option<usize>,
    pub preset: &'static str,
    pub distance_test: &'static str,
    pub threads: usize,
    pub rounds: Option<usize>,
    pub total_ms_per_step: Option<f64>,
    pub total_low: Option<f64>,
    pub total_high: Option<f64>,
    pub non_cg_ms_per_step: Option<f64>,
    pub non_cg_low: Option<f64>,
    pub non_cg_high: Option<f64>,
    pub total_speed_up: Option<f64>,
    pub total_speed_up_low: Option<f64>,
    pub total_speed_up_high: Option<f64>,
    pub non_cg_speed_up: Option<f64>,
    pub non_cg_speed_up_low: Option<f64>,
    pub non_cg_speed_up_high: Option<f64>,
}

/// Median and ends of the interval.
type Cells = (Option<f64>, Option<f64>, Option<f64>);

/// The paper's row, then each preset's by threads. Thread counts without a successful round have no row.
pub fn figure4_rows(measured: &Measured) -> Vec<Figure4Row> {
    let mut rows = vec![published_row(&Published::load())];
    for preset in [Preset::PAPER_LINKED_LIST, Preset::PAPER_AOS_RELOCATION] {
        let threads = measured.threads("figure4").into_iter();
        rows.extend(threads.filter_map(|threads| measured_row(measured, preset, threads)));
    }
    rows
}

fn published_row(published: &Published) -> Figure4Row {
    Figure4Row {
        source: "paper".to_string(),
        mode: "published",
        particles: Some(published.particles),
        preset: Preset::PAPER_AOS_RELOCATION.name(),
        distance_test: DISTANCE_TEST,
        threads: published.figure4.threads,
        total_speed_up: Some(published.figure4.total_speed_up),
        non_cg_speed_up: Some(published.figure4.non_cg_speed_up),
        ..Figure4Row::default()
    }
}

fn measured_row(measured: &Measured, preset: Preset, threads: usize) -> Option<Figure4Row> {
    let stage = measured.stage_for_tables("figure4");
    let seconds = |threads: usize, quantity: Quantity| {
        let cell = Cell::new(preset.name(), DISTANCE_TEST, threads);
        measured.per_step("figure4", stage, &cell, quantity)
    };
    let milliseconds =
        |quantity| times(&seconds(threads, quantity)).map(|estimate: Estimate| estimate.scaled(1e3));
    let speed_up = |quantity| ratio(&seconds(1, quantity), &seconds(threads, quantity));
    let total = milliseconds(Quantity::Total)?;
    let (total_ms_per_step, total_low, total_high) = cells(Some(total));
    let (non_cg_ms_per_step, non_cg_low, non_cg_high) = cells(milliseconds(Quantity::NonCg));
    let (total_speed_up, total_speed_up_low, total_speed_up_high) = cells(speed_up(Quantity::Total));
    let (non_cg_speed_up, non_cg_speed_up_low, non_cg_speed_up_high) = cells(speed_up(Quantity::NonCg));
    Some(Figure4Row {
        source: measured.info.machine_alias.clone(),
        mode: measured.info.mode.name(),
        particles: measured.particles("figure4"),
        preset: preset.name(),
        distance_test: DISTANCE_TEST,
        threads,
        rounds: Some(total.samples),
        total_ms_per_step,
        total_low,
        total_high,
        non_cg_ms_per_step,
        non_cg_low,
        non_cg_high,
        total_speed_up,
        total_speed_up_low,
        total_speed_up_high,
        non_cg_speed_up,
        non_cg_speed_up_low,
        non_cg_speed_up_high,
    })
}

fn cells(estimate: Option<Estimate>) -> Cells {
    let interval = estimate.and_then(|estimate| estimate.bounds());
    (estimate.map(|estimate| estimate.median), interval.map(|i| i.low), interval.map(|i| i.high))
}
