//! Preconditioners: iterations and time of the pressure solve, beside plain CG's.

use anyhow::Result;

use crate::base::statistics::Estimate;
use crate::engine::pressure::preconditioner::Preconditioning;
use crate::experiment::record::Stage;
use crate::report::chart::{Figure, Line, Marker, Panel, Scale, Series, XyPanel};
use crate::report::measured::{ByRound, Measured, Quantity, TimedCell, ratio, times};
use crate::report::section::{Content, automatic, categories, how_measured, point, side_by_side};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show, show_or_none};

const ID: &str = "preconditioners";

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    let solves = Solves { measured, cells: measured.cells(ID) };
    let mut findings = vec![how_measured(measured, ID)];
    findings.extend(solves.groups().into_iter().filter_map(|group| solves.finding(&group)));
    Ok(Content {
        findings,
        figures: vec![("preconditioners".to_string(), solves.figure())],
        tables: vec![solves.table()],
        ..Content::default()
    })
}

struct Solves<'a> {
    measured: &'a Measured,
    cells: Vec<TimedCell>,
}

impl Solves<'_> {
    /// The groups of cells, one a number of particles, the fewest first.
    fn groups(&self) -> Vec<String> {
        let mut groups: Vec<String> = self.cells.iter().map(|cell| cell.subject.clone()).collect();
        groups.sort_by_key(|group| group.parse().unwrap_or(usize::MAX));
        groups.dedup();
        groups
    }

    fn cell(&self, group: &str, name: Preconditioning, values: &str) -> Option<&TimedCell> {
        self.cells.iter().find(|cell| {
            cell.subject == group
                && cell.variant.preconditioner == name.name()
                && cell.variant.matrix_values == values
        })
    }

    /// Milliseconds a step in CG.
    fn time(&self, cell: &TimedCell) -> ByRound {
        let seconds = self.measured.per_step(ID, Stage::Paired, cell, Quantity::Cg);
        seconds.into_iter().map(|(round, s)| (round, 1e3 * s)).collect()
    }

    /// Iterations a step.
    fn iterations(&self, cell: &TimedCell) -> Option<f64> {
        let windows = self.measured.windows(ID, Stage::Paired, cell);
        let steps = || windows.values().next().into_iter().flat_map(|w| w.iter()).flat_map(|w| &w.steps);
        let count = steps().count();
        (count > 0).then(|| steps().map(|step| step.cg_iterations as f64).sum::<f64>() / count as f64)
    }

    /// The time over that of plain CG in double precision.
    fn over_plain(&self, group: &str, cell: &TimedCell) -> Option<Estimate> {
        let plain = self.cell(group, Preconditioning::None, "f64")?;
        ratio(&self.time(cell), &self.time(plain))
    }

    /// What two levels gain, and what single precision does.
    fn finding(&self, group: &str) -> Option<String> {
        let [plain, levels] =
            [Preconditioning::None, Preconditioning::TwoLevel].map(|name| self.cell(group, name, "f64"));
        let (plain, levels) = (plain?, levels?);
        let single = self.cell(group, Preconditioning::None, "f32")?;
        Some(format!(
            "{group} particles: two levels take {:.1} iterations where plain CG takes {:.1}, and {} of its time; with \
             values in f32, plain CG takes {} of its time.",
            self.iterations(levels)?,
            self.iterations(plain)?,
            show(&self.over_plain(group, levels)?, 3),
            show(&self.over_plain(group, single)?, 3)
        ))
    }

    fn figure(&self) -> Figure {
        let names: Vec<String> = Preconditioning::ALL.map(|name| name.name().to_string()).into();
        let shapes = [Marker::Circle, Marker::Square, Marker::OpenCircle, Marker::OpenSquare];
        let series = |(k, group): (usize, &String), value: &Value<'_>| {
            ["f64", "f32"]
                .into_iter()
                .enumerate()
                .map(move |(v, values)| Series {
                    label: format!("{group}, {values}"),
                    color: 5 + k,
                    line: Line::None,
                    marker: shapes[(k + 2 * v) % shapes.len()],
                    points: Preconditioning::ALL
                        .into_iter()
                        .enumerate()
                        .filter_map(|(x, name)| {
                            Some(point(x as f64, value(group, self.cell(group, name, values)?)?))
                        })
                        .collect(),
                })
                .collect::<Vec<_>>()
        };
        let groups = self.groups();
        let panel = |title: &str, label: &str, value: &Value<'_>| {
            Panel::Xy(XyPanel {
                title: title.to_string(),
                x: categories("preconditioner", &names),
                y: automatic(label, Scale::Linear),
                series: side_by_side(
                    groups.iter().enumerate().flat_map(|group| series(group, value)).collect(),
                ),
                marks: Vec::new(),
                bands: Vec::new(),
            })
        };
        let iterations = |_: &str, cell: &TimedCell| Some(Estimate::single(self.iterations(cell)?));
        Figure {
            title: "Preconditioners of the pressure solve".to_string(),
            description: "Iterations a step, and time in CG over that of plain CG with values in f64, by preconditioner, \
                          number of particles and precision of the matrix, with 95 % intervals."
                .to_string(),
            panels: vec![
                panel("iterations", "iterations a step", &iterations),
                panel("time", "time over plain CG's", &|group, cell| self.over_plain(group, cell)),
            ],
            note: self.measured.stamp(),
        }
    }

    fn table(&self) -> TableView {
        let mut view = TableView::new(
            "The pressure solve on one thread, set-up included: iterations and milliseconds a step, and the time over that \
             of plain CG with values in f64.",
            &["particles", "preconditioner", "values", "iterations", "CG, ms", "CG / plain CG"],
        );
        for group in self.groups() {
            for (name, values) in Preconditioning::ALL.iter().flat_map(|&name| [(name, "f64"), (name, "f32")])
            {
                let Some(cell) = self.cell(&group, name, values) else { continue };
                view.rows.push(vec![
                    group.clone(),
                    name.to_string(),
                    values.to_string(),
                    self.iterations(cell).map_or("none".to_string(), |mean| format!("{mean:.1}")),
                    show_or_none(times(&self.time(cell)), 2),
                    show_or_none(self.over_plain(&group, cell), 3),
                ]);
            }
        }
        view
    }
}

/// What a panel shows of a group's cell.
type Value<'a> = dyn Fn(&str, &TimedCell) -> Option<Estimate> + 'a;
