//! What a figure is drawn with: the embedded font, the colours, and a canvas in logical pixels.

use std::sync::LazyLock;

use anyhow::Result;
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use ttf_parser::Face;

/// The SVG backend rounds to whole units, so one logical pixel is eight of them.
pub(super) const UNITS_PER_PIXEL: f64 = 8.0;

/// The embedded font comes first; the others stand in for it where a browser shows the SVG without
/// it.
const FAMILIES: &str = "Inter, Helvetica, Arial, sans-serif";

pub(super) static REGULAR_FONT: &[u8] = include_bytes!("../fonts/Inter-Regular.ttf");
pub(super) static BOLD_FONT: &[u8] = include_bytes!("../fonts/Inter-Bold.ttf");

static REGULAR_FACE: LazyLock<Face<'static>> = LazyLock::new(|| parse(REGULAR_FONT));
static BOLD_FACE: LazyLock<Face<'static>> = LazyLock::new(|| parse(BOLD_FONT));

fn parse(bytes: &'static [u8]) -> Face<'static> {
    Face::parse(bytes, 0).expect("the font files are part of the program, and a test reads them")
}

/// The colours of Okabe and Ito, which stay apart for readers with any of the usual colour
/// blindnesses.
const OKABE_ITO: [RGBColor; 8] = [
    RGBColor(0x00, 0x00, 0x00),
    RGBColor(0xE6, 0x9F, 0x00),
    RGBColor(0x56, 0xB4, 0xE9),
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xF0, 0xE4, 0x42),
    RGBColor(0x00, 0x72, 0xB2),
    RGBColor(0xD5, 0x5E, 0x00),
    RGBColor(0xCC, 0x79, 0xA7),
];

pub(super) const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
pub(super) const MUTED: RGBColor = RGBColor(0x5A, 0x5A, 0x5A);
pub(super) const GRID: RGBColor = RGBColor(0xE0, 0xE0, 0xE0);
pub(super) const FAINT_GRID: RGBColor = RGBColor(0xF0, 0xF0, 0xF0);

/// The colour with this Okabe–Ito index; an index past the end starts again.
pub(super) fn palette(index: usize) -> RGBColor {
    OKABE_ITO[index % OKABE_ITO.len()]
}

/// The colour mixed with white, for fills that must stay paler than what is drawn over them.
pub(super) fn pale(color: RGBColor, share: f64) -> RGBColor {
    let mix = |channel: u8| (255.0 - (255.0 - f64::from(channel)) * share).round() as u8;
    RGBColor(mix(color.0), mix(color.1), mix(color.2))
}

/// A size, weight and colour of text.
#[derive(Clone, Copy)]
pub(super) struct Font {
    pub(super) size: f64,
    pub(super) style: FontStyle,
    pub(super) color: RGBColor,
}

impl Font {
    const fn new(size: f64, style: FontStyle, color: RGBColor) -> Self {
        Self { size, style, color }
    }

    /// The distance between two baselines.
    pub(super) fn line_height(&self) -> f64 {
        (self.size * 1.3).ceil()
    }

    /// The height of a capital or a digit, which is what must look centred beside a tick.
    pub(super) fn cap_height(&self) -> f64 {
        self.size * 0.73
    }

    /// How wide the text is in logical pixels.
    pub(super) fn width(&self, text: &str) -> f64 {
        let face: &Face = match self.style {
            FontStyle::Bold => &BOLD_FACE,
            _ => &REGULAR_FACE,
        };
        let advance = |letter| {
            let glyph = face.glyph_index(letter)?;
            face.glyph_hor_advance(glyph)
        };
        let units: f64 = text.chars().filter_map(advance).map(f64::from).sum();
        units * self.size / f64::from(face.units_per_em())
    }

    /// The width of the widest of these texts.
    pub(super) fn widest<'t>(&self, texts: impl IntoIterator<Item = &'t String>) -> f64 {
        let widths = texts.into_iter().map(|text| self.width(text));
        widths.fold(0.0, f64::max)
    }

    /// Breaks the text at spaces into lines of at most `limit` pixels; a longer word keeps a line
    /// of its own.
    pub(super) fn wrap(&self, text: &str, limit: f64) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in text.split(' ').filter(|word| !word.is_empty()) {
            match lines.last_mut() {
                Some(line) if self.width(line) + self.width(" ") + self.width(word) <= limit => {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(word.to_owned()),
            }
        }
        lines
    }

    /// Like `wrap`, but a word that is itself too long is cut, so that nothing leaves the picture.
    pub(super) fn wrap_hard(&self, text: &str, limit: f64) -> Vec<String> {
        let mut lines = Vec::new();
        for line in self.wrap(text, limit) {
            let mut rest = String::new();
            for letter in line.chars() {
                if !rest.is_empty() && self.width(&rest) + self.width(letter.encode_utf8(&mut [0; 4])) > limit
                {
                    lines.push(std::mem::take(&mut rest));
                }
                rest.push(letter);
            }
            lines.push(rest);
        }
        lines
    }
}

pub(super) const FIGURE_TITLE: Font = Font::new(17.0, FontStyle::Bold, INK);
pub(super) const PANEL_TITLE: Font = Font::new(14.0, FontStyle::Bold, INK);
pub(super) const AXIS_LABEL: Font = Font::new(13.0, FontStyle::Normal, INK);
pub(super) const TICK_LABEL: Font = Font::new(12.0, FontStyle::Normal, INK);
pub(super) const GROUP_LABEL: Font = Font::new(12.5, FontStyle::Bold, INK);
pub(super) const LEGEND_LABEL: Font = Font::new(12.5, FontStyle::Normal, INK);
pub(super) const POINT_LABEL: Font = Font::new(11.0, FontStyle::Normal, INK);
pub(super) const NOTE: Font = Font::new(11.5, FontStyle::Normal, MUTED);
pub(super) const NO_DATA: Font = Font::new(15.0, FontStyle::Normal, MUTED);

/// The characters of a text that the embedded font cannot draw, each once, in the order they occur.
///
/// An SVG renderer leaves such a character out without a word, so a label must be checked before it
/// is drawn.
pub fn missing_glyphs(text: &str) -> Vec<char> {
    let mut missing = Vec::new();
    for letter in text.chars() {
        let drawn = [&REGULAR_FACE, &BOLD_FACE].iter().all(|face| face.glyph_index(letter).is_some());
        if !drawn && !missing.contains(&letter) {
            missing.push(letter);
        }
    }
    missing
}

/// A position in logical pixels; y grows downwards.
pub(super) type Spot = (f64, f64);

/// A rectangle in logical pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Area {
    pub(super) fn width(&self) -> f64 {
        self.right - self.left
    }

    pub(super) fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub(super) fn middle(&self) -> Spot {
        ((self.left + self.right) / 2.0, (self.top + self.bottom) / 2.0)
    }

    /// The square of this half-width around a spot.
    pub(super) fn around((x, y): Spot, reach: f64) -> Self {
        Self { left: x - reach, top: y - reach, right: x + reach, bottom: y + reach }
    }

    pub(super) fn contains(&self, (x, y): Spot) -> bool {
        (self.left..=self.right).contains(&x) && (self.top..=self.bottom).contains(&y)
    }

    /// The area that two rectangles share, in square pixels.
    pub(super) fn overlap(&self, other: &Area) -> f64 {
        let width = self.right.min(other.right) - self.left.max(other.left);
        let height = self.bottom.min(other.bottom) - self.top.max(other.top);
        width.max(0.0) * height.max(0.0)
    }
}

/// Which part of a text its spot fixes.
#[derive(Debug, Clone, Copy)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A plotters drawing area that takes logical pixels and fractions of them.
pub(super) struct Canvas<'a> {
    root: DrawingArea<SVGBackend<'a>, Shift>,
}

fn units(length: f64) -> i32 {
    (length * UNITS_PER_PIXEL).round() as i32
}

fn at((x, y): Spot) -> (i32, i32) {
    (units(x), units(y))
}

fn stroke(color: RGBColor, width: f64) -> ShapeStyle {
    color.stroke_width(units(width).unsigned_abs())
}

impl<'a> Canvas<'a> {
    /// An SVG document of this logical size with a white ground, which also serves on a dark page.
    pub(super) fn new(document: &'a mut String, width: f64, height: f64) -> Result<Self> {
        let size = (units(width).unsigned_abs(), units(height).unsigned_abs());
        let root = SVGBackend::with_string(document, size).into_drawing_area();
        root.fill(&WHITE)?;
        Ok(Self { root })
    }

    /// Closes the document.
    pub(super) fn finish(self) -> Result<()> {
        Ok(self.root.present()?)
    }

    pub(super) fn line(&self, path: &[Spot], color: RGBColor, width: f64) -> Result<()> {
        let path: Vec<_> = path.iter().copied().map(at).collect();
        Ok(self.root.draw(&PathElement::new(path, stroke(color, width)))?)
    }

    /// A broken line; `dash` and `gap` are lengths along it.
    pub(super) fn dashes(
        &self,
        path: &[Spot],
        color: RGBColor,
        width: f64,
        (dash, gap): (f64, f64),
    ) -> Result<()> {
        let path: Vec<_> = path.iter().copied().map(at).collect();
        let dashed = DashedPathElement::new(path, units(dash), units(gap), stroke(color, width));
        Ok(self.root.draw(&dashed)?)
    }

    pub(super) fn rectangle(&self, area: Area, color: RGBColor, opacity: f64) -> Result<()> {
        let corners = [at((area.left, area.top)), at((area.right, area.bottom))];
        let fill = color.mix(opacity).filled();
        Ok(self.root.draw(&Rectangle::new(corners, fill))?)
    }

    pub(super) fn polygon(&self, corners: &[Spot], color: RGBColor) -> Result<()> {
        let corners: Vec<_> = corners.iter().copied().map(at).collect();
        Ok(self.root.draw(&Polygon::new(corners, color))?)
    }

    /// The outline of a polygon; it runs over the first side twice, so that the first corner is
    /// joined too.
    pub(super) fn outline(&self, corners: &[Spot], color: RGBColor, width: f64) -> Result<()> {
        let path: Vec<_> = corners.iter().chain(corners.iter().take(2)).copied().collect();
        self.line(&path, color, width)
    }

    pub(super) fn disc(&self, center: Spot, radius: f64, color: RGBColor) -> Result<()> {
        Ok(self.root.draw(&Circle::new(at(center), units(radius), color.filled()))?)
    }

    pub(super) fn ring(&self, center: Spot, radius: f64, color: RGBColor, width: f64) -> Result<()> {
        Ok(self.root.draw(&Circle::new(at(center), units(radius), stroke(color, width)))?)
    }

    /// Text whose baseline passes through `spot`.
    pub(super) fn text(&self, text: &str, spot: Spot, anchor: Anchor, font: Font) -> Result<()> {
        let start = (spot.0, spot.1 - TOP_TO_BASELINE * font.size);
        self.put(text, start, anchor, font, FontTransform::None)
    }

    /// Text that reads upwards and whose baseline, now vertical, passes through `spot`.
    pub(super) fn text_upwards(&self, text: &str, spot: Spot, anchor: Anchor, font: Font) -> Result<()> {
        let start = (spot.0 - TOP_TO_BASELINE * font.size, spot.1);
        self.put(text, start, anchor, font, FontTransform::Rotate270)
    }

    /// Lines of text under one another; `spot` is on the first baseline.
    pub(super) fn lines(&self, lines: &[String], spot: Spot, anchor: Anchor, font: Font) -> Result<()> {
        for (row, line) in lines.iter().enumerate() {
            let baseline = spot.1 + row as f64 * font.line_height();
            self.text(line, (spot.0, baseline), anchor, font)?;
        }
        Ok(())
    }

    fn put(&self, text: &str, spot: Spot, anchor: Anchor, font: Font, turn: FontTransform) -> Result<()> {
        let horizontal = match anchor {
            Anchor::Start => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::End => HPos::Right,
        };
        let size = font.size * UNITS_PER_PIXEL * SIZE_TO_EM;
        let style = TextStyle::from((FAMILIES, size, font.style))
            .color(&font.color)
            .transform(turn)
            .pos(Pos::new(horizontal, VPos::Top));
        Ok(self.root.draw(&Text::new(text.to_owned(), at(spot), style))?)
    }
}

/// The SVG backend puts the baseline of top-anchored text this many em below the spot. The other
/// two vertical anchors depend on the height of an x, which renderers estimate differently.
const TOP_TO_BASELINE: f64 = 0.76;

/// The SVG backend divides the size of a font by this before it writes it.
const SIZE_TO_EM: f64 = 1.24;
