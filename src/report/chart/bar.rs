//! Panels of stacked bars in groups.

use anyhow::{Result, ensure};
use plotters::style::{RGBColor, WHITE};

use super::axis::{self, Direction, Ruler};
use super::frame::{self, FootLabels, Surround};
use super::legend::{Entry, Sample};
use super::style::{self, Anchor, Area, Canvas, GROUP_LABEL, INK, MUTED, POINT_LABEL};
use super::{Axis, Bar, BarPanel, Scale};

/// The colours of the segments from the bottom up, in an order that keeps neighbours apart.
const SEGMENT_COLORS: [usize; 7] = [5, 1, 3, 7, 2, 6, 4];

const WIDEST_BAR: f64 = 64.0;
const CAP_REACH: f64 = 5.0;
const HATCH_STEP: f64 = 6.0;

/// The room beside a group, in widths of a bar's slot.
const GROUP_GAP: f64 = 0.7;

fn segment_color(index: usize) -> usize {
    SEGMENT_COLORS[index % SEGMENT_COLORS.len()]
}

/// The legend of a panel: the segments from the bottom up, then what hatching means.
pub(super) fn entries(panel: &BarPanel) -> Vec<Entry> {
    let segments = panel.segments.iter().enumerate();
    let mut entries: Vec<Entry> = segments
        .map(|(index, label)| Entry {
            label: label.clone(),
            sample: Sample::Segment { color: segment_color(index) },
        })
        .collect();
    if bars(panel).any(|bar| bar.published) {
        entries.push(Entry { label: "hatched: published value".to_owned(), sample: Sample::Published });
    }
    entries
}

fn bars(panel: &BarPanel) -> impl Iterator<Item = &Bar> {
    panel.groups.iter().flat_map(|group| &group.bars)
}

/// A value that a bar can show; a stack has no place for anything else.
fn length(value: f64) -> f64 {
    Scale::Linear.place(value).unwrap_or(0.0).max(0.0)
}

fn total(bar: &Bar) -> f64 {
    bar.values.iter().copied().map(length).sum()
}

fn has_value(bar: &Bar) -> bool {
    bar.values.iter().any(|value| value.is_finite())
}

/// The interval of the total in rising order, if both of its ends can be shown.
fn interval(bar: &Bar) -> Option<(f64, f64)> {
    let (one, other) = bar.interval?;
    let ends = Scale::Linear.place(one).zip(Scale::Linear.place(other))?;
    Some((length(ends.0.min(ends.1)), length(ends.0.max(ends.1))))
}

fn top(bar: &Bar) -> f64 {
    interval(bar).map_or(0.0, |(_, high)| high).max(total(bar))
}

/// Draws the panel without its legend.
pub(super) fn draw(canvas: &Canvas, panel: &BarPanel, area: Area) -> Result<()> {
    for bar in bars(panel) {
        let (values, segments) = (bar.values.len(), panel.segments.len());
        ensure!(values == segments, "the bar {:?} has {values} values for {segments} segments", bar.label);
    }
    let y = heights(panel)?;
    let surround = Surround { title: &panel.title, x_label: "", y_label: &panel.y_label, y: &y };
    let (left, right) = surround.sides(area);
    let slots = Slots::new(panel, left, right);
    let labels = FootLabels::fit(bars(panel).map(|bar| &bar.label), slots.width - 4.0);
    let group_lines = slots.group_lines(panel);
    let group_depth = group_lines.iter().map(Vec::len).max().unwrap_or(0) as f64 * GROUP_LABEL.line_height();
    let plot = surround.plot(area, labels.depth() + group_depth + 8.0);
    surround.draw_names(canvas, plot, area)?;
    surround.draw_heights(canvas, plot)?;
    if !bars(panel).any(has_value) {
        frame::draw_no_data(canvas, plot)?;
    }
    let stand = Stand {
        y: &y,
        plot,
        slots: &slots,
        shows_totals: totals_fit(panel, slots.width),
        counts: bars(panel).flat_map(|bar| &bar.values).all(|value| value.fract() == 0.0),
    };
    for (index, (bar, center)) in bars(panel).zip(&slots.centers).enumerate() {
        stand.draw_bar(canvas, bar, *center)?;
        labels.draw(canvas, index, *center, plot.bottom)?;
    }
    frame::draw_edges(canvas, plot)?;
    slots.draw_groups(canvas, &group_lines, plot.bottom + labels.depth() + 4.0)
}

/// The ruler of the heights, with room for the totals above the bars.
fn heights(panel: &BarPanel) -> Result<Ruler> {
    let highest = bars(panel).map(top).fold(0.0, f64::max);
    let range = (highest > 0.0).then_some((0.0, highest * 1.1));
    let axis = Axis { label: panel.y_label.clone(), scale: Scale::Linear, range, ticks: None };
    Ruler::new(&axis, &[], Direction::Up)
}

fn totals_fit(panel: &BarPanel, width: f64) -> bool {
    bars(panel).all(|bar| POINT_LABEL.width(&axis::three_digits(total(bar))) <= width - 2.0)
}

/// The places of the bars along the lower edge.
struct Slots {
    width: f64,
    centers: Vec<f64>,
    /// The left and the right edge of each group.
    groups: Vec<(f64, f64)>,
}

impl Slots {
    fn new(panel: &BarPanel, left: f64, right: f64) -> Self {
        let sizes: Vec<f64> = panel.groups.iter().map(|group| group.bars.len().max(1) as f64).collect();
        let all = sizes.iter().map(|size| size + GROUP_GAP).sum::<f64>().max(1.0);
        let width = (right - left) / all;
        let (mut centers, mut groups) = (Vec::new(), Vec::new());
        let mut start = left;
        for (group, size) in panel.groups.iter().zip(&sizes) {
            let first = start + GROUP_GAP / 2.0 * width;
            centers.extend((0..group.bars.len()).map(|index| first + (index as f64 + 0.5) * width));
            groups.push((first, first + size * width));
            start += (size + GROUP_GAP) * width;
        }
        Self { width, centers, groups }
    }

    fn group_lines(&self, panel: &BarPanel) -> Vec<Vec<String>> {
        let room = GROUP_GAP * self.width * 0.6;
        let pairs = panel.groups.iter().zip(&self.groups);
        pairs.map(|(group, (left, right))| GROUP_LABEL.wrap_hard(&group.label, right - left + room)).collect()
    }

    /// Draws a bracket under the bars of each group and its name below that.
    fn draw_groups(&self, canvas: &Canvas, lines: &[Vec<String>], top: f64) -> Result<()> {
        for (lines, (left, right)) in lines.iter().zip(&self.groups) {
            if !lines.is_empty() {
                canvas.line(&[(left + 4.0, top), (right - 4.0, top)], MUTED, 0.75)?;
            }
            let first = (f64::midpoint(*left, *right), top + GROUP_LABEL.size + 3.0);
            canvas.lines(lines, first, Anchor::Middle, GROUP_LABEL)?;
        }
        Ok(())
    }
}

/// Where the bars stand.
struct Stand<'p> {
    y: &'p Ruler,
    plot: Area,
    slots: &'p Slots,
    shows_totals: bool,
    /// Whether all values are whole numbers, which need no digits behind the point.
    counts: bool,
}

impl Stand<'_> {
    fn level(&self, value: f64) -> f64 {
        self.plot.bottom - self.y.fraction(value).unwrap_or(0.0) * self.plot.height()
    }

    fn draw_bar(&self, canvas: &Canvas, bar: &Bar, center: f64) -> Result<()> {
        if !has_value(bar) {
            return Ok(());
        }
        let reach = (self.slots.width * 0.76).min(WIDEST_BAR) / 2.0;
        let mut below = 0.0;
        for (index, value) in bar.values.iter().copied().map(length).enumerate() {
            let (top, bottom) = (self.level(below + value), self.level(below));
            let area = Area { left: center - reach, top, right: center + reach, bottom };
            let color = style::palette(segment_color(index));
            match bar.published {
                true => draw_hatched_box(canvas, area, color)?,
                false => draw_box(canvas, area, color)?,
            }
            below += value;
        }
        self.draw_interval(canvas, bar, center)?;
        if self.shows_totals {
            self.draw_total(canvas, bar, center)?;
        }
        Ok(())
    }

    /// Draws the sum of the values above the bar, on a white ground that keeps grid lines out of
    /// the digits.
    fn draw_total(&self, canvas: &Canvas, bar: &Bar, center: f64) -> Result<()> {
        let text = if self.counts { format!("{:.0}", total(bar)) } else { axis::three_digits(total(bar)) };
        let baseline = self.level(top(bar)) - 5.0;
        let reach = POINT_LABEL.width(&text) / 2.0 + 1.0;
        let (top, bottom) = (baseline - POINT_LABEL.cap_height() - 1.5, baseline + 1.5);
        let ground = Area { left: center - reach, top, right: center + reach, bottom };
        canvas.rectangle(ground, WHITE, 1.0)?;
        canvas.text(&text, (center, baseline), Anchor::Middle, POINT_LABEL)
    }

    fn draw_interval(&self, canvas: &Canvas, bar: &Bar, center: f64) -> Result<()> {
        let Some((low, high)) = interval(bar) else {
            return Ok(());
        };
        let (low, high) = (self.level(low), self.level(high));
        canvas.line(&[(center, low), (center, high)], INK, 1.5)?;
        for level in [low, high] {
            canvas.line(&[(center - CAP_REACH, level), (center + CAP_REACH, level)], INK, 1.5)?;
        }
        Ok(())
    }
}

fn corners(area: Area) -> [(f64, f64); 4] {
    [(area.left, area.top), (area.right, area.top), (area.right, area.bottom), (area.left, area.bottom)]
}

/// Draws a segment of a measured bar.
pub(super) fn draw_box(canvas: &Canvas, area: Area, color: RGBColor) -> Result<()> {
    if area.height() < 0.05 {
        return Ok(());
    }
    canvas.rectangle(area, color, 1.0)
}

/// Draws a segment of a published bar: paler, outlined and hatched, so that it differs in print as
/// well.
pub(super) fn draw_hatched_box(canvas: &Canvas, area: Area, color: RGBColor) -> Result<()> {
    let (width, height) = (area.width(), area.height());
    if height < 0.05 {
        return Ok(());
    }
    canvas.rectangle(area, style::pale(color, 0.3), 1.0)?;
    let mut reach = HATCH_STEP;
    while reach < width + height {
        let (rise, run) = (reach.min(height), reach.min(width));
        let start = (area.left + reach - rise, area.bottom - rise);
        let end = (area.left + run, area.bottom - reach + run);
        canvas.line(&[start, end], color, 1.0)?;
        reach += HATCH_STEP;
    }
    canvas.outline(&corners(area), color, 1.0)
}
