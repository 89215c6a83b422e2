//! Shared walks: what a step pays for effects that are compiled in and not named, and for one that shares a walk.

use anyhow::Result;

use crate::base::statistics::Estimate;
use crate::engine::preset::{PairTerms, Preset};
use crate::experiment::record::{Stage, Variant};
use crate::report::measured::{ByRound, Measured, Quantity, TimedCell, by_round, ratio};
use crate::report::section::{Content, how_measured};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show_or_none};

const ID: &str = "unnamed-effects";

/// The scheme that names a second effect.
const WITH_HEAT: &str = "with-heat";

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
             step without the others' code, {} outside CG; within 1 % either way: {verdict}.",
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
    findings.extend(second_effect(measured));
    findings.extend(beside_viscosity_in_fast(measured));
    Ok(Content { findings, tables: vec![view], ..Content::default() })
}

/// Cells that differ in this alone: whether the step has room for effects that are not named.
fn pairs(cells: &[TimedCell]) -> Vec<(&TimedCell, &TimedCell)> {
    let terms = PairTerms::Separate.to_string();
    let absent = |present: &TimedCell| present.with(|variant| variant.pair_terms.clone_from(&terms));
    let joined = PairTerms::Joined.to_string();
    let present = cells.iter().filter(|cell| cell.variant.pair_terms == joined);
    present.filter_map(|cell| Some((cells.iter().find(|other| **other == absent(cell))?, cell))).collect()
}

/// Seconds a step with and without heat, by round, of the variant that `of` chooses.
fn with_and_without(measured: &Measured, of: impl Fn(&Variant) -> bool) -> Option<(ByRound, ByRound)> {
    let cells = measured.cells(ID);
    let seconds = |with_heat: bool| {
        let cell = cells.iter().find(|cell| {
            let heat = cell.variant.scheme == WITH_HEAT;
            heat == with_heat && !cell.variant.scheme.is_empty() && of(&cell.variant)
        })?;
        Some(measured.per_step(ID, Stage::Paired, cell, Quantity::Total))
    };
    Some((seconds(true)?, seconds(false)?))
}

/// What a second effect costs in the walk of another, over what it costs in one of its own.
fn second_effect(measured: &Measured) -> Option<String> {
    let cost = |terms: PairTerms| {
        let of = |v: &Variant| v.preset != Preset::FAST.name() && v.pair_terms == terms.to_string();
        let (with, without) = with_and_without(measured, of)?;
        Some(by_round(&with, &without, |with, without| 1e3 * (with - without)))
    };
    let (own, shared) = (cost(PairTerms::Separate)?, cost(PairTerms::Shared)?);
    let shares: Vec<f64> = shared.iter().zip(&own).map(|(shared, own)| shared / own).collect();
    Some(format!(
        "Heat beside viscosity: {} ms a step in a walk of its own, {} ms in the walk that both share: {} of it.",
        show_or_none(Estimate::of_rounds(&own), 2),
        show_or_none(Estimate::of_rounds(&shared), 2),
        show_or_none(Estimate::of_rounds(&shares), 3),
    ))
}

/// The same in clusters, over a whole step.
fn beside_viscosity_in_fast(measured: &Measured) -> Option<String> {
    let (with, without) = with_and_without(measured, |v| v.preset == Preset::FAST.name())?;
    let over = show_or_none(ratio(&with, &without), 4);
    Some(format!("Heat beside viscosity in `fast`: a step takes {over} of the time of one without heat."))
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
