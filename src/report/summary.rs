//! `summary.csv`: a row a cell, with medians and extremes of the whole step and its parts; and the phases of each cell.

use anyhow::{Context, Result};
use polars::prelude::*;
use serde::Serialize;

use crate::base::statistics::Estimate;
use crate::engine::phase::Phase;
use crate::experiment::spec::Mode;

/// The cells' medians, milliseconds a step, with the smallest and the largest round (empty where there is but one).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SummaryRow {
    pub mode: &'static str,
    pub experiment_id: String,
    pub cell_id: String,
    pub rounds: usize,
    pub total_ms_per_step: Option<f64>,
    pub total_low: Option<f64>,
    pub total_high: Option<f64>,
    pub non_cg_ms_per_step: Option<f64>,
    pub non_cg_low: Option<f64>,
    pub non_cg_high: Option<f64>,
    pub cg_ms_per_step: Option<f64>,
    pub cg_low: Option<f64>,
    pub cg_high: Option<f64>,
}

/// The estimate of each cell and phase, milliseconds a step.
#[derive(Debug, Clone, PartialEq)]
pub struct CellPhase {
    pub experiment: String,
    pub cell: String,
    pub phase: String,
    pub estimate: Estimate,
}

/// Groups the samples by cell and phase. Cells come in the order of the samples, phases in that of a step.
pub fn cell_phases(samples: &DataFrame) -> Result<Vec<CellPhase>> {
    let grouped = samples
        .clone()
        .lazy()
        .group_by_stable([col("experiment"), col("cell"), col("phase")])
        .agg([col("ms_per_step")])
        .collect()?;
    let text = |name: &str, row: usize| -> Result<String> {
        Ok(grouped.column(name)?.str()?.get(row).unwrap_or_default().to_string())
    };
    let mut phases = Vec::with_capacity(grouped.height());
    for row in 0..grouped.height() {
        let group = grouped.column("ms_per_step")?.list()?.get_as_series(row);
        let group = group.context("a group of samples is empty")?;
        let values: Vec<f64> = group.f64()?.into_no_null_iter().collect();
        phases.push(CellPhase {
            experiment: text("experiment", row)?,
            cell: text("cell", row)?,
            phase: text("phase", row)?,
            estimate: Estimate::of_times(&values).context("a group of samples is empty")?,
        });
    }
    Ok(phases)
}

/// A row a cell.
pub fn summary(phases: &[CellPhase], mode: Mode) -> Vec<SummaryRow> {
    cells(phases)
        .into_iter()
        .map(|(experiment, cell)| {
            let of = |phase: &str| find(phases, cell, phase);
            let (total, non_cg, cg) = (of("total"), of("non_cg"), of("cg"));
            let (low, high) = (
                |e: Option<Estimate>| e?.spread.map(|i| i.low),
                |e: Option<Estimate>| e?.spread.map(|i| i.high),
            );
            SummaryRow {
                mode: mode.name(),
                experiment_id: experiment.to_string(),
                cell_id: cell.to_string(),
                rounds: total.map_or(0, |e| e.samples),
                total_ms_per_step: total.map(|e| e.median),
                total_low: low(total),
                total_high: high(total),
                non_cg_ms_per_step: non_cg.map(|e| e.median),
                non_cg_low: low(non_cg),
                non_cg_high: high(non_cg),
                cg_ms_per_step: cg.map(|e| e.median),
                cg_low: low(cg),
                cg_high: high(cg),
            }
        })
        .collect()
}

/// All cells with their experiment, each once.
pub fn cells(phases: &[CellPhase]) -> Vec<(&str, &str)> {
    let mut cells: Vec<(&str, &str)> = Vec::new();
    for phase in phases {
        if !cells.iter().any(|(_, cell)| *cell == phase.cell) {
            cells.push((&phase.experiment, &phase.cell));
        }
    }
    cells
}

/// The estimate of one phase of a cell.
pub fn find(phases: &[CellPhase], cell: &str, phase: &str) -> Option<Estimate> {
    phases.iter().find(|p| p.cell == cell && p.phase == phase).map(|p| p.estimate)
}

/// The names of all phases, in the order of a step.
pub fn phase_names() -> impl Iterator<Item = &'static str> {
    Phase::ALL.into_iter().map(Phase::name)
}
