//! Unnamed effects: what a step pays for effects that are compiled in and that its scene does not name.

use anyhow::Result;

use crate::base::statistics::Estimate;
use crate::engine::preset::PairTerms;
use crate::experiment::record::Stage;
use crate::report::measured::{Measured, Quantity, TimedCell, ratio};
use crate::report::section::{Content, how_measured};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show_or_none};

const ID: &str = "unnamed-effects";

/// What an unnamed effect may cost, as a share of a step.
const BAR: f64 = 0.01;

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    let mut findings = vec![how_measured(measured, ID)];
    let mut view = TableView::new(
        "Time of a step composed for every effect over that of a step that holds the named ones alone, one thread.",
        &["preset", "threads", "whole step", "outside CG", "whole step within 1 %"],
    );
    for (absent, present) in pairs(&measured.cells(ID)) {
        let over = |quantity| {
            let seconds = |cell| measured.per_step(ID, Stage::Paired, cell, quantity);
            ratio(&seconds(present), &seconds(absent))
        };
        let (total, outside_cg) = (over(Quantity::Total), over(Quantity::NonCg));
        let verdict = total.as_ref().map_or("not measured", verdict);
        findings.push(format!(
            "{}, {} thread(s): with every effect compiled in and the textbook's alone named, a step takes {} of the time of a \
             step without the others' code, {} outside CG: {verdict}.",
            present.variant.preset,
            present.threads,
            show_or_none(total, 4),
            show_or_none(outside_cg, 4),
        ));
        view.rows.push(vec![
            present.variant.preset.clone(),
            present.threads.to_string(),
            show_or_none(total, 4),
            show_or_none(outside_cg, 4),
            verdict.to_string(),
        ]);
    }
    Ok(Content { findings, tables: vec![view], ..Content::default() })
}

/// Cells that differ in this alone: whether the step has room for effects that are not named.
fn pairs(cells: &[TimedCell]) -> Vec<(&TimedCell, &TimedCell)> {
    let terms = PairTerms::Separate.to_string();
    let absent = |present: &TimedCell| present.with(|variant| variant.pair_terms.clone_from(&terms));
    let present = cells.iter().filter(|cell| cell.variant.pair_terms != terms);
    present.filter_map(|cell| Some((cells.iter().find(|other| **other == absent(cell))?, cell))).collect()
}

/// Whether a ratio excludes a cost, and a gain, of more than the bar.
fn verdict(ratio: &Estimate) -> &'static str {
    match ratio.interval {
        Some(interval) if interval.low >= 1.0 - BAR && interval.high <= 1.0 + BAR => "yes",
        Some(interval) if interval.low > 1.0 + BAR => "no, it costs more",
        Some(interval) if interval.high < 1.0 - BAR => "no, it costs less",
        _ => "not resolved",
    }
}
