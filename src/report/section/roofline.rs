//! Roofline: how near the loops of a step come to what the machine computes and reads at most.

use crate::base::statistics::Estimate;
use crate::engine::preset::{Preset, Search};
use crate::experiment::peaks::{Peak, Peaks};
use crate::experiment::record::Stage;
use crate::report::chart::{Figure, Line, Marker, Panel, Point, Scale, Series, XyPanel};
use crate::report::measured::{Measured, Quantity, TimedCell, times};
use crate::report::peaks;
use crate::report::roofline::{Stored, Work, of_assembly, of_solve};
use crate::report::section::peaks::size;
use crate::report::section::scaling_figure::color;
use crate::report::section::{Content, automatic};
use crate::report::table::TableView;

/// The presets that are shown, with the squared distance test.
const SHOWN: [Preset; 2] = [Preset::PAPER_LINKED_LIST, Preset::FAST];

/// A loop of a step of one cell.
struct Loop {
    name: &'static str,
    preset: String,
    particles: usize,
    work: Work,
    /// Seconds a step.
    time_s: Estimate,
    /// Bytes of the matrix.
    matrix_bytes: f64,
}

impl Loop {
    fn giga(&self, amount: f64) -> f64 {
        amount / self.time_s.median / 1e9
    }
}

/// What there is to say where an experiment measured the machine's peaks on one thread and noted what matrices hold.
pub fn content_of(measured: &Measured, id: &str) -> Content {
    let found = peaks::of(measured, id);
    let Some(peaks) = found.into_iter().find(|peaks| peaks.threads == 1) else { return Content::default() };
    let cells = measured.cells(id);
    let shown = |cell: &&TimedCell| {
        let named = SHOWN.iter().any(|preset| preset.name() == cell.variant.preset);
        named && cell.threads == 1 && cell.variant.distance_test == "squared"
    };
    let loops: Vec<Loop> =
        cells.iter().filter(shown).filter_map(|cell| loops(measured, id, cell)).flatten().collect();
    let (false, Some(roofs)) = (loops.is_empty(), Roofs::of(peaks)) else { return Content::default() };
    Content {
        findings: finding(&loops, &roofs).into_iter().collect(),
        figures: vec![(format!("{id}-roofline"), figure(measured, &loops, &roofs))],
        tables: vec![table(&loops, &roofs)],
        ..Content::default()
    }
}

/// The solve and the matrix's making of a cell.
fn loops(measured: &Measured, id: &str, cell: &TimedCell) -> Option<[Loop; 2]> {
    let windows = measured.windows(id, Stage::Paired, cell);
    let steps: Vec<_> = windows.values().next()?.iter().flat_map(|window| &window.steps).collect();
    let count = steps.len() as f64;
    let iterations = steps.iter().map(|step| step.cg_iterations as f64).sum::<f64>() / count;
    let values: Option<f64> = steps.iter().map(|step| step.matrix_entries.map(|values| values as f64)).sum();
    let matrix = Stored {
        rows: steps.iter().map(|step| step.unknowns as f64).sum::<f64>() / count,
        values: values? / count,
        bytes_a_value: bytes_a_value(cell)?,
    };
    let particles = measured.outcomes(id, cell).first()?.particles;
    let time = |quantity| times(&measured.per_step(id, Stage::Paired, cell, quantity));
    let make = |name, work, time_s| Loop {
        name,
        preset: cell.variant.preset.clone(),
        particles,
        work,
        time_s,
        matrix_bytes: matrix.values * matrix.bytes_a_value,
    };
    Some([
        make("CG", of_solve(matrix, iterations), time(Quantity::Cg)?),
        make("matrix", of_assembly(matrix), time(Quantity::Matrix)?),
    ])
}

/// Of a value and its share of an index of four bytes. The eight rows of a cluster share one, beside which a bit a row says who
/// has a value: about half of them do.
fn bytes_a_value(cell: &TimedCell) -> Option<f64> {
    let preset: Preset = cell.variant.preset.parse().ok()?;
    let value = if cell.variant.matrix_values == "f32" { 4.0 } else { 8.0 };
    Some(value + if preset.options().search == Search::Clusters { 1.25 } else { 4.0 })
}

/// What the machine computes, and reads from arrays of each size, the smallest first.
struct Roofs<'a> {
    computing: &'a Peak,
    reading: Vec<&'a Peak>,
}

impl<'a> Roofs<'a> {
    fn of(peaks: &'a Peaks) -> Option<Self> {
        let (computing, reading) = (peaks.computing()?, peaks.reading());
        (!reading.is_empty()).then_some(Roofs { computing, reading })
    }

    /// How fast the machine reads an array of so many bytes: the rate of the smallest array measured that is as large, or of
    /// the largest.
    fn reading_of(&self, bytes: f64) -> &'a Peak {
        let as_large = self.reading.iter().find(|peak| peak.working_set_bytes as f64 >= bytes);
        as_large.unwrap_or(&self.reading[self.reading.len() - 1])
    }

    /// What share of the roof a loop reaches that goes through the matrix again and again.
    fn share(&self, of: &Loop) -> f64 {
        let read = self.reading_of(of.matrix_bytes).median_per_s;
        of.work.flops / of.time_s.median / of.work.roof(self.computing.median_per_s, read)
    }
}

/// The shares of the largest scene's solves.
fn finding(loops: &[Loop], roofs: &Roofs<'_>) -> Option<String> {
    let most = loops.iter().map(|l| l.particles).max()?;
    let solves = loops.iter().filter(|l| l.name == "CG" && l.particles == most);
    let shares: Vec<String> = solves.map(|l| format!("{:.2} with {}", roofs.share(l), l.preset)).collect();
    Some(format!(
        "By the model of the roofline, the solve of {most} particles runs at these shares of what reading an array as large as its \
         matrix allows: {}. What a preconditioner does counts as time, not as work.",
        shares.join(", ")
    ))
}

fn figure(measured: &Measured, loops: &[Loop], roofs: &Roofs<'_>) -> Figure {
    let mut series: Vec<Series> = roof_lines(loops, roofs);
    for (name, markers) in
        [("CG", [Marker::Circle, Marker::Square]), ("matrix", [Marker::OpenCircle, Marker::OpenSquare])]
    {
        for (preset, marker) in SHOWN.iter().zip(markers) {
            let of_series = loops.iter().filter(|l| l.name == name && l.preset == preset.name());
            let mut points: Vec<(usize, Point)> = of_series.map(|l| (l.particles, place(l))).collect();
            points.sort_by_key(|(particles, _)| *particles);
            let Some((most, last)) = points.last_mut() else { continue };
            last.label = Some(most.to_string());
            series.push(Series {
                label: format!("{}, {name}", preset.name()),
                color: color(preset.name(), 0),
                line: Line::None,
                marker,
                points: points.into_iter().map(|(_, point)| point).collect(),
            });
        }
    }
    Figure {
        title: "Two loops of a step below the machine's roofs".to_string(),
        description: "Gigaflops a second against flops a byte, both logarithmic, on one thread. Lines are the machine's peaks: \
                      what it computes, and what it reads from arrays of three sizes. Points are the solve and the making of \
                      the matrix of two presets, one a number of particles, the largest of which stands at its point; flops and bytes are the fewest that the \
                      algorithm needs, by a model, times are measured."
            .to_string(),
        panels: vec![Panel::Xy(XyPanel {
            title: String::new(),
            x: automatic("flops a byte (model)", Scale::Log2),
            y: automatic("GFLOP/s", Scale::Log10),
            series,
            marks: Vec::new(),
            bands: Vec::new(),
        })],
        note: measured.stamp(),
    }
}

fn place(of: &Loop) -> Point {
    let bounds = of.time_s.bounds();
    Point {
        x: of.work.intensity(),
        y: of.giga(of.work.flops),
        low: bounds.map(|b| of.work.flops / b.high / 1e9),
        high: bounds.map(|b| of.work.flops / b.low / 1e9),
        label: None,
    }
}

/// A line for the smallest, a middle and the largest array.
fn roof_lines(loops: &[Loop], roofs: &Roofs<'_>) -> Vec<Series> {
    let intensities = || loops.iter().map(|l| l.work.intensity());
    let first = intensities().fold(f64::INFINITY, f64::min) / 2.0;
    let (compute, most) = (roofs.computing.median_per_s, intensities().fold(0.0, f64::max) * 2.0);
    let mut chosen = vec![0, roofs.reading.len() / 2, roofs.reading.len() - 1];
    chosen.dedup();
    let lines = chosen.into_iter().enumerate().map(|(k, place)| {
        let (peak, point) =
            (roofs.reading[place], |x: f64, y: f64| Point { x, y, low: None, high: None, label: None });
        let ridge = compute / peak.median_per_s;
        let at = |x: f64| point(x, compute.min(x * peak.median_per_s) / 1e9);
        let last = most.max(2.0 * ridge);
        Series {
            label: format!("roof: reads from {}", size(peak.working_set_bytes)),
            color: [0, 7, 1][k],
            line: if k == 0 { Line::Solid } else { Line::Dashed },
            marker: Marker::None,
            points: [first, ridge, last].map(at).to_vec(),
        }
    });
    lines.collect()
}

fn table(loops: &[Loop], roofs: &Roofs<'_>) -> TableView {
    let mut view = TableView::new(
        "Two loops on one thread against the machine's peaks, medians. Flops and bytes a step by the model: of an \
         iteration two flops a value and twelve a row, and the bytes of the matrix and of twelve vectors; of the matrix \
         thirteen flops a value and what is written. The roof is that of an array as large as the matrix.",
        &[
            "particles",
            "preset",
            "loop",
            "matrix, MiB",
            "flops a byte",
            "GFLOP/s",
            "GB/s",
            "share of the roof",
        ],
    );
    for l in loops {
        view.rows.push(vec![
            l.particles.to_string(),
            l.preset.clone(),
            l.name.to_string(),
            format!("{:.1}", l.matrix_bytes / f64::from(1 << 20)),
            format!("{:.3}", l.work.intensity()),
            format!("{:.2}", l.giga(l.work.flops)),
            format!("{:.1}", l.giga(l.work.bytes)),
            format!("{:.2}", roofs.share(l)),
        ]);
    }
    view
}
