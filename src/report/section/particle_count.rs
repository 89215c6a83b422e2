//! Particle count: the same flow with more particles.

use anyhow::Result;

use crate::base::statistics::Estimate;
use crate::engine::preset::Preset;
use crate::experiment::record::Stage;
use crate::report::chart::{Axis, Figure, Line, Mark, MarkAt, Marker, Panel, Scale, Series, XyPanel};
use crate::report::measured::{Measured, Quantity, TimedCell, by_round, ratio, times};
use crate::report::published::Published;
use crate::report::section::{Content, LINKED_LIST, RELOCATED, automatic, how_measured, point};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show};

const ID: &str = "particle-count";

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    let sizes = sizes(measured);
    Ok(Content {
        findings: std::iter::once(how_measured(measured, ID)).chain(findings(&sizes)).collect(),
        figures: vec![("particle-count".to_string(), figure(measured, &sizes))],
        tables: vec![table(&sizes)],
        ..Content::default()
    })
}

/// One scene with one distance test.
struct Size {
    particles: usize,
    test: String,
    /// Nanoseconds a particle and step.
    list_non_cg_ns: Estimate,
    relocated_non_cg_ns: Estimate,
    cg_ns: Estimate,
    gain: Estimate,
    cg_share: Estimate,
    iterations: f64,
}

fn sizes(measured: &Measured) -> Vec<Size> {
    let cells = measured.cells(ID).into_iter();
    let lists = cells.filter(|cell| cell.variant.preset == Preset::PAPER_LINKED_LIST.name());
    lists.filter_map(|cell| size(measured, &cell)).collect()
}

fn size(measured: &Measured, list: &TimedCell) -> Option<Size> {
    let relocated = list.with_preset(Preset::PAPER_AOS_RELOCATION);
    let particles = measured.outcomes(ID, list).first()?.particles;
    let per_step = |cell: &TimedCell, quantity| measured.per_step(ID, Stage::Paired, cell, quantity);
    let ns =
        |cell: &TimedCell, quantity| Some(times(&per_step(cell, quantity))?.scaled(1e9 / particles as f64));
    let share = by_round(&per_step(list, Quantity::Cg), &per_step(list, Quantity::Total), |a, b| a / b);
    let windows = measured.windows(ID, Stage::Paired, list);
    let steps: Vec<usize> =
        windows.values().next()?.iter().flat_map(|w| &w.steps).map(|step| step.cg_iterations).collect();
    Some(Size {
        particles,
        test: list.variant.distance_test.clone(),
        list_non_cg_ns: ns(list, Quantity::NonCg)?,
        relocated_non_cg_ns: ns(&relocated, Quantity::NonCg)?,
        cg_ns: ns(list, Quantity::Cg)?,
        gain: ratio(&per_step(list, Quantity::NonCg), &per_step(&relocated, Quantity::NonCg))?,
        cg_share: Estimate::of_rounds(&share)?,
        iterations: steps.iter().sum::<usize>() as f64 / steps.len() as f64,
    })
}

/// From the smallest to the largest scene, with each distance test.
fn findings(sizes: &[Size]) -> Vec<String> {
    let mut findings = Vec::new();
    for test in ["sqrt", "squared"] {
        let of_test = || sizes.iter().filter(|size| size.test == test);
        let (Some(small), Some(large)) =
            (of_test().min_by_key(|s| s.particles), of_test().max_by_key(|s| s.particles))
        else {
            continue;
        };
        findings.push(format!(
            "{test}, from {} to {} particles: outside CG a particle and step of the list cost {} and {} ns; list over \
             relocation goes from {} to {}; CG takes {:.1} and {:.1} iterations, {} and {} of the time.",
            small.particles,
            large.particles,
            show(&small.list_non_cg_ns, 0),
            show(&large.list_non_cg_ns, 0),
            show(&small.gain, 3),
            show(&large.gain, 3),
            small.iterations,
            large.iterations,
            show(&small.cg_share, 3),
            show(&large.cg_share, 3),
        ));
    }
    findings
}

fn figure(measured: &Measured, sizes: &[Size]) -> Figure {
    Figure {
        title: "The same flow with more particles".to_string(),
        description: "Left: nanoseconds a particle and step outside CG, with the linked list and with relocation, and \
                      in CG, against the number of particles. Right: the ratio of list to relocation outside CG; the \
                      star is the paper's. Bars span all rounds of times and 95 % intervals of ratios."
            .to_string(),
        panels: vec![Panel::Xy(cost_panel(sizes)), Panel::Xy(gain_panel(sizes))],
        note: measured.stamp(),
    }
}

fn cost_panel(sizes: &[Size]) -> XyPanel {
    let one = |label: &str, test: &str, color: usize, marker: Marker, value: fn(&Size) -> Estimate| {
        series(sizes, (label, test), (color, marker), value)
    };
    XyPanel {
        title: "cost".to_string(),
        x: x_axis(sizes),
        y: automatic("ns a particle and step", Scale::Linear),
        series: vec![
            one("list outside CG", "sqrt", LINKED_LIST, Marker::Circle, |s| s.list_non_cg_ns),
            one("relocated outside CG", "sqrt", RELOCATED, Marker::Square, |s| s.relocated_non_cg_ns),
            one("list outside CG", "squared", LINKED_LIST, Marker::OpenCircle, |s| s.list_non_cg_ns),
            one("relocated outside CG", "squared", RELOCATED, Marker::OpenSquare, |s| s.relocated_non_cg_ns),
            one("CG", "sqrt", 3, Marker::Triangle, |s| s.cg_ns),
        ],
        marks: Vec::new(),
        bands: Vec::new(),
    }
}

fn gain_panel(sizes: &[Size]) -> XyPanel {
    let paper = Published::load();
    let gain = paper.table2.speed_up.non_cg;
    let at = MarkAt::Point(paper.particles as f64, gain);
    XyPanel {
        title: "gain of relocation".to_string(),
        x: x_axis(sizes),
        y: automatic("list / relocated", Scale::Linear),
        series: vec![
            series(sizes, ("outside CG", "sqrt"), (3, Marker::Circle), |s| s.gain),
            series(sizes, ("outside CG", "squared"), (1, Marker::Square), |s| s.gain),
        ],
        marks: vec![
            Mark { label: String::new(), at: MarkAt::Y(1.0), color: 0 },
            Mark { label: format!("paper: {gain}x"), at, color: 0 },
        ],
        bands: Vec::new(),
    }
}

fn x_axis(sizes: &[Size]) -> Axis {
    Axis { ticks: Some(ticks(sizes)), range: range(sizes), ..automatic("particles", Scale::Log10) }
}

/// One number of the scenes with a distance test, in a colour and with a marker.
fn series(
    sizes: &[Size],
    (label, test): (&str, &str),
    (color, marker): (usize, Marker),
    value: fn(&Size) -> Estimate,
) -> Series {
    let of_test = sizes.iter().filter(|size| size.test == test);
    Series {
        label: format!("{label}, {test}"),
        color,
        line: if test == "sqrt" { Line::Solid } else { Line::Dashed },
        marker,
        points: of_test.map(|size| point(size.particles as f64, value(size))).collect(),
    }
}

fn ticks(sizes: &[Size]) -> Vec<(f64, String)> {
    let mut counts: Vec<usize> = sizes.iter().map(|size| size.particles).collect();
    counts.sort_unstable();
    counts.dedup();
    counts.into_iter().map(|count| (count as f64, count.to_string())).collect()
}

fn range(sizes: &[Size]) -> Option<(f64, f64)> {
    let counts = || sizes.iter().map(|size| size.particles as f64);
    Some((0.8 * counts().reduce(f64::min)?, 1.25 * counts().reduce(f64::max)?))
}

fn table(sizes: &[Size]) -> TableView {
    let mut view = TableView::new(
        "Nanoseconds a particle and step (smallest to largest round), the gain of relocation [95 % interval], and CG.",
        &[
            "particles",
            "distance test",
            "list outside CG, ns",
            "relocated outside CG, ns",
            "list / relocated",
            "CG, ns",
            "CG's share (list)",
            "CG iterations",
        ],
    );
    for size in sizes {
        view.rows.push(vec![
            size.particles.to_string(),
            size.test.clone(),
            show(&size.list_non_cg_ns, 0),
            show(&size.relocated_non_cg_ns, 0),
            show(&size.gain, 3),
            show(&size.cg_ns, 0),
            show(&size.cg_share, 3),
            format!("{:.1}", size.iterations),
        ]);
    }
    view
}
