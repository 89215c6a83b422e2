//! Tables: the paper's Table 2 beside ours, and plain tables for pages.

use serde::Serialize;

use crate::base::statistics::Estimate;
use crate::engine::preset::Preset;
use crate::report::measured::{ByRound, Cell, Measured, Quantity, estimate, ratio};
use crate::report::published::{Published, Seconds};
use crate::report::summary::{CellPhase, cells, find, phase_names};

/// A table as pages show it: cells are finished text.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct TableView {
    pub caption: String,
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl TableView {
    pub fn new(caption: &str, header: &[&str]) -> Self {
        TableView {
            caption: caption.to_string(),
            header: header.iter().map(|h| h.to_string()).collect(),
            rows: Vec::new(),
        }
    }

    /// The same for a repository's pages. Bars inside a cell are escaped.
    pub fn to_markdown(&self) -> String {
        let line = |cells: &[String]| -> String {
            let escaped: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
            format!("| {} |\n", escaped.join(" | "))
        };
        let mut text = line(&self.header);
        text.push_str(&format!("|{}\n", "---|".repeat(self.header.len())));
        for row in &self.rows {
            text.push_str(&line(row));
        }
        text
    }
}

/// A row of `tables/table2.csv`: seconds of a whole run, or a speed-up.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table2Row {
    pub source: String,
    /// `published`, or the mode of the run.
    pub mode: &'static str,
    pub particles: Option<usize>,
    pub distance_test: String,
    pub row: String,
    pub quantity: &'static str,
    pub unit: &'static str,
    pub value: f64,
    pub low: Option<f64>,
    pub high: Option<f64>,
    pub rounds: Option<usize>,
}

const QUANTITIES: [(&str, Quantity); 3] = [
    ("cg", Quantity::Cg),
    ("non_cg", Quantity::NonCg),
    ("total", Quantity::Total),
];

/// Median and interval, with as many digits as the value needs.
pub fn show(estimate: &Estimate, digits: usize) -> String {
    match estimate.interval {
        Some(i) => format!(
            "{:.digits$} [{:.digits$}, {:.digits$}]",
            estimate.median, i.low, i.high
        ),
        None => format!("{:.digits$} (n = {})", estimate.median, estimate.samples),
    }
}

/// The steps that the seconds of Table 2 stand for.
fn run_steps() -> f64 {
    Published::load().steps as f64
}

/// Seconds of a whole run of one cell, by round.
fn run_seconds(measured: &Measured, preset: Preset, test: &str, quantity: Quantity) -> ByRound {
    let stage = measured.stage_for_tables("table2");
    let cell = Cell::new(preset.name(), test, 1);
    let per_step = measured.per_step("table2", stage, &cell, quantity);
    per_step
        .into_iter()
        .map(|(round, s)| (round, s * run_steps()))
        .collect()
}

/// The distance tests that Table 2 was measured with, the paper's first.
pub fn distance_tests(measured: &Measured) -> Vec<String> {
    measured
        .experiment("table2")
        .map(|e| e.factors.distance_test.clone())
        .unwrap_or_default()
}

/// Table 2, the paper's and ours, as rows for a CSV.
pub fn table2_rows(measured: &Measured) -> Vec<Table2Row> {
    let published = Published::load();
    let mut rows = Vec::new();
    let mut paper = |row: &str, unit: &'static str, values: [f64; 3]| {
        for ((quantity, _), value) in QUANTITIES.into_iter().zip(values) {
            rows.push(Table2Row {
                source: "paper".to_string(),
                mode: "published",
                particles: Some(published.particles),
                distance_test: "sqrt".to_string(),
                row: row.to_string(),
                quantity,
                unit,
                value,
                low: None,
                high: None,
                rounds: None,
            });
        }
    };
    let seconds = |s: Seconds| [s.cg_s, s.non_cg_s, s.total_s];
    let (list, relocated) = (Preset::PAPER_LINKED_LIST, Preset::PAPER_AOS_RELOCATION);
    paper(list.name(), "s", seconds(published.table2.linked_list));
    paper(
        relocated.name(),
        "s",
        seconds(published.table2.aos_relocation),
    );
    let speed_up = published.table2.speed_up;
    paper(
        "speed_up",
        "ratio",
        [speed_up.cg, speed_up.non_cg, speed_up.total],
    );
    for test in distance_tests(measured) {
        for (quantity, q) in QUANTITIES {
            let (a, b) = (
                run_seconds(measured, list, &test, q),
                run_seconds(measured, relocated, &test, q),
            );
            let values = [
                (list.name(), "s", estimate(&a)),
                (relocated.name(), "s", estimate(&b)),
                ("speed_up", "ratio", ratio(&a, &b)),
            ];
            for (row, unit, value) in values {
                let Some(value) = value else { continue };
                rows.push(Table2Row {
                    source: measured.info.machine_alias.clone(),
                    mode: measured.info.mode.name(),
                    particles: measured.particles(),
                    distance_test: test.clone(),
                    row: row.to_string(),
                    quantity,
                    unit,
                    value: value.median,
                    low: value.interval.map(|i| i.low),
                    high: value.interval.map(|i| i.high),
                    rounds: Some(value.samples),
                });
            }
        }
    }
    rows
}

/// Table 2 for people: the paper's seconds, ours, and the ratio of the two speed-ups.
pub fn table2_view(measured: &Measured) -> TableView {
    let published = Published::load();
    let stamp = measured
        .stamp()
        .map_or(String::new(), |stamp| format!(" {stamp}."));
    let tolerance = measured
        .experiment("table2")
        .map_or(0.0, |e| e.fixed.cg_tolerance);
    let caption = format!(
        "Seconds of {} steps on one thread, median [95 % interval]. Ours: the mean of the sampled steps times {}; the \
         interval is over rounds, which all sample the same steps; CG to a relative residual of {tolerance:e}.{stamp}",
        published.steps, published.steps
    );
    let mut view = TableView::new(&caption, &["", "CG", "outside CG", "total"]);
    let (list, relocated) = (Preset::PAPER_LINKED_LIST, Preset::PAPER_AOS_RELOCATION);
    let mut plain = |name: &str, values: [f64; 3], digits: usize, unit: &str| {
        let cells = values.map(|v| format!("{v:.digits$}{unit}"));
        view.rows
            .push(std::iter::once(name.to_string()).chain(cells).collect());
    };
    let seconds = |s: Seconds| [s.cg_s, s.non_cg_s, s.total_s];
    let speed_up = published.table2.speed_up;
    plain(
        "paper: linked list",
        seconds(published.table2.linked_list),
        1,
        " s",
    );
    plain(
        "paper: with relocation",
        seconds(published.table2.aos_relocation),
        1,
        " s",
    );
    plain(
        "paper: speed-up",
        [speed_up.cg, speed_up.non_cg, speed_up.total],
        2,
        "x",
    );
    for test in distance_tests(measured) {
        let columns = QUANTITIES.map(|(_, q)| {
            let a = run_seconds(measured, list, &test, q);
            let b = run_seconds(measured, relocated, &test, q);
            (estimate(&a), estimate(&b), ratio(&a, &b))
        });
        let text = |e: Option<Estimate>, digits: usize, unit: &str| {
            e.map_or("none".to_string(), |e| {
                format!("{}{unit}", show(&e, digits))
            })
        };
        let mut row = |name: String, cells: [String; 3]| {
            view.rows.push(std::iter::once(name).chain(cells).collect());
        };
        row(
            format!("here, {test}: linked list"),
            columns.map(|c| text(c.0, 1, " s")),
        );
        row(
            format!("here, {test}: with relocation"),
            columns.map(|c| text(c.1, 1, " s")),
        );
        row(
            format!("here, {test}: speed-up"),
            columns.map(|c| text(c.2, 3, "x")),
        );
        let paper = [speed_up.cg, speed_up.non_cg, speed_up.total];
        let mut cells = columns.map(|c| c.2).into_iter().zip(paper);
        let ours_over_paper = [0; 3].map(|_| {
            let (ours, paper) = cells.next().unwrap_or((None, 1.0));
            text(ours.map(|e| e.scaled(1.0 / paper)), 3, "x")
        });
        row(
            format!("here, {test}: our speed-up over the paper's"),
            ours_over_paper,
        );
    }
    view
}

/// The phases of an experiment's cells, milliseconds a step.
pub fn phases_view(phases: &[CellPhase], experiment: &str) -> TableView {
    let cells: Vec<&str> = cells(phases)
        .into_iter()
        .filter(|(e, _)| *e == experiment)
        .map(|(_, cell)| cell)
        .collect();
    let short = |cell: &str| cell.split('/').skip(1).collect::<Vec<_>>().join(" ");
    let mut view = TableView::new(
        "Milliseconds a step by phase, medians of the rounds.",
        &["phase"],
    );
    view.header.extend(cells.iter().map(|cell| short(cell)));
    for phase in phase_names().chain(["non_cg", "total"]) {
        let values: Vec<Option<Estimate>> =
            cells.iter().map(|cell| find(phases, cell, phase)).collect();
        if values.iter().any(Option::is_some) {
            let shown = values
                .iter()
                .map(|v| v.map_or(String::new(), |e| format!("{:.2}", e.median)));
            view.rows
                .push(std::iter::once(phase.to_string()).chain(shown).collect());
        }
    }
    view
}
