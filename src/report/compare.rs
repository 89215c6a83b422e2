//! Several runs side by side, from any machines: ratios within each, absolute times beside them, and what differs.
//!
//! Only equal work is compared: the same steps of the same number of particles that end in the same states. Digests do not
//! depend on the machine, so two runs whose states differ have not both computed what they should.

use std::collections::BTreeSet;

use serde::Serialize;

use crate::base::statistics::Estimate;
use crate::engine::preset::Preset;
use crate::experiment::record::{Stage, Window};
use crate::report::chart::{Figure, Line, Mark, MarkAt, Marker, Panel, Scale, Series, XyPanel};
use crate::report::measured::{Measured, Quantity, TimedCell, ratio, times};
use crate::report::samples::cell_id;
use crate::report::section::{automatic, categories, point, side_by_side};
use crate::report::table::{TableView, show};

/// Runs with the names they have in tables.
#[derive(Debug)]
pub struct Comparison<'a> {
    runs: &'a [(String, Measured)],
    cells: Vec<ComparedCell>,
}

/// One timed cell in every run.
#[derive(Debug)]
struct ComparedCell {
    id: String,
    found: Vec<Option<Found>>,
}

/// One cell of one run.
#[derive(Debug)]
struct Found {
    work: Work,
    /// Milliseconds a step.
    total_ms: Option<Estimate>,
    non_cg_ms: Option<Estimate>,
    /// Time outside CG of this list over that of relocation, all else equal.
    gain: Option<Estimate>,
}

/// What was computed.
#[derive(Debug, Clone, PartialEq)]
struct Work {
    particles: usize,
    windows: Vec<Window>,
    digests: Vec<String>,
}

/// A row of the comparison's CSV: one cell of one run.
#[derive(Debug, Serialize)]
pub struct CompareRow<'a> {
    run: &'a str,
    machine_id: &'a str,
    mode: &'static str,
    cell_id: &'a str,
    comparable: &'static str,
    reason: String,
    particles: Option<usize>,
    total_ms_per_step: Option<f64>,
    total_low: Option<f64>,
    total_high: Option<f64>,
    non_cg_ms_per_step: Option<f64>,
    non_cg_low: Option<f64>,
    non_cg_high: Option<f64>,
    list_over_relocated: Option<f64>,
    list_over_relocated_low: Option<f64>,
    list_over_relocated_high: Option<f64>,
}

/// Why a cell's numbers of several runs must not stand beside each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Hindrance {
    OneRunOnly,
    OtherParticles,
    OtherSteps,
    OtherStates,
}

impl Hindrance {
    fn in_words(self) -> &'static str {
        match self {
            Hindrance::OneRunOnly => "in one run only",
            Hindrance::OtherParticles => "another number of particles",
            Hindrance::OtherSteps => "other steps",
            Hindrance::OtherStates => {
                "the same steps end in other states: not all of these runs computed the same"
            }
        }
    }
}

impl<'a> Comparison<'a> {
    pub fn new(runs: &'a [(String, Measured)]) -> Self {
        let mut ids: Vec<(String, String, TimedCell)> = Vec::new();
        for (_, measured) in runs {
            for experiment in &measured.info.experiments {
                for cell in measured.cells(&experiment.id) {
                    let id = cell_id(&experiment.id, Stage::Paired, &cell);
                    if ids.iter().all(|(known, ..)| *known != id) {
                        ids.push((id, experiment.id.clone(), cell));
                    }
                }
            }
        }
        let compared = |(id, experiment, cell): (String, String, TimedCell)| ComparedCell {
            found: runs.iter().map(|(_, measured)| find(measured, &experiment, &cell)).collect(),
            id,
        };
        Comparison { runs, cells: ids.into_iter().map(compared).collect() }
    }

    /// The number of cells that can be compared.
    pub fn comparable(&self) -> usize {
        self.cells.iter().filter(|cell| cell.hindrance().is_none()).count()
    }

    /// Runs that end in other states than the others after the same steps.
    pub fn odd_states(&self) -> Vec<String> {
        let odd = |cell: &&ComparedCell| cell.hindrance() == Some(Hindrance::OtherStates);
        self.cells.iter().filter(odd).map(|cell| format!("{}: {}", cell.id, self.states(cell))).collect()
    }

    /// Cells that a later run computes more slowly than the first one on the same machine, beyond doubt: its fastest
    /// round is slower than the other's slowest, and the medians by more than [`REGRESSION`].
    pub fn regressions(&self) -> Vec<String> {
        let Some((first, of_first)) = self.runs.first() else {
            return Vec::new();
        };
        let mut regressions = Vec::new();
        for cell in self.cells.iter().filter(|cell| cell.hindrance().is_none()) {
            let Some(before) = cell.found[0].as_ref().and_then(|found| found.total_ms) else {
                continue;
            };
            for ((name, measured), found) in self.runs.iter().zip(&cell.found).skip(1) {
                let same = measured.info.machine_id == of_first.info.machine_id;
                let after = found.as_ref().and_then(|found| found.total_ms).filter(|_| same);
                if let Some(after) = after.filter(|after| is_slower(after, &before)) {
                    regressions.push(format!(
                        "{}: {} ms a step in {name}, {} in {first}",
                        cell.id,
                        show(&after, 2),
                        show(&before, 2)
                    ));
                }
            }
        }
        regressions
    }

    /// Which run is in which state at the end of the first window in which they differ.
    fn states(&self, cell: &ComparedCell) -> String {
        let works: Vec<&Work> = cell.found.iter().flatten().map(|found| &found.work).collect();
        let differ =
            |k: &usize| works.windows(2).any(|pair| pair[0].digests.get(*k) != pair[1].digests.get(*k));
        let place = (0..works.first().map_or(0, |work| work.windows.len())).find(differ).unwrap_or(0);
        let states = self.runs.iter().zip(&cell.found).filter_map(|((name, _), found)| {
            Some(format!("{name} ends in {}", found.as_ref()?.work.digests.get(place)?))
        });
        states.collect::<Vec<_>>().join(", ")
    }

    pub fn rows(&self) -> Vec<CompareRow<'_>> {
        let mut rows = Vec::new();
        for cell in &self.cells {
            let hindrance = cell.hindrance();
            for ((name, measured), found) in self.runs.iter().zip(&cell.found) {
                let Some(found) = found else {
                    continue;
                };
                let low = |e: Option<Estimate>| e?.bounds().map(|i| i.low);
                let high = |e: Option<Estimate>| e?.bounds().map(|i| i.high);
                rows.push(CompareRow {
                    run: name,
                    machine_id: &measured.info.machine_id,
                    mode: measured.info.mode.name(),
                    cell_id: &cell.id,
                    comparable: if hindrance.is_none() { "yes" } else { "no" },
                    reason: hindrance.map_or(String::new(), |h| h.in_words().to_string()),
                    particles: Some(found.work.particles),
                    total_ms_per_step: found.total_ms.map(|e| e.median),
                    total_low: low(found.total_ms),
                    total_high: high(found.total_ms),
                    non_cg_ms_per_step: found.non_cg_ms.map(|e| e.median),
                    non_cg_low: low(found.non_cg_ms),
                    non_cg_high: high(found.non_cg_ms),
                    list_over_relocated: found.gain.map(|e| e.median),
                    list_over_relocated_low: low(found.gain),
                    list_over_relocated_high: high(found.gain),
                });
            }
        }
        rows
    }

    /// A row a comparable cell, the runs side by side; cells that cannot be compared, with the reason.
    pub fn tables(&self) -> Vec<TableView> {
        let mut times =
            TableView::new("Milliseconds a step, median (smallest to largest round).", &["cell", "part"]);
        let mut gains = TableView::new(
            "List over relocation outside CG, within each machine, median [95 % interval].",
            &["cell"],
        );
        let mut refused = TableView::new("Not comparable.", &["cell", "why"]);
        let names = || self.runs.iter().map(|(name, _)| name.clone());
        times.header.extend(names());
        gains.header.extend(names());
        for cell in &self.cells {
            if let Some(hindrance) = cell.hindrance() {
                refused.rows.push(vec![cell.id.clone(), hindrance.in_words().to_string()]);
                continue;
            }
            let row = |part: Option<&str>, value: &dyn Fn(&Found) -> Option<Estimate>, digits: usize| {
                let shown = cell.found.iter().map(|found| {
                    let estimate = found.as_ref().and_then(value);
                    estimate.map_or(String::new(), |e| show(&e, digits))
                });
                let names = std::iter::once(cell.id.clone()).chain(part.map(String::from));
                names.chain(shown).collect::<Vec<String>>()
            };
            times.rows.push(row(Some("total"), &|found| found.total_ms, 2));
            times.rows.push(row(Some("outside CG"), &|found| found.non_cg_ms, 2));
            if cell.found.iter().flatten().any(|found| found.gain.is_some()) {
                gains.rows.push(row(None, &|found| found.gain, 3));
            }
        }
        let tables = [gains, times, self.differences(), refused];
        tables.into_iter().filter(|table| !table.rows.is_empty()).collect()
    }

    /// Facts about machines and builds that are not the same everywhere.
    fn differences(&self) -> TableView {
        let mut view = TableView::new("What differs between the machines and builds.", &["fact", "unit"]);
        view.header.extend(self.runs.iter().map(|(name, _)| name.clone()));
        let mut seen: BTreeSet<(&str, &str)> = BTreeSet::new();
        for fact in self.runs.iter().flat_map(|(_, measured)| &measured.machine.facts) {
            if !seen.insert((&fact.group, &fact.key)) || fact.key.starts_with("load_") {
                continue;
            }
            let value = |measured: &Measured| {
                let same = measured.machine.facts.iter().find(|f| f.group == fact.group && f.key == fact.key);
                same.map_or("unknown".to_string(), |fact| fact.value.to_string())
            };
            let values: Vec<String> = self.runs.iter().map(|(_, measured)| value(measured)).collect();
            if values.windows(2).any(|pair| pair[0] != pair[1]) {
                let names = [format!("{} {}", fact.group, fact.key), fact.unit.clone()];
                view.rows.push(names.into_iter().chain(values).collect());
            }
        }
        view
    }

    /// The gain of relocation in every comparable cell, the runs side by side; `None` where there is none.
    pub fn figure(&self) -> Option<Figure> {
        let shown: Vec<&ComparedCell> = self
            .cells
            .iter()
            .filter(|cell| cell.hindrance().is_none())
            .filter(|cell| cell.found.iter().flatten().any(|found| found.gain.is_some()))
            .collect();
        if shown.is_empty() {
            return None;
        }
        let names: Vec<String> = shown.iter().map(|cell| short(&cell.id)).collect();
        let markers = [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond, Marker::Cross];
        let colors = [5, 6, 3, 7, 1, 2];
        let series = self.runs.iter().enumerate().map(|(run, (name, _))| Series {
            label: name.clone(),
            color: colors[run % colors.len()],
            line: Line::None,
            marker: markers[run % markers.len()],
            points: shown
                .iter()
                .enumerate()
                .filter_map(|(place, cell)| Some(point(place as f64, cell.found[run].as_ref()?.gain?)))
                .collect(),
        });
        Some(Figure {
            title: "The gain of relocation on several machines".to_string(),
            description:
                "Time outside CG with the linked list over that with relocation, in each cell that the runs \
                          have in common, with 95 % intervals."
                    .to_string(),
            panels: vec![Panel::Xy(XyPanel {
                title: String::new(),
                x: categories("", &names),
                y: automatic("list / relocated", Scale::Linear),
                series: side_by_side(series.collect()),
                marks: vec![Mark { label: String::new(), at: MarkAt::Y(1.0), color: 0 }],
                bands: Vec::new(),
            })],
            note: None,
        })
    }
}

/// How much slower a cell must be for a regression: less changes with the day on a shared machine.
const REGRESSION: f64 = 1.05;

/// Where only one round was measured nothing is beyond doubt.
fn is_slower(after: &Estimate, before: &Estimate) -> bool {
    let apart = after.bounds().zip(before.bounds()).is_some_and(|(after, before)| after.low > before.high);
    apart && after.median > REGRESSION * before.median
}

/// A cell's name without what all cells with a gain have in common.
fn short(id: &str) -> String {
    id.replace("/paired/", " ")
        .replace(Preset::PAPER_LINKED_LIST.name(), "")
        .replace("//", " ")
        .replace('/', " ")
}

impl ComparedCell {
    fn hindrance(&self) -> Option<Hindrance> {
        let works: Vec<&Work> = self.found.iter().flatten().map(|found| &found.work).collect();
        let differ = |same: fn(&Work, &Work) -> bool| works.windows(2).any(|pair| !same(pair[0], pair[1]));
        if works.len() < 2 {
            Some(Hindrance::OneRunOnly)
        } else if differ(|a, b| a.particles == b.particles) {
            Some(Hindrance::OtherParticles)
        } else if differ(|a, b| a.windows == b.windows) {
            Some(Hindrance::OtherSteps)
        } else if differ(|a, b| a.digests == b.digests) {
            Some(Hindrance::OtherStates)
        } else {
            None
        }
    }
}

fn find(measured: &Measured, experiment: &str, cell: &TimedCell) -> Option<Found> {
    let windows = measured.windows(experiment, Stage::Paired, cell);
    let first = windows.values().next()?;
    let per_step = |cell: &TimedCell, quantity| measured.per_step(experiment, Stage::Paired, cell, quantity);
    let ms = |quantity| times(&per_step(cell, quantity)).map(|e| e.scaled(1e3));
    let list = cell.variant.preset == Preset::PAPER_LINKED_LIST.name();
    let relocated = || per_step(&cell.with_preset(Preset::PAPER_AOS_RELOCATION), Quantity::NonCg);
    Some(Found {
        work: Work {
            particles: measured.outcomes(experiment, cell).first()?.particles,
            windows: first.iter().map(|w| w.window).collect(),
            digests: first.iter().map(|w| w.digest.clone()).collect(),
        },
        total_ms: ms(Quantity::Total),
        non_cg_ms: ms(Quantity::NonCg),
        gain: list.then(|| ratio(&per_step(cell, Quantity::NonCg), &relocated())).flatten(),
    })
}
