//! An experiment file: one question, the cells that answer it, and how long each mode may take.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::base::parallel::MAX_THREADS;
use crate::engine::preset::Search;
use crate::experiment::record::Variant;

/// The version of the experiment format.
pub const SCHEMA: u32 = 1;

/// How much time a run may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Minutes, on a coarser scene: shows that everything works.
    Quick,
    /// About half an hour on two cores.
    Default,
    /// Hours: whole runs in interleaved rounds.
    Full,
}

impl Mode {
    pub fn name(self) -> &'static str {
        match self {
            Mode::Quick => "quick",
            Mode::Default => "default",
            Mode::Full => "full",
        }
    }
}

/// One experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    pub schema: u32,
    /// The name in commands, files and cells: lower-case letters, digits and `-`.
    pub id: String,
    pub title: String,
    pub question: String,
    /// How to read the answer.
    pub analysis: String,
    /// An embedded scene's name or a scene file's path.
    pub scene: String,
    /// Seed of the order of trials and of variants within a step.
    pub seed: u64,
    pub factors: Factors,
    pub fixed: Fixed,
    /// What each mode measures.
    pub mode: Modes,
}

/// The cells: every combination of these.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factors {
    pub threads: Vec<usize>,
    pub preset: Vec<String>,
    pub distance_test: Vec<String>,
}

/// What all cells share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fixed {
    pub storage: String,
    pub schedule: String,
    pub cg: String,
    pub cg_tolerance: f64,
    /// `off`, `close` or `spread`.
    pub pin: String,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Modes {
    pub quick: Measurement,
    pub default: Measurement,
    pub full: Measurement,
}

/// What one mode measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measurement {
    /// Changes to keys of the scene.
    #[serde(default)]
    pub scene: BTreeMap<String, toml::Value>,
    pub whole: Option<Whole>,
    pub paired: Option<Paired>,
}

/// Whole runs, one variant a process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Whole {
    pub rounds: usize,
    /// Only these distance tests; all of the factors' when left out.
    pub distance_test: Option<Vec<String>>,
}

/// All variants of a thread count in one process, in lock step through windows of states from early to late.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Paired {
    pub rounds: usize,
    pub windows: usize,
    pub warmup_steps: usize,
    pub steps: usize,
}

impl Experiment {
    /// Reads and checks an experiment file; `file` names it in errors.
    pub fn parse(text: &str, file: &str) -> Result<Experiment, InputError> {
        let experiment: Experiment = toml::from_str(text).map_err(|error| {
            let text = error.to_string().trim().replace('\n', " ");
            InputError::new(file, "experiment", "not a valid experiment", text)
        })?;
        experiment.check(file)?;
        Ok(experiment)
    }

    fn check(&self, file: &str) -> Result<(), InputError> {
        let check = Check { file };
        let allowed = format!("this program reads schema {SCHEMA}");
        check.require(self.schema == SCHEMA, "schema", self.schema, allowed)?;
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        let named = !self.id.is_empty() && self.id.len() <= 40 && self.id.chars().all(plain);
        let allowed = "allowed are up to 40 lower-case letters, digits and `-`";
        check.require(named, "id", format!("`{}`", self.id), allowed)?;
        check_list(check, "factors.threads", &self.factors.threads)?;
        check_list(check, "factors.preset", &self.factors.preset)?;
        check_list(check, "factors.distance_test", &self.factors.distance_test)?;
        for &threads in &self.factors.threads {
            let allowed = format!("allowed are 1 to {MAX_THREADS}");
            check.require((1..=MAX_THREADS).contains(&threads), "factors.threads", threads, allowed)?;
        }
        let pin = self.fixed.pin.as_str();
        let allowed = "allowed are `off`, `close` or `spread`";
        check.require(matches!(pin, "off" | "close" | "spread"), "fixed.pin", pin, allowed)?;
        for variant in self.variants() {
            let search = variant.options(file)?.search;
            let allowed = "its sums run in another order, so its end state differs from the other searches'";
            check.require(search != Search::BruteForce, "factors.preset", &variant.preset, allowed)?;
        }
        for (mode, measurement) in self.measurements() {
            measurement.check(check, mode, &self.factors)?;
        }
        Ok(())
    }

    fn measurements(&self) -> [(Mode, &Measurement); 3] {
        [Mode::Quick, Mode::Default, Mode::Full].map(|mode| (mode, self.measurement(mode)))
    }

    pub fn measurement(&self, mode: Mode) -> &Measurement {
        match mode {
            Mode::Quick => &self.mode.quick,
            Mode::Default => &self.mode.default,
            Mode::Full => &self.mode.full,
        }
    }

    /// The ways to compute a step that the experiment compares.
    pub fn variants(&self) -> Vec<Variant> {
        let Fixed { storage, schedule, cg, cg_tolerance, .. } = &self.fixed;
        let mut variants = Vec::new();
        for distance_test in &self.factors.distance_test {
            for preset in &self.factors.preset {
                variants.push(Variant {
                    preset: preset.clone(),
                    distance_test: distance_test.clone(),
                    storage: storage.clone(),
                    schedule: schedule.clone(),
                    cg: cg.clone(),
                    cg_tolerance: *cg_tolerance,
                });
            }
        }
        variants
    }
}

impl Measurement {
    fn check(&self, check: Check<'_>, mode: Mode, factors: &Factors) -> Result<(), InputError> {
        let key = |name: &str| format!("mode.{}.{name}", mode.name());
        let counts = "allowed are 1 to 10000";
        let valid = |count: usize| (1..=10_000).contains(&count);
        if let Some(whole) = &self.whole {
            check.require(valid(whole.rounds), &key("whole.rounds"), whole.rounds, counts)?;
        }
        if let Some(tests) = self.whole.as_ref().and_then(|whole| whole.distance_test.as_ref()) {
            check_list(check, &key("whole.distance_test"), tests)?;
            let known = tests.iter().all(|test| factors.distance_test.contains(test));
            let allowed = format!("allowed are those of the factors, {:?}", factors.distance_test);
            check.require(known, &key("whole.distance_test"), format!("{tests:?}"), allowed)?;
        }
        if let Some(paired) = &self.paired {
            let warmup = paired.warmup_steps;
            check.require(warmup <= 10_000, &key("paired.warmup_steps"), warmup, "allowed are 0 to 10000")?;
            for (name, count) in [
                ("paired.rounds", paired.rounds),
                ("paired.windows", paired.windows),
                ("paired.steps", paired.steps),
            ] {
                check.require(valid(count), &key(name), count, counts)?;
            }
        }
        let something = self.whole.is_some() || self.paired.is_some();
        check.require(something, &key("whole"), "missing", "a mode needs `whole`, `paired` or both")
    }

    /// The changes to the scene as `key=value`.
    pub fn scene_sets(&self) -> Vec<String> {
        let mut sets = Vec::new();
        for (key, value) in &self.scene {
            flatten(key, value, &mut sets);
        }
        sets
    }
}

/// `key=value` of every value below `key`, with dotted keys: setting a table as a whole would drop its other keys.
fn flatten(key: &str, value: &toml::Value, sets: &mut Vec<String>) {
    match value {
        toml::Value::Table(table) => {
            for (inner, value) in table {
                flatten(&format!("{key}.{inner}"), value, sets);
            }
        }
        value => sets.push(format!("{key}={value}")),
    }
}

/// Refuses a list that is empty or names something twice.
fn check_list<T: PartialEq + std::fmt::Debug>(
    check: Check<'_>,
    key: &str,
    list: &[T],
) -> Result<(), InputError> {
    check.require(!list.is_empty(), key, "empty", "at least one value is needed")?;
    let twice = list.iter().enumerate().any(|(k, value)| list[..k].contains(value));
    check.require(!twice, key, format!("{list:?}"), "each value may stand there once")
}
