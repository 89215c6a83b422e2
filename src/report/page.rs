//! The report: every derived file of a run folder, `report.md` and the self-contained `report.html`. The manifest is last.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use minijinja::{AutoEscape, Environment};
use serde::Serialize;

use crate::base::files::write_whole;
use crate::experiment::cluster::blocks::in_words;
use crate::experiment::machine::Machine;
use crate::experiment::record::{Stage, Status};
use crate::report::assets::Assets;
use crate::report::chart::{Figure, svg_to_png};
use crate::report::claim::{Judged, Verdict, in_short, judge_all};
use crate::report::effort::{self, Effort};
use crate::report::manifest;
use crate::report::measured::Measured;
use crate::report::section::{self, Content};
use crate::report::summary::{CellPhase, cell_phases, summary};
use crate::report::table::{TableView, show};
use crate::report::{compared, markdown, noise, observations, peaks, samples, twin, validation};

/// Width of the PNGs, pixels.
pub const PNG_WIDTH: u32 = 1600;

/// What the templates show. Nothing in it is markup but `svg`, which the chart module made, and the page's own assets.
#[derive(Debug, Serialize)]
struct Page {
    assets: Assets,
    title: String,
    stamp: Option<String>,
    run: RunView,
    /// How many verdicts there are of each kind.
    verdicts: String,
    /// `None` where the run holds no claim's experiment.
    claims: Option<TableView>,
    sections: Vec<Section>,
    effort: TableView,
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
    /// Tables as files, below the run folder.
    files: Vec<String>,
    /// The command that repeats it alone.
    command: String,
    /// Trials, time and size of the records.
    took: String,
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
pub struct ClaimRow<'a> {
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
    /// Trials that ended without an outcome, those left out that cannot run here.
    pub failed_trials: usize,
    /// Trials that have one.
    pub ok_trials: usize,
}

impl Written {
    pub fn has_failing_claim(&self) -> bool {
        self.judged.iter().any(|judged| judged.verdict == Verdict::Fails)
    }
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
    observations::write(&measured, folder)?;
    twin::write(&measured, folder)?;
    validation::write(&measured, folder)?;
    peaks::write(&measured, folder)?;
    write_machine(&measured.machine, folder)?;
    let judged = judge_all(&measured);
    samples::write_csv(&folder.join("claims.csv"), &claim_rows(&measured, &judged))?;
    let efforts = effort::of(&measured, folder)?;
    samples::write_csv(&folder.join("effort.csv"), &effort::rows(&measured, &efforts, &judged))?;
    let sections = efforts
        .iter()
        .map(|effort| section(&measured, &phases, effort, folder))
        .collect::<Result<Vec<_>>>()?;
    let mut files = file_names(folder, &sections);
    write_page(&page(&measured, &judged, &efforts, sections), folder)?;
    manifest::write(folder)?;
    files.extend(["manifest.csv", "manifest.sha256"].map(String::from));
    let rounds = || measured.rounds.iter().filter(|round| round.stage != Stage::States);
    let trials = || rounds().flat_map(|round| &round.trials);
    let ok_trials = trials().filter(|trial| trial.status == Status::Ok).count();
    let failed_trials = trials().filter(|trial| trial.status.is_failure()).count();
    Ok(Written { files, judged, ok_trials, failed_trials })
}

/// All derived files below the run folder, those for people first. A table without a row has no file.
fn file_names(folder: &Path, sections: &[Section]) -> Vec<String> {
    let mut files: Vec<String> = ["report.html", "report.md", "claims.csv"].map(String::from).into();
    files.extend(sections.iter().flat_map(|section| section.files.clone()));
    let figures = sections.iter().flat_map(|section| &section.figures);
    files.extend(figures.flat_map(|f| ["svg", "png"].map(|kind| format!("figures/{}.{kind}", f.file))));
    let data = ["summary.csv", "samples.csv", "steps.csv", "observations.csv", "fronts.csv", "twin.csv"];
    let more = ["validation.csv", "peaks.csv", "effort.csv", "machine.json", "machine.csv"];
    files.extend(data.into_iter().chain(more).map(String::from));
    files.retain(|file| file.starts_with("report.") || folder.join(file).is_file());
    files
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

/// A row a claim and rule.
pub fn claim_rows<'a>(measured: &Measured, judged: &'a [Judged]) -> Vec<ClaimRow<'a>> {
    judged
        .iter()
        .map(|j| ClaimRow {
            mode: measured.info.mode.name(),
            particles: measured.particles(&j.claim.estimate.experiment),
            claim: &j.claim.id,
            judged_by: &j.judgement.name,
            statement: &j.claim.statement,
            source: &j.claim.source,
            published: &j.claim.quote,
            estimate: j.estimate.map(|e| e.median),
            low: j.estimate.and_then(|e| e.bounds()).map(|i| i.low),
            high: j.estimate.and_then(|e| e.bounds()).map(|i| i.high),
            unit: j.unit,
            rounds: j.estimate.map(|e| e.samples),
            rule: j.judgement.rule.in_words(),
            verdict: j.verdict.name(),
            reason: j.verdict.reason(),
        })
        .collect()
}

/// The claims for people.
pub fn claims_view(judged: &[Judged]) -> TableView {
    let mut view = TableView::new(
        "Each claim with its verdict, the paper's number, ours [95 % interval] (of seconds, the range of rounds) and the rule.",
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

fn section(measured: &Measured, phases: &[CellPhase], effort: &Effort, folder: &Path) -> Result<Section> {
    let id = effort.experiment.as_str();
    let experiment = measured.experiment(id).context("an experiment of the run is missing")?;
    let Content { findings, figures, tables, files } = section::content(measured, phases, id)?;
    for (file, bytes) in &files {
        write_whole(&folder.join(file), bytes).with_context(|| format!("cannot write {file}"))?;
    }
    Ok(Section {
        id: id.to_string(),
        title: experiment.title.clone(),
        question: experiment.question.clone(),
        analysis: experiment.analysis.trim().to_string(),
        findings: findings
            .into_iter()
            .chain(noise::findings(measured, id))
            .chain(failures(measured, id))
            .collect(),
        figures: figures
            .iter()
            .map(|(name, figure)| draw(name, figure, folder))
            .collect::<Result<Vec<_>>>()?,
        tables: tables.into_iter().chain(compared::view(measured, id)).collect(),
        files: files.into_iter().map(|(file, _)| file).collect(),
        command: effort.command.clone(),
        took: effort.in_words(),
    })
}

fn draw(name: &str, figure: &Figure, folder: &Path) -> Result<FigureView> {
    let svg = figure.clone().legible().to_svg().with_context(|| format!("cannot draw {name}"))?;
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

/// What is missing of an experiment, and why.
fn failures(measured: &Measured, id: &str) -> Vec<String> {
    let mut sentences = Vec::new();
    for stage in Stage::ALL {
        for (round, trial) in measured.trials(id, stage).filter(|(_, trial)| trial.status.is_failure()) {
            sentences.push(format!(
                "{}{} round {round} on {} thread(s): {}: {}",
                stage.name(),
                if trial.subject.is_empty() { String::new() } else { format!(" `{}`,", trial.subject) },
                trial.threads,
                trial.status.name(),
                trial.reason
            ));
        }
    }
    sentences.extend(measured.disagreeing(id).into_iter().map(|run| {
        format!("`{run}` ended in different states in different rounds: at least one of them computed something else.")
    }));
    let unrecorded = in_words(&measured.missing(id));
    if !unrecorded.is_empty() {
        sentences.push(format!("The run is unfinished; missing are the rounds {}.", unrecorded.join("; ")));
    }
    let there = measured.info.usable_threads;
    let all = measured.thread_counts(id).into_iter();
    let missing: Vec<String> = all.filter(|&threads| threads > there).map(|t| t.to_string()).collect();
    if !missing.is_empty() {
        sentences.push(format!("Not applicable here: {} threads ({there} may be used).", missing.join(", ")));
    }
    sentences
}

fn page(measured: &Measured, judged: &[Judged], efforts: &[Effort], sections: Vec<Section>) -> Page {
    let info = &measured.info;
    let mut machine = TableView::new("The machine and the build.", &["group", "fact", "value", "unit"]);
    for fact in &measured.machine.facts {
        let value = fact.value.to_string();
        machine.rows.push(vec![fact.group.clone(), fact.key.clone(), value, fact.unit.clone()]);
    }
    Page {
        assets: Assets::load(),
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
        verdicts: in_short(judged),
        claims: (!judged.is_empty()).then(|| claims_view(judged)),
        sections,
        effort: effort::view(efforts, judged),
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
    environment.add_filter("text", markdown::plain);
    environment.add_filter("code", markdown::code);
    environment.add_filter("with_code", with_code);
    environment.add_template("report.html", include_str!("report.html"))?;
    environment.add_template("report.md", include_str!("report.md"))?;
    for name in ["report.md", "report.html"] {
        let text = environment.get_template(name)?.render(page)?;
        write_whole(&folder.join(name), text.as_bytes()).with_context(|| format!("cannot write {name}"))?;
    }
    Ok(())
}

/// The filter that shows what stands between backticks as code on the page; all else of a text stays text.
fn with_code(text: &str) -> minijinja::Value {
    let escaped = minijinja::HtmlEscape(text).to_string();
    let parts: Vec<&str> = escaped.split('`').collect();
    // A backtick without another one is no pair.
    if parts.len().is_multiple_of(2) {
        return minijinja::Value::from_safe_string(escaped);
    }
    let code = |(k, part): (usize, &&str)| {
        if k.is_multiple_of(2) { part.to_string() } else { format!("<code>{part}</code>") }
    };
    minijinja::Value::from_safe_string(parts.iter().enumerate().map(code).collect())
}

/// The filter that turns a table into Markdown.
pub fn markdown_table(view: minijinja::Value) -> Result<String, minijinja::Error> {
    let texts = |list: minijinja::Value| -> Result<Vec<String>, minijinja::Error> {
        Ok(list.try_iter()?.map(|cell| cell.to_string()).collect())
    };
    let mut table = TableView { header: texts(view.get_attr("header")?)?, ..TableView::default() };
    for row in view.get_attr("rows")?.try_iter()? {
        table.rows.push(texts(row)?);
    }
    Ok(table.to_markdown())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backticks_become_code_and_markup_stays_text() {
        for (text, expected) in [
            ("the preset `fast` and `a<b>`", "the preset <code>fast</code> and <code>a&lt;b&gt;</code>"),
            ("one ` alone & <script>", "one ` alone &amp; &lt;script&gt;"),
            ("none", "none"),
        ] {
            assert_eq!(with_code(text).to_string(), expected);
        }
    }
}
