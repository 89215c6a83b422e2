//! The reproduction's own short write-up, with every number computed from a run.

use anyhow::Result;
use minijinja::{Environment, context};
use serde::Serialize;

use crate::base::statistics::Estimate;
use crate::engine::preset::Preset;
use crate::experiment::machine::Reading;
use crate::experiment::record::Stage;
use crate::report::claim::{Judged, Verdict, in_short, judge_all};
use crate::report::measured::{Cell, Measured, Quantity, ratio};
use crate::report::published::Published;
use crate::report::section;
use crate::report::summary::{CellPhase, cell_phases};
use crate::report::table::{TableView, show, show_or_none};
use crate::report::{markdown, page, samples};

/// Sentences of each experiment that the write-up repeats; the report has all.
const FINDINGS: usize = 2;

/// One question beside the paper's own.
#[derive(Debug, Serialize)]
struct Question {
    title: String,
    question: String,
    findings: Vec<String>,
}

/// The write-up of a run as Markdown.
pub fn text(measured: &Measured) -> Result<String> {
    let judged = judge_all(measured);
    let phases = cell_phases(&samples::frame(&samples::rows(measured))?)?;
    let (published, stage) = (Published::load(), measured.stage_for_tables("table2"));
    let mut environment = Environment::new();
    environment.add_filter("text", markdown::plain);
    environment.add_filter("code", markdown::code);
    environment.add_filter("markdown_table", page::markdown_table);
    environment.add_template("write_up.md", include_str!("write_up.md"))?;
    let text = environment.get_template("write_up.md")?.render(context! {
        info => &measured.info,
        stamp => measured.stamp(),
        mode => measured.info.mode.name(),
        particles => measured.particles("table2"),
        paper_particles => published.particles,
        paper_steps => published.steps,
        paper_machine => &published.machine,
        paper_speed_up => format!("{:.2}", published.table2.speed_up.non_cg),
        paper_speed_up_total => format!("{:.2}", published.table2.speed_up.total),
        rounds => measured.succeeded("table2", stage),
        stage => if stage == Stage::Whole { "whole runs" } else { "paired trials" },
        machine => machine(measured),
        verdicts => in_short(&judged),
        claims => claims(&judged),
        gains => gains(measured),
        questions => questions(measured, &phases)?,
        open => open(&judged),
    })?;
    Ok(text + "\n")
}

/// The machine in a sentence.
fn machine(measured: &Measured) -> String {
    let fact =
        |key: &str| measured.machine.fact(key).and_then(Reading::value).unwrap_or("unknown").to_string();
    let gibibytes = |key: &str| {
        fact(key).parse::<f64>().map_or("unknown".to_string(), |b| format!("{:.1}", b / 1073741824.0))
    };
    let mebibytes = |key: &str| {
        fact(key).parse::<f64>().map_or("unknown".to_string(), |b| format!("{:.1}", b / 1048576.0))
    };
    let virtualised = if fact("virtualised") == "yes" { "a virtual machine with " } else { "" };
    format!(
        "{virtualised}{} usable core(s) of an {}, {} MiB of L2 cache a core and {} MiB of L3, {} GiB of memory, {}, {}",
        measured.info.usable_cores,
        fact("model_name"),
        mebibytes("l2_size_bytes"),
        mebibytes("l3_size_bytes"),
        gibibytes("total_bytes"),
        fact("distribution"),
        fact("compiler")
    )
}

/// A row a claim, with the verdicts of all its rules.
fn claims(judged: &[Judged]) -> TableView {
    let mut view = TableView::new("", &["", "claim", "paper", "here", "verdict"]);
    for j in judged {
        let verdict = format!("{}: {}", j.judgement.name, j.verdict.name());
        match view.rows.last_mut().filter(|row| row[0] == j.claim.id) {
            Some(row) => row[4] = format!("{}; {verdict}", row[4]),
            None => view.rows.push(vec![
                j.claim.id.clone(),
                j.claim.statement.clone(),
                j.claim.quote.clone(),
                j.estimate.map_or("none".to_string(), |e| format!("{} {}", show(&e, 3), j.unit)),
                verdict,
            ]),
        }
    }
    view
}

/// List over relocation on one thread with each distance test, outside CG and in all.
fn gains(measured: &Measured) -> Vec<String> {
    let stage = measured.stage_for_tables("table2");
    let gain = |test: &str, quantity: Quantity| -> Option<Estimate> {
        let [list, relocated] = [Preset::PAPER_LINKED_LIST, Preset::PAPER_AOS_RELOCATION]
            .map(|preset| measured.per_step("table2", stage, &Cell::new(preset.name(), test, 1), quantity));
        ratio(&list, &relocated)
    };
    let sentence = |(test, name): (&str, &str)| {
        let outside = gain(test, Quantity::NonCg)?;
        let total = show_or_none(gain(test, Quantity::Total), 3);
        Some(format!(
            "with {name}, list over relocation is {} outside CG and {total} in all",
            show(&outside, 3)
        ))
    };
    let tests =
        [("sqrt", "the paper's distance test, a root for every candidate"), ("squared", "squared distances")];
    tests.into_iter().filter_map(sentence).collect()
}

/// What else was asked, with the first sentences of what came out.
fn questions(measured: &Measured, phases: &[CellPhase]) -> Result<Vec<Question>> {
    let mut questions = Vec::new();
    let experiments =
        measured.info.experiments.iter().filter(|e| !["table2", "figure4"].contains(&e.id.as_str()));
    for experiment in experiments {
        let mut findings = section::content(measured, phases, &experiment.id)?.findings;
        // How it was measured is said once, under the method.
        findings.retain(|finding| !finding.starts_with("Numbers are from"));
        findings.truncate(FINDINGS);
        let (title, question) = (experiment.title.clone(), experiment.question.clone());
        questions.push(Question { title, question, findings });
    }
    Ok(questions)
}

/// Claims without an answer, and why.
fn open(judged: &[Judged]) -> Vec<String> {
    let open = judged.iter().filter(|j| !matches!(j.verdict, Verdict::Holds | Verdict::Fails));
    open.map(|j| {
        format!("{} ({}): {}, {}.", j.claim.id, j.judgement.name, j.verdict.name(), j.verdict.reason())
    })
    .collect()
}
