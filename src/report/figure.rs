//! The figures of the report, as descriptions that the chart module draws.

use crate::base::statistics::Estimate;
use crate::engine::preset::Preset;
use crate::experiment::record::Stage;
use crate::experiment::spec::Mode;
use crate::report::chart::{
    Axis, Bar, BarGroup, BarPanel, Figure, Line, Mark, MarkAt, Marker, Panel, Point, Scale, Series,
    XyPanel,
};
use crate::report::measured::{Cell, Measured, Quantity, estimate, ratio};
use crate::report::published::{Published, Seconds};
use crate::report::table::distance_tests;

const LINKED_LIST: usize = 5;
const RELOCATED: usize = 6;

/// What stands under every figure of a quick run.
fn stamp(measured: &Measured) -> Option<String> {
    (measured.info.mode == Mode::Quick).then(|| "quick: not for citation".to_string())
}

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
                values: vec![of(Quantity::Cg)?.median, of(Quantity::NonCg)?.median],
                interval: of(Quantity::Total)?.interval.map(|i| (i.low, i.high)),
                published: false,
            })
        };
        let bars = [
            bar("list", Preset::PAPER_LINKED_LIST),
            bar("relocated", Preset::PAPER_AOS_RELOCATION),
        ];
        groups.push(BarGroup {
            label: format!("here, {test}"),
            bars: bars.into_iter().flatten().collect(),
        });
    }
    Figure {
        title: "Table 2: one thread, linked list against relocation".to_string(),
        description: "Stacked bars of the seconds inside and outside CG for the whole run on one thread: the \
                      paper's two bars, and ours for each distance test, with a 95 % interval on the total."
            .to_string(),
        panels: vec![Panel::Bars(BarPanel {
            title: format!("{} steps", published.steps),
            y_label: "time of the run (s)".to_string(),
            segments: vec!["CG".to_string(), "outside CG".to_string()],
            groups,
        })],
        note: stamp(measured),
    }
}

/// Figure 4: time against threads and parallel efficiency, with ideal lines; the paper's two printed maxima as marks.
pub fn figure4(measured: &Measured) -> Figure {
    let published = Published::load();
    Figure {
        title: "Figure 4: time against the number of threads".to_string(),
        description: "Left: seconds of the whole run and of its part outside CG against the number of threads, \
                      with and without relocation, with 95 % intervals and ideal lines. Right: speed-up over one \
                      thread of the same search, with the two largest speed-ups that the paper prints as marks."
            .to_string(),
        panels: vec![
            Panel::Xy(times_panel(measured, published.steps as f64)),
            Panel::Xy(efficiency_panel(measured)),
            Panel::Xy(speed_up_panel(measured, &published)),
        ],
        note: stamp(measured),
    }
}

struct Curve {
    label: &'static str,
    preset: Preset,
    quantity: Quantity,
    color: usize,
    marker: Marker,
}

const CURVES: [Curve; 4] = [
    Curve {
        label: "whole run, linked list",
        preset: Preset::PAPER_LINKED_LIST,
        quantity: Quantity::Total,
        color: LINKED_LIST,
        marker: Marker::Circle,
    },
    Curve {
        label: "whole run, relocated",
        preset: Preset::PAPER_AOS_RELOCATION,
        quantity: Quantity::Total,
        color: RELOCATED,
        marker: Marker::Square,
    },
    Curve {
        label: "outside CG, linked list",
        preset: Preset::PAPER_LINKED_LIST,
        quantity: Quantity::NonCg,
        color: LINKED_LIST,
        marker: Marker::OpenCircle,
    },
    Curve {
        label: "outside CG, relocated",
        preset: Preset::PAPER_AOS_RELOCATION,
        quantity: Quantity::NonCg,
        color: RELOCATED,
        marker: Marker::OpenSquare,
    },
];

fn thread_axis(measured: &Measured) -> Axis {
    let threads = measured
        .experiment("figure4")
        .map(|e| e.factors.threads.clone())
        .unwrap_or_default();
    let most = threads.iter().copied().max().unwrap_or(1) as f64;
    Axis {
        label: "threads".to_string(),
        scale: Scale::Log2,
        range: Some((0.9, 1.15 * most)),
        ticks: Some(threads.iter().map(|&t| (t as f64, t.to_string())).collect()),
    }
}

fn automatic(label: &str, scale: Scale) -> Axis {
    Axis {
        label: label.to_string(),
        scale,
        range: None,
        ticks: None,
    }
}

fn point(threads: usize, estimate: Estimate) -> Point {
    Point {
        x: threads as f64,
        y: estimate.median,
        low: estimate.interval.map(|i| i.low),
        high: estimate.interval.map(|i| i.high),
        label: None,
    }
}

/// One estimate a thread count for a curve; thread counts without a successful round are left out.
fn points(measured: &Measured, value: impl Fn(usize) -> Option<Estimate>) -> Vec<Point> {
    measured
        .threads("figure4")
        .into_iter()
        .filter_map(|t| Some(point(t, value(t)?)))
        .collect()
}

fn per_step(
    measured: &Measured,
    curve: &Curve,
    threads: usize,
) -> crate::report::measured::ByRound {
    let stage = measured.stage_for_tables("figure4");
    let cell = Cell::new(curve.preset.name(), "sqrt", threads);
    measured.per_step("figure4", stage, &cell, curve.quantity)
}

fn times_panel(measured: &Measured, steps: f64) -> XyPanel {
    let mut series = Vec::new();
    for curve in &CURVES {
        let points = points(measured, |t| {
            estimate(&per_step(measured, curve, t)).map(|e| e.scaled(steps))
        });
        if let Some(first) = points.first().cloned() {
            series.push(ideal(
                &measured
                    .experiment("figure4")
                    .map(|e| e.factors.threads.clone())
                    .unwrap_or_default(),
                first,
                curve.color,
            ));
        }
        series.push(Series {
            label: curve.label.to_string(),
            color: curve.color,
            line: Line::Solid,
            marker: curve.marker,
            points,
        });
    }
    XyPanel {
        title: "time of the run".to_string(),
        x: thread_axis(measured),
        y: automatic("seconds", Scale::Log10),
        series,
        marks: Vec::new(),
        bands: Vec::new(),
    }
}

/// The time that perfect scaling from one thread would give.
fn ideal(threads: &[usize], first: Point, color: usize) -> Series {
    let points = threads
        .iter()
        .map(|&t| Point {
            x: t as f64,
            y: first.y / t as f64,
            low: None,
            high: None,
            label: None,
        })
        .collect();
    Series {
        label: String::new(),
        color,
        line: Line::Dashed,
        marker: Marker::None,
        points,
    }
}

fn efficiency_panel(measured: &Measured) -> XyPanel {
    let series = CURVES
        .iter()
        .map(|curve| Series {
            label: curve.label.to_string(),
            color: curve.color,
            line: Line::Solid,
            marker: curve.marker,
            points: points(measured, |t| {
                let speed_up = ratio(&per_step(measured, curve, 1), &per_step(measured, curve, t))?;
                Some(speed_up.scaled(1.0 / t as f64))
            }),
        })
        .collect();
    XyPanel {
        title: "parallel efficiency".to_string(),
        x: thread_axis(measured),
        y: Axis {
            range: Some((0.0, 1.15)),
            ..automatic("speed-up / threads", Scale::Linear)
        },
        series,
        marks: vec![Mark {
            label: String::new(),
            at: MarkAt::Y(1.0),
            color: 0,
        }],
        bands: Vec::new(),
    }
}

fn speed_up_panel(measured: &Measured, published: &Published) -> XyPanel {
    let series = CURVES
        .iter()
        .map(|curve| Series {
            label: curve.label.to_string(),
            color: curve.color,
            line: Line::Solid,
            marker: curve.marker,
            points: points(measured, |t| {
                ratio(&per_step(measured, curve, 1), &per_step(measured, curve, t))
            }),
        })
        .collect();
    let threads = published.figure4.threads as f64;
    let mark = |label: &str, y: f64| Mark {
        label: format!("paper, {label}: {y}x at 32 threads"),
        at: MarkAt::Point(threads, y),
        color: 0,
    };
    XyPanel {
        title: "speed-up over one thread, and the paper's two numbers".to_string(),
        x: thread_axis(measured),
        y: Axis {
            range: Some((0.8, 40.0)),
            ticks: Some(
                [1, 2, 4, 8, 16, 32]
                    .map(|t| (f64::from(t), t.to_string()))
                    .to_vec(),
            ),
            ..automatic("speed-up", Scale::Log2)
        },
        series,
        marks: vec![
            mark("whole run", published.figure4.total_speed_up),
            mark("outside CG", published.figure4.non_cg_speed_up),
        ],
        bands: Vec::new(),
    }
}

/// Time of each step of the whole runs: how the parts change as particles mix.
pub fn steps(measured: &Measured) -> Option<Figure> {
    let mut series = Vec::new();
    for (preset, name, color) in [
        (Preset::PAPER_LINKED_LIST, "linked list", LINKED_LIST),
        (Preset::PAPER_AOS_RELOCATION, "relocated", RELOCATED),
    ] {
        let windows =
            measured.windows("table2", Stage::Whole, &Cell::new(preset.name(), "sqrt", 1));
        let (_, windows) = windows.into_iter().next()?;
        let steps: Vec<_> = windows.iter().flat_map(|w| &w.steps).collect();
        let points = |value: fn(&crate::experiment::record::StepSample) -> f64| -> Vec<Point> {
            steps
                .chunks(STEPS_PER_POINT)
                .map(|chunk| middle_of(chunk, value))
                .collect()
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
        description: "Milliseconds a step inside and outside CG over the whole run on one thread, for both searches; \
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
        note: stamp(measured),
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
    Point {
        x,
        y,
        low: None,
        high: None,
        label: None,
    }
}
