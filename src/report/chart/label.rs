//! Short texts beside points, placed where they hide the least.

use anyhow::Result;

use super::style::{Anchor, Area, Canvas, POINT_LABEL, Spot};

/// How much worse it is to leave the plot than to cover the same area of data.
const OUTSIDE_PENALTY: f64 = 20.0;

/// How many square pixels of data a label may cover rather than move to the next, less natural
/// place.
const RANK_PENALTY: f64 = 1.5;

/// What a label should not cover.
pub(super) struct Obstacles {
    plot: Area,
    covered: Vec<Area>,
}

impl Obstacles {
    pub(super) fn new(plot: Area) -> Self {
        Self { plot, covered: Vec::new() }
    }

    pub(super) fn add(&mut self, area: Area) {
        self.covered.push(area);
    }

    /// Adds a line as a row of small squares.
    pub(super) fn add_path(&mut self, path: &[Spot]) {
        for ends in path.windows(2) {
            let (dx, dy) = (ends[1].0 - ends[0].0, ends[1].1 - ends[0].1);
            let steps = (dx.hypot(dy) / 4.0).ceil().max(1.0);
            let place = |step: f64| (ends[0].0 + dx * step / steps, ends[0].1 + dy * step / steps);
            self.covered.extend((0..=steps as u32).map(|step| Area::around(place(step.into()), 1.5)));
        }
    }

    fn cost(&self, text: &Area) -> f64 {
        let hidden: f64 = self.covered.iter().map(|area| area.overlap(text)).sum();
        let outside = text.width() * text.height() - text.overlap(&self.plot);
        hidden + OUTSIDE_PENALTY * outside
    }
}

/// Draws each text beside its point; an earlier text is an obstacle for the later ones.
pub(super) fn draw_beside(canvas: &Canvas, labels: &[(&str, Spot)], mut obstacles: Obstacles) -> Result<()> {
    for (text, point) in labels {
        let candidates = candidates(POINT_LABEL.width(text), *point).into_iter().enumerate();
        let costs = candidates.map(|(rank, area)| (obstacles.cost(&area) + RANK_PENALTY * rank as f64, area));
        if let Some((_, area)) = costs.min_by(|one, other| one.0.total_cmp(&other.0)) {
            canvas.text(text, (area.left, area.bottom - 2.0), Anchor::Start, POINT_LABEL)?;
            obstacles.add(area);
        }
    }
    Ok(())
}

/// The places to try, from the most natural one on; of equally good ones the first wins.
fn candidates(width: f64, (x, y): Spot) -> [Area; 12] {
    let height = POINT_LABEL.cap_height() + 4.0;
    let place = |left: f64, middle: f64| {
        let top = middle - height / 2.0;
        Area { left, top, right: left + width, bottom: top + height }
    };
    let (right, left, center) = (x + 8.0, x - 8.0 - width, x - width / 2.0);
    [
        place(right, y),
        place(left, y),
        place(center, y - 13.0),
        place(center, y + 13.0),
        place(right - 2.0, y - 11.0),
        place(right - 2.0, y + 11.0),
        place(left + 2.0, y - 11.0),
        place(left + 2.0, y + 11.0),
        place(right + 2.0, y - 20.0),
        place(right + 2.0, y + 20.0),
        place(left - 2.0, y - 20.0),
        place(left - 2.0, y + 20.0),
    ]
}
