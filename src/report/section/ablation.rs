//! A scene's effects one by one: what each costs in time and memory, removed from the whole and added to what is bare,
//! and what it changes.

use crate::base::statistics::Estimate;
use crate::experiment::ablation::{BARE, WHOLE, only, without};
use crate::experiment::quantity::Quantity;
use crate::experiment::record::{Observation, Stage, Status};
use crate::report::chart::{Figure, Line, Mark, MarkAt, Marker, Panel, Scale, Series, XyPanel};
use crate::report::measured::{ByRound, Measured, ratio};
use crate::report::section::{Content, automatic, categories, point, side_by_side};
use crate::report::table::{TableView, show_or_none};
use crate::scene::spec::effects::EffectsSpec;

/// What is of a run's cost or course, not of its answer.
const NO_ANSWER: [Quantity; 4] =
    [Quantity::ColumnBytes, Quantity::BytesPerParticle, Quantity::CgIterations, Quantity::MaxCourant];

/// The section of the experiment with that id.
pub fn content_of(measured: &Measured, id: &str) -> Content {
    let runs = Runs { measured, id };
    let effects: Vec<EffectOf> = EffectsSpec::NAMES.iter().filter_map(|name| runs.effect(name)).collect();
    Content {
        findings: runs.findings(&effects),
        figures: vec![(id.to_string(), figure(measured, &effects))],
        tables: vec![table(&effects)],
        ..Content::default()
    }
}

/// The observed runs of one scene with all its schemes.
struct Runs<'a> {
    measured: &'a Measured,
    id: &'a str,
}

/// An effect that the scene names.
struct EffectOf {
    name: &'static str,
    /// Time of a step of the whole scene over time without the effect.
    last_in: Option<Estimate>,
    /// Time of a step of the bare scene with the effect over time without it.
    first_in: Option<Estimate>,
    /// Bytes of columns a particle that leave with the effect.
    columns: Option<f64>,
    /// What changes most without it: the quantity, its value with and without.
    change: Option<(Quantity, f64, f64)>,
    /// How the run without it ended.
    ended: String,
}

impl Runs<'_> {
    /// The first observation of a scheme: all have the same answer.
    fn seen(&self, scheme: &str) -> Option<&Observation> {
        self.measured.observations(self.id, &format!("run/{scheme}")).into_iter().next()
    }

    /// Seconds a step, by round.
    fn per_step(&self, scheme: &str) -> ByRound {
        let subject = format!("run/{scheme}");
        let trials = self.measured.trials(self.id, Stage::Observed);
        let ok = trials.filter(|(_, trial)| trial.subject == subject && trial.status == Status::Ok);
        let seconds = ok.filter_map(|(round, trial)| {
            let seen = trial.observation.as_ref().filter(|seen| seen.steps > 0)?;
            Some((round, seen.stepping_s / seen.steps as f64))
        });
        seconds.collect()
    }

    fn effect(&self, name: &'static str) -> Option<EffectOf> {
        let scheme = without(name);
        let has = |id: &str| {
            self.measured.experiment(self.id).is_some_and(|e| e.scheme.iter().any(|scheme| scheme.id == id))
        };
        // Where a scheme was left out since it equals another one, that one stands for it.
        let removed = if has(&scheme) {
            scheme
        } else if has(BARE) {
            BARE.to_string()
        } else {
            return None;
        };
        let added = if has(&only(name)) { only(name) } else { WHOLE.to_string() };
        if !self.names(name) {
            return None;
        }
        let (whole, gone) = (self.seen(WHOLE), self.seen(&removed));
        let bytes = |seen: &Observation| seen.quantities.get(&Quantity::ColumnBytes).copied();
        let both = whole.zip(gone);
        Some(EffectOf {
            name,
            last_in: ratio(&self.per_step(WHOLE), &self.per_step(&removed)),
            first_in: ratio(&self.per_step(&added), &self.per_step(BARE)),
            columns: both.and_then(|(whole, gone)| Some(bytes(whole)? - bytes(gone)?)),
            change: both.and_then(|(whole, gone)| largest_change(whole, gone)),
            ended: gone.map_or("failed".to_string(), |seen| seen.ended.clone()),
        })
    }

    /// Whether the scene names the effect: some scheme takes it out.
    fn names(&self, effect: &str) -> bool {
        let key = format!("effects.{effect}");
        let schemes = self.measured.experiment(self.id).map(|e| e.scheme.as_slice()).unwrap_or_default();
        schemes.iter().any(|scheme| scheme.set.contains_key(&key))
    }

    fn findings(&self, effects: &[EffectOf]) -> Vec<String> {
        let mut findings = Vec::new();
        if let Some(whole) = self.seen(WHOLE) {
            let per_step = self.per_step(WHOLE);
            let milliseconds: Vec<f64> = per_step.values().map(|s| 1e3 * s).collect();
            findings.push(format!(
                "{} particles, {} steps, {} round(s) of {} runs; the whole scene takes {} ms a step.",
                whole.particles,
                whole.steps,
                per_step.len(),
                self.measured.experiment(self.id).map_or(0, |e| e.scheme.len()),
                show_or_none(Estimate::of_times(&milliseconds), 3)
            ));
        }
        let free = |effect: &&EffectOf| {
            effect.last_in.is_some_and(|e| e.interval.is_some_and(|i| i.low <= 1.0 && i.high >= 1.0))
        };
        let free: Vec<&str> = effects.iter().filter(free).map(|effect| effect.name).collect();
        if !free.is_empty() {
            findings.push(format!("Whose cost is not resolved from none: {}.", free.join(", ")));
        }
        let idle = effects
            .iter()
            .filter(|effect| effect.change.is_some_and(|(_, with, without)| relative(with, without) < 1e-3));
        let idle: Vec<&str> = idle.map(|effect| effect.name).collect();
        if !idle.is_empty() {
            findings.push(format!(
                "Without which no observed number changes by a thousandth of itself, so that this scene hardly calls for \
                 them: {}.",
                idle.join(", ")
            ));
        }
        findings
    }
}

/// The number of the answer that differs most, relative to the larger of its two values.
fn largest_change(with: &Observation, without: &Observation) -> Option<(Quantity, f64, f64)> {
    let answers = with.quantities.iter().filter(|(quantity, _)| !NO_ANSWER.contains(quantity));
    let both =
        answers.filter_map(|(quantity, value)| Some((*quantity, *value, *without.quantities.get(quantity)?)));
    both.max_by(|a, b| relative(a.1, a.2).total_cmp(&relative(b.1, b.2)))
}

fn relative(a: f64, b: f64) -> f64 {
    if a == b { 0.0 } else { (a - b).abs() / a.abs().max(b.abs()) }
}

fn figure(measured: &Measured, effects: &[EffectOf]) -> Figure {
    let series = |label: &str, color: usize, marker: Marker, of: fn(&EffectOf) -> Option<Estimate>| Series {
        label: label.to_string(),
        color,
        line: Line::None,
        marker,
        points: effects.iter().enumerate().filter_map(|(k, e)| Some(point(k as f64, of(e)?))).collect(),
    };
    let names: Vec<String> = effects.iter().map(|effect| effect.name.replace('_', " ")).collect();
    Figure {
        title: "Time of a step with an effect over time without it".to_string(),
        description: "For each effect that the scene names, the time of a step of the whole scene over that without the \
                      effect, and the time of the bare scene with the effect over that of the bare scene, with 95 % \
                      intervals."
            .to_string(),
        panels: vec![Panel::Xy(XyPanel {
            title: String::new(),
            x: categories("", &names),
            y: automatic("with / without", Scale::Log10),
            series: side_by_side(vec![
                series("removed from the whole scene", 5, Marker::Circle, |e| e.last_in),
                series("added to the bare scene", 6, Marker::Square, |e| e.first_in),
            ]),
            marks: vec![Mark { label: String::new(), at: MarkAt::Y(1.0), color: 0 }],
            bands: Vec::new(),
        })],
        note: measured.stamp(),
    }
}

fn table(effects: &[EffectOf]) -> TableView {
    let mut view = TableView::new(
        "Time ratios are of a step with the effect over one without it; columns are what leaves with the effect; the \
         change is that of the observed number that changes most without it.",
        &[
            "effect",
            "whole / without",
            "bare with / bare",
            "columns, B a particle",
            "changes most",
            "with",
            "without",
            "run without",
        ],
    );
    for effect in effects {
        let (what, with, without) = match effect.change {
            Some((quantity, with, without)) => {
                (format!("{}, {}", quantity.in_words(), quantity.unit()), number(with), number(without))
            }
            None => ("nothing in common".to_string(), String::new(), String::new()),
        };
        view.rows.push(vec![
            effect.name.replace('_', " "),
            show_or_none(effect.last_in, 3),
            show_or_none(effect.first_in, 3),
            effect.columns.map_or("unknown".to_string(), |bytes| format!("{bytes:.0}")),
            what,
            with,
            without,
            effect.ended.clone(),
        ]);
    }
    view
}

fn number(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e5).contains(&value.abs()) {
        format!("{value:.3e}")
    } else {
        format!("{value:.4}")
    }
}
