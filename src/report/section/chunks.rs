//! Chunks: time and gain over schedule and chunk size, on all cores.

use anyhow::Result;

use crate::base::statistics::Estimate;
use crate::engine::preset::Preset;
use crate::experiment::record::Stage;
use crate::report::chart::{Axis, Figure, Line, Mark, MarkAt, Marker, Panel, Scale, Series, XyPanel};
use crate::report::measured::{ByRound, Measured, Quantity, TimedCell, ratio, times};
use crate::report::section::{Content, automatic, how_measured, point};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show, show_or_none};

const ID: &str = "chunks";
/// The paper's schedule.
const PAPER: &str = "dynamic:64";

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    let timings = Timings { measured, cells: measured.cells(ID) };
    let mut findings = vec![how_measured(measured, ID)];
    findings.extend(Preset::PAPER.into_iter().filter_map(|preset| timings.fastest(preset)));
    findings.extend(timings.gains());
    Ok(Content {
        findings,
        figures: vec![("chunks".to_string(), timings.figure())],
        tables: vec![timings.table()],
        ..Content::default()
    })
}

struct Timings<'a> {
    measured: &'a Measured,
    cells: Vec<TimedCell>,
}

/// A schedule's kind, and its chunk where it has one.
fn split(schedule: &str) -> (&str, Option<f64>) {
    match schedule.split_once(':') {
        Some((kind, chunk)) => (kind, chunk.parse().ok()),
        None => (schedule, None),
    }
}

impl Timings<'_> {
    fn of(&self, cell: &TimedCell) -> ByRound {
        self.measured.per_step(ID, Stage::Paired, cell, Quantity::NonCg)
    }

    fn with_preset(&self, preset: Preset) -> impl Iterator<Item = &TimedCell> {
        self.cells.iter().filter(move |cell| cell.variant.preset == preset.name())
    }

    /// How far the paper's schedule is from the fastest.
    fn fastest(&self, preset: Preset) -> Option<String> {
        let median = |cell: &&TimedCell| times(&self.of(cell)).map_or(f64::INFINITY, |e| e.median);
        let fastest = self.with_preset(preset).min_by(|a, b| median(a).total_cmp(&median(b)))?;
        let paper = self.with_preset(preset).find(|cell| cell.variant.schedule == PAPER)?;
        let over_fastest = |cell: &TimedCell| ratio(&self.of(cell), &self.of(fastest));
        let tied = self.with_preset(preset).filter(|cell| {
            let interval = over_fastest(cell).and_then(|ratio| ratio.interval);
            *cell != fastest && interval.is_some_and(|interval| interval.low <= 1.0)
        });
        let tied: Vec<&str> = tied.map(|cell| cell.variant.schedule.as_str()).collect();
        let tied = if tied.is_empty() { "none".to_string() } else { tied.join(", ") };
        let lost = match paper == fastest {
            true => "the paper's own".to_string(),
            false => format!("the paper's {PAPER} takes {} times as long", show(&over_fastest(paper)?, 3)),
        };
        Some(format!(
            "{preset} on {} threads is fastest with {}, {lost}: {} ms a step outside CG. Not resolved from the fastest: \
             {tied}.",
            fastest.threads,
            fastest.variant.schedule,
            show(&times(&self.of(fastest))?.scaled(1e3), 1),
        ))
    }

    /// List over relocation with each schedule.
    fn gains(&self) -> Option<String> {
        let mut gains = Vec::new();
        for list in self.with_preset(Preset::PAPER_LINKED_LIST) {
            let relocated = self.of(&list.with_preset(Preset::PAPER_AOS_RELOCATION));
            gains.push((list.variant.schedule.as_str(), ratio(&self.of(list), &relocated)?));
        }
        let least = gains.iter().min_by(|a, b| a.1.median.total_cmp(&b.1.median))?;
        let most = gains.iter().max_by(|a, b| a.1.median.total_cmp(&b.1.median))?;
        let paper = gains.iter().find(|(schedule, _)| *schedule == PAPER)?;
        Some(format!(
            "List over relocation outside CG: {} with {PAPER}, from {} ({}) to {} ({}).",
            show(&paper.1, 3),
            show(&least.1, 3),
            least.0,
            show(&most.1, 3),
            most.0
        ))
    }

    fn figure(&self) -> Figure {
        let threads = self.cells.first().map_or(0, |cell| cell.threads);
        let time = |cell: &TimedCell| times(&self.of(cell)).map(|e| e.scaled(1e3));
        let gain = |cell: &TimedCell| {
            let relocated = cell.with_preset(Preset::PAPER_AOS_RELOCATION);
            ratio(&self.of(cell), &self.of(&relocated))
        };
        let panel = |title: &str, label: &str, preset: Preset, value: &Value<'_>| {
            Panel::Xy(self.panel(title, label, preset, value))
        };
        let ms = "ms a step outside CG";
        Figure {
            title: format!("Schedules and chunks on {threads} threads"),
            description: "Milliseconds a step outside CG against the chunk size for each kind of schedule, with the \
                          linked list and with relocation, and the ratio of the two. Bars span all rounds of times and 95 % intervals of ratios. The level dotted \
                          line is the static schedule, which has no chunk; the upright one the paper's chunk of 64."
                .to_string(),
            panels: vec![
                panel("linked list", ms, Preset::PAPER_LINKED_LIST, &time),
                panel("relocated", ms, Preset::PAPER_AOS_RELOCATION, &time),
                panel("gain of relocation", "list / relocated", Preset::PAPER_LINKED_LIST, &gain),
            ],
            note: self.measured.stamp(),
        }
    }

    fn panel(&self, title: &str, label: &str, preset: Preset, value: &Value<'_>) -> XyPanel {
        let kinds =
            [("dynamic", 5, Marker::Circle), ("guided", 6, Marker::Square), ("rayon", 3, Marker::Triangle)];
        let series = kinds.map(|(kind, color, marker)| Series {
            label: kind.to_string(),
            color,
            line: Line::Solid,
            marker,
            points: self
                .with_preset(preset)
                .filter(|cell| split(&cell.variant.schedule).0 == kind)
                .filter_map(|cell| Some(point(split(&cell.variant.schedule).1?, value(cell)?)))
                .collect(),
        });
        let fixed = self.with_preset(preset).find(|cell| cell.variant.schedule == "static").and_then(value);
        let mut marks = vec![Mark { label: "the paper's chunk".to_string(), at: MarkAt::X(64.0), color: 0 }];
        marks.extend(fixed.map(|e| Mark { label: "static".to_string(), at: MarkAt::Y(e.median), color: 7 }));
        XyPanel {
            title: title.to_string(),
            x: Axis { ticks: Some(ticks()), range: Some((0.8, 5200.0)), ..automatic("chunk", Scale::Log2) },
            y: automatic(label, Scale::Linear),
            series: series.into(),
            marks,
            bands: Vec::new(),
        }
    }

    fn table(&self) -> TableView {
        let mut view = TableView::new(
            "Milliseconds a step outside CG (smallest to largest round) and the gain of relocation [95 % interval].",
            &["schedule", "linked list", "relocated", "list / relocated"],
        );
        for list in self.with_preset(Preset::PAPER_LINKED_LIST) {
            let relocated = list.with_preset(Preset::PAPER_AOS_RELOCATION);
            let (a, b) = (self.of(list), self.of(&relocated));
            let cells = [times(&a).map(|e| e.scaled(1e3)), times(&b).map(|e| e.scaled(1e3)), ratio(&a, &b)];
            let shown = cells.into_iter().zip([2, 2, 3]).map(|(cell, digits)| show_or_none(cell, digits));
            view.rows.push(std::iter::once(list.variant.schedule.clone()).chain(shown).collect());
        }
        view
    }
}

/// What a panel shows of a cell.
type Value<'a> = dyn Fn(&TimedCell) -> Option<Estimate> + 'a;

fn ticks() -> Vec<(f64, String)> {
    [1, 8, 64, 512, 4096].map(|chunk| (f64::from(chunk), chunk.to_string())).into()
}
