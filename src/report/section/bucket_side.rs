//! Bucket side: 27 buckets as long as the largest radius, or 125 half as long.

use anyhow::Result;

use crate::engine::preset::Preset;
use crate::experiment::record::Stage;
use crate::report::chart::{Figure, Line, Marker, Panel, Scale, Series, XyPanel};
use crate::report::measured::{ByRound, Measured, Quantity, TimedCell, ratio, times};
use crate::report::section::{
    Content, LINKED_LIST, RELOCATED, automatic, categories, how_measured, point, side_by_side,
};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show, show_or_none};

const ID: &str = "bucket-side";

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    let sides = Sides { measured, cells: measured.cells(ID) };
    let mut findings = vec![how_measured(measured, ID)];
    findings.extend(sides.rows().filter_map(|cell| sides.finding(cell)));
    Ok(Content {
        findings,
        figures: vec![("bucket-side".to_string(), sides.figure())],
        tables: vec![sides.table()],
        ..Content::default()
    })
}

struct Sides<'a> {
    measured: &'a Measured,
    cells: Vec<TimedCell>,
}

impl Sides<'_> {
    /// Milliseconds a step outside CG.
    fn time(&self, cell: &TimedCell, buckets_per_radius: usize) -> ByRound {
        let cell = cell.with(|variant| variant.buckets_per_radius = buckets_per_radius);
        let seconds = self.measured.per_step(ID, Stage::Paired, &cell, Quantity::NonCg);
        seconds.into_iter().map(|(round, s)| (round, 1e3 * s)).collect()
    }

    /// The cells with whole sides: one a search and distance test.
    fn rows(&self) -> impl Iterator<Item = &TimedCell> {
        self.cells.iter().filter(|cell| cell.variant.buckets_per_radius == 1)
    }

    fn finding(&self, list: &TimedCell) -> Option<String> {
        if list.variant.preset != Preset::PAPER_LINKED_LIST.name() {
            return None;
        }
        let relocated = list.with_preset(Preset::PAPER_AOS_RELOCATION);
        let gain = |side| ratio(&self.time(list, side), &self.time(&relocated, side));
        let smaller = |cell: &TimedCell| ratio(&self.time(cell, 2), &self.time(cell, 1));
        Some(format!(
            "{}: half the side takes {} times as long with the list and {} with relocation; list over relocation is {} \
             with whole sides and {} with half.",
            list.variant.distance_test,
            show(&smaller(list)?, 3),
            show(&smaller(&relocated)?, 3),
            show(&gain(1)?, 3),
            show(&gain(2)?, 3)
        ))
    }

    fn figure(&self) -> Figure {
        let series = |cell: &TimedCell| {
            let list = cell.variant.preset == Preset::PAPER_LINKED_LIST.name();
            let root = cell.variant.distance_test == "sqrt";
            let time = |(k, side): (usize, usize)| Some(point(k as f64, times(&self.time(cell, side))?));
            Series {
                label: format!("{}, {}", if list { "list" } else { "relocated" }, cell.variant.distance_test),
                color: if list { LINKED_LIST } else { RELOCATED },
                line: Line::None,
                marker: match (list, root) {
                    (true, true) => Marker::Circle,
                    (true, false) => Marker::OpenCircle,
                    (false, true) => Marker::Square,
                    (false, false) => Marker::OpenSquare,
                },
                points: [(0, 1), (1, 2)].into_iter().filter_map(time).collect(),
            }
        };
        let names = ["largest radius (27 buckets)", "half of it (125 buckets)"].map(String::from);
        Figure {
            title: "The side of a bucket".to_string(),
            description:
                "Milliseconds a step outside CG with buckets as long as the largest radius and half as long, \
                          for both searches and distance tests; bars span all rounds."
                    .to_string(),
            panels: vec![Panel::Xy(XyPanel {
                title: String::new(),
                x: categories("bucket side", &names),
                y: automatic("ms a step outside CG", Scale::Linear),
                series: side_by_side(self.rows().map(series).collect()),
                marks: Vec::new(),
                bands: Vec::new(),
            })],
            note: self.measured.stamp(),
        }
    }

    fn table(&self) -> TableView {
        let mut view = TableView::new(
            "Milliseconds a step outside CG, median (smallest to largest round), and the ratio [95 % interval].",
            &["search", "distance test", "whole side", "half side", "half / whole"],
        );
        for cell in self.rows() {
            let (whole, half) = (self.time(cell, 1), self.time(cell, 2));
            let cells = [times(&whole), times(&half), ratio(&half, &whole)];
            let shown = cells.into_iter().zip([2, 2, 3]).map(|(cell, digits)| show_or_none(cell, digits));
            let names = [cell.variant.preset.clone(), cell.variant.distance_test.clone()];
            view.rows.push(names.into_iter().chain(shown).collect());
        }
        view
    }
}
