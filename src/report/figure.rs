//! The figures of the report, as descriptions that the chart module draws.

use crate::engine::preset::Preset;
use crate::experiment::record::Stage;
use crate::report::chart::{
    Axis, Bar, BarGroup, BarPanel, Figure, Line, Marker, Panel, Point, Scale, Series, XyPanel,
};
use crate::report::measured::{Cell, Measured, Quantity, estimate};
use crate::report::published::{Published, Seconds};
use crate::report::table::distance_tests;

/// The colour of each search in all figures, by its place in the palette.
pub(super) const LINKED_LIST: usize = 5;
pub(super) const RELOCATED: usize = 6;

/// Table 2 as stacked bars: the paper's and ours.
pub fn table2(measured: &Measured) -> Figure {
    let published = Published::load();
    let steps = published.steps as f64;
    let paper_bar = |label: &str, s: Seconds| Bar {
        label: label.to_string(),
        values: vec![s.cg_s, s.non_cg_s],
        interval: None,
        published: true,
    };
    let mut groups = vec![BarGroup {
        label: "paper (Xeon 8358)".to_string(),
        bars: vec![
            paper_bar("list", published.table2.linked_list),
            paper_bar("relocated", published.table2.aos_relocation),
        ],
    }];
    let stage = measured.stage_for_tables("table2");
    for test in distance_tests(measured) {
        let bar = |label: &str, preset: Preset| {
            let cell = Cell::new(preset.name(), &test, 1);
            let of = |q: Quantity| {
                estimate(&measured.per_step("table2", stage, &cell, q)).map(|e| e.scaled(steps))
            };
            Some(Bar {
                label: label.to_string(),
                // The top of the bar is the median of the total, as in the table, not the sum of two medians.
                values: vec![
                    of(Quantity::Cg)?.median,
                    of(Quantity::Total)?.median - of(Quantity::Cg)?.median,
                ],
                interval: of(Quantity::Total)?.interval.map(|i| (i.low, i.high)),
                published: false,
            })
        };
        let bars = [bar("list", Preset::PAPER_LINKED_LIST), bar("relocated", Preset::PAPER_AOS_RELOCATION)];
        groups.push(BarGroup {
            label: match measured.particles().filter(|&count| count != published.particles) {
                Some(count) => format!("here, {test}, {count} particles"),
                None => format!("here, {test}"),
            },
            bars: bars.into_iter().flatten().collect(),
        });
    }
    Figure {
        title: "Table 2: one thread, linked list against relocation".to_string(),
        description:
            "Stacked bars of the seconds inside and outside CG for the whole run on one thread: the \
                      paper's two bars, and ours for each distance test, with a 95 % interval on the total."
                .to_string(),
        panels: vec![Panel::Bars(BarPanel {
            title: format!("{} steps", published.steps),
            y_label: "time of the run (s)".to_string(),
            segments: vec!["CG".to_string(), "outside CG".to_string()],
            groups,
        })],
        note: measured.stamp(),
    }
}

/// An axis whose range and ticks follow from the data.
pub(super) fn automatic(label: &str, scale: Scale) -> Axis {
    Axis { label: label.to_string(), scale, range: None, ticks: None }
}

/// Time of each step of the whole runs: how the parts change as particles mix.
pub fn steps(measured: &Measured) -> Option<Figure> {
    let mut series = Vec::new();
    for (preset, name, color) in [
        (Preset::PAPER_LINKED_LIST, "linked list", LINKED_LIST),
        (Preset::PAPER_AOS_RELOCATION, "relocated", RELOCATED),
    ] {
        let windows = measured.windows("table2", Stage::Whole, &Cell::new(preset.name(), "sqrt", 1));
        let (_, windows) = windows.into_iter().next()?;
        let steps: Vec<_> = windows.iter().flat_map(|w| &w.steps).collect();
        let points = |value: fn(&crate::experiment::record::StepSample) -> f64| -> Vec<Point> {
            steps.chunks(STEPS_PER_POINT).map(|chunk| middle_of(chunk, value)).collect()
        };
        series.push(Series {
            label: format!("outside CG, {name}"),
            color,
            line: Line::Solid,
            marker: Marker::None,
            points: points(|s| 1e3 * (s.total_s - s.cg_s)),
        });
        series.push(Series {
            label: format!("CG, {name}"),
            color,
            line: Line::Dashed,
            marker: Marker::None,
            points: points(|s| 1e3 * s.cg_s),
        });
    }
    Some(Figure {
        title: "The whole runs, step by step".to_string(),
        description:
            "Milliseconds a step inside and outside CG over the whole run on one thread, for both searches; \
                      medians of short runs of steps."
                .to_string(),
        panels: vec![Panel::Xy(XyPanel {
            title: format!("medians of {STEPS_PER_POINT} steps"),
            x: automatic("step", Scale::Linear),
            y: Axis { range: None, ..automatic("ms a step", Scale::Linear) },
            series,
            marks: Vec::new(),
            bands: Vec::new(),
        })],
        note: measured.stamp(),
    })
}

const STEPS_PER_POINT: usize = 23;

fn middle_of(
    steps: &[&crate::experiment::record::StepSample],
    value: fn(&crate::experiment::record::StepSample) -> f64,
) -> Point {
    let values: Vec<f64> = steps.iter().map(|step| value(step)).collect();
    let x = steps.iter().map(|step| step.step as f64).sum::<f64>() / steps.len() as f64;
    let y = crate::base::statistics::median(&values).unwrap_or(f64::NAN);
    Point { x, y, low: None, high: None, label: None }
}
