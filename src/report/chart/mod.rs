//! Figures of the report as SVG, and as PNG from the same SVG.
//!
//! A `Figure` says what is to be shown; where things go follows from it alone, so the same figure
//! always gives the same bytes. plotters draws, in logical pixels that its whole-number SVG sees
//! eightfold. All text is measured with the embedded font, and the legend stands below the plots,
//! so nothing covers data.

use std::fmt::Write as _;
use std::sync::{Arc, LazyLock};

use anyhow::{Context, Result, bail, ensure};
use resvg::{tiny_skia, usvg};

mod axis;
mod bar;
mod frame;
mod label;
mod layout;
mod legend;
mod legible;
mod line;
mod style;
#[cfg(test)]
mod tests;

use layout::Layout;
use legend::Entry;
pub use style::missing_glyphs;
use style::{Area, Canvas, UNITS_PER_PIXEL};

/// A picture of one or more panels, two to a row.
#[derive(Debug, Clone)]
pub struct Figure {
    /// The heading above the panels; it is also the document's title. It may be empty.
    pub title: String,
    /// What the figure shows, for readers who cannot see it.
    pub description: String,
    /// The plots.
    pub panels: Vec<Panel>,
    /// A small line at the bottom, such as a warning against citing the figure.
    pub note: Option<String>,
}

/// One plot of a figure.
#[derive(Debug, Clone)]
pub enum Panel {
    /// Points and lines over two axes.
    Xy(XyPanel),
    /// Stacked bars in groups.
    Bars(BarPanel),
}

/// How values are spread along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences take equal room.
    Linear,
    /// Equal ratios take equal room; ticks are powers of two.
    Log2,
    /// Equal ratios take equal room; ticks are powers of ten.
    Log10,
}

/// One axis of an [`XyPanel`].
#[derive(Debug, Clone)]
pub struct Axis {
    /// The quantity and its unit.
    pub label: String,
    /// How values are spread along the axis.
    pub scale: Scale,
    /// The first and the last value; chosen from the data if absent.
    pub range: Option<(f64, f64)>,
    /// The labelled values, which may stand for categories; chosen from the range if absent.
    pub ticks: Option<Vec<(f64, String)>>,
}

/// Points and lines over two axes. What has no place on an axis, such as NaN or zero on a
/// logarithmic one, is left out and interrupts its line.
#[derive(Debug, Clone)]
pub struct XyPanel {
    /// The heading of the panel; it may be empty.
    pub title: String,
    /// The lower axis.
    pub x: Axis,
    /// The left axis.
    pub y: Axis,
    /// The data; later series lie over earlier ones.
    pub series: Vec<Series>,
    /// Single values behind the data.
    pub marks: Vec<Mark>,
    /// Shaded ranges behind everything.
    pub bands: Vec<Band>,
}

/// Points that belong together.
#[derive(Debug, Clone)]
pub struct Series {
    /// The legend's text; a series with an empty one is not in the legend.
    pub label: String,
    /// An index into the colours of Okabe and Ito: black, orange, sky blue, bluish green, yellow,
    /// blue, vermilion, reddish purple. Yellow is too faint on white for a thin line.
    pub color: usize,
    /// How the points are joined, in the order given.
    pub line: Line,
    /// What stands at each point.
    pub marker: Marker,
    /// The data.
    pub points: Vec<Point>,
}

/// How the points of a series are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Line {
    /// Not at all.
    None,
    /// By a full line.
    Solid,
    /// By a broken line, as for an ideal.
    Dashed,
}

/// What stands at each point of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Marker {
    /// Nothing.
    None,
    /// A disc.
    Circle,
    /// A filled square.
    Square,
    /// A filled triangle.
    Triangle,
    /// A filled diamond.
    Diamond,
    /// Two crossed strokes.
    Cross,
    /// A ring with a white middle.
    OpenCircle,
    /// The outline of a square with a white middle.
    OpenSquare,
    /// The outline of a triangle with a white middle.
    OpenTriangle,
    /// The outline of a diamond with a white middle.
    OpenDiamond,
}

/// One value of a series.
#[derive(Debug, Clone)]
pub struct Point {
    /// The place along the lower axis.
    pub x: f64,
    /// The height.
    pub y: f64,
    /// The lower end of the interval around `y`.
    pub low: Option<f64>,
    /// The upper end of the interval around `y`.
    pub high: Option<f64>,
    /// A short text beside the point.
    pub label: Option<String>,
}

/// A single value to compare the data with, such as a published one.
#[derive(Debug, Clone)]
pub struct Mark {
    /// The legend's text; a mark with an empty one is not in the legend.
    pub label: String,
    /// Where it is.
    pub at: MarkAt,
    /// An index into the colours, as for a [`Series`].
    pub color: usize,
}

/// The place of a [`Mark`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MarkAt {
    /// An upright dotted line.
    X(f64),
    /// A level dotted line.
    Y(f64),
    /// A star.
    Point(f64, f64),
}

/// A shaded range of heights across the whole panel.
#[derive(Debug, Clone)]
pub struct Band {
    /// The legend's text; a band with an empty one is not in the legend.
    pub label: String,
    /// The lower end.
    pub low: f64,
    /// The upper end.
    pub high: f64,
    /// An index into the colours, as for a [`Series`].
    pub color: usize,
}

/// Stacked bars in groups, over an axis that starts at zero.
#[derive(Debug, Clone)]
pub struct BarPanel {
    /// The heading of the panel; it may be empty.
    pub title: String,
    /// The quantity and its unit.
    pub y_label: String,
    /// The parts of each bar, from the bottom up.
    pub segments: Vec<String>,
    /// The bars.
    pub groups: Vec<BarGroup>,
}

/// Bars that stand together.
#[derive(Debug, Clone)]
pub struct BarGroup {
    /// The name below the bars.
    pub label: String,
    /// The bars from left to right.
    pub bars: Vec<Bar>,
}

/// One stacked bar.
#[derive(Debug, Clone)]
pub struct Bar {
    /// The name below the bar.
    pub label: String,
    /// The length of each segment; one that is negative or not finite counts as nothing.
    pub values: Vec<f64>,
    /// The interval of the sum of the values.
    pub interval: Option<(f64, f64)>,
    /// Whether the value comes from the paper; such a bar is paler and hatched.
    pub published: bool,
}

impl Figure {
    /// Draws the figure; its width is left to the page that shows it.
    ///
    /// # Errors
    ///
    /// If a text has a character that the embedded font lacks, if a given axis range does not fit
    /// its scale, or if a bar does not have one value for each segment.
    pub fn to_svg(&self) -> Result<String> {
        self.check_glyphs()?;
        let layout = Layout::new(self);
        let mut drawing = String::new();
        let canvas = Canvas::new(&mut drawing, layout.width, layout.height)?;
        layout.draw(&canvas, self)?;
        canvas.finish()?;
        let (_, content) = drawing.split_once('>').context("plotters wrote no SVG element")?;
        Ok(self.opening(&layout) + content)
    }

    /// The opening tag and the texts for readers who cannot see the figure, in place of the bare
    /// tag of plotters.
    fn opening(&self, layout: &Layout) -> String {
        let (width, height) = (layout.width, layout.height);
        let texts = [self.title.as_str(), self.description.as_str()];
        let spoken: Vec<&str> = texts.into_iter().filter(|text| !text.is_empty()).collect();
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{}\" width=\"100%\" \
             viewBox=\"0 0 {} {}\" style=\"max-width:{width}px;height:auto\" stroke-linejoin=\"round\">\n\
             <title>{}</title>\n<desc>{}</desc>",
            escape(&spoken.join(" – ")),
            width * UNITS_PER_PIXEL,
            height * UNITS_PER_PIXEL,
            escape(&self.title),
            escape(&self.description),
        )
    }

    fn check_glyphs(&self) -> Result<()> {
        for (place, text) in self.drawn_texts() {
            if let Some(&letter) = missing_glyphs(text).first() {
                let code = u32::from(letter);
                bail!("the figures' font has no {letter:?} (U+{code:04X}), which the {place} {text:?} needs");
            }
        }
        Ok(())
    }

    /// Every text that the picture shows, with the name of its place.
    fn drawn_texts(&self) -> Vec<(&'static str, &str)> {
        let mut texts = vec![("figure title", self.title.as_str())];
        texts.extend(self.note.iter().map(|note| ("note", note.as_str())));
        for panel in &self.panels {
            match panel {
                Panel::Xy(panel) => panel.add_texts(&mut texts),
                Panel::Bars(panel) => panel.add_texts(&mut texts),
            }
        }
        texts
    }
}

impl XyPanel {
    fn add_texts<'p>(&'p self, texts: &mut Vec<(&'static str, &'p str)>) {
        texts.push(("panel title", &self.title));
        for axis in [&self.x, &self.y] {
            texts.push(("axis label", &axis.label));
            let ticks = axis.ticks.iter().flatten();
            texts.extend(ticks.map(|(_, label)| ("tick label", label.as_str())));
        }
        for series in &self.series {
            texts.push(("series label", &series.label));
            let labels = series.points.iter().filter_map(|point| point.label.as_deref());
            texts.extend(labels.map(|label| ("point label", label)));
        }
        texts.extend(self.marks.iter().map(|mark| ("mark label", mark.label.as_str())));
        texts.extend(self.bands.iter().map(|band| ("band label", band.label.as_str())));
    }
}

impl BarPanel {
    fn add_texts<'p>(&'p self, texts: &mut Vec<(&'static str, &'p str)>) {
        texts.push(("panel title", &self.title));
        texts.push(("axis label", &self.y_label));
        texts.extend(self.segments.iter().map(|label| ("segment label", label.as_str())));
        for group in &self.groups {
            texts.push(("group label", &group.label));
            texts.extend(group.bars.iter().map(|bar| ("bar label", bar.label.as_str())));
        }
    }
}

impl Panel {
    fn entries(&self) -> Vec<Entry> {
        match self {
            Panel::Xy(panel) => line::entries(panel),
            Panel::Bars(panel) => bar::entries(panel),
        }
    }

    fn draw(&self, canvas: &Canvas, area: Area) -> Result<()> {
        match self {
            Panel::Xy(panel) => line::draw(canvas, panel, area),
            Panel::Bars(panel) => bar::draw(canvas, panel, area),
        }
    }
}

/// The text as it may stand in an element or an attribute; characters that XML forbids altogether
/// are dropped.
pub(in crate::report) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '<' | '>' | '&' | '"' | '\'' => {
                let _infallible = write!(escaped, "&#{};", u32::from(letter));
            }
            '\n' | '\t' => escaped.push(letter),
            '\u{FFFE}' | '\u{FFFF}' => {}
            _ if letter.is_control() => {}
            _ => escaped.push(letter),
        }
    }
    escaped
}

/// The embedded font alone, so that the machine's own fonts cannot change a picture.
static FONTS: LazyLock<Arc<usvg::fontdb::Database>> = LazyLock::new(|| {
    let mut fonts = usvg::fontdb::Database::new();
    for bytes in [style::REGULAR_FONT, style::BOLD_FONT] {
        fonts.load_font_data(bytes.to_vec());
    }
    Arc::new(fonts)
});

/// Turns an SVG into a PNG of this width on a white ground.
///
/// # Errors
///
/// If the SVG cannot be read, or the picture would be empty or too large.
pub fn svg_to_png(svg: &str, width_px: u32) -> Result<Vec<u8>> {
    let tree = parsed(svg)?;
    let scale = f64::from(width_px) / f64::from(tree.size().width());
    let height = (f64::from(tree.size().height()) * scale).round().max(1.0);
    ensure!(height <= f64::from(u16::MAX), "a picture {width_px} pixels wide would be {height} pixels high");
    let mut image =
        tiny_skia::Pixmap::new(width_px, height as u32).context("the picture would be empty or too large")?;
    image.fill(tiny_skia::Color::WHITE);
    let transform = tiny_skia::Transform::from_scale(scale as f32, scale as f32);
    resvg::render(&tree, transform, &mut image.as_mut());
    image.encode_png().context("the picture cannot be written as PNG")
}

/// Draws an SVG over a picture, a unit a pixel.
pub(in crate::report) fn draw_svg(svg: &str, image: &mut tiny_skia::Pixmap) -> Result<()> {
    resvg::render(&parsed(svg)?, tiny_skia::Transform::identity(), &mut image.as_mut());
    Ok(())
}

fn parsed(svg: &str) -> Result<usvg::Tree> {
    let options = usvg::Options { fontdb: Arc::clone(&FONTS), ..usvg::Options::default() };
    usvg::Tree::from_str(svg, &options).context("the SVG cannot be read")
}
