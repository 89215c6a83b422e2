//! Tables: the paper's Table 2 beside ours, and plain tables for pages.

use serde::Serialize;

use crate::base::statistics::{Estimate, NoInterval};
use crate::engine::preset::Preset;
use crate::report::markdown;
use crate::report::measured::{ByRound, Cell, Measured, Quantity, ratio, times};
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

    /// The same for a repository's pages. Bars inside a cell are escaped, and so is what would be markup.
    pub fn to_markdown(&self) -> String {
        let line = |cells: &[String]| -> String {
            let escape = |cell: &String| markdown::plain(cell).replace('|', "\\|");
            let escaped: Vec<String> = cells.iter().map(escape).collect();
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

const QUANTITIES: [(&str, Quantity); 3] =
    [("cg", Quantity::Cg), ("non_cg", Quantity::NonCg), ("total", Quantity::Total)];

/// How captions describe what [`show`] writes.
pub const TIMES: &str = "median (smallest to largest round)";
pub const RATIOS: &str = "median [95 % interval]";

/// The median with as many digits as the value needs, beside it the interval in brackets or the spread of times in
/// parentheses; where there is neither, the number of rounds, and whether they depend on one another.
pub fn show(estimate: &Estimate, digits: usize) -> String {
    let Estimate { median, samples, .. } = estimate;
    if let Some(ends) = estimate.spread {
        return format!("{median:.digits$} ({:.digits$} to {:.digits$})", ends.low, ends.high);
    }
    match (estimate.interval, estimate.why_no_interval()) {
        (Some(i), _) => format!("{median:.digits$} [{:.digits$}, {:.digits$}]", i.low, i.high),
        (None, Some(NoInterval::DependentRounds)) => format!("{median:.digits$} (n = {samples}, dependent)"),
        (None, _) => format!("{median:.digits$} (n = {samples})"),
    }
}

/// The same, or `none` where nothing was measured.
pub fn show_or_none(estimate: Option<Estimate>, digits: usize) -> String {
    estimate.map_or("none".to_string(), |estimate| show(&estimate, digits))
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
    per_step.into_iter().map(|(round, s)| (round, s * run_steps())).collect()
}

/// The preset that goes beyond the paper, on one thread.
pub fn fast_cell() -> Cell {
    Cell::new(Preset::FAST.name(), "squared", 1)
}

/// Its seconds of a whole run, by round; none in runs that were recorded without it.
fn fast_seconds(measured: &Measured, quantity: Quantity) -> ByRound {
    let stage = measured.stage_for_tables("table2");
    let per_step = measured.per_step("table2", stage, &fast_cell(), quantity);
    per_step.into_iter().map(|(round, s)| (round, s * run_steps())).collect()
}

/// The distance tests that Table 2 was measured with, the paper's first.
pub fn distance_tests(measured: &Measured) -> Vec<String> {
    let mut tests: Vec<String> = Vec::new();
    let list = Preset::PAPER_LINKED_LIST.name();
    for cell in measured.cells("table2").into_iter().filter(|cell| cell.variant.preset == list) {
        if !tests.contains(&cell.variant.distance_test) {
            tests.push(cell.variant.distance_test);
        }
    }
    tests
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
    paper(relocated.name(), "s", seconds(published.table2.aos_relocation));
    let speed_up = published.table2.speed_up;
    paper("speed_up", "ratio", [speed_up.cg, speed_up.non_cg, speed_up.total]);
    let mut ours =
        |test: &str, row: &str, quantity: &'static str, unit: &'static str, value: Option<Estimate>| {
            let Some(value) = value else { return };
            rows.push(Table2Row {
                source: measured.info.machine_alias.clone(),
                mode: measured.info.mode.name(),
                particles: measured.particles("table2"),
                distance_test: test.to_string(),
                row: row.to_string(),
                quantity,
                unit,
                value: value.median,
                low: value.bounds().map(|i| i.low),
                high: value.bounds().map(|i| i.high),
                rounds: Some(value.samples),
            });
        };
    for test in distance_tests(measured) {
        for (quantity, q) in QUANTITIES {
            let (a, b) = (run_seconds(measured, list, &test, q), run_seconds(measured, relocated, &test, q));
            ours(&test, list.name(), quantity, "s", times(&a));
            ours(&test, relocated.name(), quantity, "s", times(&b));
            ours(&test, "speed_up", quantity, "ratio", ratio(&a, &b));
            ours(&test, "list_over_fast", quantity, "ratio", ratio(&a, &fast_seconds(measured, q)));
        }
    }
    for (quantity, q) in QUANTITIES {
        ours(
            &fast_cell().distance_test,
            Preset::FAST.name(),
            quantity,
            "s",
            times(&fast_seconds(measured, q)),
        );
    }
    rows
}

/// Table 2 for people: the paper's seconds, ours, and the ratio of the two speed-ups.
pub fn table2_view(measured: &Measured) -> TableView {
    let published = Published::load();
    let stamp = measured.stamp().map_or(String::new(), |stamp| format!(" {stamp}."));
    let tolerance = measured.experiment("table2").map_or(0.0, |e| e.fixed.cg_tolerance);
    let caption = format!(
        "Seconds of {} steps on one thread, {TIMES}. Ours: the mean of the sampled steps times {}, by round; all rounds \
         sample the same steps. Speed-ups: {RATIOS}. CG to a relative residual of {tolerance:e}.{stamp}",
        published.steps, published.steps
    );
    let mut view = TableView::new(&caption, &["", "CG", "outside CG", "total"]);
    view.rows = published_rows(&published);
    for test in distance_tests(measured) {
        view.rows.extend(measured_rows(measured, &published, &test));
    }
    view.rows.extend(fast_rows(measured));
    view
}

/// A row's name before its cells.
fn named(name: String, cells: [String; 3]) -> Vec<String> {
    std::iter::once(name).chain(cells).collect()
}

fn published_rows(published: &Published) -> Vec<Vec<String>> {
    let seconds = |s: Seconds| [s.cg_s, s.non_cg_s, s.total_s].map(|v| format!("{v:.1} s"));
    let speed_up = speed_ups(published).map(|v| format!("{v:.2}x"));
    vec![
        named("paper: linked list".to_string(), seconds(published.table2.linked_list)),
        named("paper: with relocation".to_string(), seconds(published.table2.aos_relocation)),
        named("paper: speed-up".to_string(), speed_up),
    ]
}

/// The paper's speed-ups of CG, the rest and the whole.
fn speed_ups(published: &Published) -> [f64; 3] {
    let speed_up = published.table2.speed_up;
    [speed_up.cg, speed_up.non_cg, speed_up.total]
}

/// What goes beyond the paper: the fast preset, and the list over it.
fn fast_rows(measured: &Measured) -> Vec<Vec<String>> {
    let seconds = QUANTITIES.map(|(_, quantity)| fast_seconds(measured, quantity));
    if seconds[0].is_empty() {
        return Vec::new();
    }
    let in_seconds = |of: &ByRound| times(of).map_or("none".to_string(), |e| format!("{} s", show(&e, 2)));
    let mut rows = vec![named("beyond the paper: fast".to_string(), seconds.each_ref().map(in_seconds))];
    for test in distance_tests(measured) {
        let over = [0, 1, 2].map(|k| {
            let list = run_seconds(measured, Preset::PAPER_LINKED_LIST, &test, QUANTITIES[k].1);
            ratio(&list, &seconds[k]).map_or("none".to_string(), |e| format!("{}x", show(&e, 2)))
        });
        rows.push(named(format!("beyond the paper: linked list ({test}) over fast"), over));
    }
    rows
}

/// Ours with one distance test, and our speed-ups over the paper's.
fn measured_rows(measured: &Measured, published: &Published, test: &str) -> Vec<Vec<String>> {
    let columns = QUANTITIES.map(|(_, quantity)| {
        let list = run_seconds(measured, Preset::PAPER_LINKED_LIST, test, quantity);
        let relocated = run_seconds(measured, Preset::PAPER_AOS_RELOCATION, test, quantity);
        (times(&list), times(&relocated), ratio(&list, &relocated))
    });
    let text = |e: Option<Estimate>, digits: usize, unit: &str| {
        e.map_or("none".to_string(), |e| format!("{}{unit}", show(&e, digits)))
    };
    let paper = speed_ups(published);
    let over_paper = [0, 1, 2].map(|k| columns[k].2.map(|ours| ours.scaled(1.0 / paper[k])));
    vec![
        named(format!("here, {test}: linked list"), columns.map(|c| text(c.0, 1, " s"))),
        named(format!("here, {test}: with relocation"), columns.map(|c| text(c.1, 1, " s"))),
        named(format!("here, {test}: speed-up"), columns.map(|c| text(c.2, 3, "x"))),
        named(format!("here, {test}: our speed-up over the paper's"), over_paper.map(|e| text(e, 3, "x"))),
    ]
}

/// The phases of an experiment's cells, milliseconds a step.
pub fn phases_view(phases: &[CellPhase], experiment: &str) -> TableView {
    let cells: Vec<&str> =
        cells(phases).into_iter().filter(|(e, _)| *e == experiment).map(|(_, cell)| cell).collect();
    let short = |cell: &str| cell.split('/').skip(1).collect::<Vec<_>>().join(" ");
    let mut view = TableView::new("Milliseconds a step by phase, medians of the rounds.", &["phase"]);
    view.header.extend(cells.iter().map(|cell| short(cell)));
    for phase in phase_names().chain(["non_cg", "total"]) {
        let values: Vec<Option<Estimate>> = cells.iter().map(|cell| find(phases, cell, phase)).collect();
        if values.iter().any(Option::is_some) {
            let shown = values.iter().map(|v| v.map_or(String::new(), |e| format!("{:.2}", e.median)));
            view.rows.push(std::iter::once(phase.to_string()).chain(shown).collect());
        }
    }
    view
}
