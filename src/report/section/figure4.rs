//! Figure 4: time against threads, and parallel efficiency beside the two speed-ups that the paper prints.

use anyhow::Result;

use crate::base::statistics::{Estimate, Interval};
use crate::engine::preset::Preset;
use crate::report::chart::{Axis, Figure, Line, Mark, MarkAt, Marker, Panel, Point, Scale, Series, XyPanel};
use crate::report::measured::{ByRound, Cell, Measured, Quantity, ratio, times};
use crate::report::model::{relative_time, serial_share};
use crate::report::published::Published;
use crate::report::section::{Content, FAST, LINKED_LIST, RELOCATED, automatic, how_measured, point};
use crate::report::summary::CellPhase;
use crate::report::table::phases_view;

/// The section.
pub fn content(measured: &Measured, phases: &[CellPhase]) -> Result<Content> {
    Ok(Content {
        findings: vec![how_measured(measured, "figure4")],
        figures: vec![("figure4".to_string(), figure4(measured))],
        tables: vec![phases_view(phases, "figure4")],
        ..Content::default()
    })
}

/// One search and one part of the step.
struct Curve {
    label: &'static str,
    preset: Preset,
    test: &'static str,
    quantity: Quantity,
    color: usize,
    marker: Marker,
}

const CURVES: [Curve; 6] = [
    Curve {
        label: "whole run, linked list",
        preset: Preset::PAPER_LINKED_LIST,
        test: "sqrt",
        quantity: Quantity::Total,
        color: LINKED_LIST,
        marker: Marker::Circle,
    },
    Curve {
        label: "whole run, relocated",
        preset: Preset::PAPER_AOS_RELOCATION,
        test: "sqrt",
        quantity: Quantity::Total,
        color: RELOCATED,
        marker: Marker::Square,
    },
    Curve {
        label: "outside CG, linked list",
        preset: Preset::PAPER_LINKED_LIST,
        test: "sqrt",
        quantity: Quantity::NonCg,
        color: LINKED_LIST,
        marker: Marker::OpenCircle,
    },
    Curve {
        label: "outside CG, relocated",
        preset: Preset::PAPER_AOS_RELOCATION,
        test: "sqrt",
        quantity: Quantity::NonCg,
        color: RELOCATED,
        marker: Marker::OpenSquare,
    },
    Curve {
        label: "whole run, beyond the paper: fast",
        preset: Preset::FAST,
        test: "squared",
        quantity: Quantity::Total,
        color: FAST,
        marker: Marker::Triangle,
    },
    Curve {
        label: "outside CG, beyond the paper: fast",
        preset: Preset::FAST,
        test: "squared",
        quantity: Quantity::NonCg,
        color: FAST,
        marker: Marker::OpenTriangle,
    },
];

/// The figure. Only measured points, the ideal lines from one thread, and - where enough thread counts were measured -
/// a model's points, named as such.
fn figure4(measured: &Measured) -> Figure {
    let published = Published::load();
    Figure {
        title: "Figure 4: time against the number of threads".to_string(),
        description: "Left: seconds of the whole run and of its part outside CG against the number of threads, with \
                      and without relocation, bars spanning all rounds, and the lines of ideal scaling. Right: parallel \
                      efficiency, the speed-up over one thread of the same search divided by the number of threads, with \
                      95 % intervals; \
                      stars are the two largest speed-ups that the paper prints, the only numbers it gives."
            .to_string(),
        panels: vec![
            Panel::Xy(times_panel(measured, published.steps as f64)),
            Panel::Xy(efficiency_panel(measured, &published)),
        ],
        note: measured.stamp(),
    }
}

fn thread_axis(measured: &Measured) -> Axis {
    let threads = measured.thread_counts("figure4");
    let most = threads.iter().copied().max().unwrap_or(1) as f64;
    Axis {
        label: "threads".to_string(),
        scale: Scale::Log2,
        range: Some((0.9, 1.15 * most)),
        ticks: Some(threads.iter().map(|&t| (t as f64, t.to_string())).collect()),
    }
}

fn per_step(measured: &Measured, curve: &Curve, threads: usize) -> ByRound {
    let stage = measured.stage_for_tables("figure4");
    let cell = Cell::new(curve.preset.name(), curve.test, threads);
    measured.per_step("figure4", stage, &cell, curve.quantity)
}

/// A curve with one estimate a thread count; those without a successful round are left out.
fn series(measured: &Measured, curve: &Curve, value: impl Fn(usize) -> Option<Estimate>) -> Series {
    let threads = measured.threads("figure4").into_iter();
    Series {
        label: curve.label.to_string(),
        color: curve.color,
        line: Line::Solid,
        marker: curve.marker,
        points: threads.filter_map(|t| Some(point(t as f64, value(t)?))).collect(),
    }
}

fn times_panel(measured: &Measured, steps: f64) -> XyPanel {
    let mut all = Vec::new();
    for (k, curve) in CURVES.iter().enumerate() {
        let seconds = |t: usize| Some(times(&per_step(measured, curve, t))?.scaled(steps));
        let curve_series = series(measured, curve, seconds);
        if let Some(first) = curve_series.points.iter().find(|point| point.x == 1.0) {
            let label = if k == 0 { "ideal scaling" } else { "" };
            all.push(ideal(measured, first.y, curve, label));
            all.extend(modelled(measured, curve, first.y));
        }
        all.push(curve_series);
    }
    all.retain(|series: &Series| !series.points.is_empty());
    XyPanel {
        title: "time of the run".to_string(),
        x: thread_axis(measured),
        y: automatic("seconds", Scale::Log10),
        series: all,
        marks: Vec::new(),
        bands: Vec::new(),
    }
}

/// The times that perfect scaling from one thread would give.
fn ideal(measured: &Measured, one_thread: f64, curve: &Curve, label: &str) -> Series {
    let time = |t: usize| Point { x: t as f64, y: one_thread / t as f64, low: None, high: None, label: None };
    Series {
        label: label.to_string(),
        color: curve.color,
        line: Line::Dashed,
        marker: Marker::None,
        points: measured.thread_counts("figure4").into_iter().map(time).collect(),
    }
}

/// Amdahl's law at the thread counts that this machine cannot run.
fn modelled(measured: &Measured, curve: &Curve, one_thread: f64) -> Option<Series> {
    let there = measured.threads("figure4");
    let times: Vec<_> = there.iter().map(|&t| (t, per_step(measured, curve, t))).collect();
    let share = serial_share(&times)?;
    let at = |t: usize| {
        let time = |share: f64| one_thread * relative_time(share, t);
        let interval = share.interval.map(|i| Interval { low: time(i.low), high: time(i.high) });
        point(t as f64, Estimate { interval, ..Estimate::single(time(share.median)) })
    };
    let missing: Vec<Point> =
        measured.thread_counts("figure4").into_iter().filter(|t| !there.contains(t)).map(at).collect();
    (!missing.is_empty()).then(|| Series {
        label: format!("{}: Amdahl model, serial share {:.3}", curve.label, share.median),
        color: curve.color,
        line: Line::None,
        marker: Marker::Cross,
        points: missing,
    })
}

fn efficiency_panel(measured: &Measured, published: &Published) -> XyPanel {
    let efficiency = |curve: &Curve| {
        series(measured, curve, |t| {
            let speed_up = ratio(&per_step(measured, curve, 1), &per_step(measured, curve, t))?;
            Some(speed_up.scaled(1.0 / t as f64))
        })
    };
    let mut series: Vec<Series> = CURVES.iter().map(efficiency).collect();
    series.retain(|series| !series.points.is_empty());
    let tops = series.iter().flat_map(|s| &s.points).map(|p| p.high.unwrap_or(p.y));
    let most = 1.05 * tops.fold(0.0, f64::max);
    let threads = published.figure4.threads as f64;
    let mark = |part: &str, speed_up: f64, color: usize| Mark {
        label: format!("paper, {part}: {speed_up}x at {threads} threads"),
        at: MarkAt::Point(threads, speed_up / threads),
        color,
    };
    XyPanel {
        title: "parallel efficiency".to_string(),
        x: thread_axis(measured),
        y: Axis { range: Some((0.0, most.max(1.15))), ..automatic("speed-up / threads", Scale::Linear) },
        series,
        marks: vec![
            Mark { label: String::new(), at: MarkAt::Y(1.0), color: 0 },
            mark("whole run", published.figure4.total_speed_up, 0),
            mark("outside CG", published.figure4.non_cg_speed_up, 7),
        ],
        bands: Vec::new(),
    }
}
