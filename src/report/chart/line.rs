//! Panels of points and lines over two axes.

use anyhow::Result;
use plotters::style::{RGBColor, WHITE};

use super::axis::{Direction, Ruler};
use super::frame::{self, FootLabels, Surround};
use super::label::{self, Obstacles};
use super::legend::{Entry, Sample};
use super::style::{self, Area, Canvas, INK, Spot};
use super::{Axis, Band, Line, Mark, MarkAt, Marker, Point, Series, XyPanel};

const LINE_WIDTH: f64 = 1.75;
const OPEN_WIDTH: f64 = 1.6;
const ERROR_WIDTH: f64 = 1.25;
const CAP_REACH: f64 = 4.0;
const IDEAL_DASHES: (f64, f64) = (7.0, 4.0);
const MARK_DASHES: (f64, f64) = (1.8, 3.0);

/// The legend of a panel: its series, then what lies behind them.
pub(super) fn entries(panel: &XyPanel) -> Vec<Entry> {
    let series = panel.series.iter().map(|series| {
        let sample = Sample::Series { color: series.color, line: series.line, marker: series.marker };
        (&series.label, sample)
    });
    let marks = panel.marks.iter().map(|mark| (&mark.label, Sample::of_mark(mark)));
    let bands = panel.bands.iter().map(|band| (&band.label, Sample::Band { color: band.color }));
    let mut entries: Vec<Entry> = Vec::new();
    for (label, sample) in series.chain(marks).chain(bands) {
        let entry = Entry { label: label.clone(), sample };
        if !label.is_empty() && !entries.contains(&entry) {
            entries.push(entry);
        }
    }
    entries
}

/// Draws the panel without its legend.
pub(super) fn draw(canvas: &Canvas, panel: &XyPanel, area: Area) -> Result<()> {
    let (x_values, y_values) = shown_values(panel);
    let mut x = Ruler::new(&panel.x, &x_values, Direction::Across)?;
    let y = Ruler::new(&panel.y, &y_values, Direction::Up)?;
    let surround = Surround { title: &panel.title, x_label: &panel.x.label, y_label: &panel.y.label, y: &y };
    let (left, right) = surround.sides(area);
    let labels = fit_labels(&panel.x, &mut x, right - left);
    let plot = surround.plot(area, labels.depth());
    surround.draw_names(canvas, plot, area)?;
    let view = View { x: &x, y: &y, plot };
    for band in &panel.bands {
        view.draw_band(canvas, band)?;
    }
    frame::draw_widths(canvas, plot, &x, &labels)?;
    surround.draw_heights(canvas, plot)?;
    if panel.marks.is_empty() && !panel.series.iter().any(|series| view.shows(series)) {
        frame::draw_no_data(canvas, plot)?;
    }
    frame::draw_edges(canvas, plot)?;
    view.draw_data(canvas, panel)
}

/// The values that an automatic range must cover. A point without a place on one axis does not
/// stretch the other.
fn shown_values(panel: &XyPanel) -> (Vec<f64>, Vec<f64>) {
    let (mut x, mut y) = (Vec::new(), Vec::new());
    for point in panel.series.iter().flat_map(|series| &series.points) {
        if panel.x.scale.place(point.x).and(panel.y.scale.place(point.y)).is_some() {
            x.push(point.x);
            y.push(point.y);
            y.extend(point.low.into_iter().chain(point.high));
        }
    }
    for mark in &panel.marks {
        match mark.at {
            MarkAt::X(at) => x.push(at),
            MarkAt::Y(at) => y.push(at),
            MarkAt::Point(across, up) => {
                x.push(across);
                y.push(up);
            }
        }
    }
    y.extend(panel.bands.iter().flat_map(|band| [band.low, band.high]));
    (x, y)
}

/// Fits the labels of the lower axis into a plot of this width; of ticks that nobody asked for,
/// some may go.
fn fit_labels(axis: &Axis, ruler: &mut Ruler, width: f64) -> FootLabels {
    loop {
        let labels = ruler.ticks.iter().map(|tick| &tick.label);
        let fitted = FootLabels::fit(labels, slot(ruler, width));
        if axis.ticks.is_some() || !fitted.turned() || ruler.ticks.len() < 3 {
            return fitted;
        }
        ruler.thin();
    }
}

/// The room that one label has below a plot of this width.
fn slot(ruler: &Ruler, width: f64) -> f64 {
    let places = ruler.ticks.windows(2).map(|pair| [pair[0].place, pair[1].place]);
    let steps = places.map(|pair| pair.map(|place| ruler.fraction_of_place(place)));
    let narrowest = steps.map(|[low, high]| high - low).fold(1.0, f64::min);
    narrowest * width - 5.0
}

/// Two rulers laid along a plot.
struct View<'p> {
    x: &'p Ruler,
    y: &'p Ruler,
    plot: Area,
}

impl View<'_> {
    fn column(&self, x: f64) -> Option<f64> {
        Some(self.plot.left + self.x.fraction(x)? * self.plot.width())
    }

    fn level(&self, y: f64) -> Option<f64> {
        Some(self.plot.bottom - self.y.fraction(y)? * self.plot.height())
    }

    /// Where a pair of values lies, inside the plot or out.
    fn spot(&self, x: f64, y: f64) -> Option<Spot> {
        self.column(x).zip(self.level(y))
    }

    /// Where a pair of values lies, if that is inside the plot; the slack lets a value sit on the
    /// frame.
    fn visible(&self, x: f64, y: f64) -> Option<Spot> {
        let Area { left, top, right, bottom } = self.plot;
        let reach = Area { left: left - 0.01, top: top - 0.01, right: right + 0.01, bottom: bottom + 0.01 };
        self.spot(x, y).filter(|spot| reach.contains(*spot))
    }

    fn shows(&self, series: &Series) -> bool {
        series.points.iter().any(|point| self.spot(point.x, point.y).is_some())
    }

    /// Draws lines first and points last, so that no line hides a measured value.
    fn draw_data(&self, canvas: &Canvas, panel: &XyPanel) -> Result<()> {
        let mut obstacles = Obstacles::new(self.plot);
        for mark in &panel.marks {
            self.draw_mark(canvas, mark, &mut obstacles)?;
        }
        for series in &panel.series {
            for path in self.visible_paths(&series.points) {
                draw_stroke(canvas, &path, series.line, style::palette(series.color))?;
                if series.line != Line::None {
                    obstacles.add_path(&path);
                }
            }
        }
        for series in &panel.series {
            for point in &series.points {
                self.draw_interval(canvas, point, style::palette(series.color), &mut obstacles)?;
            }
        }
        for series in &panel.series {
            for spot in series.points.iter().filter_map(|point| self.visible(point.x, point.y)) {
                draw_marker(canvas, spot, series.marker, style::palette(series.color))?;
                obstacles.add(Area::around(spot, 5.0));
            }
        }
        let points = panel.series.iter().flat_map(|series| &series.points);
        let labels =
            points.filter_map(|point| Some((point.label.as_deref()?, self.visible(point.x, point.y)?)));
        label::draw_beside(canvas, &labels.collect::<Vec<_>>(), obstacles)
    }

    fn draw_mark(&self, canvas: &Canvas, mark: &Mark, obstacles: &mut Obstacles) -> Result<()> {
        let plot = self.plot;
        let ends = match mark.at {
            MarkAt::X(x) => self.column(x).map(|x| [(x, plot.top), (x, plot.bottom)]),
            MarkAt::Y(y) => self.level(y).map(|y| [(plot.left, y), (plot.right, y)]),
            MarkAt::Point(x, y) => {
                let Some(spot) = self.visible(x, y) else {
                    return Ok(());
                };
                obstacles.add(Area::around(spot, 7.0));
                return draw_star(canvas, spot, mark.color);
            }
        };
        match ends.filter(|ends| ends.iter().all(|end| plot.contains(*end))) {
            Some(ends) => {
                obstacles.add_path(&ends);
                draw_mark_line(canvas, ends, mark.color)
            }
            None => Ok(()),
        }
    }

    fn draw_band(&self, canvas: &Canvas, band: &Band) -> Result<()> {
        if band.low.is_nan() || band.high.is_nan() {
            return Ok(());
        }
        let (low, high) = (band.low.min(band.high), band.low.max(band.high));
        let clamp = |level: f64| level.clamp(self.plot.top, self.plot.bottom);
        let top = self.level(high).unwrap_or(self.plot.top);
        let bottom = self.level(low).unwrap_or(self.plot.bottom);
        draw_band(canvas, Area { top: clamp(top), bottom: clamp(bottom), ..self.plot }, band.color)
    }

    /// The parts of a line that lie inside the plot; a value without a place on the axes interrupts
    /// it.
    fn visible_paths(&self, points: &[Point]) -> Vec<Vec<Spot>> {
        let spots: Vec<_> = points.iter().map(|point| self.spot(point.x, point.y)).collect();
        let mut paths: Vec<Vec<Spot>> = Vec::new();
        for pair in spots.windows(2) {
            let ends = pair[0].zip(pair[1]);
            let Some([from, to]) = ends.and_then(|(from, to)| clip(from, to, self.plot)) else {
                continue;
            };
            match paths.last_mut() {
                Some(path) if path.last() == Some(&from) => path.push(to),
                _ => paths.push(vec![from, to]),
            }
        }
        paths
    }

    /// Draws the bar of an interval, and a cap at each end that the plot does not cut off.
    fn draw_interval(
        &self,
        canvas: &Canvas,
        point: &Point,
        color: RGBColor,
        obstacles: &mut Obstacles,
    ) -> Result<()> {
        let Some((x, y)) = self.spot(point.x, point.y) else {
            return Ok(());
        };
        let plot = self.plot;
        if (point.low.is_none() && point.high.is_none())
            || !(plot.left - 0.01..=plot.right + 0.01).contains(&x)
        {
            return Ok(());
        }
        let end = |value: Option<f64>, beyond: f64| match value {
            None => y,
            Some(value) => self.level(value).unwrap_or(if value.is_nan() { y } else { beyond }),
        };
        let (bottom, top) = (end(point.low, plot.bottom + 1.0), end(point.high, plot.top - 1.0));
        let clamp = |level: f64| level.clamp(plot.top, plot.bottom);
        let bar = [(x, clamp(bottom)), (x, clamp(top))];
        canvas.line(&bar, color, ERROR_WIDTH)?;
        obstacles.add_path(&bar);
        for level in [bottom, top] {
            if (plot.top..=plot.bottom).contains(&level) && level != y {
                canvas.line(&[(x - CAP_REACH, level), (x + CAP_REACH, level)], color, ERROR_WIDTH)?;
            }
        }
        Ok(())
    }
}

/// The part of a straight line inside the plot, found by narrowing its ends side by side.
fn clip(from: Spot, to: Spot, plot: Area) -> Option<[Spot; 2]> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let sides = [
        (-dx, from.0 - plot.left),
        (dx, plot.right - from.0),
        (-dy, from.1 - plot.top),
        (dy, plot.bottom - from.1),
    ];
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (outwards, room) in sides {
        if outwards < 0.0 {
            enter = enter.max(room / outwards);
        } else if outwards > 0.0 {
            leave = leave.min(room / outwards);
        } else if room < 0.0 {
            return None;
        }
    }
    let along = |share: f64| match share {
        0.0 => from,
        1.0 => to,
        _ => (from.0 + share * dx, from.1 + share * dy),
    };
    (enter < leave).then(|| [along(enter), along(leave)])
}

/// Draws a path in the manner of a series.
pub(super) fn draw_stroke(canvas: &Canvas, path: &[Spot], line: Line, color: RGBColor) -> Result<()> {
    match line {
        Line::None => Ok(()),
        Line::Solid => canvas.line(path, color, LINE_WIDTH),
        Line::Dashed => canvas.dashes(path, color, LINE_WIDTH, IDEAL_DASHES),
    }
}

/// Draws the dotted line of a mark.
pub(super) fn draw_mark_line(canvas: &Canvas, ends: [Spot; 2], color: usize) -> Result<()> {
    canvas.dashes(&ends, style::palette(color), LINE_WIDTH, MARK_DASHES)
}

/// Draws the ground of a band; it is translucent, so that bands may overlap.
pub(super) fn draw_band(canvas: &Canvas, area: Area, color: usize) -> Result<()> {
    canvas.rectangle(area, style::palette(color), 0.2)
}

/// Draws the star of a mark at a point; no series has one.
pub(super) fn draw_star(canvas: &Canvas, (x, y): Spot, color: usize) -> Result<()> {
    let corner = |index: i32| {
        let radius = if index % 2 == 0 { 8.0 } else { 3.3 };
        let (sine, cosine) = (f64::from(index) * std::f64::consts::PI / 5.0).sin_cos();
        (x + radius * sine, y - radius * cosine)
    };
    let corners: Vec<Spot> = (0..10).map(corner).collect();
    canvas.polygon(&corners, style::palette(color))?;
    canvas.outline(&corners, INK, 0.75)
}

/// Draws a marker; an open one is filled with white, so that its own line does not cross it.
pub(super) fn draw_marker(canvas: &Canvas, center: Spot, marker: Marker, color: RGBColor) -> Result<()> {
    match marker {
        Marker::None => Ok(()),
        Marker::Circle => canvas.disc(center, 4.25, color),
        Marker::OpenCircle => {
            canvas.disc(center, 4.0, WHITE)?;
            canvas.ring(center, 4.0, color, OPEN_WIDTH)
        }
        Marker::Cross => {
            let reach = Area::around(center, 3.75);
            canvas.line(&[(reach.left, reach.top), (reach.right, reach.bottom)], color, 2.0)?;
            canvas.line(&[(reach.left, reach.bottom), (reach.right, reach.top)], color, 2.0)
        }
        Marker::Square => canvas.polygon(&square(center, 3.75), color),
        Marker::Triangle => canvas.polygon(&triangle(center, 5.25), color),
        Marker::Diamond => canvas.polygon(&diamond(center, 5.5), color),
        Marker::OpenSquare => draw_open(canvas, &square(center, 3.5), color),
        Marker::OpenTriangle => draw_open(canvas, &triangle(center, 4.75), color),
        Marker::OpenDiamond => draw_open(canvas, &diamond(center, 4.75), color),
    }
}

fn draw_open(canvas: &Canvas, corners: &[Spot], color: RGBColor) -> Result<()> {
    canvas.polygon(corners, WHITE)?;
    canvas.outline(corners, color, OPEN_WIDTH)
}

fn square((x, y): Spot, reach: f64) -> [Spot; 4] {
    [(x - reach, y - reach), (x + reach, y - reach), (x + reach, y + reach), (x - reach, y + reach)]
}

fn diamond((x, y): Spot, reach: f64) -> [Spot; 4] {
    [(x, y - reach), (x + reach, y), (x, y + reach), (x - reach, y)]
}

fn triangle((x, y): Spot, reach: f64) -> [Spot; 3] {
    [(x, y - reach), (x + reach * 0.92, y + reach * 0.62), (x - reach * 0.92, y + reach * 0.62)]
}
