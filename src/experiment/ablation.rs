//! The experiment that takes a scene's effects apart: each removed from the whole, each added to what is left without any.
//!
//! It is an experiment like those in files, made from the scene: observed runs, each of a process of its own, interleaved
//! in rounds. `repro effects SCENE` runs it; those of a few scenes stand in `experiments/` and are part of `repro all`.

use std::collections::BTreeMap;

use crate::base::input::{Check, InputError};
use crate::experiment::observed::{Case, Scheme};
use crate::experiment::record::Variant;
use crate::experiment::spec::{Experiment, Measurement, Mode, Modes, Observed, SCHEMA};
use crate::scene::Scene;
use crate::scene::spec::effects::EffectsSpec;

/// How ids of such experiments begin.
pub const PREFIX: &str = "effects-of-";
/// The scheme of the scene as it is.
pub const WHOLE: &str = "as-named";
/// The scheme of the scene without any effect that can be left out.
pub const BARE: &str = "bare";
/// Seeds the order of runs within rounds.
const SEED: u64 = 1871;

/// Whether an experiment is one of these.
pub fn is_ablation(id: &str) -> bool {
    id.starts_with(PREFIX)
}

/// The scheme in which an effect is removed.
pub fn without(effect: &str) -> String {
    format!("no-{}", effect.replace('_', "-"))
}

/// The scheme in which an effect is added to the bare scene.
pub fn only(effect: &str) -> String {
    format!("only-{}", effect.replace('_', "-"))
}

/// What to run for how long.
#[derive(Debug, Clone, PartialEq)]
pub struct Ablation<'a> {
    /// The scene's name or file.
    pub scene: &'a str,
    /// Changes to its keys.
    pub sets: BTreeMap<String, toml::Value>,
    /// Where runs end, seconds of simulated time.
    pub until_s: f64,
    pub rounds: usize,
}

impl Ablation<'_> {
    /// The experiment. `loaded` is the scene with the changes.
    pub fn experiment(&self, loaded: &Scene) -> Result<Experiment, InputError> {
        let named = loaded.effects.named();
        let allowed = "a scene that names at least one effect";
        Check { file: self.scene }.require(!named.is_empty(), "effects", "empty", allowed)?;
        let mut scheme =
            vec![Scheme { id: WHOLE.to_string(), title: "as named".to_string(), set: BTreeMap::new() }];
        let removed = |gone: &[&str]| {
            gone.iter().map(|name| (format!("effects.{name}"), toml::Value::Boolean(false))).collect()
        };
        for effect in &named {
            let gone = EffectsSpec::with_dependents(effect, &named);
            let title = format!("without {}", in_words(&gone));
            scheme.push(Scheme { id: without(effect), title, set: removed(&gone) });
        }
        scheme.push(Scheme {
            id: BARE.to_string(),
            title: "without any effect".to_string(),
            set: removed(&named),
        });
        for effect in &named {
            let kept = EffectsSpec::with_needs(effect, &named);
            let gone: Vec<&str> = named.iter().copied().filter(|name| !kept.contains(name)).collect();
            let title = format!("with {} alone", in_words(&kept));
            scheme.push(Scheme { id: only(effect), title, set: removed(&gone) });
        }
        // A scene with one effect: leaving it out and leaving all out are one run.
        let mut seen: Vec<BTreeMap<String, toml::Value>> = Vec::new();
        scheme.retain(|scheme| {
            let new = !seen.contains(&scheme.set);
            seen.push(scheme.set.clone());
            new
        });
        let mut set = self.sets.clone();
        set.insert("end_time_s".to_string(), toml::Value::Float(self.until_s));
        let case = Case {
            id: "run".to_string(),
            title: format!("{} to {} s", loaded.name, self.until_s),
            scene: self.scene.to_string(),
            modes: Mode::every(),
            set,
            quick: BTreeMap::new(),
            schemes: None,
            pass: Vec::new(),
            must_end_with: None,
        };
        let observed = |rounds: usize| Measurement {
            scene: BTreeMap::new(),
            whole: None,
            paired: None,
            observed: Some(Observed { rounds }),
            twin: None,
            validation: None,
            peaks: None,
        };
        let experiment = Experiment {
            schema: SCHEMA,
            id: format!("{PREFIX}{}", loaded.name),
            title: format!("The effects of `{}`, one by one", loaded.name),
            question: "What does each effect that the scene names cost in time and memory, and what does it change?"
                .to_string(),
            analysis: "Each effect removed from the whole scene, with what cannot be without it, and each added to the \
                       bare scene, with what it needs. Runs from the start, a process each, interleaved in rounds; a ratio \
                       is of the time of a step within a round. An effect that costs little and changes nothing is one \
                       that the scene does not call for."
                .to_string(),
            scene: self.scene.to_string(),
            seed: SEED,
            pin: "close".to_string(),
            claims: Vec::new(),
            time_limit_s: None,
            gate: None,
            factors: Vec::new(),
            fixed: Variant {
                preset: crate::engine::preset::Preset::PAPER_AOS_RELOCATION.name().to_string(),
                distance_test: "squared".to_string(),
                storage: "csr".to_string(),
                ..Variant::default()
            },
            exclude: Vec::new(),
            filter: Vec::new(),
            case: vec![case],
            scheme,
            sweep: Vec::new(),
            twin: None,
            validation: None,
            mode: Modes {
                quick: observed(self.rounds.min(2)),
                default: observed(self.rounds),
                full: observed(2 * self.rounds),
            },
        };
        experiment.check(self.scene)?;
        Ok(experiment)
    }
}

/// `a, b and c`, with spaces for underscores.
fn in_words(effects: &[&str]) -> String {
    let names: Vec<String> = effects.iter().map(|name| name.replace('_', " ")).collect();
    match names.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
        None => "nothing".to_string(),
    }
}
