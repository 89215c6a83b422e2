//! The legend under the plots, where it can hide no data.

use anyhow::Result;

use super::style::{self, Anchor, Area, Canvas, LEGEND_LABEL, Spot};
use super::{Line, Mark, MarkAt, Marker, bar, line};

const SAMPLE_WIDTH: f64 = 30.0;
const SAMPLE_GAP: f64 = 7.0;
const COLUMN_GAP: f64 = 22.0;
const ROW_GAP: f64 = 4.0;
const ROOM_ABOVE: f64 = 8.0;

/// What stands before a legend label.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Sample {
    Series { color: usize, line: Line, marker: Marker },
    AcrossMark { color: usize },
    UprightMark { color: usize },
    PointMark { color: usize },
    Band { color: usize },
    Segment { color: usize },
    Published,
}

impl Sample {
    pub(super) fn of_mark(mark: &Mark) -> Self {
        let color = mark.color;
        match mark.at {
            MarkAt::X(_) => Self::UprightMark { color },
            MarkAt::Y(_) => Self::AcrossMark { color },
            MarkAt::Point(_, _) => Self::PointMark { color },
        }
    }

    fn draw(self, canvas: &Canvas, (x, y): Spot) -> Result<()> {
        let middle = (x + SAMPLE_WIDTH / 2.0, y);
        let swatch = Area { left: x + 6.0, top: y - 6.0, right: x + SAMPLE_WIDTH - 6.0, bottom: y + 6.0 };
        match self {
            Self::Series { color, line: stroke, marker } => {
                line::draw_stroke(canvas, &[(x, y), (x + SAMPLE_WIDTH, y)], stroke, style::palette(color))?;
                line::draw_marker(canvas, middle, marker, style::palette(color))
            }
            Self::AcrossMark { color } => {
                line::draw_mark_line(canvas, [(x, y), (x + SAMPLE_WIDTH, y)], color)
            }
            Self::UprightMark { color } => {
                line::draw_mark_line(canvas, [(middle.0, y - 8.0), (middle.0, y + 8.0)], color)
            }
            Self::PointMark { color } => line::draw_star(canvas, middle, color),
            Self::Band { color } => line::draw_band(canvas, swatch, color),
            Self::Segment { color } => bar::draw_box(canvas, swatch, style::palette(color)),
            Self::Published => bar::draw_hatched_box(canvas, swatch, style::MUTED),
        }
    }
}

/// One line of a legend before it has a place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub(super) label: String,
    pub(super) sample: Sample,
}

/// A legend laid out in columns.
pub(super) struct Legend {
    rows: Vec<Vec<(Sample, Vec<String>)>>,
    column_widths: Vec<f64>,
}

impl Legend {
    /// Uses as many columns as the width holds, because a flat legend leaves the plots more room.
    pub(super) fn arrange(entries: &[Entry], width: f64) -> Self {
        let limit = width - SAMPLE_WIDTH - SAMPLE_GAP;
        let cells: Vec<_> =
            entries.iter().map(|entry| (entry.sample, LEGEND_LABEL.wrap_hard(&entry.label, limit))).collect();
        let columns = (1..=cells.len())
            .rev()
            .find(|&columns| total_width(&column_widths(&cells, columns)) <= width)
            .unwrap_or(1);
        let even_columns = cells.len().div_ceil(cells.len().div_ceil(columns).max(1)).max(1);
        Self {
            column_widths: column_widths(&cells, even_columns),
            rows: cells.chunks(even_columns).map(<[_]>::to_vec).collect(),
        }
    }

    /// The height that the legend takes, including the room above it.
    pub(super) fn height(&self) -> f64 {
        let rows: f64 = self.rows.iter().map(|row| row_height(row)).sum();
        if self.rows.is_empty() { 0.0 } else { rows + ROOM_ABOVE }
    }

    /// Draws the legend centred below `top`.
    pub(super) fn draw(&self, canvas: &Canvas, left: f64, right: f64, top: f64) -> Result<()> {
        let start = ((left + right - total_width(&self.column_widths)) / 2.0).max(left);
        let mut y = top + ROOM_ABOVE;
        for row in &self.rows {
            let mut x = start;
            for ((sample, lines), width) in row.iter().zip(&self.column_widths) {
                let middle = y + LEGEND_LABEL.line_height() / 2.0;
                sample.draw(canvas, (x, middle))?;
                let text = (x + SAMPLE_WIDTH + SAMPLE_GAP, middle + LEGEND_LABEL.cap_height() / 2.0);
                canvas.lines(lines, text, Anchor::Start, LEGEND_LABEL)?;
                x += width + COLUMN_GAP;
            }
            y += row_height(row);
        }
        Ok(())
    }
}

fn column_widths(cells: &[(Sample, Vec<String>)], columns: usize) -> Vec<f64> {
    let mut widths = vec![0.0_f64; columns];
    for (index, (_, lines)) in cells.iter().enumerate() {
        let width = SAMPLE_WIDTH + SAMPLE_GAP + LEGEND_LABEL.widest(lines);
        widths[index % columns] = widths[index % columns].max(width);
    }
    widths
}

fn total_width(columns: &[f64]) -> f64 {
    columns.iter().sum::<f64>() + COLUMN_GAP * (columns.len() as f64 - 1.0)
}

fn row_height(row: &[(Sample, Vec<String>)]) -> f64 {
    let lines = row.iter().map(|(_, lines)| lines.len()).max().unwrap_or(0);
    lines as f64 * LEGEND_LABEL.line_height() + ROW_GAP
}
