//! The part of a panel that lines and bars share: title, grid, axes and their labels.

use anyhow::Result;

use super::axis::Ruler;
use super::style::{
    AXIS_LABEL, Anchor, Area, Canvas, FAINT_GRID, GRID, INK, NO_DATA, PANEL_TITLE, TICK_LABEL,
};

const TICK_LENGTH: f64 = 4.0;
const LABEL_GAP: f64 = 4.0;

/// The texts around a plot and the ruler of its heights.
pub(super) struct Surround<'p> {
    pub(super) title: &'p str,
    pub(super) x_label: &'p str,
    pub(super) y_label: &'p str,
    pub(super) y: &'p Ruler,
}

impl Surround<'_> {
    /// How far left of the plot the tick labels of the heights reach.
    fn label_depth(&self) -> f64 {
        TICK_LENGTH + LABEL_GAP + TICK_LABEL.widest(self.y.ticks.iter().map(|tick| &tick.label))
    }

    /// The plot's left and right edge inside a panel.
    pub(super) fn sides(&self, panel: Area) -> (f64, f64) {
        let rows = AXIS_LABEL.wrap(self.y_label, panel.height() * 0.8).len() as f64;
        let left = panel.left + rows * AXIS_LABEL.line_height() + self.label_depth() + 9.0;
        (left, panel.right - 14.0)
    }

    /// The plot inside a panel when the labels below it need `depth` pixels.
    pub(super) fn plot(&self, panel: Area, depth: f64) -> Area {
        let (left, right) = self.sides(panel);
        let title = PANEL_TITLE.wrap_hard(self.title, right - left).len() as f64;
        let x_label = AXIS_LABEL.wrap_hard(self.x_label, right - left).len() as f64;
        let top = panel.top + title * PANEL_TITLE.line_height() + 12.0;
        let below = depth + x_label * AXIS_LABEL.line_height() + 6.0;
        Area { left, top, right, bottom: (panel.bottom - below).max(top + 40.0) }
    }

    /// Draws the title, the horizontal grid and the upright axis with its ticks.
    pub(super) fn draw_heights(&self, canvas: &Canvas, plot: Area) -> Result<()> {
        let level = |place| plot.bottom - self.y.fraction_of_place(place) * plot.height();
        for &place in &self.y.faint {
            canvas.line(&[(plot.left, level(place)), (plot.right, level(place))], FAINT_GRID, 0.75)?;
        }
        for tick in &self.y.ticks {
            let y = level(tick.place);
            canvas.line(&[(plot.left, y), (plot.right, y)], GRID, 0.75)?;
            canvas.line(&[(plot.left - TICK_LENGTH, y), (plot.left, y)], INK, 1.0)?;
            let spot = (plot.left - TICK_LENGTH - LABEL_GAP, y + TICK_LABEL.cap_height() / 2.0);
            canvas.text(&tick.label, spot, Anchor::End, TICK_LABEL)?;
        }
        Ok(())
    }

    /// Draws the title and the names of both axes around the plot.
    pub(super) fn draw_names(&self, canvas: &Canvas, plot: Area, panel: Area) -> Result<()> {
        let title = PANEL_TITLE.wrap_hard(self.title, plot.width());
        canvas.lines(&title, (plot.left, panel.top + PANEL_TITLE.size), Anchor::Start, PANEL_TITLE)?;
        let (center, middle) = plot.middle();
        let x_label = AXIS_LABEL.wrap_hard(self.x_label, plot.width());
        let rows = x_label.len() as f64 - 1.0;
        let baseline = panel.bottom - rows * AXIS_LABEL.line_height() - 8.0;
        canvas.lines(&x_label, (center, baseline), Anchor::Middle, AXIS_LABEL)?;
        let y_label = AXIS_LABEL.wrap(self.y_label, panel.height() * 0.8);
        let first = plot.left - self.label_depth() - 11.0;
        for (row, line) in y_label.iter().rev().enumerate() {
            let x = first - row as f64 * AXIS_LABEL.line_height();
            canvas.text_upwards(line, (x, middle), Anchor::Middle, AXIS_LABEL)?;
        }
        Ok(())
    }
}

/// Draws the left and the lower edge of the plot, over the data that may touch them.
pub(super) fn draw_edges(canvas: &Canvas, plot: Area) -> Result<()> {
    let corner = [(plot.left, plot.top), (plot.left, plot.bottom), (plot.right, plot.bottom)];
    canvas.line(&corner, INK, 1.0)
}

/// Fills a plot that has nothing to show.
pub(super) fn draw_no_data(canvas: &Canvas, plot: Area) -> Result<()> {
    let corners =
        [(plot.left, plot.top), (plot.right, plot.top), (plot.right, plot.bottom), (plot.left, plot.bottom)];
    canvas.outline(&corners, GRID, 1.0)?;
    let (x, y) = plot.middle();
    canvas.text("no data", (x, y + NO_DATA.cap_height() / 2.0), Anchor::Middle, NO_DATA)
}

/// The labels below a plot, broken into lines or turned upwards so that neighbours do not touch.
pub(super) struct FootLabels {
    labels: Vec<Vec<String>>,
    turned: bool,
}

impl FootLabels {
    /// Fits each label into `slot` pixels.
    pub(super) fn fit<'l>(labels: impl Iterator<Item = &'l String>, slot: f64) -> Self {
        let whole: Vec<&String> = labels.collect();
        let broken: Vec<_> = whole.iter().map(|label| TICK_LABEL.wrap(label, slot)).collect();
        let fits = broken.iter().all(|lines| lines.len() <= 3 && TICK_LABEL.widest(lines) <= slot);
        if fits {
            return Self { labels: broken, turned: false };
        }
        let labels = whole.iter().map(|label| TICK_LABEL.wrap_hard(label, LONGEST_TURNED)).collect();
        Self { labels, turned: true }
    }

    /// Whether the labels had to be turned.
    pub(super) fn turned(&self) -> bool {
        self.turned
    }

    /// How many pixels below the plot the labels take, with the tick marks.
    pub(super) fn depth(&self) -> f64 {
        let rows = self.labels.iter().map(Vec::len).max().unwrap_or(0) as f64;
        let reach = match self.turned {
            true => TICK_LABEL.widest(self.labels.iter().flatten()),
            false => rows * TICK_LABEL.line_height(),
        };
        TICK_LENGTH + LABEL_GAP + reach
    }

    /// Draws the label with this index below a place on the lower edge.
    pub(super) fn draw(&self, canvas: &Canvas, index: usize, x: f64, edge: f64) -> Result<()> {
        let lines = &self.labels[index];
        let top = edge + TICK_LENGTH + LABEL_GAP;
        if !self.turned {
            return canvas.lines(lines, (x, top + TICK_LABEL.size * 0.8), Anchor::Middle, TICK_LABEL);
        }
        let first = x - (lines.len() as f64 - 1.0) * TICK_LABEL.line_height() / 2.0;
        for (row, line) in lines.iter().enumerate() {
            let baseline = first + row as f64 * TICK_LABEL.line_height() + TICK_LABEL.cap_height() / 2.0;
            canvas.text_upwards(line, (baseline, top), Anchor::End, TICK_LABEL)?;
        }
        Ok(())
    }
}

/// A longer label that reads upwards is broken, so that the plot keeps most of the panel's height.
const LONGEST_TURNED: f64 = 130.0;

/// Draws the upright grid and the ticks of the lower edge.
pub(super) fn draw_widths(canvas: &Canvas, plot: Area, ruler: &Ruler, labels: &FootLabels) -> Result<()> {
    let column = |place| plot.left + ruler.fraction_of_place(place) * plot.width();
    for &place in &ruler.faint {
        canvas.line(&[(column(place), plot.top), (column(place), plot.bottom)], FAINT_GRID, 0.75)?;
    }
    for (index, tick) in ruler.ticks.iter().enumerate() {
        let x = column(tick.place);
        canvas.line(&[(x, plot.top), (x, plot.bottom)], GRID, 0.75)?;
        canvas.line(&[(x, plot.bottom), (x, plot.bottom + TICK_LENGTH)], INK, 1.0)?;
        labels.draw(canvas, index, x, plot.bottom)?;
    }
    Ok(())
}
