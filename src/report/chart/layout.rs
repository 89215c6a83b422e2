//! Where the parts of a figure go.

use anyhow::Result;

use super::legend::{Entry, Legend};
use super::style::{Anchor, Area, Canvas, FIGURE_TITLE, NOTE};
use super::{Figure, Panel};

const PANEL_WIDTH: f64 = 560.0;
const PANEL_HEIGHT: f64 = 420.0;
const PANELS_PER_ROW: usize = 2;
const GAP: f64 = 20.0;
const MARGIN: f64 = 14.0;

/// The places of everything in a figure.
pub(super) struct Layout {
    pub(super) width: f64,
    pub(super) height: f64,
    title: Vec<String>,
    panels: Vec<Area>,
    /// Each legend with the left edge, the right edge and the top of its room.
    legends: Vec<(Legend, f64, f64, f64)>,
    note: Vec<String>,
}

impl Layout {
    /// Stacks the title, the rows of panels, the legends and the note.
    pub(super) fn new(figure: &Figure) -> Self {
        let columns = figure.panels.len().clamp(1, PANELS_PER_ROW) as f64;
        let width = 2.0 * MARGIN + columns * PANEL_WIDTH + (columns - 1.0) * GAP;
        let inside = width - 2.0 * MARGIN;
        let title = FIGURE_TITLE.wrap_hard(&figure.title, inside);
        let note = NOTE.wrap_hard(figure.note.as_deref().unwrap_or_default(), inside);
        let (mut panels, mut legends) = (Vec::new(), Vec::new());
        let head =
            if title.is_empty() { 0.0 } else { title.len() as f64 * FIGURE_TITLE.line_height() + 12.0 };
        let mut top = MARGIN + head;
        let entries: Vec<Vec<Entry>> = figure.panels.iter().map(Panel::entries).collect();
        let shared = shared_entries(&entries);
        for (row, entries) in entries.chunks(PANELS_PER_ROW).enumerate() {
            top += if row == 0 { 0.0 } else { GAP };
            let below = top + PANEL_HEIGHT;
            let mut deepest = 0.0_f64;
            for (column, entries) in entries.iter().enumerate() {
                let left = MARGIN + column as f64 * (PANEL_WIDTH + GAP);
                let right = left + PANEL_WIDTH;
                panels.push(Area { left, top, right, bottom: below });
                if shared.is_none() {
                    let legend = Legend::arrange(entries, PANEL_WIDTH);
                    deepest = deepest.max(legend.height());
                    legends.push((legend, left, right, below));
                }
            }
            top = below + deepest;
        }
        if let Some(entries) = shared {
            let legend = Legend::arrange(entries, inside);
            let height = legend.height();
            legends.push((legend, MARGIN, width - MARGIN, top));
            top += height;
        }
        let foot = if note.is_empty() { 0.0 } else { note.len() as f64 * NOTE.line_height() + 6.0 };
        Self { width, height: top + foot + MARGIN, title, panels, legends, note }
    }

    /// Draws every part in its place.
    pub(super) fn draw(&self, canvas: &Canvas, figure: &Figure) -> Result<()> {
        canvas.lines(&self.title, (MARGIN, MARGIN + FIGURE_TITLE.size), Anchor::Start, FIGURE_TITLE)?;
        for (panel, area) in figure.panels.iter().zip(&self.panels) {
            panel.draw(canvas, *area)?;
        }
        for (legend, left, right, top) in &self.legends {
            legend.draw(canvas, *left, *right, *top)?;
        }
        let rows = self.note.len() as f64 - 1.0;
        let baseline = self.height - MARGIN + 2.0 - rows * NOTE.line_height();
        canvas.lines(&self.note, (MARGIN, baseline), Anchor::Start, NOTE)
    }
}

/// The longest legend, if it explains every panel: then it need not be repeated under each.
fn shared_entries(legends: &[Vec<Entry>]) -> Option<&Vec<Entry>> {
    let longest = legends.iter().max_by_key(|entries| entries.len())?;
    let explains_all = legends.iter().flatten().all(|entry| longest.contains(entry));
    explains_all.then_some(longest)
}
