//! Hard cases: what passes, what fails and by how much.

use anyhow::Result;

use crate::experiment::observed::{Case, Criterion, Scheme};
use crate::experiment::quantity::Quantity;
use crate::experiment::record::Observation;
use crate::experiment::spec::Experiment;
use crate::report::chart::{Bar, BarGroup, BarPanel, Figure, Panel};
use crate::report::measured::Measured;
use crate::report::section::{Content, capital};
use crate::report::summary::CellPhase;
use crate::report::table::TableView;

const ID: &str = "hard-cases";

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    let Some(experiment) = measured.experiment(ID) else {
        return Ok(Content::default());
    };
    let (mut findings, tables) = verdicts(measured, experiment);
    let results = results(measured, experiment);
    findings.extend(cost(experiment, &results));
    let figures = vec![("hard-cases".to_string(), figure(measured, experiment, &results))];
    Ok(Content { findings, figures, tables, ..Content::default() })
}

/// What passes and what fails of any experiment's cases; nothing where it has none.
pub fn verdicts(measured: &Measured, experiment: &Experiment) -> (Vec<String>, Vec<TableView>) {
    let results = results(measured, experiment);
    if results.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let schemes = schemes(experiment);
    let findings = schemes.iter().filter_map(|scheme| scheme_in_words(scheme, &results)).collect();
    (findings, vec![table(experiment, &schemes, &results)])
}

/// A case with a scheme, and what was seen.
struct CaseResult<'a> {
    case: &'a Case,
    /// The id of the scheme; empty where there are none.
    scheme: &'a str,
    /// `None` where its process failed.
    observation: Option<&'a Observation>,
}

/// Ids and titles of the schemes; a nameless one where there are none.
fn schemes(experiment: &Experiment) -> Vec<(&str, &str)> {
    let named: Vec<(&str, &str)> =
        experiment.scheme.iter().map(|scheme| (scheme.id.as_str(), scheme.title.as_str())).collect();
    if named.is_empty() { vec![("", "as it is")] } else { named }
}

/// One thing that was asked of a run.
struct Asked {
    what: String,
    found: String,
    holds: bool,
}

fn results<'a>(measured: &'a Measured, experiment: &'a Experiment) -> Vec<CaseResult<'a>> {
    let cases = experiment.case.iter().filter(|case| case.modes.contains(&measured.info.mode));
    let mut results = Vec::new();
    for case in cases {
        let first = |run: &str| measured.observations(&experiment.id, run).into_iter().next();
        if experiment.scheme.is_empty() {
            results.push(CaseResult { case, scheme: "", observation: first(&case.id) });
        }
        for scheme in case.schemes_of(&experiment.scheme) {
            let observation = first(&case.run_id(scheme));
            results.push(CaseResult { case, scheme: &scheme.id, observation });
        }
    }
    results
}

impl CaseResult<'_> {
    fn asked(&self) -> Vec<Asked> {
        let due = self.case.must_end_with.as_deref().unwrap_or(Observation::COMPLETED);
        let what = match due {
            Observation::COMPLETED => "runs to its end".to_string(),
            error => format!("ends with the error `{error}`"),
        };
        let found = match self.observation {
            Some(seen) if seen.error.is_empty() => seen.ended.clone(),
            Some(seen) => format!("{}: {}", seen.ended, seen.error),
            None => "nothing: its process failed".to_string(),
        };
        let holds = self.observation.is_some_and(|seen| seen.ended == due);
        let mut asked = vec![Asked { what, found, holds }];
        asked.extend(self.case.pass.iter().map(|criterion| self.judge(criterion)));
        asked
    }

    fn judge(&self, criterion: &Criterion) -> Asked {
        let value = self.observation.and_then(|seen| seen.quantities.get(&criterion.quantity).copied());
        let completed = self.observation.is_some_and(|seen| seen.ended == Observation::COMPLETED);
        Asked {
            what: criterion.in_words(),
            found: value.map_or("nothing".to_string(), short),
            holds: completed && value.is_some_and(|value| criterion.holds_for(value)),
        }
    }

    fn passes(&self) -> bool {
        self.asked().iter().all(|asked| asked.holds)
    }

    fn quantity(&self, quantity: Quantity) -> f64 {
        self.observation.and_then(|seen| seen.quantities.get(&quantity).copied()).unwrap_or(0.0)
    }
}

/// A number with as many digits as tell it apart from its bound.
fn short(value: f64) -> String {
    if value == value.round() && value.abs() < 1e6 {
        format!("{value:.0}")
    } else if value.abs() >= 1e-3 && value.abs() < 1e4 {
        format!("{value:.4}")
    } else {
        format!("{value:.1e}")
    }
}

/// How many cases pass, and what the others fail.
fn scheme_in_words((id, title): &(&str, &str), results: &[CaseResult<'_>]) -> Option<String> {
    let of_scheme: Vec<&CaseResult<'_>> = results.iter().filter(|r| r.scheme == *id).collect();
    let failed: Vec<String> = of_scheme
        .iter()
        .filter(|result| !result.passes())
        .map(|result| {
            let asked = result.asked();
            let wrong = asked.iter().filter(|asked| !asked.holds);
            let wrong: Vec<String> = wrong.map(|a| format!("{}, found {}", a.what, a.found)).collect();
            format!("{} (asked: {})", result.case.title, wrong.join("; "))
        })
        .collect();
    let (all, passed) = (of_scheme.len(), of_scheme.len() - failed.len());
    let failures = match failed.as_slice() {
        [] => String::new(),
        failed => format!(" It fails {}.", failed.join(", and ")),
    };
    (all > 0).then(|| format!("{}: {passed} of {all} cases pass.{failures}", capital(title)))
}

/// What stops the leaks, and what it costs.
fn cost(experiment: &Experiment, results: &[CaseResult<'_>]) -> Vec<String> {
    let [plain, changed] = experiment.scheme.as_slice() else {
        return Vec::new();
    };
    let of =
        |case: &Case, scheme: &Scheme| results.iter().find(|r| r.case.id == case.id && r.scheme == scheme.id);
    let leaky = |case: &&Case| of(case, plain).is_some_and(|r| r.quantity(Quantity::Leaks) > 0.0);
    let sentence = |case: &Case| {
        let (before, after) = (of(case, plain)?, of(case, changed)?);
        let a_step = |r: &CaseResult<'_>| r.observation.map(|seen| seen.stepping_s / seen.steps as f64);
        Some(format!(
            "{}: {:.0} of {:.0} fluid particles leak and {:.0} leave the domain; {}, {:.0} leak and {:.0} leave, at {:.2} \
             times the time a step (one run each).",
            capital(&case.title),
            before.quantity(Quantity::Leaks),
            before.quantity(Quantity::Fluid),
            before.quantity(Quantity::Left),
            changed.title,
            after.quantity(Quantity::Leaks),
            after.quantity(Quantity::Left),
            a_step(after)? / a_step(before)?
        ))
    };
    experiment.case.iter().filter(leaky).filter_map(sentence).collect()
}

fn figure(measured: &Measured, experiment: &Experiment, results: &[CaseResult<'_>]) -> Figure {
    let bar = |result: &CaseResult<'_>| Bar {
        label: result.scheme.to_string(),
        values: vec![result.quantity(Quantity::Leaks)],
        interval: None,
        published: false,
    };
    let leaky =
        |case: &&Case| results.iter().any(|r| r.case.id == case.id && r.quantity(Quantity::Leaks) > 0.0);
    let groups = experiment.case.iter().filter(leaky).map(|case| BarGroup {
        label: case.id.clone(),
        bars: results.iter().filter(|r| r.case.id == case.id).map(bar).collect(),
    });
    Figure {
        title: "Fluid particles that leak into walls".to_string(),
        description:
            "Particles seen deeper than half a particle distance inside a wall, past its first layer, in the \
                      cases that have any, with the textbook's scheme and with wall contact and kernel floor."
                .to_string(),
        panels: vec![Panel::Bars(BarPanel {
            title: String::new(),
            y_label: "particles that leak".to_string(),
            segments: vec!["ever seen inside a wall".to_string()],
            groups: groups.collect(),
        })],
        note: measured.stamp(),
    }
}

/// Rows are what a case asks, columns the schemes; the first row of a case is its verdict.
fn table(experiment: &Experiment, schemes: &[(&str, &str)], results: &[CaseResult<'_>]) -> TableView {
    let mut view = TableView::new(
        "What each case asks, and what was found with each scheme: `holds` or `fails`, and the number.",
        &["case", "asked"],
    );
    view.header.extend(schemes.iter().map(|(_, title)| title.to_string()));
    for case in &experiment.case {
        let of_scheme =
            |(id, _): &(&str, &str)| results.iter().find(|r| r.case.id == case.id && r.scheme == *id);
        let of_case: Vec<Option<&CaseResult<'_>>> = schemes.iter().map(of_scheme).collect();
        let Some(first) = of_case.iter().flatten().next() else {
            continue;
        };
        let row = |name: &str, what: String, cell: &dyn Fn(&CaseResult<'_>) -> String| {
            let cells = of_case.iter().map(|result| result.map_or("not run".to_string(), cell));
            [name.to_string(), what].into_iter().chain(cells).collect::<Vec<String>>()
        };
        view.rows.push(row(&case.title, "everything below".to_string(), &|result| verdict(result.passes())));
        for (k, asked) in first.asked().into_iter().enumerate() {
            view.rows.push(row("", asked.what, &|result| {
                let asked = &result.asked()[k];
                format!("{}: {}", verdict(asked.holds), asked.found)
            }));
        }
    }
    view
}

fn verdict(holds: bool) -> String {
    if holds { "holds" } else { "fails" }.to_string()
}
