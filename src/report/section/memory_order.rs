//! Memory order: the same states laid out in other orders, and what that says about the paper's gain.

use anyhow::Result;

use crate::base::statistics::Estimate;
use crate::engine::preset::Preset;
use crate::experiment::record::Stage;
use crate::report::chart::{Figure, Line, Mark, MarkAt, Marker, Panel, Scale, Series, XyPanel};
use crate::report::measured::{ByRound, Measured, Quantity, TimedCell, ratio, times};
use crate::report::published::Published;
use crate::report::section::{
    Content, LINKED_LIST, RELOCATED, automatic, categories, how_measured, point, side_by_side,
};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show};

const ID: &str = "memory-order";

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    let orders = Orders::new(measured);
    let mut findings = vec![how_measured(measured, ID)];
    findings.extend(orders.findings());
    Ok(Content {
        findings,
        figures: vec![("memory-order".to_string(), orders.figure())],
        tables: vec![orders.table()],
        ..Content::default()
    })
}

/// The measured states, tests and orders.
struct Orders<'a> {
    measured: &'a Measured,
    cells: Vec<TimedCell>,
    /// Place of the window, and the step that it starts after.
    states: Vec<(usize, usize)>,
}

/// The gain of one state, distance test and order.
struct Gain<'a> {
    start_step: usize,
    test: &'a str,
    order: &'a str,
    list: Estimate,
    relocated: Estimate,
    ratio: Estimate,
}

impl<'a> Orders<'a> {
    fn new(measured: &'a Measured) -> Self {
        let cells = measured.cells(ID);
        let windows = cells.first().map(|cell| measured.windows(ID, Stage::Paired, cell)).unwrap_or_default();
        let first = windows.values().next().copied().unwrap_or_default();
        let states = first.iter().enumerate().map(|(k, w)| (k, w.window.start_step)).collect();
        Orders { measured, cells, states }
    }

    fn lists(&self) -> impl Iterator<Item = &TimedCell> {
        self.cells.iter().filter(|cell| cell.variant.preset == Preset::PAPER_LINKED_LIST.name())
    }

    /// Milliseconds a step outside CG, from one state.
    fn time(&self, cell: &TimedCell, state: usize) -> ByRound {
        let seconds = self.measured.per_step_in(ID, Stage::Paired, cell, Quantity::NonCg, |k| k == state);
        seconds.into_iter().map(|(round, s)| (round, 1e3 * s)).collect()
    }

    fn gains(&self) -> Vec<Gain<'_>> {
        let mut gains = Vec::new();
        for &(state, start_step) in &self.states {
            for cell in self.lists() {
                let list = self.time(cell, state);
                let relocated = self.time(&cell.with_preset(Preset::PAPER_AOS_RELOCATION), state);
                let all = (times(&list), times(&relocated), ratio(&list, &relocated));
                if let (Some(list), Some(relocated), Some(ratio)) = all {
                    let (test, order) =
                        (cell.variant.distance_test.as_str(), cell.variant.memory_order.as_str());
                    gains.push(Gain { start_step, test, order, list, relocated, ratio });
                }
            }
        }
        gains
    }

    /// Which layouts give the paper's gain, and how far order alone moves it.
    fn findings(&self) -> Vec<String> {
        let (gains, paper) = (self.gains(), Published::load().table2.speed_up.non_cg);
        let mut findings = Vec::new();
        for &(_, start_step) in &self.states {
            for test in ["sqrt", "squared"] {
                let of_state: Vec<&Gain<'_>> =
                    gains.iter().filter(|g| g.start_step == start_step && g.test == test).collect();
                findings.extend(spread(&of_state, paper));
            }
        }
        let meets = |gain: &&Gain<'_>| {
            let close = (gain.ratio.median / paper - 1.0).abs() <= 0.05;
            close || gain.ratio.interval.is_some_and(|i| i.low <= paper && paper <= i.high)
        };
        let name = |g: &Gain<'_>| format!("{} after step {} ({})", g.order, g.start_step, g.test);
        let met: Vec<String> = gains.iter().filter(meets).map(name).collect();
        findings.push(if met.is_empty() {
            format!("No layout gives the paper's {paper} (in the interval, or the median within 5 %).")
        } else {
            format!(
                "The paper's {paper} (claim C1; in the interval, or the median within 5 %) is what these layouts give: {}.",
                met.join("; ")
            )
        });
        findings
    }

    fn figure(&self) -> Figure {
        let mut names: Vec<String> = Vec::new();
        for cell in &self.cells {
            if !names.contains(&cell.variant.memory_order) {
                names.push(cell.variant.memory_order.clone());
            }
        }
        let mut panels: Vec<Panel> =
            self.states.iter().map(|&(_, step)| Panel::Xy(self.times_panel(step, &names))).collect();
        panels.push(Panel::Xy(self.gains_panel(&names)));
        Figure {
            title: "The same state in four orders of memory".to_string(),
            description: "Milliseconds a step outside CG with the linked list and with relocation, from an early and \
                          from a late state, each laid out in four orders; and the ratio of list to relocation. 95 % \
                          intervals of ratios and all rounds of times; the dotted lines of the last panel are no gain and the paper's gain."
                .to_string(),
            panels,
            note: self.measured.stamp(),
        }
    }

    fn times_panel(&self, start_step: usize, names: &[String]) -> XyPanel {
        let gains = self.gains();
        let mut series = Vec::new();
        for (test, [of_list, of_relocated]) in [
            ("sqrt", [Marker::Circle, Marker::Square]),
            ("squared", [Marker::OpenCircle, Marker::OpenSquare]),
        ] {
            let line = Line::None;
            let part = |value: fn(&Gain<'_>) -> Estimate| {
                let of = gains.iter().filter(|g| g.start_step == start_step && g.test == test);
                of.filter_map(|g| Some(point(place(names, g.order)?, value(g)))).collect()
            };
            let (list, relocated) = (part(|g| g.list), part(|g| g.relocated));
            let labels = [format!("list, {test}"), format!("relocated, {test}")];
            let [list_label, relocated_label] = labels;
            series.push(Series {
                label: list_label,
                color: LINKED_LIST,
                line,
                marker: of_list,
                points: list,
            });
            series.push(Series {
                label: relocated_label,
                color: RELOCATED,
                line,
                marker: of_relocated,
                points: relocated,
            });
        }
        XyPanel {
            title: format!("after step {start_step}"),
            x: categories("order in memory", names),
            y: automatic("ms a step outside CG", Scale::Linear),
            series: side_by_side(series),
            marks: Vec::new(),
            bands: Vec::new(),
        }
    }

    fn gains_panel(&self, names: &[String]) -> XyPanel {
        let (gains, paper) = (self.gains(), Published::load().table2.speed_up.non_cg);
        let mut series = Vec::new();
        let markers = [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond];
        for (&(_, step), color) in self.states.iter().zip([3, 1, 2, 7].into_iter().cycle()) {
            for test in ["sqrt", "squared"] {
                let of = gains.iter().filter(|g| g.start_step == step && g.test == test);
                series.push(Series {
                    label: format!("after step {step}, {test}"),
                    color,
                    line: Line::None,
                    marker: markers[series.len() % markers.len()],
                    points: of.filter_map(|g| Some(point(place(names, g.order)?, g.ratio))).collect(),
                });
            }
        }
        XyPanel {
            title: "gain of relocation".to_string(),
            x: categories("order in memory", names),
            y: automatic("list / relocated", Scale::Linear),
            series: side_by_side(series),
            marks: vec![
                Mark { label: String::new(), at: MarkAt::Y(1.0), color: 0 },
                Mark { label: format!("paper: {paper}x"), at: MarkAt::Y(paper), color: 0 },
            ],
            bands: Vec::new(),
        }
    }

    fn table(&self) -> TableView {
        let mut view = TableView::new(
            "Milliseconds a step outside CG (smallest to largest round), and the gain of relocation [95 % interval].",
            &["state after step", "distance test", "order", "linked list", "relocated", "list / relocated"],
        );
        for g in self.gains() {
            view.rows.push(vec![
                g.start_step.to_string(),
                g.test.to_string(),
                g.order.to_string(),
                show(&g.list, 2),
                show(&g.relocated, 2),
                show(&g.ratio, 3),
            ]);
        }
        view
    }
}

fn place(names: &[String], order: &str) -> Option<f64> {
    names.iter().position(|name| name == order).map(|k| k as f64)
}

/// How far the order moves the gain of one state and distance test.
fn spread(gains: &[&Gain<'_>], paper: f64) -> Option<String> {
    let least = gains.iter().min_by(|a, b| a.ratio.median.total_cmp(&b.ratio.median))?;
    let most = gains.iter().max_by(|a, b| a.ratio.median.total_cmp(&b.ratio.median))?;
    let inside = (least.ratio.median..=most.ratio.median).contains(&paper);
    Some(format!(
        "After step {}, {}: order alone moves list over relocation from {} ({}) to {} ({}); the paper's {paper} lies {}.",
        least.start_step,
        least.test,
        show(&least.ratio, 3),
        least.order,
        show(&most.ratio, 3),
        most.order,
        if inside { "between" } else { "outside" }
    ))
}
