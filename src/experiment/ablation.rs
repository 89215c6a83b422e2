//! The experiment that takes a scene's effects apart: each removed from the whole, each added to what is left without any.
//!
//! It is an experiment like those in files, made from the scene: observed runs, each of a process of its own, interleaved
//! in rounds. `repro effects SCENE` runs it; those of a few scenes stand in `experiments/` and are part of `repro all`.

use std::collections::BTreeMap;

use crate::base::input::{Check, InputError};
use crate::experiment::observed::{Case, Scheme};
use crate::experiment::record::Variant;
use crate::experiment::spec::{Experiment, Measurement, Mode, Modes, Observed, SCHEMA, scene_sets};
use crate::scene::spec::effects::EffectsSpec;
use crate::scene::{Scene, library};

/// How ids of such experiments begin.
pub const PREFIX: &str = "effects-of-";
/// The scheme of the scene as it is.
pub const WHOLE: &str = "as-named";
/// The scheme of the scene without any effect that can be left out.
pub const BARE: &str = "bare";
/// The key that says how far runs go.
const END: &str = "end_time_s";
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

/// The command that makes such an experiment from its scene and runs it; `None` for an experiment of another kind.
pub fn command(experiment: &Experiment) -> Option<String> {
    let case = experiment.case.first().filter(|_| is_ablation(&experiment.id))?;
    let mut command = format!("repro effects {}", in_shell(&case.scene));
    for set in scene_sets([&case.set]) {
        match set.strip_prefix(END) {
            Some(until) => command += &format!(" --until {}", until.trim_start_matches('=')),
            None => command += &format!(" --set {}", in_shell(&set)),
        }
    }
    Some(format!("{command} --rounds {}", experiment.mode.default.observed.as_ref()?.rounds))
}

/// A word as a shell takes it for one.
fn in_shell(word: &str) -> String {
    match word.chars().all(|c| c.is_ascii_alphanumeric() || "._-/=+:".contains(c)) {
        true => word.to_string(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
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
    /// Whether the scene is one without the effect: not where walls move, bodies float or all fluid comes in by it.
    fn is_removable(&self, effect: &str, named: &[&'static str]) -> bool {
        let mut sets = scene_sets([&self.sets]);
        let gone = EffectsSpec::with_dependents(effect, named);
        sets.extend(gone.iter().map(|name| format!("effects.{name}=false")));
        library::load(self.scene, &sets).and_then(|scene| scene.particles(self.scene)).is_ok()
    }

    /// The experiment. `loaded` is the scene with the changes.
    pub fn experiment(&self, loaded: &Scene) -> Result<Experiment, InputError> {
        let all = loaded.effects.named();
        let named: Vec<&str> = all.iter().copied().filter(|effect| self.is_removable(effect, &all)).collect();
        let allowed = "a scene that names at least one effect which it can be without";
        Check { file: self.scene }.require(!named.is_empty(), "effects", "empty", allowed)?;
        let mut scheme =
            vec![Scheme { id: WHOLE.to_string(), title: "as named".to_string(), set: BTreeMap::new() }];
        let removed = |gone: &[&str]| {
            gone.iter().map(|name| (format!("effects.{name}"), toml::Value::Boolean(false))).collect()
        };
        for effect in &named {
            let gone = EffectsSpec::with_dependents(effect, &all);
            let title = format!("without {}", in_words(&gone));
            scheme.push(Scheme { id: without(effect), title, set: removed(&gone) });
        }
        scheme.push(Scheme { id: BARE.to_string(), title: without_any(&named, &all), set: removed(&named) });
        for effect in &named {
            let kept = EffectsSpec::with_needs(effect, &all);
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
        set.insert(END.to_string(), toml::Value::Float(self.until_s));
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
            title: format!("The effects of {}, one by one", loaded.name),
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
                quick: observed(1),
                default: observed(self.rounds),
                full: observed(2 * self.rounds),
            },
        };
        experiment.check(self.scene)?;
        Ok(experiment)
    }
}

/// What is left when all effects are gone that can be.
fn without_any(removable: &[&str], named: &[&str]) -> String {
    let left: Vec<&str> = named.iter().copied().filter(|name| !removable.contains(name)).collect();
    match left.is_empty() {
        true => "without any effect".to_string(),
        false => format!("without any effect but {}", in_words(&left)),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::library as experiments;

    /// Files and scenes drift apart: an effect that a scene names later would be missing.
    #[test]
    fn the_programs_files_are_what_their_scenes_make() {
        let mut found = 0;
        for id in experiments::names().filter(|id| is_ablation(id)) {
            let experiment = experiments::embedded(id).unwrap();
            let mut sets = experiment.case[0].set.clone();
            let scene = library::load(&experiment.scene, &scene_sets([&experiment.case[0].set])).unwrap();
            let until_s = sets.remove(END).and_then(|end| end.as_float()).unwrap();
            let rounds = experiment.mode.default.observed.as_ref().unwrap().rounds;
            let ablation = Ablation { scene: &experiment.scene, sets, until_s, rounds };
            let again = format!("write it anew: {} --print", command(&experiment).unwrap());
            assert_eq!(ablation.experiment(&scene).unwrap(), experiment, "{again}");
            found += 1;
        }
        assert_eq!(found, 4);
    }

    #[test]
    fn a_scene_keeps_the_effects_without_which_it_is_none() {
        for (name, stays) in [("floating-box", "rigid_bodies"), ("piston-wave", "wall_motion")] {
            let scene = library::load(name, &[]).unwrap();
            let ablation = Ablation { scene: name, sets: BTreeMap::new(), until_s: 0.01, rounds: 1 };
            let experiment = ablation.experiment(&scene).unwrap();
            let gone = format!("effects.{stays}");
            assert!(experiment.scheme.iter().all(|scheme| !scheme.set.contains_key(&gone)), "{name}");
            let bare = experiment.scheme.iter().find(|scheme| scheme.id == BARE).unwrap();
            assert_eq!(bare.title, format!("without any effect but {}", stays.replace('_', " ")));
        }
    }

    #[test]
    fn the_command_says_all_that_the_experiment_was_made_of() {
        let experiment = experiments::embedded("effects-of-mud-flow").unwrap();
        assert_eq!(
            command(&experiment).unwrap(),
            "repro effects mud-flow --until 0.15 --set particle_distance_m=0.01 --set time_step_s=0.001 --rounds 9"
        );
        assert_eq!(command(&experiments::embedded("table2").unwrap()), None);
        assert_eq!(in_shell("a b's"), r"'a b'\''s'");
    }
}
