//! Table 2: the paper's bars and ours, the whole runs step by step, and whether all ways of measuring agree.

use anyhow::Result;

use crate::base::statistics::{Estimate, median};
use crate::engine::preset::Preset;
use crate::experiment::record::{Stage, Status, StepSample};
use crate::report::chart::{
    Axis, Bar, BarGroup, BarPanel, Figure, Line, Marker, Panel, Point, Scale, Series, XyPanel,
};
use crate::report::measured::{Cell, Measured, Quantity, ratio, times};
use crate::report::published::{Published, Seconds};
use crate::report::samples::csv_bytes;
use crate::report::section::{Content, LINKED_LIST, RELOCATED, automatic, how_measured};
use crate::report::summary::CellPhase;
use crate::report::table::{distance_tests, fast_cell, phases_view, show, table2_rows, table2_view};

/// The section.
pub fn content(measured: &Measured, phases: &[CellPhase]) -> Result<Content> {
    let view = table2_view(measured);
    let text = format!("{}\n\n{}", view.caption, view.to_markdown());
    let mut content = Content {
        files: vec![
            ("tables/table2.csv".to_string(), csv_bytes(&table2_rows(measured))?),
            ("tables/table2.md".to_string(), text.into_bytes()),
        ],
        figures: vec![("table2".to_string(), bars(measured))],
        tables: vec![view, phases_view(phases, "table2")],
        findings: vec![how_measured(measured, "table2")],
    };
    content.figures.extend(steps(measured).map(|figure| ("steps".to_string(), figure)));
    content.findings.extend(agreement(measured));
    content.findings.extend(representativeness(measured));
    content.findings.extend(flow(measured));
    Ok(content)
}

/// Table 2 as stacked bars: the paper's and ours.
fn bars(measured: &Measured) -> Figure {
    let published = Published::load();
    let paper_bar = |label: &str, s: Seconds| Bar {
        label: label.to_string(),
        values: vec![s.cg_s, s.non_cg_s],
        interval: None,
        published: true,
    };
    let mut groups = vec![BarGroup {
        label: "paper (Xeon 8358)".to_string(),
        bars: vec![
            paper_bar("list", published.table2.linked_list),
            paper_bar("relocated", published.table2.aos_relocation),
        ],
    }];
    for test in distance_tests(measured) {
        let bar = |label: &str, preset: Preset| bar(measured, label, &Cell::new(preset.name(), &test, 1));
        let bars = [bar("list", Preset::PAPER_LINKED_LIST), bar("relocated", Preset::PAPER_AOS_RELOCATION)];
        groups.push(BarGroup {
            label: match measured.particles("table2").filter(|&count| count != published.particles) {
                Some(count) => format!("here, {test}, {count} particles"),
                None => format!("here, {test}"),
            },
            bars: bars.into_iter().flatten().collect(),
        });
    }
    groups.extend(fast_bar(measured));
    Figure {
        title: "Table 2: one thread, linked list against relocation".to_string(),
        description:
            "Stacked bars of the seconds inside and outside CG for the whole run on one thread: the \
                      paper's two bars, ours for each distance test, and what goes beyond the paper, with the smallest and largest \
                      round on the total."
                .to_string(),
        panels: vec![Panel::Bars(BarPanel {
            title: format!("{} steps", published.steps),
            y_label: "time of the run (s)".to_string(),
            segments: vec!["CG".to_string(), "outside CG".to_string()],
            groups,
        })],
        note: measured.stamp(),
    }
}

/// The seconds of one cell, stacked.
fn bar(measured: &Measured, label: &str, cell: &Cell) -> Option<Bar> {
    let (stage, steps) = (measured.stage_for_tables("table2"), Published::load().steps as f64);
    let of = |q: Quantity| times(&measured.per_step("table2", stage, cell, q)).map(|e| e.scaled(steps));
    Some(Bar {
        label: label.to_string(),
        // The top of the bar is the median of the total, as in the table, not the sum of two medians.
        values: vec![of(Quantity::Cg)?.median, of(Quantity::Total)?.median - of(Quantity::Cg)?.median],
        interval: of(Quantity::Total)?.bounds().map(|i| (i.low, i.high)),
        published: false,
    })
}

/// The preset that goes beyond the paper.
fn fast_bar(measured: &Measured) -> Option<BarGroup> {
    let bar = bar(measured, "fast", &fast_cell())?;
    Some(BarGroup { label: "beyond the paper".to_string(), bars: vec![bar] })
}

/// Time of each step of the whole runs: how the parts change as particles mix.
fn steps(measured: &Measured) -> Option<Figure> {
    let mut series = Vec::new();
    for (preset, name, color) in [
        (Preset::PAPER_LINKED_LIST, "linked list", LINKED_LIST),
        (Preset::PAPER_AOS_RELOCATION, "relocated", RELOCATED),
    ] {
        let windows = measured.windows("table2", Stage::Whole, &Cell::new(preset.name(), "sqrt", 1));
        let (_, windows) = windows.into_iter().next()?;
        let steps: Vec<_> = windows.iter().flat_map(|w| &w.steps).collect();
        let points = |value: fn(&StepSample) -> f64| -> Vec<Point> {
            steps.chunks(STEPS_PER_POINT).map(|chunk| middle_of(chunk, value)).collect()
        };
        series.push(Series {
            label: format!("outside CG, {name}"),
            color,
            line: Line::Solid,
            marker: Marker::None,
            points: points(|s| 1e3 * (s.total_s - s.cg_s)),
        });
        series.push(Series {
            label: format!("CG, {name}"),
            color,
            line: Line::Dashed,
            marker: Marker::None,
            points: points(|s| 1e3 * s.cg_s),
        });
    }
    Some(Figure {
        title: "The whole runs, step by step".to_string(),
        description:
            "Milliseconds a step inside and outside CG over the whole run on one thread, for both searches; \
                      medians of short runs of steps."
                .to_string(),
        panels: vec![Panel::Xy(XyPanel {
            title: format!("medians of {STEPS_PER_POINT} steps"),
            x: automatic("step", Scale::Linear),
            y: Axis { range: None, ..automatic("ms a step", Scale::Linear) },
            series,
            marks: Vec::new(),
            bands: Vec::new(),
        })],
        note: measured.stamp(),
    })
}

const STEPS_PER_POINT: usize = 23;

fn middle_of(steps: &[&StepSample], value: fn(&StepSample) -> f64) -> Point {
    let values: Vec<f64> = steps.iter().map(|step| value(step)).collect();
    let x = steps.iter().map(|step| step.step as f64).sum::<f64>() / steps.len() as f64;
    let y = median(&values).unwrap_or(f64::NAN);
    Point { x, y, low: None, high: None, label: None }
}

/// How far apart ways of measuring the same ratio may lie and still count as agreeing.
const AGREEMENT: f64 = 0.05;

/// Whether whole runs, trials of all variants and trials of two variants tell the same ratio.
fn agreement(measured: &Measured) -> Option<String> {
    let (list, relocated) =
        (Cell::new("paper-linked-list", "sqrt", 1), Cell::new("paper-aos-relocation", "sqrt", 1));
    let ways = [
        ("whole runs", "table2", Stage::Whole),
        ("paired trials of all variants", "table2", Stage::Paired),
        ("paired trials of these two alone", "figure4", Stage::Paired),
    ];
    let eight = measured.cells("bucket-side").into_iter().find(|cell| {
        let variant = &cell.variant;
        variant.preset == list.preset && variant.distance_test == "sqrt" && variant.buckets_per_radius == 1
    });
    let eight = eight.and_then(|list| {
        let relocated = list.with_preset(Preset::PAPER_AOS_RELOCATION);
        let per_step = |cell| measured.per_step("bucket-side", Stage::Paired, cell, Quantity::NonCg);
        Some((
            "paired trials of eight variants in fewer states",
            ratio(&per_step(&list), &per_step(&relocated))?,
        ))
    });
    let found: Vec<(&str, Estimate)> = ways
        .into_iter()
        .filter_map(|(name, experiment, stage)| {
            let per_step = |cell| measured.per_step(experiment, stage, cell, Quantity::NonCg);
            Some((name, ratio(&per_step(&list), &per_step(&relocated))?))
        })
        .chain(eight)
        .collect();
    let medians = || found.iter().map(|(_, estimate)| estimate.median);
    let spread = medians().reduce(f64::max)? / medians().reduce(f64::min)? - 1.0;
    let texts: Vec<String> = found.iter().map(|(name, e)| format!("{name} {}", show(e, 3))).collect();
    let verdict = if spread <= AGREEMENT { "they agree" } else { "they do not agree" };
    Some(format!(
        "List over relocation outside CG (sqrt): {}. They lie {:.1} % apart: {verdict} within {:.0} %.",
        texts.join(", "),
        100.0 * spread,
        100.0 * AGREEMENT
    ))
}

/// Whether the sampled steps stand for all: their mean over the mean of all steps, in a whole run of the list.
fn representativeness(measured: &Measured) -> Option<String> {
    let list = Cell::new("paper-linked-list", "sqrt", 1);
    let paired = measured.windows("table2", Stage::Paired, &list);
    let sampled: Vec<usize> = paired.values().next()?.iter().flat_map(|w| &w.steps).map(|s| s.step).collect();
    let whole = measured.windows("table2", Stage::Whole, &list);
    let steps: Vec<&StepSample> = whole.values().next()?.iter().flat_map(|w| &w.steps).collect();
    let mean = |value: fn(&StepSample) -> f64, wanted: &dyn Fn(usize) -> bool| -> f64 {
        let values: Vec<f64> = steps.iter().filter(|s| wanted(s.step)).map(|s| value(s)).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    let share =
        |value: fn(&StepSample) -> f64| mean(value, &|step| sampled.contains(&step)) / mean(value, &|_| true);
    Some(format!(
        "In the whole run of the list, the {} steps that paired trials sample take {:.3} times the mean of all {} steps \
         in CG, {:.3} times outside CG; they need {:.3} times the mean number of CG iterations.",
        sampled.len(),
        share(|s| s.cg_s),
        steps.len(),
        share(|s| s.total_s - s.cg_s),
        share(|s| s.cg_iterations as f64)
    ))
}

/// What the whole run did as a flow.
fn flow(measured: &Measured) -> Option<String> {
    let (_, trial) = measured.trials("table2", Stage::Whole).find(|(_, trial)| trial.status == Status::Ok)?;
    let outcome = trial.outcome.as_ref()?;
    let window = outcome.samples.first()?.first()?;
    let (last, steps) = (window.steps.last()?, window.steps.len());
    let iterations: usize = window.steps.iter().map(|s| s.cg_iterations).sum();
    Some(format!(
        "The scene has {} particles, {} of them fluid; {} left the bucket domain by step {steps} and became ghosts. CG \
         took {:.1} iterations a step to a relative residual of {:.0e}. The end state is {}.",
        outcome.particles,
        outcome.fluid_particles,
        last.ghosts,
        iterations as f64 / steps as f64,
        trial.variants.first()?.cg_tolerance,
        window.digest
    ))
}
