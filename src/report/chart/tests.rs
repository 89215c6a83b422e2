//! What a reader relies on: the same bytes, whole and legible labels, and no crash on odd data.

use resvg::tiny_skia::Pixmap;
use resvg::usvg::{self, roxmltree};

use super::axis::{Direction, Ruler};
use super::*;

/// What the report's texts are written with, beyond plain letters.
const SYMBOLS: &str = "éÀ–—×÷±≤≥≈µμρΔν²³·…‘’“”→−⁰¹⁴⁵⁶⁷⁸⁹⁻";

const HOSTILE: &str = "<script>alert(\"a\" & 'b')</script>";

fn axis(label: &str, scale: Scale) -> Axis {
    Axis { label: label.to_owned(), scale, range: None, ticks: None }
}

fn point(x: f64, y: f64) -> Point {
    Point { x, y, low: Some(y * 0.9), high: Some(y * 1.1), label: Some("point".to_owned()) }
}

fn series(label: &str, points: Vec<Point>) -> Series {
    Series { label: label.to_owned(), color: 5, line: Line::Solid, marker: Marker::Circle, points }
}

fn panel(x: Scale, y: Scale, points: Vec<Point>) -> XyPanel {
    XyPanel {
        title: "panel".to_owned(),
        x: axis("threads", x),
        y: axis("time (ms)", y),
        series: vec![series("sorted cells", points)],
        marks: Vec::new(),
        bands: Vec::new(),
    }
}

fn bar(values: Vec<f64>, published: bool) -> Bar {
    Bar { label: "this machine".to_owned(), values, interval: Some((1.0, 4.0)), published }
}

fn bar_panel(bars: Vec<Bar>) -> BarPanel {
    BarPanel {
        title: "bars".to_owned(),
        y_label: "time (s)".to_owned(),
        segments: vec!["CG".to_owned(), "non-CG".to_owned()],
        groups: vec![BarGroup { label: "8 threads".to_owned(), bars }],
    }
}

fn figure(panels: Vec<Panel>) -> Figure {
    Figure {
        title: "figure".to_owned(),
        description: "what it shows".to_owned(),
        panels,
        note: Some("note".to_owned()),
    }
}

fn scaling() -> XyPanel {
    let points = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0].map(|threads: f64| point(threads, 80.0 / threads));
    panel(Scale::Log2, Scale::Log10, points.to_vec())
}

fn mixed() -> Figure {
    let mut shown = scaling();
    shown.marks = vec![
        Mark { label: "paper".to_owned(), at: MarkAt::Y(60.0), color: 6 },
        Mark { label: "default".to_owned(), at: MarkAt::X(4.0), color: 7 },
        Mark { label: "optimum".to_owned(), at: MarkAt::Point(8.0, 20.0), color: 1 },
    ];
    shown.bands = vec![Band { label: "noise".to_owned(), low: 5.0, high: 9.0, color: 3 }];
    figure(vec![
        Panel::Xy(shown),
        Panel::Bars(bar_panel(vec![bar(vec![1.0, 2.0], true), bar(vec![2.0, 1.0], false)])),
    ])
}

fn texts(svg: &str) -> Vec<String> {
    let document = roxmltree::Document::parse(svg).expect("the SVG is well-formed");
    let elements = document.descendants().filter(|node| node.has_tag_name("text"));
    elements.filter_map(|node| Some(node.text()?.trim().to_owned())).collect()
}

#[test]
fn same_figure_gives_same_bytes() {
    let (one, other) = (mixed().to_svg().unwrap(), mixed().to_svg().unwrap());
    assert_eq!(one, other);
    assert_eq!(svg_to_png(&one, 600).unwrap(), svg_to_png(&other, 600).unwrap());
}

#[test]
fn png_has_the_width_asked_for_and_a_white_ground() {
    let png = svg_to_png(&mixed().to_svg().unwrap(), 640).unwrap();
    let image = Pixmap::decode_png(&png).unwrap();
    assert_eq!(image.width(), 640);
    assert!((200..640).contains(&image.height()));
    let corner = image.pixel(0, 0).unwrap();
    assert_eq!((corner.red(), corner.green(), corner.blue(), corner.alpha()), (255, 255, 255, 255));
    assert!(image.pixels().iter().any(|pixel| pixel.red() < 60), "there is ink on the ground");
    assert!(svg_to_png("<svg", 640).is_err());
    assert!(svg_to_png(&mixed().to_svg().unwrap(), 0).is_err());
}

#[test]
fn document_speaks_to_readers_who_cannot_see_it() {
    let svg = mixed().to_svg().unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let root = document.root_element();
    assert_eq!(root.attribute("role"), Some("img"));
    assert_eq!(root.attribute("width"), Some("100%"));
    assert_eq!(root.attribute("aria-label"), Some("figure – what it shows"));
    let child = |name| root.children().find(|node| node.has_tag_name(name)).and_then(|node| node.text());
    assert_eq!((child("title"), child("desc")), (Some("figure"), Some("what it shows")));
    let ground = root.children().find(|node| node.has_tag_name("rect")).unwrap();
    assert_eq!(ground.attribute("fill"), Some("#FFFFFF"));
}

#[test]
fn text_cannot_become_markup() {
    let mut hostile = mixed();
    hostile.title = HOSTILE.to_owned();
    hostile.description = format!("{HOSTILE}\u{0}\u{1B}");
    let mut plot = scaling();
    plot.series[0].label = HOSTILE.to_owned();
    plot.x.ticks = Some(vec![(2.0, HOSTILE.replace(' ', "_"))]);
    hostile.panels.push(Panel::Xy(plot));
    let svg = hostile.to_svg().unwrap();
    assert!(!svg.contains("<script"));
    let document = roxmltree::Document::parse(&svg).unwrap();
    let desc = document.descendants().find(|node| node.has_tag_name("desc"));
    assert_eq!(desc.and_then(|node| node.text()), Some(HOSTILE));
    assert!(texts(&svg).contains(&HOSTILE.to_owned()));
}

#[test]
fn font_has_every_character_that_the_report_uses() {
    let printable: String = (' '..='~').chain('\u{A0}'..='\u{AC}').chain('\u{AE}'..='\u{FF}').collect();
    assert_eq!(missing_glyphs(&printable), []);
    assert_eq!(missing_glyphs(SYMBOLS), []);
    assert_eq!(missing_glyphs("a粒b子c粒\n"), ['粒', '子', '\n']);
}

#[test]
fn missing_glyph_is_an_error_that_names_it() {
    let mut unreadable = mixed();
    let Panel::Xy(plot) = &mut unreadable.panels[0] else { unreachable!() };
    plot.series[0].points[2].label = Some("粒子".to_owned());
    let message = unreadable.to_svg().unwrap_err().to_string();
    assert!(message.contains("U+7C92") && message.contains("point label \"粒子\""), "{message}");
    let svg = unreadable.legible().to_svg().unwrap();
    assert!(texts(&svg).contains(&"??".to_owned()), "the rest of the figure is worth more than the letters");
    unreadable = mixed();
    unreadable.description = "粒子".to_owned();
    assert!(unreadable.to_svg().is_ok(), "the description is not drawn");
}

/// Whatever text a figure draws, foreign letters in it do not stop the report.
#[test]
fn every_drawn_text_can_be_made_legible() {
    let mut foreign = mixed();
    let places = foreign.drawn_texts().len();
    let mut changed = 0;
    foreign.change_texts(&mut |text| {
        *text = "粒\n<b>".to_owned();
        changed += 1;
    });
    assert_eq!(changed, places);
    let svg = foreign.legible().to_svg().unwrap();
    assert!(texts(&svg).iter().any(|text| text == "? <b>") && !svg.contains("<b>"));
}

#[test]
fn thread_axis_is_labelled_with_powers_of_two() {
    let threads = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
    let ruler = Ruler::new(&axis("threads", Scale::Log2), &threads, Direction::Across).unwrap();
    let labels: Vec<&str> = ruler.ticks.iter().map(|tick| tick.label.as_str()).collect();
    assert_eq!(labels, ["1", "2", "4", "8", "16", "32"]);
    let ends = [1.0, 32.0].map(|value| ruler.fraction(value).unwrap());
    assert!(ends[0] > 0.02 && ends[1] < 0.98, "{ends:?}");
}

#[test]
fn decimal_axis_ends_on_round_values() {
    let labels = |values: &[f64]| {
        let ruler = Ruler::new(&axis("time", Scale::Log10), values, Direction::Up).unwrap();
        ruler.ticks.into_iter().map(|tick| tick.label).collect::<Vec<_>>()
    };
    assert_eq!(labels(&[0.9, 300.0]), ["1", "10", "100"]);
    assert_eq!(labels(&[3.0, 40.0]), ["2", "5", "10", "20", "50"]);
    assert_eq!(labels(&[1e-7, 1e-6]), ["5×10⁻⁸", "10⁻⁷", "2×10⁻⁷", "5×10⁻⁷", "10⁻⁶", "2×10⁻⁶"]);
}

#[test]
fn linear_axis_has_even_ticks_with_equal_decimals() {
    let labels = |values: &[f64], direction| {
        let ruler = Ruler::new(&axis("value", Scale::Linear), values, direction).unwrap();
        ruler.ticks.into_iter().map(|tick| tick.label).collect::<Vec<_>>()
    };
    assert_eq!(labels(&[0.1, 1.0], Direction::Up), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
    assert_eq!(labels(&[-2.0, 3.0], Direction::Across), ["−2", "−1", "0", "1", "2", "3"]);
    assert_eq!(labels(&[0.0, 3e7], Direction::Up).last().unwrap(), "3.0×10⁷");
}

#[test]
fn odd_data_never_panics_and_never_leaves_the_picture() {
    let odd = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        0.0,
        -1.0,
        f64::MAX,
        f64::MIN_POSITIVE,
        5e-324,
        1e299,
        1.0,
    ];
    let mut sets: Vec<Vec<Point>> = vec![Vec::new(), vec![point(5.0, 5.0)], vec![point(3.0, 7.0); 4]];
    sets.extend(odd.map(|value| vec![point(value, 1.0), point(1.0, value)]));
    sets.push(odd.map(|value| point(value, value)).to_vec());
    sets.push(vec![point(1.0, 1.0), point(1.0 + f64::EPSILON, 1.0 + f64::EPSILON)]);
    let scales = [Scale::Linear, Scale::Log2, Scale::Log10];
    for set in sets {
        for (x, y) in scales.iter().flat_map(|x| scales.map(|y| (*x, y))) {
            let svg = figure(vec![Panel::Xy(panel(x, y, set.clone()))]).to_svg().unwrap();
            assert!(!svg.contains("NaN"), "{set:?} on {x:?} and {y:?}");
            assert_texts_inside(&svg);
        }
    }
}

#[test]
fn odd_bars_never_panic() {
    for values in [vec![0.0, 0.0], vec![f64::NAN, -1.0], vec![f64::INFINITY, 1e290], vec![1e-300, 0.0]] {
        let mut odd = bar(values, true);
        odd.interval = Some((f64::NAN, 1.0));
        assert_texts_inside(&figure(vec![Panel::Bars(bar_panel(vec![odd]))]).to_svg().unwrap());
    }
    let short = figure(vec![Panel::Bars(bar_panel(vec![bar(vec![1.0], false)]))]);
    assert!(short.to_svg().unwrap_err().to_string().contains("1 values for 2 segments"));
}

#[test]
fn empty_panels_say_so() {
    let mut bars = bar_panel(Vec::new());
    bars.groups.clear();
    let empty =
        figure(vec![Panel::Xy(panel(Scale::Log2, Scale::Log10, vec![point(1.0, -1.0)])), Panel::Bars(bars)]);
    let shown = texts(&empty.to_svg().unwrap());
    assert_eq!(shown.iter().filter(|text| *text == "no data").count(), 2);
    assert!(figure(Vec::new()).to_svg().is_ok());
}

#[test]
fn long_texts_stay_inside_the_picture() {
    let long = "a label that goes on and on ".repeat(8) + &"unbroken".repeat(20);
    let mut plot = scaling();
    plot.title.clone_from(&long);
    plot.x.label.clone_from(&long);
    plot.series[0].label.clone_from(&long);
    plot.x.ticks = Some(vec![(1.0, "a memory order with a name".to_owned()), (2.0, "short".to_owned())]);
    let mut bars = bar_panel(vec![bar(vec![1.0, 2.0], true); 12]);
    bars.groups[0].label.clone_from(&long);
    let mut crowded = figure(vec![Panel::Xy(plot), Panel::Bars(bars)]);
    crowded.title.clone_from(&long);
    crowded.note = Some(long);
    assert_texts_inside(&crowded.to_svg().unwrap());
}

#[test]
fn impossible_range_is_an_error() {
    for range in [(1.0, 1.0), (2.0, 1.0), (0.0, 8.0), (1.0, f64::NAN)] {
        let mut plot = scaling();
        plot.x.range = Some(range);
        let message = figure(vec![Panel::Xy(plot)]).to_svg().unwrap_err().to_string();
        assert!(message.contains("\"threads\""), "{message}");
    }
}

#[test]
fn legend_that_explains_all_panels_is_drawn_once() {
    let same = figure(vec![Panel::Xy(scaling()), Panel::Xy(scaling())]).to_svg().unwrap();
    assert_eq!(texts(&same).iter().filter(|text| *text == "sorted cells").count(), 1);
    let mut other = scaling();
    other.series[0].color = 6;
    let different = figure(vec![Panel::Xy(scaling()), Panel::Xy(other)]).to_svg().unwrap();
    assert_eq!(texts(&different).iter().filter(|text| *text == "sorted cells").count(), 2);
}

/// Checks with the renderer's own measures that no text is cut off by the edge of the picture.
fn assert_texts_inside(svg: &str) {
    let options = usvg::Options { fontdb: Arc::clone(&FONTS), ..usvg::Options::default() };
    let tree = usvg::Tree::from_str(svg, &options).unwrap();
    let (width, height) = (tree.size().width(), tree.size().height());
    for node in tree.root().children() {
        if let usvg::Node::Text(text) = node {
            let bounds = text.abs_bounding_box();
            let inside = bounds.left() >= 0.0
                && bounds.top() >= 0.0
                && bounds.right() <= width
                && bounds.bottom() <= height;
            let words: String = text.chunks().iter().map(|chunk| chunk.text()).collect();
            assert!(inside, "{words:?} lies at {bounds:?} in a picture of {width} by {height}");
        }
    }
}
