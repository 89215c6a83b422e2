//! Peaks: what the machine reads, writes and computes at most.

use crate::experiment::peaks::{Peak, PeakKind, Peaks};
use crate::report::chart::{Figure, Line, Marker, Panel, Point, Scale, Series, XyPanel};
use crate::report::measured::Measured;
use crate::report::peaks;
use crate::report::section::{Content, automatic};
use crate::report::table::TableView;

/// What there is to say about the peaks that an experiment measured; nothing where it measured none.
pub fn content_of(measured: &Measured, id: &str) -> Content {
    let found = peaks::of(measured, id);
    if found.is_empty() {
        return Content::default();
    }
    Content {
        findings: found.iter().filter_map(|peaks| finding(peaks)).collect(),
        figures: vec![(format!("{id}-peaks"), figure(measured, &found))],
        tables: vec![table(&found)],
        ..Content::default()
    }
}

fn finding(peaks: &Peaks) -> Option<String> {
    let reading = peaks.reading();
    let (computing, smallest, largest) = (peaks.computing()?, reading.first()?, reading.last()?);
    Some(format!(
        "On {} the machine computes at most {:.1} GFLOP/s in double precision ({}), and reads {:.1} GB/s from \
         arrays of {} and {:.1} GB/s from arrays of {} a thread.",
        threads(peaks),
        giga(computing),
        peaks.instructions,
        giga(smallest),
        size(smallest.working_set_bytes),
        giga(largest),
        size(largest.working_set_bytes),
    ))
}

fn threads(peaks: &Peaks) -> String {
    match peaks.threads {
        1 => "1 thread".to_string(),
        count => format!("{count} threads"),
    }
}

fn giga(peak: &Peak) -> f64 {
    peak.median_per_s / 1e9
}

/// A power of two as people write it.
pub(super) fn size(bytes: u64) -> String {
    match bytes {
        0 => "registers".to_string(),
        bytes if bytes < 1 << 20 => format!("{} KiB", bytes >> 10),
        bytes => format!("{} MiB", bytes >> 20),
    }
}

fn figure(measured: &Measured, found: &[&Peaks]) -> Figure {
    let mut series = Vec::new();
    for (k, peaks) in found.iter().enumerate() {
        for (kind, color, markers) in [
            (PeakKind::Read, 5, [Marker::OpenCircle, Marker::Circle]),
            (PeakKind::Triad, 6, [Marker::OpenSquare, Marker::Square]),
        ] {
            let of_kind = peaks.peaks.iter().filter(|peak| peak.kind == kind);
            let point = |peak: &Peak| Point {
                x: peak.working_set_bytes as f64 / f64::from(1 << 20),
                y: giga(peak),
                low: Some(peak.lowest_per_s / 1e9),
                high: Some(peak.highest_per_s / 1e9),
                label: None,
            };
            series.push(Series {
                label: format!("{}, {}", kind.name(), threads(peaks)),
                color,
                line: if k == 0 { Line::Dashed } else { Line::Solid },
                marker: markers[k.min(1)],
                points: of_kind.map(point).collect(),
            });
        }
    }
    Figure {
        title: "How fast this machine reads and writes".to_string(),
        description: "Gigabytes a second of all threads together against the size of what each thread goes through \
                      again and again, both logarithmic: the sum of an array, and the triad a = b + s c, which counts \
                      two arrays read and one written. Medians, with the lowest and highest repetition."
            .to_string(),
        panels: vec![Panel::Xy(XyPanel {
            title: String::new(),
            x: automatic("working set of a thread (MiB)", Scale::Log2),
            y: automatic("GB/s", Scale::Log10),
            series,
            marks: Vec::new(),
            bands: Vec::new(),
        })],
        note: measured.stamp(),
    }
}

fn table(found: &[&Peaks]) -> TableView {
    let mut view = TableView::new(
        "The machine's peaks, all threads together: median of the repetitions, lowest and highest. Working sets are a \
         thread's.",
        &["threads", "loop", "working set", "median", "lowest", "highest", "unit", "instructions"],
    );
    for peaks in found {
        for peak in &peaks.peaks {
            let number = |rate: f64| format!("{:.2}", rate / 1e9);
            view.rows.push(vec![
                peaks.threads.to_string(),
                peak.kind.name().to_string(),
                size(peak.working_set_bytes),
                number(peak.median_per_s),
                number(peak.lowest_per_s),
                number(peak.highest_per_s),
                peak.kind.unit().to_string(),
                peaks.instructions.clone(),
            ]);
        }
    }
    view
}
