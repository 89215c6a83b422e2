//! What a report says about each experiment: sentences with computed numbers, figures and tables.
//!
//! A new experiment that wants more than the table of its phases is one new file here and one line in [`SECTIONS`].

mod ablation;
mod accuracy_cost;
mod bucket_side;
mod cg;
mod chunks;
mod effects_cost;
mod figure4;
mod hard_cases;
mod layouts;
mod memory_order;
mod peaks;
mod preconditioners;
mod roofline;
mod scaling;
mod scaling_figure;
mod table2;
mod twin;
mod unnamed;
mod validation;

use anyhow::Result;

use crate::base::statistics::Estimate;
use crate::experiment::ablation::is_ablation;
use crate::experiment::record::Stage;
use crate::experiment::spec::{Mode, Paired};
use crate::report::chart::{Axis, Figure, Point, Scale, Series};
use crate::report::measured::Measured;
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, phases_view};

/// What there is to say about one experiment.
#[derive(Debug, Default)]
pub struct Content {
    /// What came out, in sentences.
    pub findings: Vec<String>,
    /// Figures with the name of their file.
    pub figures: Vec<(String, Figure)>,
    pub tables: Vec<TableView>,
    /// Further files with their path below the run folder.
    pub files: Vec<(String, Vec<u8>)>,
}

impl Content {
    /// Adds what else there is to say.
    fn append(&mut self, mut more: Content) {
        self.findings.append(&mut more.findings);
        self.figures.append(&mut more.figures);
        self.tables.append(&mut more.tables);
        self.files.append(&mut more.files);
    }
}

type Section = fn(&Measured, &[CellPhase]) -> Result<Content>;

const SECTIONS: [(&str, Section); 16] = [
    ("table2", table2::content),
    ("figure4", figure4::content),
    ("chunks", chunks::content),
    ("memory-order", memory_order::content),
    ("scaling-n", scaling::content),
    ("particle-count", scaling::content_of_older),
    ("cg", cg::content),
    ("preconditioners", preconditioners::content),
    ("bucket-side", bucket_side::content),
    ("layouts", layouts::content),
    ("twin", twin::content),
    ("effects-cost", effects_cost::content),
    ("unnamed-effects", unnamed::content),
    ("accuracy-cost", accuracy_cost::content),
    ("hard-cases", hard_cases::content),
    ("validation", validation::content),
];

/// The section of an experiment; that of one without a file of its own shows the times of its phases.
pub fn content(measured: &Measured, phases: &[CellPhase], id: &str) -> Result<Content> {
    match SECTIONS.iter().find(|(name, _)| *name == id) {
        Some((_, section)) => section(measured, phases),
        None if is_ablation(id) => Ok(ablation::content_of(measured, id)),
        None => Ok(plain(measured, phases, id)),
    }
}

/// The section of an experiment without a file here: the phases of its cells and the verdicts on its cases.
fn plain(measured: &Measured, phases: &[CellPhase], id: &str) -> Content {
    let mut content = Content::default();
    if !measured.cells(id).is_empty() {
        content.findings.push(how_measured(measured, id));
        content.tables.push(phases_view(phases, id));
    }
    if let Some(experiment) = measured.experiment(id) {
        let (findings, tables) = hard_cases::verdicts(measured, experiment);
        content.findings.extend(findings);
        content.tables.extend(tables);
        content.append(twin::content_of(measured, id));
        content.append(validation::content_of(measured, id));
        content.append(peaks::content_of(measured, id));
    }
    content
}

/// The colour of each search in all figures, by its place in the palette.
const LINKED_LIST: usize = 5;
const RELOCATED: usize = 6;
/// That of the preset that goes beyond the paper.
const FAST: usize = 3;

/// An axis whose range and ticks follow from the data.
pub fn automatic(label: &str, scale: Scale) -> Axis {
    Axis { label: label.to_string(), scale, range: None, ticks: None }
}

/// An axis whose places 0, 1, 2 ... have names.
pub fn categories(label: &str, names: &[String]) -> Axis {
    Axis {
        label: label.to_string(),
        scale: Scale::Linear,
        range: (!names.is_empty()).then(|| (-0.5, names.len() as f64 - 0.5)),
        ticks: Some(names.iter().enumerate().map(|(k, name)| (k as f64, name.clone())).collect()),
    }
}

/// Series over categories, moved sideways a little so that their intervals stand side by side.
pub fn side_by_side(mut series: Vec<Series>) -> Vec<Series> {
    let middle = 0.5 * (series.len() as f64 - 1.0);
    for (k, series) in series.iter_mut().enumerate() {
        for point in &mut series.points {
            point.x += 0.1 * (k as f64 - middle);
        }
    }
    series
}

/// An estimate as a point of a series.
pub fn point(x: f64, estimate: Estimate) -> Point {
    Point {
        x,
        y: estimate.median,
        low: estimate.bounds().map(|i| i.low),
        high: estimate.bounds().map(|i| i.high),
        label: None,
    }
}

/// The text with its first letter as a capital.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Which trials the numbers of an experiment are from, and what was left to the full mode.
fn how_measured(measured: &Measured, id: &str) -> String {
    let stage = measured.stage_for_tables(id);
    if stage == Stage::Whole {
        return "Numbers are from whole runs, a process each.".to_string();
    }
    let paired = |mode| measured.experiment(id).and_then(|e| e.measurement(mode).paired.as_ref());
    let counted = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    let extent = |p: &Paired| {
        format!("{} from each of {}", counted(p.steps, "step"), counted(p.windows.count(), "state"))
    };
    let here = paired(measured.info.mode).map_or(String::new(), |p| format!(", {}", extent(p)));
    let full = paired(Mode::Full).filter(|_| measured.info.mode != Mode::Full);
    let left = full.map_or(String::new(), |p| {
        format!(" Left to the full mode: {}, {}.", p.rounds.in_words(), extent(p))
    });
    format!(
        "Numbers are from paired trials: each process computes the same steps with all variants in turn{here}; {} rounds, \
         whose processes are the samples.{left}",
        measured.succeeded(id, stage)
    )
}
