//! What is written beside the particles: the scene and its time, what the colours mean, and how long a metre is.

use std::fmt::Write;

use anyhow::Result;
use resvg::tiny_skia::Pixmap;

use crate::report::chart::{draw_svg, escape};
use crate::report::picture::color::viridis;
use crate::report::picture::range::{Range, number};
use crate::report::picture::{HEIGHT, WIDTH};
use crate::scene::output::Moment;
use crate::scene::output::field::Field;

/// The colour bar, pixels.
const BAR_LEFT: f64 = 1150.0;
const BAR_WIDTH: f64 = 22.0;
const BAR_TOP: f64 = 130.0;
const BAR_BOTTOM: f64 = 570.0;
/// The longest scale, pixels.
const SCALE: f64 = 160.0;

const INK: &str = "#222222";
const MUTED: &str = "#5a5a5a";

#[derive(Debug)]
pub struct Labels<'a> {
    pub title: &'a str,
    pub moment: &'a Moment<'a>,
    pub field: &'a Field<'a>,
    pub range: &'a Range,
    /// The fluid's values, for their extremes.
    pub values: &'a [f64],
    pub pixels_per_m: f64,
}

impl Labels<'_> {
    pub fn draw(&self, image: &mut Pixmap) -> Result<()> {
        let mut svg =
            format!("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\">");
        self.heading(&mut svg);
        self.bar(&mut svg);
        self.scale(&mut svg);
        svg.push_str("</svg>");
        draw_svg(&svg, image)
    }

    fn heading(&self, svg: &mut String) {
        let Moment { step, time_s, .. } = self.moment;
        Text { size: 22.0, bold: true, ..Text::at(48.0, 44.0) }.write(svg, self.title);
        Text { size: 22.0, anchor: "end", ..Text::at(1110.0, 44.0) }
            .write(svg, &format!("t = {time_s:.4} s"));
        let under = Text { size: 14.0, color: MUTED, anchor: "end", ..Text::at(1110.0, 64.0) };
        under.write(svg, &format!("step {step}"));
    }

    /// The colours from the lower end to the upper one, with round values and their unit, and the extremes under them.
    fn bar(&self, svg: &mut String) {
        let name = self.field.name.replace('_', " ");
        // Longer names are written smaller, or the edge of the picture would cut them.
        let size = 16.0_f64.min(16.0 * 13.0 / name.len() as f64);
        Text { size, bold: true, ..Text::at(BAR_LEFT, BAR_TOP - 40.0) }.write(svg, &name);
        let unit = if self.field.unit.is_empty() { "no unit" } else { self.field.unit };
        Text { size: 14.0, color: MUTED, ..Text::at(BAR_LEFT, BAR_TOP - 20.0) }.write(svg, unit);
        let length = BAR_BOTTOM - BAR_TOP;
        // Whole pixels, so that no gap shows between two colours.
        for row in 0..length as usize {
            let [red, green, blue] = viridis(1.0 - (row as f64 + 0.5) / length);
            let y = BAR_TOP + row as f64;
            let _infallible = write!(
                svg,
                "<rect x=\"{BAR_LEFT}\" y=\"{y}\" width=\"{BAR_WIDTH}\" height=\"1\" \
                 fill=\"rgb({red},{green},{blue})\" shape-rendering=\"crispEdges\"/>"
            );
        }
        for (value, text) in self.range.ticks() {
            let y = BAR_BOTTOM - length * self.range.share(value);
            line(svg, [BAR_LEFT + BAR_WIDTH, y], [BAR_LEFT + BAR_WIDTH + 6.0, y]);
            Text { size: 15.0, ..Text::at(BAR_LEFT + BAR_WIDTH + 11.0, y + 5.5) }.write(svg, &text);
        }
        let extreme = |of: fn(f64, f64) -> f64| self.values.iter().copied().reduce(of);
        if let (Some(least), Some(most)) = (extreme(f64::min), extreme(f64::max)) {
            let step = (self.range.high - self.range.low) / 100.0;
            for (row, (name, value)) in [("max", most), ("min", least)].into_iter().enumerate() {
                let place = Text::at(BAR_LEFT, BAR_BOTTOM + 30.0 + 20.0 * row as f64);
                Text { size: 14.0, color: MUTED, ..place }
                    .write(svg, &format!("{name} {}", number(value, step)));
            }
        }
    }

    /// A line of a round length in metres.
    fn scale(&self, svg: &mut String) {
        let longest = SCALE / self.pixels_per_m;
        let power = 10.0_f64.powf(longest.log10().floor());
        let factor = [5.0, 2.0].into_iter().find(|factor| factor * power <= longest).unwrap_or(1.0);
        let (length, y) = (factor * power, HEIGHT as f64 - 30.0);
        let end = 48.0 + length * self.pixels_per_m;
        line(svg, [48.0, y], [end, y]);
        for x in [48.0, end] {
            line(svg, [x, y - 5.0], [x, y + 5.0]);
        }
        Text { size: 15.0, ..Text::at(end + 10.0, y + 5.5) }
            .write(svg, &format!("{} m", number(length, power)));
    }
}

fn line(svg: &mut String, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]) {
    let _infallible = write!(
        svg,
        "<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" stroke=\"{INK}\" stroke-width=\"1.5\"/>"
    );
}

/// Where and how a text stands; its baseline passes through the spot. A white rim keeps it readable over particles.
#[derive(Debug, Clone, Copy)]
struct Text {
    x: f64,
    y: f64,
    size: f64,
    bold: bool,
    color: &'static str,
    anchor: &'static str,
}

impl Text {
    fn at(x: f64, y: f64) -> Text {
        Text { x, y, size: 15.0, bold: false, color: INK, anchor: "start" }
    }

    fn write(self, svg: &mut String, text: &str) {
        let Text { x, y, size, bold, color, anchor } = self;
        let weight = if bold { "bold" } else { "normal" };
        let _infallible = write!(
            svg,
            "<text x=\"{x}\" y=\"{y}\" font-family=\"Inter\" font-size=\"{size}\" font-weight=\"{weight}\" \
             fill=\"{color}\" text-anchor=\"{anchor}\" stroke=\"white\" stroke-width=\"4\" \
             stroke-linejoin=\"round\" paint-order=\"stroke\">{}</text>",
            escape(text)
        );
    }
}
