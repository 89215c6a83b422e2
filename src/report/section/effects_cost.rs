//! Effects: the time, the memory and the answer with and without each of them.

use anyhow::Result;

use crate::base::statistics::Estimate;
use crate::experiment::observed::Scheme;
use crate::experiment::quantity::Quantity as Observed;
use crate::experiment::record::{Observation, Stage};
use crate::report::chart::{Figure, Line, Mark, MarkAt, Marker, Panel, Scale, Series, XyPanel};
use crate::report::measured::{ByRound, Measured, Quantity, TimedCell, by_round, ratio};
use crate::report::section::{Content, automatic, capital, categories, how_measured, point};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show};

const ID: &str = "effects-cost";

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    let changes = changes(measured);
    let mut findings = vec![how_measured(measured, ID)];
    findings.extend(changes.iter().map(Change::in_words));
    findings.extend(equal_answers(&changes));
    Ok(Content {
        findings,
        figures: vec![("effects-cost".to_string(), figure(measured, &changes))],
        tables: vec![table(&changes)],
        ..Content::default()
    })
}

/// The scene with one change, beside the scene as it is.
struct Change {
    id: String,
    title: String,
    /// Seconds a step with the change, by round.
    per_step: ByRound,
    /// Milliseconds a step that the change saves; negative where it costs.
    saved_ms: Estimate,
    /// Time with the change over time without.
    time_ratio: Estimate,
    /// Bytes of columns a particle that the change saves: what the effect declares.
    saved_columns: Option<f64>,
    /// The same at the end of the run from the start, the matrix included.
    saved_bytes: Option<f64>,
    phases_gone: Vec<String>,
    phases_new: Vec<String>,
    front_m: Option<f64>,
    front_change_m: Option<f64>,
    /// What was seen of the run from the start; `None` where its process failed.
    seen: Option<Observation>,
}

fn changes(measured: &Measured) -> Vec<Change> {
    let schemes = measured.experiment(ID).map(|e| e.scheme.as_slice()).unwrap_or_default();
    let cells = measured.cells(ID);
    let Some(base) = cells.iter().find(|cell| cell.variant.scene_changes.is_empty()) else {
        return Vec::new();
    };
    schemes.iter().filter_map(|scheme| change(measured, &cells, base, scheme)).collect()
}

fn change(measured: &Measured, cells: &[TimedCell], base: &TimedCell, scheme: &Scheme) -> Option<Change> {
    let cell = cells.iter().filter(|cell| *cell != base).find(|cell| cell.variant.scheme == scheme.id)?;
    let per_step = |cell: &TimedCell| measured.per_step(ID, Stage::Paired, cell, Quantity::Total);
    let saved_ms = by_round(&per_step(base), &per_step(cell), |base, changed| 1e3 * (base - changed));
    let (before, after) = (phases(measured, base), phases(measured, cell));
    let missing_in = |a: &[String], b: &[String]| a.iter().filter(|p| !b.contains(p)).cloned().collect();
    let case = measured.experiment(ID)?.case.first()?;
    let seen = |id: &str| measured.observations(ID, &format!("{}/{id}", case.id)).into_iter().next();
    let both = |quantity: Observed| {
        let of = |o: &Observation| o.quantities.get(&quantity).copied();
        seen(&base.variant.scheme).and_then(of).zip(seen(&scheme.id).and_then(of))
    };
    let saved = |quantity| both(quantity).map(|(as_is, changed)| as_is - changed);
    let front = both(Observed::FrontP99);
    Some(Change {
        id: scheme.id.clone(),
        title: scheme.title.clone(),
        per_step: per_step(cell),
        saved_ms: Estimate::of_rounds(&saved_ms)?,
        time_ratio: ratio(&per_step(cell), &per_step(base))?,
        saved_columns: saved(Observed::ColumnBytes),
        saved_bytes: saved(Observed::BytesPerParticle),
        phases_gone: missing_in(&before, &after),
        phases_new: missing_in(&after, &before),
        front_m: front.map(|(_, changed)| changed),
        front_change_m: front.map(|(as_is, changed)| changed - as_is),
        seen: seen(&scheme.id).cloned(),
    })
}

/// The phases that took place.
fn phases(measured: &Measured, cell: &TimedCell) -> Vec<String> {
    let windows = measured.windows(ID, Stage::Paired, cell);
    let samples = windows.values().next().into_iter().flat_map(|w| w.iter()).flat_map(|w| &w.phases);
    let mut names: Vec<String> = Vec::new();
    for sample in samples {
        if !names.contains(&sample.phase) {
            names.push(sample.phase.clone());
        }
    }
    names
}

impl Change {
    fn in_words(&self) -> String {
        let phases = |verb: &str, names: &[String]| match names {
            [] => String::new(),
            names => format!("; {verb}: {}", names.join(", ")),
        };
        format!(
            "{}: {} ms a step saved ({} of the time as named), {} bytes of columns a particle saved{}{}.",
            capital(&self.title),
            show(&self.saved_ms, 2),
            show(&self.time_ratio, 3),
            bytes(self.saved_columns),
            phases("phases gone", &self.phases_gone),
            phases("phases new", &self.phases_new)
        )
    }
}

/// Bytes a particle, with a digit behind the point where they are no whole number.
fn bytes(value: Option<f64>) -> String {
    match value {
        Some(value) if (value - value.round()).abs() < 1e-6 => format!("{value:.0}"),
        Some(value) => format!("{value:.1}"),
        None => "unknown".to_string(),
    }
}

/// Whether leaving an effect out and setting it to zero give one answer.
fn equal_answers(changes: &[Change]) -> Vec<String> {
    let find = |id: &str| changes.iter().find(|change| change.id == id);
    let pair = |effect: &str| {
        let (without, zero) = (find(&format!("no-{effect}"))?, find(&format!("zero-{effect}"))?);
        let difference = match largest_difference(without.seen.as_ref()?, zero.seen.as_ref()?) {
            0.0 => "every number observed of the run is the same to the last bit".to_string(),
            most => format!("no number observed of the run differs by more than {most:.1e} of itself"),
        };
        let saved = by_round(&zero.per_step, &without.per_step, |zero, without| 1e3 * (zero - without));
        Some(format!(
            "Without {effect} and with {effect} zero, {difference}; leaving it out saves {} ms a step more than \
             setting it to zero.",
            show(&Estimate::of_rounds(&saved)?, 2)
        ))
    };
    ["viscosity", "collision"].into_iter().filter_map(pair).collect()
}

/// What is of a run's memory, not of its answer.
const MEMORY: [Observed; 2] = [Observed::ColumnBytes, Observed::BytesPerParticle];

/// The largest relative difference between two runs in any observed number of their answer.
fn largest_difference(a: &Observation, b: &Observation) -> f64 {
    let numbers = a.quantities.iter().filter(|(quantity, _)| !MEMORY.contains(quantity));
    let differences = numbers.map(|(quantity, a)| match b.quantities.get(quantity) {
        Some(b) if a == b => 0.0,
        Some(b) => (a - b).abs() / a.abs().max(b.abs()),
        None => f64::INFINITY,
    });
    let fronts = a.front.iter().zip(&b.front).map(|(a, b)| (a.front_p99_m / b.front_p99_m - 1.0).abs());
    differences.chain(fronts).fold(0.0, f64::max)
}

fn figure(measured: &Measured, changes: &[Change]) -> Figure {
    let panel = |title: &str, shown: Vec<&Change>| {
        let names: Vec<String> = shown.iter().map(|change| change.id.clone()).collect();
        let points = shown.iter().enumerate().map(|(k, change)| point(k as f64, change.time_ratio)).collect();
        Panel::Xy(XyPanel {
            title: title.to_string(),
            x: categories("", &names),
            y: automatic("time with the change / as named", Scale::Linear),
            series: vec![Series {
                label: "steps from early to late states".to_string(),
                color: 5,
                line: Line::None,
                marker: Marker::Circle,
                points,
            }],
            marks: vec![Mark { label: String::new(), at: MarkAt::Y(1.0), color: 0 }],
            bands: Vec::new(),
        })
    };
    let small = changes.iter().filter(|change| change.time_ratio.median > 0.5).collect();
    Figure {
        title: "What each effect costs".to_string(),
        description: "Time of a step with one change to the scene's effects over the time of a step as the scene names \
                      them, with 95 % intervals: below one the change saves time, above it costs. Right: the same \
                      without changes that halve the time."
            .to_string(),
        panels: vec![panel("all changes", changes.iter().collect()), panel("the small ones", small)],
        note: measured.stamp(),
    }
}

fn table(changes: &[Change]) -> TableView {
    let mut view = TableView::new(
        "One change at a time: time and memory of a step, and the front (99th percentile of x) of a run to 0.3 s.",
        &[
            "change",
            "saved, ms a step",
            "time / as named",
            "columns saved, B a particle",
            "with the matrix, B a particle",
            "front, m",
            "front's change, m",
            "run",
        ],
    );
    for change in changes {
        let metres = |value: Option<f64>| value.map_or("none".to_string(), |m| format!("{m:.6}"));
        view.rows.push(vec![
            change.title.clone(),
            show(&change.saved_ms, 2),
            show(&change.time_ratio, 3),
            bytes(change.saved_columns),
            bytes(change.saved_bytes),
            metres(change.front_m),
            change.front_change_m.map_or("none".to_string(), |m| format!("{m:+.2e}")),
            change.seen.as_ref().map_or("failed".to_string(), |seen| seen.ended.clone()),
        ]);
    }
    view
}
