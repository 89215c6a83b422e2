//! The figure of cost against particle count.

use crate::base::statistics::Estimate;
use crate::engine::preset::Preset;
use crate::report::chart::{Axis, Figure, Line, Mark, MarkAt, Marker, Panel, Point, Scale, Series, XyPanel};
use crate::report::measured::Measured;
use crate::report::published::Published;
use crate::report::section::scaling::{Cost, by_variant};
use crate::report::section::{FAST, LINKED_LIST, RELOCATED, automatic, point};

pub(super) fn figure(measured: &Measured, costs: &[Cost]) -> Figure {
    Figure {
        title: "The same flow with more particles".to_string(),
        description: "Four panels against the number of particles, logarithmic: microseconds a fluid particle and step \
                      outside CG, and in CG with its iterations at the points; the ratio of list to relocation outside \
                      CG, where the star is the paper's; bytes a particle. Bars span all rounds of times and 95 % intervals of ratios."
            .to_string(),
        panels: vec![
            Panel::Xy(XyPanel {
                y: automatic("µs a fluid particle and step", Scale::Log10),
                series: all(costs, |c| Some(point(0.0, c.us_a_fluid_particle(c.non_cg_s)))),
                ..panel("outside CG", costs)
            }),
            Panel::Xy(XyPanel {
                y: automatic("µs a fluid particle and step", Scale::Log10),
                series: all(costs, in_cg),
                ..panel("in CG", costs)
            }),
            Panel::Xy(gain_panel(costs)),
            Panel::Xy(XyPanel {
                y: automatic("bytes a particle", Scale::Log10),
                series: all(costs, |c| with_squares(c, bare(c.bytes_a_particle))),
                ..panel("memory", costs)
            }),
        ],
        note: measured.stamp(),
    }
}

/// Where the distance test makes no difference one of them is enough.
fn with_squares(cost: &Cost, point: Point) -> Option<Point> {
    (cost.test == "squared").then_some(point)
}

fn in_cg(cost: &Cost) -> Option<Point> {
    // One label a place is enough, too: searches take the same iterations.
    let labelled = cost.preset == Preset::PAPER_LINKED_LIST.name();
    let label = labelled.then(|| format!("{:.0} it.", cost.iterations));
    with_squares(cost, Point { label, ..point(0.0, cost.us_a_fluid_particle(cost.cg_s)) })
}

fn gain_panel(costs: &[Cost]) -> XyPanel {
    let paper = Published::load();
    let gain = paper.table2.speed_up.non_cg;
    let of_list = |c: &Cost| c.over_relocated.filter(|_| c.preset == Preset::PAPER_LINKED_LIST.name());
    XyPanel {
        y: automatic("list / relocated, outside CG", Scale::Linear),
        series: all(costs, |c| of_list(c).map(|gain: Estimate| point(0.0, gain))),
        marks: vec![
            Mark { label: String::new(), at: MarkAt::Y(1.0), color: 0 },
            Mark {
                label: format!("paper: {gain}x"),
                at: MarkAt::Point(paper.particles as f64, gain),
                color: 0,
            },
        ],
        ..panel("gain of relocation", costs)
    }
}

/// An empty panel over the number of particles.
fn panel(title: &str, costs: &[Cost]) -> XyPanel {
    XyPanel {
        title: title.to_string(),
        x: Axis { ticks: Some(ticks(costs)), range: range(costs), ..automatic("particles", Scale::Log10) },
        y: automatic("", Scale::Linear),
        series: Vec::new(),
        marks: Vec::new(),
        bands: Vec::new(),
    }
}

/// A series a variant that has any value.
fn all(costs: &[Cost], value: impl Fn(&Cost) -> Option<Point>) -> Vec<Series> {
    let mut presets: Vec<&str> = Vec::new();
    let mut series = Vec::new();
    for (label, of_variant) in by_variant(costs) {
        let preset = of_variant[0].preset.as_str();
        if !presets.contains(&preset) {
            presets.push(preset);
        }
        let place = presets.iter().position(|known| *known == preset).unwrap_or(0);
        let rooted = of_variant[0].test == "sqrt";
        let at = |cost: &&Cost| Some(Point { x: cost.particles as f64, ..value(cost)? });
        let points: Vec<Point> = of_variant.iter().filter_map(at).collect();
        if points.is_empty() {
            continue;
        }
        series.push(Series {
            label,
            color: color(preset, place),
            line: if rooted { Line::Dashed } else { Line::Solid },
            marker: marker(place, rooted),
            points,
        });
    }
    series
}

fn bare(y: f64) -> Point {
    Point { x: 0.0, y, low: None, high: None, label: None }
}

/// The colours of the paper's two presets are those of all figures.
pub(super) fn color(preset: &str, place: usize) -> usize {
    let others = [7, 1, 2];
    match preset {
        _ if preset == Preset::PAPER_LINKED_LIST.name() => LINKED_LIST,
        _ if preset == Preset::PAPER_AOS_RELOCATION.name() => RELOCATED,
        _ if preset == Preset::FAST.name() => FAST,
        _ => others[place % 3],
    }
}

fn marker(place: usize, open: bool) -> Marker {
    let filled = [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond];
    let outlines = [Marker::OpenCircle, Marker::OpenSquare, Marker::OpenTriangle, Marker::OpenDiamond];
    if open { outlines[place % 4] } else { filled[place % 4] }
}

fn ticks(costs: &[Cost]) -> Vec<(f64, String)> {
    let mut counts: Vec<usize> = costs.iter().map(|cost| cost.particles).collect();
    counts.sort_unstable();
    counts.dedup();
    counts.into_iter().map(|count| (count as f64, count.to_string())).collect()
}

fn range(costs: &[Cost]) -> Option<(f64, f64)> {
    let counts = || costs.iter().map(|cost| cost.particles as f64);
    Some((0.7 * counts().reduce(f64::min)?, 1.4 * counts().reduce(f64::max)?))
}
