//! The twin: list over relocated in C and in Rust, and whether the ratio is the language's or the layout's.

use std::collections::BTreeSet;

use anyhow::Result;

use crate::experiment::record::{Stage, Status};
use crate::experiment::twin::outcome::Language;
use crate::report::chart::{Figure, Line, Mark, MarkAt, Marker, Panel, Scale, Series, XyPanel};
use crate::report::language_or_layout::{Compared, verdict};
use crate::report::measured::{ByRound, Measured, estimate, ratio, times};
use crate::report::section::{Content, automatic, categories, point, side_by_side};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show, show_or_none};
use crate::report::twin::{Part, Program, answers, builds, by_round, name, programs};

const ID: &str = "twin";

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    Ok(content_of(measured, ID))
}

/// The same of any experiment; empty where it has no twin.
pub fn content_of(measured: &Measured, id: &str) -> Content {
    let twins = Twins { measured, id, programs: programs(measured, id) };
    if twins.programs.is_empty() {
        return Content::default();
    }
    let mut findings = vec![twins.how_measured()];
    findings.extend(twins.groups().into_iter().filter_map(|(test, threads)| twins.finding(&test, threads)));
    findings.extend(twins.not_applicable());
    Content {
        findings,
        figures: vec![(ID.to_string(), twins.figure())],
        tables: [twins.times_table(), twins.builds_table()]
            .into_iter()
            .filter(|t| !t.rows.is_empty())
            .collect(),
        ..Content::default()
    }
}

struct Twins<'a> {
    measured: &'a Measured,
    id: &'a str,
    programs: Vec<Program>,
}

impl Twins<'_> {
    fn time(&self, program: &Program, part: Part) -> ByRound {
        by_round(self.measured, self.id, program, part)
    }

    /// List over relocated, by round.
    fn gain(&self, program: &Program) -> ByRound {
        let (list, relocated) = (self.time(program, Part::List), self.time(program, Part::Relocated));
        let both = |(round, list): (usize, f64)| Some((round, list / relocated.get(&round)?));
        list.into_iter().filter_map(both).collect()
    }

    /// Distance tests and thread counts.
    fn groups(&self) -> BTreeSet<(String, usize)> {
        self.programs.iter().map(|program| (program.cell.distance_test.clone(), program.threads)).collect()
    }

    fn of_group(&self, test: &str, threads: usize) -> impl Iterator<Item = &Program> {
        self.programs.iter().filter(move |p| p.cell.distance_test == test && p.threads == threads)
    }

    fn how_measured(&self) -> String {
        let found = || answers(self.measured, self.id);
        let rounds: BTreeSet<usize> = found().map(|(round, ..)| round).collect();
        let passes = found().map(|(_, _, answer)| answer.passes.len()).max().unwrap_or(0);
        let digests: BTreeSet<&str> = found().map(|(_, _, answer)| answer.digest.as_str()).collect();
        format!(
            "A number is the median of {passes} passes over both layouts in random order; {} rounds, whose processes are \
             the samples of every interval. In each round every program gave the sums of the Rust loop, to the last bit, \
             or is a failure; digests of all sums: {}.",
            rounds.len(),
            digests.into_iter().collect::<Vec<_>>().join(", ")
        )
    }

    /// What one distance test on a number of threads says.
    fn finding(&self, test: &str, threads: usize) -> Option<String> {
        let rust = self.of_group(test, threads).find(|p| p.cell.language == Language::Rust)?;
        let in_rust = self.gain(rust);
        let compare = |program: &Program| {
            let gain = self.gain(program);
            let (gain, over_rust) = (estimate(&gain)?, ratio(&gain, &in_rust)?);
            Some(Compared { name: name(&program.cell), gain, over_rust })
        };
        let in_c = self.of_group(test, threads).filter(|p| p.cell.language == Language::C);
        let compared: Vec<Compared> = in_c.filter_map(compare).collect();
        let in_rust = estimate(&in_rust)?;
        let shown = compared.iter().map(|c| format!("{} in {}", show(&c.gain, 3), c.name));
        let shown: Vec<String> =
            std::iter::once(format!("{} in {}", show(&in_rust, 3), name(&rust.cell))).chain(shown).collect();
        let plural = if threads == 1 { "" } else { "s" };
        Some(format!(
            "{test}, {threads} thread{plural}: list over relocated is {}. {}",
            shown.join("; "),
            verdict(&in_rust, &compared)
        ))
    }

    /// What could not run here, and why: a sentence a reason.
    fn not_applicable(&self) -> Vec<String> {
        let trials = self.measured.trials(self.id, Stage::Twin).map(|(_, trial)| trial);
        let reasons: BTreeSet<&str> = trials
            .filter(|trial| trial.status == Status::NotApplicable)
            .map(|trial| trial.reason.as_str())
            .collect();
        reasons.into_iter().map(|reason| format!("Not applicable here: {reason}.")).collect()
    }

    fn figure(&self) -> Figure {
        let tests: BTreeSet<&str> = self.programs.iter().map(|p| p.cell.distance_test.as_str()).collect();
        Figure {
            title: "The same loop in C and in Rust".to_string(),
            description: "The time of the paper's Figure 3 loop along the linked list over that along the relocated rows, \
                          for each language, compiler and target, by distance test and threads; 95 % intervals. The dotted \
                          line is no gain."
                .to_string(),
            panels: tests.into_iter().map(|test| Panel::Xy(self.panel(test))).collect(),
            note: self.measured.stamp(),
        }
    }

    fn panel(&self, test: &str) -> XyPanel {
        let threads: BTreeSet<usize> = self.programs.iter().map(|program| program.threads).collect();
        let threads: Vec<usize> = threads.into_iter().collect();
        let mut series: Vec<Series> = Vec::new();
        for program in self.programs.iter().filter(|program| program.cell.distance_test == test) {
            let place = threads.iter().position(|&count| count == program.threads);
            let Some((place, gain)) = place.zip(estimate(&self.gain(program))) else {
                continue;
            };
            let point = point(place as f64, gain);
            let label = name(&program.cell);
            match series.iter_mut().find(|series| series.label == label) {
                Some(series) => series.points.push(point),
                None => series.push(Series { points: vec![point], ..empty_series(label, series.len()) }),
            }
        }
        let names: Vec<String> = threads.iter().map(|count| count.to_string()).collect();
        XyPanel {
            title: format!("distance test: {test}"),
            x: categories("threads", &names),
            y: automatic("list / relocated", Scale::Linear),
            series: side_by_side(series),
            marks: vec![Mark { label: String::new(), at: MarkAt::Y(1.0), color: 0 }],
            bands: Vec::new(),
        }
    }

    fn times_table(&self) -> TableView {
        let mut view = TableView::new(
            "Milliseconds of one loop over all particles and of the copy before it (smallest to largest round); ratios [95 % interval].",
            &[
                "distance test",
                "threads",
                "program",
                "linked list",
                "relocated",
                "with the copy",
                "list / relocated",
                "list / with the copy",
            ],
        );
        for program in &self.programs {
            let [list, relocated, copied] =
                [Part::List, Part::Relocated, Part::RelocatedWithCopy].map(|part| self.time(program, part));
            if list.is_empty() {
                continue;
            }
            let milliseconds = [&list, &relocated, &copied].map(|time| times(time).map(|e| e.scaled(1e3)));
            let ratios = [ratio(&list, &relocated), ratio(&list, &copied)];
            let (test, threads) = (program.cell.distance_test.clone(), program.threads.to_string());
            let names = [test, threads, name(&program.cell)].into_iter();
            let shown = milliseconds.into_iter().chain(ratios).map(|cell| show_or_none(cell, 3));
            view.rows.push(names.chain(shown).collect());
        }
        view
    }

    fn builds_table(&self) -> TableView {
        let mut view = TableView::new(
            "How the programs in C were compiled; the Rust loop's compiler and flags stand among the facts of the machine.",
            &["compiler", "target", "version", "command"],
        );
        for ((compiler, target), build) in builds(self.measured, self.id) {
            let cells = [compiler, target, &build.version, &build.command];
            view.rows.push(cells.map(String::from).to_vec());
        }
        view
    }
}

/// A series without points; its place decides how it looks.
fn empty_series(label: String, place: usize) -> Series {
    const LOOKS: [(usize, Marker); 7] = [
        (0, Marker::Diamond),
        (3, Marker::Circle),
        (3, Marker::OpenCircle),
        (1, Marker::Square),
        (1, Marker::OpenSquare),
        (7, Marker::Triangle),
        (7, Marker::OpenTriangle),
    ];
    let (color, marker) = LOOKS[place % LOOKS.len()];
    Series { label, color, line: Line::None, marker, points: Vec::new() }
}
