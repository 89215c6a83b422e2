//! Layouts: all neighbour searches beside the linked list, in time and in memory.

use anyhow::Result;

use crate::base::statistics::Estimate;
use crate::engine::preset::Preset;
use crate::experiment::record::Stage;
use crate::report::chart::{Bar, BarGroup, BarPanel, Figure, Panel};
use crate::report::measured::{ByRound, Measured, Quantity, TimedCell, ratio, times};
use crate::report::section::{Content, how_measured};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show};

const ID: &str = "layouts";

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    let settings = settings(measured);
    let mut findings = vec![how_measured(measured, ID)];
    findings.extend(settings.iter().filter_map(Setting::finding));
    Ok(Content {
        findings,
        figures: vec![("layouts".to_string(), figure(measured, &settings))],
        tables: vec![table(&settings)],
        ..Content::default()
    })
}

/// One number of threads and one state.
struct Setting {
    threads: usize,
    start_step: usize,
    searches: Vec<Search>,
}

/// What a search took there, milliseconds a step.
struct Search {
    name: String,
    total: Estimate,
    cg: Estimate,
    non_cg: Estimate,
    /// Part of `non_cg`: buckets, copies and lists.
    build: Estimate,
    /// Linked list over this one, outside CG and in all.
    gain: Estimate,
    gain_in_all: Estimate,
    bytes_per_particle: Option<f64>,
}

fn settings(measured: &Measured) -> Vec<Setting> {
    let cells = measured.cells(ID);
    let first = cells.first().map(|cell| measured.windows(ID, Stage::Paired, cell)).unwrap_or_default();
    let windows = first.values().next().copied().unwrap_or_default();
    let mut settings = Vec::new();
    for threads in measured.threads(ID) {
        for (state, window) in windows.iter().enumerate() {
            let of_threads = || cells.iter().filter(|cell| cell.threads == threads);
            let searches = of_threads().filter_map(|cell| search(measured, cell, state)).collect();
            settings.push(Setting { threads, start_step: window.window.start_step, searches });
        }
    }
    settings
}

fn search(measured: &Measured, cell: &TimedCell, state: usize) -> Option<Search> {
    let time = |cell: &TimedCell, quantity| -> ByRound {
        let seconds = measured.per_step_in(ID, Stage::Paired, cell, quantity, |k| k == state);
        seconds.into_iter().map(|(round, s)| (round, 1e3 * s)).collect()
    };
    let list = cell.beside_list();
    let of = |quantity| times(&time(cell, quantity));
    let gain = |quantity| ratio(&time(&list, quantity), &time(cell, quantity));
    Some(Search {
        name: in_words(&cell.variant.preset),
        total: of(Quantity::Total)?,
        cg: of(Quantity::Cg)?,
        non_cg: of(Quantity::NonCg)?,
        build: of(Quantity::Build)?,
        gain: gain(Quantity::NonCg)?,
        gain_in_all: gain(Quantity::Total)?,
        bytes_per_particle: bytes_per_particle(measured, cell),
    })
}

/// Bytes of all columns of the cell's simulation, as its last trial ended.
fn bytes_per_particle(measured: &Measured, cell: &TimedCell) -> Option<f64> {
    let trials = measured.trials(ID, Stage::Paired).map(|(_, trial)| trial);
    let of_cell =
        trials.filter(|t| t.subject == cell.subject && t.threads == cell.threads).filter_map(|trial| {
            let variant = trial.variants.iter().position(|variant| *variant == cell.variant)?;
            let outcome = trial.outcome.as_ref()?;
            Some(*outcome.bytes.get(variant)? as f64 / outcome.particles as f64)
        });
    of_cell.last()
}

/// A preset's name without the paper's mark, and as prose spells it.
fn in_words(preset: &str) -> String {
    let word = |word| match word {
        "aos" => "AoS",
        "soa" => "SoA",
        "aosoa" => "AoSoA",
        "neighbor" => "neighbour",
        other => other,
    };
    preset.trim_start_matches("paper-").split('-').map(word).collect::<Vec<_>>().join(" ")
}

impl Setting {
    fn in_words(&self) -> String {
        format!("{}, after step {}", in_threads(self.threads), self.start_step)
    }

    /// The fastest search, and which are slower than the list.
    fn finding(&self) -> Option<String> {
        let list = in_words(Preset::PAPER_LINKED_LIST.name());
        let others = || self.searches.iter().filter(|search| search.name != list);
        let fastest = others().max_by(|a, b| a.gain.median.total_cmp(&b.gain.median))?;
        let slower: Vec<String> = others()
            .filter(|s| s.gain.interval.map_or(s.gain.median, |i| i.high) < 1.0)
            .map(|s| format!("{} ({})", s.name, show(&s.gain, 3)))
            .collect();
        let slower = match slower.as_slice() {
            [] => "none is slower than the list".to_string(),
            some => format!("slower than the list: {}", some.join(", ")),
        };
        Some(format!(
            "{}: the fastest outside CG is {}, list over it {} outside CG and {} in all; {slower}.",
            super::capital(&self.in_words()),
            fastest.name,
            show(&fastest.gain, 3),
            show(&fastest.gain_in_all, 3)
        ))
    }

    /// A bar a search: CG, what is built, and all else.
    fn panel(&self) -> BarPanel {
        let bar = |search: &Search| Bar {
            label: search.name.clone(),
            // The top of the bar is the median of the total, as in the table, not the sum of medians.
            values: vec![
                search.cg.median,
                search.build.median,
                search.total.median - search.cg.median - search.build.median,
            ],
            interval: search.total.bounds().map(|i| (i.low, i.high)),
            published: false,
        };
        BarPanel {
            title: self.in_words(),
            y_label: "ms a step".to_string(),
            segments: ["CG", "buckets, copies, lists", "all else"].map(String::from).into(),
            groups: vec![BarGroup { label: String::new(), bars: self.searches.iter().map(bar).collect() }],
        }
    }
}

fn in_threads(threads: usize) -> String {
    format!("{threads} thread{}", if threads == 1 { "" } else { "s" })
}

fn figure(measured: &Measured, settings: &[Setting]) -> Figure {
    Figure {
        title: "Neighbour searches: the same steps, another layout".to_string(),
        description: "Stacked bars of the milliseconds a step in CG, for buckets with what is made of them, and for all \
                      else, a bar a search; on one thread and on all, from a state in the lattice's order and from one \
                      in which particles have mixed. Bars span all rounds of the total; `fast` has a preconditioner as well."
            .to_string(),
        panels: settings.iter().map(|setting| Panel::Bars(setting.panel())).collect(),
        note: measured.stamp(),
    }
}

fn table(settings: &[Setting]) -> TableView {
    let mut view = TableView::new(
        "Milliseconds a step, and how often the search's time goes into the linked list's: times with (smallest to largest round), ratios with [95 % interval].",
        &[
            "threads",
            "state after step",
            "search",
            "outside CG",
            "of it build",
            "in all",
            "list / search outside CG",
            "list / search in all",
            "B a particle",
        ],
    );
    for setting in settings {
        for search in &setting.searches {
            view.rows.push(vec![
                setting.threads.to_string(),
                setting.start_step.to_string(),
                search.name.clone(),
                show(&search.non_cg, 2),
                show(&search.build, 2),
                show(&search.total, 2),
                show(&search.gain, 3),
                show(&search.gain_in_all, 3),
                search.bytes_per_particle.map_or("unknown".to_string(), |bytes| format!("{bytes:.0}")),
            ]);
        }
    }
    view
}
