//! Every cell against the first of its group, with verdicts that hold for all of them at once.

use crate::base::statistics::compare;
use crate::experiment::record::Stage;
use crate::report::measured::{ByRound, Measured, Quantity, TimedCell, by_round};
use crate::report::noise;
use crate::report::table::{TableView, show_or_none};

/// A cell and the one it is compared with.
struct Pair {
    cell: TimedCell,
    base: TimedCell,
}

/// The time of a whole step of each cell over that of the first cell of its group and thread count; `None` where no group
/// has two. The probability that any verdict of the table is wrong is at most five per cent.
pub fn view(measured: &Measured, experiment: &str) -> Option<TableView> {
    let pairs = pairs(measured.cells(experiment));
    if pairs.is_empty() {
        return None;
    }
    let stage = measured.stage_for_tables(experiment);
    let per_step = |cell: &TimedCell| measured.per_step(experiment, stage, cell, Quantity::Total);
    let log_ratios: Vec<Vec<f64>> =
        pairs.iter().map(|pair| logarithms(&per_step(&pair.cell), &per_step(&pair.base))).collect();
    let floor = noise::floor(measured, experiment, Quantity::Total).filter(|_| stage == Stage::Paired);
    let caption = format!(
        "Time of the whole step over that of the first cell of the group, by round: median [95 % interval of each \
         alone]. The verdicts hold together: the probability that any of these {} is wrong is at most 5 % (sign tests, \
         corrected by Holm's method).",
        pairs.len()
    );
    let mut view = TableView::new(&caption, &["cell", "compared with", "time over its time", "verdict"]);
    for (pair, comparison) in pairs.iter().zip(compare(&log_ratios, floor.as_ref())) {
        let ratio = show_or_none(comparison.ratio, 3);
        view.rows.push(vec![name(&pair.cell), name(&pair.base), ratio, comparison.verdict.to_string()]);
    }
    Some(view)
}

/// Every cell but the first of its group and thread count, with that first one.
fn pairs(cells: Vec<TimedCell>) -> Vec<Pair> {
    let mut bases: Vec<TimedCell> = Vec::new();
    let mut pairs = Vec::new();
    for cell in cells {
        let base = bases.iter().find(|base| base.subject == cell.subject && base.threads == cell.threads);
        match base {
            Some(base) => pairs.push(Pair { base: base.clone(), cell }),
            None => bases.push(cell),
        }
    }
    pairs
}

fn logarithms(of: &ByRound, over: &ByRound) -> Vec<f64> {
    by_round(of, over, |a, b| (a / b).ln())
}

fn name(cell: &TimedCell) -> String {
    let group = if cell.subject.is_empty() { String::new() } else { format!("{} ", cell.subject) };
    format!("{group}{} t{}", cell.variant.label().replace('/', " "), cell.threads)
}
