//! CG: time and iterations over its tolerance, and which tolerance would give the paper's share.

use anyhow::Result;

use crate::base::statistics::Estimate;
use crate::engine::preset::Preset;
use crate::experiment::record::Stage;
use crate::report::chart::{Figure, Line, Mark, MarkAt, Marker, Panel, Point, Scale, Series, XyPanel};
use crate::report::measured::{ByRound, Cell, Measured, Quantity, TimedCell, ratio, times};
use crate::report::published::Published;
use crate::report::section::{Content, automatic, how_measured, point};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show, show_or_none};

const ID: &str = "cg";

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    let solver = Solver { measured, cells: measured.cells(ID) };
    let mut findings = vec![how_measured(measured, ID)];
    findings.extend(["ell", "csr"].into_iter().filter_map(|storage| solver.papers_tolerance(storage)));
    findings.extend(solver.representative());
    findings.extend(solver.storage());
    findings.extend(solver.serial());
    Ok(Content {
        findings,
        figures: vec![("cg".to_string(), solver.figure())],
        tables: vec![solver.tolerances_table(), solver.who_table()],
        ..Content::default()
    })
}

struct Solver<'a> {
    measured: &'a Measured,
    cells: Vec<TimedCell>,
}

/// The tolerance that `value` reaches `wanted` at, by interpolation between the two neighbours in the tolerance's
/// logarithm; `None` where no two neighbours have it between them.
fn tolerance_at(points: &[(f64, f64)], wanted: f64) -> Option<f64> {
    points.windows(2).find_map(|pair| {
        let ((a, low), (b, high)) = (pair[0], pair[1]);
        let between = (low.min(high)..=low.max(high)).contains(&wanted) && low != high;
        between.then(|| (a.ln() + (wanted - low) / (high - low) * (b.ln() - a.ln())).exp())
    })
}

impl Solver<'_> {
    fn of(&self, cell: &TimedCell, quantity: Quantity) -> ByRound {
        let seconds = self.measured.per_step(ID, Stage::Paired, cell, quantity);
        seconds.into_iter().map(|(round, s)| (round, 1e3 * s)).collect()
    }

    fn iterations(&self, cell: &TimedCell) -> f64 {
        let windows = self.measured.windows(ID, Stage::Paired, cell);
        let steps = || windows.values().next().into_iter().flat_map(|w| w.iter()).flat_map(|w| &w.steps);
        steps().map(|step| step.cg_iterations as f64).sum::<f64>() / steps().count() as f64
    }

    /// The cells of one storage, from the loosest tolerance to the tightest.
    fn tolerances(&self, storage: &str) -> Vec<&TimedCell> {
        let of = self.cells.iter().filter(|c| c.subject == "tolerance" && c.variant.storage == storage);
        let mut cells: Vec<&TimedCell> = of.collect();
        cells.sort_by(|a, b| b.variant.cg_tolerance.total_cmp(&a.variant.cg_tolerance));
        cells
    }

    /// CG over the rest, the paper's and ours with each tolerance.
    fn papers_tolerance(&self, storage: &str) -> Option<String> {
        let paper = Published::load().table2.linked_list;
        let wanted = paper.cg_s / paper.non_cg_s;
        let mut points = Vec::new();
        for cell in self.tolerances(storage) {
            let share = ratio(&self.of(cell, Quantity::Cg), &self.of(cell, Quantity::NonCg))?;
            points.push((cell.variant.cg_tolerance, share.median));
        }
        let (loosest, tightest) = (points.first()?, points.last()?);
        let answer = match tolerance_at(&points, wanted) {
            Some(tolerance) => format!("a tolerance of about {tolerance:.0e} would give that share here"),
            None if wanted < loosest.1 => {
                format!(
                    "even {:e} takes {:.3} here: no tolerance tried is loose enough",
                    loosest.0, loosest.1
                )
            }
            None => format!("even {:e} takes only {:.3} here", tightest.0, tightest.1),
        };
        Some(format!(
            "The paper's CG takes {wanted:.3} times the rest ({} s beside {} s); with {storage}, linked list and sqrt, \
             {answer} (from {:.3} at {:e} to {:.3} at {:e}).",
            paper.cg_s, paper.non_cg_s, loosest.1, loosest.0, tightest.1, tightest.0
        ))
    }

    /// ELL over CSR at the usual tolerance.
    fn storage(&self) -> Option<String> {
        let usual = |cell: &&TimedCell| {
            cell.variant.cg_tolerance == self.measured.experiment(ID).map_or(0.0, |e| e.fixed.cg_tolerance)
        };
        let [ell, csr] = ["ell", "csr"].map(|storage| self.tolerances(storage).into_iter().find(usual));
        let (ell, csr) = (ell?, csr?);
        let over = ratio(&self.of(ell, Quantity::Cg), &self.of(csr, Quantity::Cg))?;
        Some(format!(
            "At {:e}, ELL takes {} times CSR's time in CG on one thread, for {:.1} iterations a step.",
            ell.variant.cg_tolerance,
            show(&over, 3),
            self.iterations(ell)
        ))
    }

    /// How well the few steps of this experiment stand for the run.
    fn representative(&self) -> Option<String> {
        let usual = self.measured.experiment(ID)?.fixed.cg_tolerance;
        let here = self.tolerances("ell").into_iter().find(|cell| cell.variant.cg_tolerance == usual)?;
        let here = ratio(&self.of(here, Quantity::Cg), &self.of(here, Quantity::NonCg))?;
        let list = Cell::new(Preset::PAPER_LINKED_LIST.name(), "sqrt", 1);
        let run = |quantity| self.measured.per_step("table2", Stage::Paired, &list, quantity);
        let there = ratio(&run(Quantity::Cg), &run(Quantity::NonCg))?;
        Some(format!(
            "At {usual:e} CG takes {} times the rest in these steps, {} times in the steps of table2, which stand for \
             more of the run.",
            show(&here, 3),
            show(&there, 3)
        ))
    }

    /// What the speed-up of the whole would be without a parallel CG.
    fn serial(&self) -> Option<String> {
        let who = || self.cells.iter().filter(|c| c.subject == "who" && c.variant.storage == "ell");
        let threads = who().map(|c| c.threads).max().filter(|&threads| threads > 1)?;
        let total = |threads: usize, cg: &str| {
            let cell = who().find(|c| c.threads == threads && c.variant.cg == cg)?;
            Some(self.of(cell, Quantity::Total))
        };
        let one = total(1, "parallel")?;
        let speed_up = |cg: &str| ratio(&one, &total(threads, cg)?);
        Some(format!(
            "The whole step is {} times as fast on {threads} threads as on one with parallel CG, {} times with serial CG \
             (ell, linked list, sqrt).",
            show(&speed_up("parallel")?, 3),
            show(&speed_up("serial")?, 3)
        ))
    }

    fn figure(&self) -> Figure {
        let paper = Published::load().table2.linked_list;
        let time = |cell: &TimedCell| times(&self.of(cell, Quantity::Cg));
        let iterations = |cell: &TimedCell| Some(Estimate::single(self.iterations(cell)));
        let non_cg = self.tolerances("ell").first().and_then(|cell| times(&self.of(cell, Quantity::NonCg)));
        let share = non_cg.map(|e| Mark {
            label: "the paper's share of CG".to_string(),
            at: MarkAt::Y(e.median * paper.cg_s / paper.non_cg_s),
            color: 0,
        });
        Figure {
            title: "What CG's tolerance costs".to_string(),
            description: "Milliseconds a step in CG and its iterations against the relative residual at which it \
                          stops, on one thread, for both storages of the matrix. Bars span all rounds of times and 95 % intervals of ratios. The dotted line is \
                          where CG would have the paper's share beside our time outside CG."
                .to_string(),
            panels: vec![
                Panel::Xy(self.panel("time", "ms a step in CG", &time, share.into_iter().collect())),
                Panel::Xy(self.panel("iterations", "iterations a step", &iterations, Vec::new())),
            ],
            note: self.measured.stamp(),
        }
    }

    fn panel(&self, title: &str, label: &str, value: &Value<'_>, marks: Vec<Mark>) -> XyPanel {
        let series =
            [("ell", 5, Marker::Circle), ("csr", 6, Marker::Square)].map(|(storage, color, marker)| {
                let at = |cell: &TimedCell| -> Option<Point> {
                    Some(point(cell.variant.cg_tolerance, value(cell)?))
                };
                Series {
                    label: storage.to_string(),
                    color,
                    line: Line::Solid,
                    marker,
                    points: self.tolerances(storage).into_iter().filter_map(at).collect(),
                }
            });
        XyPanel {
            title: title.to_string(),
            x: automatic("relative residual at the end", Scale::Log10),
            y: automatic(label, Scale::Linear),
            series: series.into(),
            marks,
            bands: Vec::new(),
        }
    }

    fn tolerances_table(&self) -> TableView {
        let mut view = TableView::new(
            "CG by tolerance on one thread, linked list, sqrt: milliseconds a step, and CG over the rest.",
            &["storage", "tolerance", "iterations", "CG, ms", "CG / outside CG"],
        );
        for cell in ["ell", "csr"].into_iter().flat_map(|storage| self.tolerances(storage)) {
            let (cg, non_cg) = (self.of(cell, Quantity::Cg), self.of(cell, Quantity::NonCg));
            view.rows.push(vec![
                cell.variant.storage.clone(),
                format!("{:e}", cell.variant.cg_tolerance),
                format!("{:.1}", self.iterations(cell)),
                show_or_none(times(&cg), 2),
                show_or_none(ratio(&cg, &non_cg), 3),
            ]);
        }
        view
    }

    fn who_table(&self) -> TableView {
        let mut view = TableView::new(
            "Who computes CG: milliseconds a step, linked list, sqrt, median (smallest to largest round).",
            &["threads", "CG", "storage", "CG, ms", "outside CG, ms", "total, ms"],
        );
        for cell in self.cells.iter().filter(|cell| cell.subject == "who") {
            let names = [cell.threads.to_string(), cell.variant.cg.clone(), cell.variant.storage.clone()];
            let times = [Quantity::Cg, Quantity::NonCg, Quantity::Total].map(|q| times(&self.of(cell, q)));
            let shown = times.into_iter().map(|time| show_or_none(time, 2));
            view.rows.push(names.into_iter().chain(shown).collect());
        }
        view
    }
}

/// What a panel shows of a cell.
type Value<'a> = dyn Fn(&TimedCell) -> Option<Estimate> + 'a;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tolerance_is_interpolated_in_its_logarithm() {
        let points = [(1e-2, 0.1), (1e-4, 0.2), (1e-8, 0.4)];
        assert!((tolerance_at(&points, 0.15).unwrap().log10() + 3.0).abs() < 1e-12);
        assert!((tolerance_at(&points, 0.3).unwrap().log10() + 6.0).abs() < 1e-12);
        assert_eq!(tolerance_at(&points, 0.05), None);
        assert_eq!(tolerance_at(&points, 0.5), None);
    }
}
