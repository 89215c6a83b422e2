//! What the workbook's charts show, read from its tables: Table 2 as bars, Figure 4 as times and as speed-ups.

use super::block::{Block, Curve, Places, Point, Role};
use crate::engine::preset::Preset;
use crate::report::export::dictionary::{FIGURE4, TABLE2};
use crate::report::export::sheet::Sheet;
use crate::report::export::value::Value;

/// The charts that the run has numbers for.
pub fn charts(sheets: &[Sheet]) -> Vec<Block> {
    let named = |name: &str| sheets.iter().find(|sheet| sheet.table.name == name && is_measured(sheet));
    let mut charts: Vec<Block> = named(TABLE2.name).map(bars).into_iter().collect();
    charts.extend(named(FIGURE4.name).into_iter().flat_map(|sheet| [times(sheet), speed_ups(sheet)]));
    charts
}

/// Whether a row is the paper's; a machine may be called anything, a mode may not.
fn is_published(sheet: &Sheet, row: &[Value]) -> bool {
    sheet.text(row, "mode") == "published"
}

/// Whether a table says more than the paper.
fn is_measured(sheet: &Sheet) -> bool {
    sheet.rows.iter().any(|row| !is_published(sheet, row))
}

/// What a preset is called in a chart.
fn short(preset: &str) -> &'static str {
    if preset == Preset::PAPER_LINKED_LIST.name() { "linked list" } else { "relocated" }
}

/// Table 2: a bar a preset and distance test, the paper's first.
fn bars(sheet: &Sheet) -> Block {
    let totals = sheet.rows.iter().filter(|row| is_seconds(sheet, row, "total"));
    let bars: Vec<Bar> = totals.filter_map(|total| Bar::of(sheet, total)).collect();
    let curve = |name: &str, role, point: fn(&Bar) -> Point| {
        let points = bars.iter().map(|bar| Some(point(bar))).collect();
        Curve { name: name.to_string(), role, points }
    };
    Block {
        title: "Table 2: time of the run on one thread",
        unit: "s",
        places: Places::Names(bars.iter().map(|bar| bar.name.clone()).collect()),
        curves: vec![
            curve("CG", Role::InsideCg, |bar| bar.inside),
            curve("outside CG", Role::OutsideCg, |bar| bar.outside),
        ],
    }
}

/// A bar of Table 2 in two parts.
struct Bar {
    name: String,
    inside: Point,
    outside: Point,
}

impl Bar {
    /// The bar of the row of a total. Its top is the median of the total, as in the table, not the sum of two medians; the
    /// paper's parts are as printed.
    fn of(sheet: &Sheet, total: &[Value]) -> Option<Bar> {
        let same = |row: &&Vec<Value>| {
            ["mode", "distance_test", "row"]
                .iter()
                .all(|name| sheet.cell(row, name) == sheet.cell(total, name))
        };
        let part = |quantity: &str| {
            let row = sheet.rows.iter().filter(|row| is_seconds(sheet, row, quantity)).find(same)?;
            sheet.number(row, "value")
        };
        let (cg, value) = (part("cg")?, sheet.number(total, "value")?);
        let search = short(sheet.text(total, "row"));
        if is_published(sheet, total) {
            let name = format!("paper: {search}");
            return Some(Bar { name, inside: plain(cg), outside: plain(part("non_cg")?) });
        }
        let end = |column: &str| sheet.number(total, column).map(|end| end - cg);
        Some(Bar {
            name: format!("here, {}: {search}", sheet.text(total, "distance_test")),
            inside: plain(cg),
            outside: Point { value: value - cg, low: end("low"), high: end("high") },
        })
    }
}

fn is_seconds(sheet: &Sheet, row: &[Value], quantity: &str) -> bool {
    sheet.text(row, "unit") == "s" && sheet.text(row, "quantity") == quantity
}

/// A curve of Figure 4: a preset, and the part of a step whose columns begin with `part`.
struct Followed {
    preset: Preset,
    part: &'static str,
}

/// The four of them: the whole step, then the part outside the conjugate gradients.
const FOLLOWED: [Followed; 4] = [
    Followed { preset: Preset::PAPER_LINKED_LIST, part: "total" },
    Followed { preset: Preset::PAPER_AOS_RELOCATION, part: "total" },
    Followed { preset: Preset::PAPER_LINKED_LIST, part: "non_cg" },
    Followed { preset: Preset::PAPER_AOS_RELOCATION, part: "non_cg" },
];

impl Followed {
    /// The curve through the columns of the median and the interval's ends, whose names end so.
    fn curve(&self, sheet: &Sheet, threads: &[f64], ends: [&str; 3]) -> Curve {
        let whole = self.part == "total";
        let relocated = self.preset == Preset::PAPER_AOS_RELOCATION;
        let part = if whole { "whole step" } else { "outside CG" };
        let columns = ends.map(|end| format!("{}_{end}", self.part));
        Curve {
            name: format!("{part}, {}", short(self.preset.name())),
            role: Role::Measured { relocated, whole },
            points: points(sheet, threads, self.preset.name(), columns.each_ref().map(String::as_str)),
        }
    }
}

/// The points of one preset at each number of threads: `median`, `low` and `high` are columns.
fn points(
    sheet: &Sheet,
    threads: &[f64],
    preset: &str,
    [median, low, high]: [&str; 3],
) -> Vec<Option<Point>> {
    let measured = |row: &&Vec<Value>| !is_published(sheet, row) && sheet.text(row, "preset") == preset;
    let at = |threads: f64| {
        let of_preset = sheet.rows.iter().filter(measured);
        let row = of_preset.into_iter().find(|row| sheet.number(row, "threads") == Some(threads))?;
        let (low, high) = (sheet.number(row, low), sheet.number(row, high));
        Some(Point { value: sheet.number(row, median)?, low, high })
    };
    threads.iter().map(|&threads| at(threads)).collect()
}

/// All numbers of threads in the table, the paper's among them.
fn threads(sheet: &Sheet) -> Vec<f64> {
    let mut threads: Vec<f64> = sheet.rows.iter().filter_map(|row| sheet.number(row, "threads")).collect();
    threads.sort_by(f64::total_cmp);
    threads.dedup();
    threads
}

/// Figure 4: milliseconds a step against threads, and what ideal scaling of the linked list would give.
fn times(sheet: &Sheet) -> Block {
    let threads = threads(sheet);
    let curve = |followed: &Followed| followed.curve(sheet, &threads, ["ms_per_step", "low", "high"]);
    let mut curves: Vec<Curve> = FOLLOWED.iter().map(curve).collect();
    let of_list = curves.iter().filter(|curve| matches!(curve.role, Role::Measured { relocated: false, .. }));
    let ideals: Vec<Curve> = of_list.map(|curve| ideal_of(curve, &threads)).collect();
    curves.extend(ideals);
    Block { title: "Figure 4: time of a step", unit: "ms", places: Places::Threads(threads), curves }
}

/// What the time on one thread, where there is one, would become if threads shared it evenly.
fn ideal_of(curve: &Curve, threads: &[f64]) -> Curve {
    let one_thread = threads.iter().position(|&threads| threads == 1.0).and_then(|place| curve.points[place]);
    let at = |threads: &f64| Some(plain(one_thread?.value / threads));
    let name = format!("{}: ideal scaling", curve.name);
    Curve { name, role: Role::Ideal, points: threads.iter().map(at).collect() }
}

/// A value without an interval.
fn plain(value: f64) -> Point {
    Point { value, low: None, high: None }
}

/// Figure 4: speed-up over one thread, beside the two that the paper prints.
fn speed_ups(sheet: &Sheet) -> Block {
    let threads = threads(sheet);
    let curve =
        |followed: &Followed| followed.curve(sheet, &threads, ["speed_up", "speed_up_low", "speed_up_high"]);
    let mut curves: Vec<Curve> = FOLLOWED.iter().map(curve).collect();
    let ideal = threads.iter().map(|&threads| Some(plain(threads))).collect();
    curves.push(Curve { name: "ideal scaling".to_string(), role: Role::Ideal, points: ideal });
    curves.push(published(sheet, &threads, true));
    curves.push(published(sheet, &threads, false));
    Block { title: "Figure 4: speed-up over one thread", unit: "1", places: Places::Threads(threads), curves }
}

/// The one point that the paper prints of a curve.
fn published(sheet: &Sheet, threads: &[f64], whole: bool) -> Curve {
    let (name, column) =
        if whole { ("whole run", "total_speed_up") } else { ("outside CG", "non_cg_speed_up") };
    let at = |threads: &f64| {
        let row = sheet.rows.iter().find(|row| is_published(sheet, row))?;
        let there = sheet.number(row, "threads") == Some(*threads);
        sheet.number(row, column).filter(|_| there).map(plain)
    };
    let points = threads.iter().map(at).collect();
    Curve { name: format!("paper, {name}"), role: Role::Published { whole }, points }
}
