//! The report: every derived file of a run folder, `report.md` and the self-contained `report.html`.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use minijinja::{AutoEscape, Environment};
use serde::Serialize;

use crate::base::files::write_whole;
use crate::base::statistics::Estimate;
use crate::experiment::machine::Machine;
use crate::experiment::record::{Stage, Status, StepSample};
use crate::experiment::run::LAST_FILE;
use crate::report::chart::{Figure, svg_to_png};
use crate::report::claim::{Judged, judge_all};
use crate::report::measured::{Cell, Measured, Quantity, ratio};
use crate::report::summary::{CellPhase, cell_phases, summary};
use crate::report::table::{TableView, phases_view, show, table2_rows, table2_view};
use crate::report::{figure, figure4, samples};

/// Width of the PNGs, pixels.
const PNG_WIDTH: u32 = 1600;

/// What the templates show. Nothing in it is markup but `svg`, which the chart module made.
#[derive(Debug, Serialize)]
struct Page {
    title: String,
    stamp: Option<String>,
    run: RunView,
    claims: TableView,
    sections: Vec<Section>,
    machine: TableView,
}

#[derive(Debug, Serialize)]
struct RunView {
    id: String,
    mode: &'static str,
    command: String,
    commit: String,
    source_hash: String,
    created_utc: String,
    finished_utc: String,
}

/// One experiment.
#[derive(Debug, Serialize)]
struct Section {
    id: String,
    title: String,
    question: String,
    analysis: String,
    /// What came out, in sentences whose numbers are computed.
    findings: Vec<String>,
    figures: Vec<FigureView>,
    tables: Vec<TableView>,
}

#[derive(Debug, Serialize)]
struct FigureView {
    file: String,
    title: String,
    description: String,
    svg: String,
}

/// A row of `claims.csv`.
#[derive(Debug, Serialize)]
struct ClaimRow<'a> {
    mode: &'static str,
    particles: Option<usize>,
    claim: &'a str,
    judged_by: &'a str,
    statement: &'a str,
    source: &'a str,
    published: &'a str,
    estimate: Option<f64>,
    low: Option<f64>,
    high: Option<f64>,
    unit: &'a str,
    rounds: Option<usize>,
    rule: String,
    verdict: &'a str,
    reason: &'a str,
}

/// A row of `machine.csv`.
#[derive(Debug, Serialize)]
struct FactRow<'a> {
    group: &'a str,
    key: &'a str,
    value: String,
    unit: &'a str,
}

/// What a report says about a run, for those who only want the verdicts.
#[derive(Debug)]
pub struct Written {
    /// Paths below the run folder, in the order in which a reader wants them.
    pub files: Vec<String>,
    pub judged: Vec<Judged>,
    /// Trials that ended without an outcome.
    pub failed_trials: usize,
    /// Trials that have one.
    pub ok_trials: usize,
}

/// Derives every file of a run folder from its records.
pub fn write(folder: &Path) -> Result<Written> {
    let measured = Measured::read(folder)?;
    for name in ["tables", "figures"] {
        fs::create_dir_all(folder.join(name)).with_context(|| format!("cannot create {name}"))?;
    }
    let rows = samples::rows(&measured);
    samples::write(&measured, &rows, folder)?;
    let phases = cell_phases(&samples::frame(&rows)?)?;
    samples::write_csv(&folder.join("summary.csv"), &summary(&phases, measured.info.mode))?;
    write_machine(&measured.machine, folder)?;
    let judged = judge_all(&measured);
    write_claims(&measured, &judged, folder)?;
    let sections = measured
        .info
        .experiments
        .iter()
        .map(|e| section(&measured, &phases, &e.id, folder))
        .collect::<Result<Vec<_>>>()?;
    let files = file_names(&measured, &sections);
    write_page(&page(&measured, &judged, sections), folder)?;
    let trials = || measured.rounds.iter().flat_map(|round| &round.trials);
    let ok_trials = trials().filter(|trial| trial.status == Status::Ok).count();
    Ok(Written { files, judged, ok_trials, failed_trials: trials().count() - ok_trials })
}

/// All derived files below the run folder, those for people first.
fn file_names(measured: &Measured, sections: &[Section]) -> Vec<String> {
    let mut files = vec!["report.html", "report.md", "claims.csv"];
    if measured.experiment("table2").is_some() {
        files.extend(["tables/table2.csv", "tables/table2.md"]);
    }
    let data = ["summary.csv", "samples.csv", "steps.csv", "machine.json", "machine.csv"];
    let figures = sections.iter().flat_map(|section| &section.figures);
    let drawn = figures.flat_map(|f| ["svg", "png"].map(|kind| format!("figures/{}.{kind}", f.file)));
    files.into_iter().map(String::from).chain(drawn).chain(data.map(String::from)).collect()
}

fn write_machine(machine: &Machine, folder: &Path) -> Result<()> {
    let rows: Vec<FactRow<'_>> = machine
        .facts
        .iter()
        .map(|fact| FactRow {
            group: &fact.group,
            key: &fact.key,
            value: fact.value.to_string(),
            unit: &fact.unit,
        })
        .collect();
    samples::write_csv(&folder.join("machine.csv"), &rows)
}

fn write_claims(measured: &Measured, judged: &[Judged], folder: &Path) -> Result<()> {
    let rows: Vec<ClaimRow<'_>> = judged
        .iter()
        .map(|j| ClaimRow {
            mode: measured.info.mode.name(),
            particles: measured.particles(),
            claim: &j.claim.id,
            judged_by: &j.judgement.name,
            statement: &j.claim.statement,
            source: &j.claim.source,
            published: &j.claim.quote,
            estimate: j.estimate.map(|e| e.median),
            low: j.estimate.and_then(|e| e.interval).map(|i| i.low),
            high: j.estimate.and_then(|e| e.interval).map(|i| i.high),
            unit: j.unit,
            rounds: j.estimate.map(|e| e.samples),
            rule: j.judgement.rule.in_words(),
            verdict: j.verdict.name(),
            reason: j.verdict.reason(),
        })
        .collect();
    samples::write_csv(&folder.join("claims.csv"), &rows)
}

/// The claims for people.
pub fn claims_view(judged: &[Judged]) -> TableView {
    let mut view = TableView::new(
        "Each claim with its verdict, the paper's number, ours [95 % interval] and the rule.",
        &["", "verdict", "claim", "paper", "here", "rule"],
    );
    for j in judged {
        let reason = j.verdict.reason();
        let verdict = match reason {
            "" => j.verdict.name().to_string(),
            reason => format!("{}: {reason}", j.verdict.name()),
        };
        let here = j.estimate.map_or("none".to_string(), |e| format!("{} {}", show(&e, 3), j.unit));
        view.rows.push(vec![
            j.claim.id.clone(),
            verdict,
            format!("{} ({}; {})", j.claim.statement, j.judgement.name, j.claim.source),
            j.claim.quote.clone(),
            here,
            j.judgement.rule.in_words(),
        ]);
    }
    view
}

fn section(measured: &Measured, phases: &[CellPhase], id: &str, folder: &Path) -> Result<Section> {
    let experiment = measured.experiment(id).context("an experiment of the run is missing")?;
    let (mut figures, mut tables) = (Vec::new(), Vec::new());
    match id {
        "table2" => {
            samples::write_csv(&folder.join("tables/table2.csv"), &table2_rows(measured))?;
            let view = table2_view(measured);
            let text = format!("{}\n\n{}", view.caption, view.to_markdown());
            write_whole(&folder.join("tables/table2.md"), text.as_bytes())?;
            tables.push(view);
            figures.push(draw("table2", &figure::table2(measured), folder)?);
            if let Some(steps) = figure::steps(measured) {
                figures.push(draw("steps", &steps, folder)?);
            }
        }
        "figure4" => figures.push(draw("figure4", &figure4::figure4(measured), folder)?),
        _ => {}
    }
    tables.push(phases_view(phases, id));
    Ok(Section {
        id: id.to_string(),
        title: experiment.title.clone(),
        question: experiment.question.clone(),
        analysis: experiment.analysis.trim().to_string(),
        findings: findings(measured, id),
        figures,
        tables,
    })
}

fn draw(name: &str, figure: &Figure, folder: &Path) -> Result<FigureView> {
    let svg = figure.to_svg().with_context(|| format!("cannot draw {name}"))?;
    let path = |extension: &str| folder.join("figures").join(format!("{name}.{extension}"));
    write_whole(&path("svg"), svg.as_bytes())?;
    write_whole(&path("png"), &svg_to_png(&svg, PNG_WIDTH)?)?;
    Ok(FigureView {
        file: name.to_string(),
        title: figure.title.clone(),
        description: figure.description.clone(),
        svg,
    })
}

/// Sentences about an experiment's outcome.
fn findings(measured: &Measured, id: &str) -> Vec<String> {
    let mut findings = Vec::new();
    let stage = measured.stage_for_tables(id);
    findings.push(match stage {
        Stage::Whole => "Numbers are from whole runs, a process each.".to_string(),
        _ => format!(
            "Numbers are from paired trials: each process computes the same steps with all variants in turn; \
             {} rounds, whose processes are the samples of every interval.",
            measured.succeeded(id, stage)
        ),
    });
    if id == "table2" {
        findings.extend(agreement(measured));
        findings.extend(representativeness(measured));
        findings.extend(flow(measured));
    }
    findings.extend(failures(measured, id));
    findings
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
    let found: Vec<(&str, Estimate)> = ways
        .into_iter()
        .filter_map(|(name, experiment, stage)| {
            let per_step = |cell| measured.per_step(experiment, stage, cell, Quantity::NonCg);
            Some((name, ratio(&per_step(&list), &per_step(&relocated))?))
        })
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

fn failures(measured: &Measured, id: &str) -> Vec<String> {
    let mut sentences = Vec::new();
    for stage in [Stage::States, Stage::Whole, Stage::Paired] {
        for (round, trial) in measured.trials(id, stage).filter(|(_, trial)| trial.status != Status::Ok) {
            sentences.push(format!(
                "{} round {round} on {} thread(s): {}: {}",
                stage.name(),
                trial.threads,
                trial.status.name(),
                trial.reason
            ));
        }
    }
    let there = measured.info.usable_threads;
    if let Some(experiment) = measured.experiment(id) {
        let missing: Vec<String> =
            experiment.factors.threads.iter().filter(|&&t| t > there).map(|t| t.to_string()).collect();
        if !missing.is_empty() {
            sentences
                .push(format!("Not applicable here: {} threads ({there} may be used).", missing.join(", ")));
        }
    }
    sentences
}

fn page(measured: &Measured, judged: &[Judged], sections: Vec<Section>) -> Page {
    let info = &measured.info;
    let mut machine = TableView::new("The machine and the build.", &["group", "fact", "value", "unit"]);
    for fact in &measured.machine.facts {
        let value = fact.value.to_string();
        machine.rows.push(vec![fact.group.clone(), fact.key.clone(), value, fact.unit.clone()]);
    }
    Page {
        title: format!("AoS relocation in the MPS method, rerun on {}", info.machine_alias),
        stamp: measured.stamp(),
        run: RunView {
            id: info.run_id.clone(),
            mode: info.mode.name(),
            command: info.command.clone(),
            commit: info.commit.clone(),
            source_hash: info.source_hash.clone(),
            created_utc: info.created_utc.clone(),
            finished_utc: info.finished_utc.clone().unwrap_or_else(|| "unfinished".to_string()),
        },
        claims: claims_view(judged),
        sections,
        machine,
    }
}

fn write_page(page: &Page, folder: &Path) -> Result<()> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|name| match name {
        "report.html" => AutoEscape::Html,
        _ => AutoEscape::None,
    });
    environment.add_filter("markdown_table", markdown_table);
    environment.add_template("report.html", include_str!("report.html"))?;
    environment.add_template("report.md", include_str!("report.md"))?;
    for name in ["report.md", LAST_FILE] {
        let text = environment.get_template(name)?.render(page)?;
        write_whole(&folder.join(name), text.as_bytes()).with_context(|| format!("cannot write {name}"))?;
    }
    Ok(())
}

fn markdown_table(view: minijinja::Value) -> Result<String, minijinja::Error> {
    let texts = |list: minijinja::Value| -> Result<Vec<String>, minijinja::Error> {
        Ok(list.try_iter()?.map(|cell| cell.to_string()).collect())
    };
    let mut table = TableView { header: texts(view.get_attr("header")?)?, ..TableView::default() };
    for row in view.get_attr("rows")?.try_iter()? {
        table.rows.push(texts(row)?);
    }
    Ok(table.to_markdown())
}
