//! An experiment file: one question, what answers it, and how long each mode may take.
//!
//! Two kinds of answers may stand in one file. *Timed* cells ([`Factors`]) compute the same steps in several ways and
//! compare times. *Observed* runs ([`Case`], [`Sweep`]) simulate scenes from the start and look at what comes out.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::experiment::factors::Factors;
use crate::experiment::gate::Gate;
use crate::experiment::observed::{Case, ObservedRun, Scheme};
use crate::experiment::peaks::PeaksMeasurement;
use crate::experiment::record::{Stage, Variant};
use crate::experiment::selection::{CellSettings, Exclusion, Selection};
use crate::experiment::stopping::Rounds;
use crate::experiment::sweep::Sweep;
use crate::experiment::twin::spec::{TwinFactors, TwinMeasurement};
use crate::experiment::validation::{Validation, ValidationMeasurement};

/// The version of the experiment format.
pub const SCHEMA: u32 = 2;

/// More variants of a group, or cases with schemes, than anyone can measure.
const MOST_COMBINATIONS: usize = 10_000;

/// How much time a run may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
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
    pub const ALL: [Mode; 3] = [Mode::Quick, Mode::Default, Mode::Full];

    pub fn name(self) -> &'static str {
        match self {
            Mode::Quick => "quick",
            Mode::Default => "default",
            Mode::Full => "full",
        }
    }

    /// What a part of an experiment file that names no modes takes part in.
    pub fn every() -> Vec<Mode> {
        Mode::ALL.to_vec()
    }
}

/// One experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    pub schema: u32,
    /// The name in commands, files and cells: lower-case letters, digits and `-`.
    pub id: String,
    pub title: String,
    pub question: String,
    /// How to read the answer.
    pub analysis: String,
    /// An embedded scene's name or a scene file's path; what timed cells compute.
    pub scene: String,
    /// Seed of the order of trials and of variants within a step.
    pub seed: u64,
    /// Where threads are pinned: `off`, `close` or `spread`.
    #[serde(default = "close")]
    pub pin: String,
    /// The claims of the paper that it feeds, by id.
    #[serde(default)]
    pub claims: Vec<String>,
    /// Seconds after which a trial is stopped; eight times the plan's estimate, and two minutes at least, where left out.
    pub time_limit_s: Option<f64>,
    /// How quiet the machine must be when a round begins.
    pub gate: Option<Gate>,
    /// Groups of timed cells.
    #[serde(default)]
    pub factors: Vec<Factors>,
    /// What a group that does not vary a setting computes with; the paper's setting where left out.
    #[serde(default)]
    pub fixed: Variant,
    /// Timed cells that are left out, each with the reason.
    #[serde(default)]
    pub exclude: Vec<Exclusion>,
    /// Which timed cells the command asked for; all that fit each of these.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(skip)]
    pub filter: Vec<Selection>,
    /// Scenes to observe, each with every scheme.
    #[serde(default)]
    pub case: Vec<Case>,
    /// Changes to the scene with which every case is observed; where there is none, cases run as they are.
    #[serde(default)]
    pub scheme: Vec<Scheme>,
    /// Scenes to observe with many settings.
    #[serde(default)]
    pub sweep: Vec<Sweep>,
    /// The loop of the paper's Figure 3 in two languages.
    #[serde(default)]
    pub twin: Option<TwinFactors>,
    /// Cases with known answers.
    #[serde(default)]
    pub validation: Option<Validation>,
    /// What each mode measures.
    pub mode: Modes,
}

fn close() -> String {
    "close".to_string()
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Modes {
    pub quick: Measurement,
    pub default: Measurement,
    pub full: Measurement,
}

/// What one mode measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Measurement {
    /// Changes to keys of the timed cells' scene.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub scene: BTreeMap<String, toml::Value>,
    pub whole: Option<Whole>,
    pub paired: Option<Paired>,
    pub observed: Option<Observed>,
    pub twin: Option<TwinMeasurement>,
    pub validation: Option<ValidationMeasurement>,
    /// What the machine can do at most, for roofs above what phases reach.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peaks: Option<PeaksMeasurement>,
}

/// Whole runs, one variant a process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Whole {
    pub rounds: Rounds,
    /// Only these distance tests; all of the factors' when left out.
    pub distance_test: Option<Vec<String>>,
}

/// All variants of a group and thread count in one process, in lock step through windows of states.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Paired {
    pub rounds: Rounds,
    pub windows: Windows,
    pub warmup_steps: usize,
    pub steps: usize,
    /// Measures the first variant of each group twice: how far two equal cells lie apart is the noise floor.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub control: bool,
}

/// Which states of a run windows start from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number of windows, or a list of the steps after which they start")]
pub enum Windows {
    /// So many, spread evenly from early to late.
    Spread(usize),
    /// Those after these steps.
    After(Vec<usize>),
}

/// Why a cell is not measured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LeftOut {
    Excluded(String),
    Skipped(String),
}

/// Observed runs, each as often as there are rounds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Observed {
    pub rounds: usize,
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

    pub(super) fn check(&self, file: &str) -> Result<(), InputError> {
        let check = Check { file };
        let allowed = format!("this program reads schema {SCHEMA}");
        check.require(self.schema == SCHEMA, "schema", self.schema, allowed)?;
        check_name(check, "id", &self.id)?;
        let pin = self.pin.as_str();
        let allowed = "allowed are `off`, `close` or `spread`";
        check.require(matches!(pin, "off" | "close" | "spread"), "pin", pin, allowed)?;
        check_list(check, "claims", &self.claims, true)?;
        let limit_s = self.time_limit_s.unwrap_or(1.0);
        let allowed = "allowed are numbers above 0, up to 1e7 seconds";
        check.require(limit_s > 0.0 && limit_s <= 1e7, "time_limit_s", limit_s, allowed)?;
        if let Some(gate) = &self.gate {
            gate.check(check)?;
        }
        for (k, exclusion) in self.exclude.iter().enumerate() {
            exclusion.cells.check(check, &format!("exclude[{k}].where"))?;
            let allowed = "a reason is needed: it stands in the rows of the cells";
            check.require(!exclusion.reason.is_empty(), &format!("exclude[{k}].reason"), "empty", allowed)?;
        }
        for filter in &self.filter {
            filter.check(check, "filter")?;
        }
        self.fixed.options(file)?;
        let allowed = "a scheme belongs to a group of `[[factors]]`, not to all of them";
        check.require(self.fixed.scheme.is_empty(), "fixed.scheme", &self.fixed.scheme, allowed)?;
        let changes = self.fixed.scene_changes.len();
        let allowed = "changes to the scene belong to `scene` or a `[[scheme]]`";
        check.require(changes == 0, "fixed.scene_changes", changes, allowed)?;
        self.check_size(check)?;
        for (k, factors) in self.factors.iter().enumerate() {
            let key = format!("factors[{k}]");
            factors.check(check, &key, &self.variants(factors))?;
            for id in &factors.scheme {
                let known = self.scheme.iter().any(|scheme| scheme.id == *id);
                let allowed = "allowed are ids of a `[[scheme]]`";
                check.require(known, &format!("{key}.scheme"), format!("`{id}`"), allowed)?;
            }
        }
        for (k, case) in self.case.iter().enumerate() {
            case.check(check, &format!("case[{k}]"), &self.scheme)?;
        }
        let ids: Vec<&str> = self.scheme.iter().map(|scheme| scheme.id.as_str()).collect();
        check_list(check, "scheme.id", &ids, true)?;
        for id in ids {
            check_name(check, "scheme.id", id)?;
        }
        for (k, sweep) in self.sweep.iter().enumerate() {
            sweep.check(check, &format!("sweep[{k}]"))?;
        }
        if let Some(twin) = &self.twin {
            twin.check(check)?;
        }
        if let Some(validation) = &self.validation {
            validation.check(check)?;
        }
        for mode in Mode::ALL {
            self.check_mode(check, mode)?;
        }
        Ok(())
    }

    /// Refuses lists whose combinations nobody could measure, before they are made.
    fn check_size(&self, check: Check<'_>) -> Result<(), InputError> {
        let allowed = format!("allowed are up to {MOST_COMBINATIONS} combinations");
        for (k, factors) in self.factors.iter().enumerate() {
            let count = factors.combinations();
            check.require(count <= MOST_COMBINATIONS, &format!("factors[{k}]"), count, &allowed)?;
        }
        let runs = self.case.len().saturating_mul(self.scheme.len().max(1));
        check.require(runs <= MOST_COMBINATIONS, "case", runs, &allowed)
    }

    fn check_mode(&self, check: Check<'_>, mode: Mode) -> Result<(), InputError> {
        let measurement = self.measurement(mode);
        measurement.check(check, mode)?;
        let key = |name: &str| format!("mode.{}.{name}", mode.name());
        let timed = measurement.whole.is_some() || measurement.paired.is_some();
        let cells = self.groups(mode).next().is_some();
        let allowed = "`whole` or `paired` and `[[factors]]` belong together";
        check.require(timed == cells, &key("paired"), timed, allowed)?;
        let runs = self.observed_runs(mode);
        let allowed = "`observed` and `[[case]]` or `[[sweep]]` belong together";
        check.require(
            measurement.observed.is_some() != runs.is_empty(),
            &key("observed"),
            runs.len(),
            allowed,
        )?;
        let twin = measurement.twin.is_some();
        let allowed = "`twin` and the table `[twin]` belong together";
        check.require(!twin || self.twin.is_some(), &key("twin"), twin, allowed)?;
        let validation = measurement.validation.is_some();
        let allowed = "`validation` and the table `[validation]` belong together";
        check.require(!validation || self.validation.is_some(), &key("validation"), validation, allowed)?;
        check.require(
            timed || twin || validation || measurement.peaks.is_some() || !runs.is_empty(),
            &key("paired"),
            "missing",
            "a mode must measure something",
        )?;
        let names: Vec<&str> = self.groups(mode).map(|group| group.name.as_str()).collect();
        check_list(check, "factors.name", &names, names.is_empty())?;
        let ids: Vec<&str> = runs.iter().map(|run| run.id.as_str()).collect();
        check_list(check, "case.id", &ids, ids.is_empty())?;
        let tests = measurement.whole.iter().flat_map(|whole| whole.distance_test.iter().flatten());
        for test in tests {
            let known = self.groups(mode).flat_map(|group| self.variants(group));
            let known = known.into_iter().any(|variant| variant.distance_test == *test);
            let allowed = "allowed are distance tests of the factors";
            check.require(known, &key("whole.distance_test"), format!("`{test}`"), allowed)?;
        }
        Ok(())
    }

    pub fn measurement(&self, mode: Mode) -> &Measurement {
        match mode {
            Mode::Quick => &self.mode.quick,
            Mode::Default => &self.mode.default,
            Mode::Full => &self.mode.full,
        }
    }

    /// The groups of timed cells of a mode.
    pub fn groups(&self, mode: Mode) -> impl Iterator<Item = &Factors> {
        self.factors.iter().filter(move |group| group.modes.contains(&mode))
    }

    /// The ways to compute a step that a group compares.
    pub fn variants(&self, group: &Factors) -> Vec<Variant> {
        let mut variants = group.variants(&self.fixed);
        for variant in &mut variants {
            let scheme = self.scheme.iter().find(|scheme| scheme.id == variant.scheme);
            variant.scene_changes.extend(scheme.map(|scheme| scene_sets([&scheme.set])).unwrap_or_default());
        }
        variants
    }

    /// Why a cell is not measured, where it is not: the experiment excludes it, or the command did not ask for it.
    pub fn left_out(&self, cell: CellSettings<'_>) -> Option<LeftOut> {
        let excluded = self.exclude.iter().find(|exclusion| exclusion.cells.fits(cell));
        let excluded = excluded.map(|exclusion| LeftOut::Excluded(exclusion.reason.clone()));
        let unasked = || {
            let filter = self.filter.iter().find(|filter| !filter.fits(cell))?;
            Some(LeftOut::Skipped(format!("left out by the filter {}", filter.in_words())))
        };
        excluded.or_else(unasked)
    }

    /// The rounds of a stage; `None` where the mode has none, and for states, which are no round of measuring.
    pub fn rounds(&self, mode: Mode, stage: Stage) -> Option<Rounds> {
        let measurement = self.measurement(mode);
        match stage {
            Stage::States => None,
            Stage::Whole => measurement.whole.as_ref().map(|whole| whole.rounds),
            Stage::Paired => measurement.paired.as_ref().map(|paired| paired.rounds),
            Stage::Observed => measurement.observed.as_ref().map(|observed| Rounds::Fixed(observed.rounds)),
            Stage::Validation => measurement.validation.map(|_| Rounds::Fixed(1)),
            Stage::Twin => measurement.twin.as_ref().map(|twin| Rounds::Fixed(twin.rounds)),
            Stage::Peaks => measurement.peaks.map(|_| Rounds::Fixed(1)),
        }
    }

    /// Everything that a mode observes.
    pub fn observed_runs(&self, mode: Mode) -> Vec<ObservedRun> {
        let cases = self.case.iter().filter(|case| case.modes.contains(&mode));
        let sweeps = self.sweep.iter().filter(|sweep| sweep.modes.contains(&mode));
        let cases = cases.flat_map(|case| case.runs(&self.scheme, &self.fixed, mode));
        cases.chain(sweeps.flat_map(|sweep| sweep.runs(&self.fixed))).collect()
    }
}

impl Paired {
    /// The variants of one trial: those of a group and, where it is asked for, a second copy of the first.
    pub fn with_control(&self, mut variants: Vec<Variant>) -> Vec<Variant> {
        let first = variants.first().filter(|_| self.control);
        let copy = first.map(|first| Variant { control: true, ..first.clone() });
        variants.extend(copy);
        variants
    }
}

impl Windows {
    pub fn count(&self) -> usize {
        match self {
            Windows::Spread(count) => *count,
            Windows::After(steps) => steps.len(),
        }
    }
}

impl Measurement {
    fn check(&self, check: Check<'_>, mode: Mode) -> Result<(), InputError> {
        let key = |name: &str| format!("mode.{}.{name}", mode.name());
        let counts = "allowed are 1 to 10000";
        let mut found = Vec::new();
        if let Some(whole) = &self.whole {
            whole.rounds.check(check, &key("whole.rounds"))?;
        }
        found.extend(self.observed.iter().map(|observed| ("observed.rounds", observed.rounds)));
        if let Some(paired) = &self.paired {
            let warmup = paired.warmup_steps;
            check.require(warmup <= 10_000, &key("paired.warmup_steps"), warmup, "allowed are 0 to 10000")?;
            paired.rounds.check(check, &key("paired.rounds"))?;
            found.push(("paired.windows", paired.windows.count()));
            found.push(("paired.steps", paired.steps));
        }
        for (name, count) in found {
            check.require((1..=10_000).contains(&count), &key(name), count, counts)?;
        }
        self.peaks.map_or(Ok(()), |peaks| peaks.check(check, mode.name()))?;
        self.twin.map_or(Ok(()), |twin| twin.check(check, mode.name()))
    }
}

/// The changes to a scene as `key=value`, in the order in which they apply: table after table, and within one by key.
pub fn scene_sets<'a>(tables: impl IntoIterator<Item = &'a BTreeMap<String, toml::Value>>) -> Vec<String> {
    let mut sets = Vec::new();
    for (key, value) in tables.into_iter().flatten() {
        flatten(key, value, &mut sets);
    }
    sets
}

/// The value of every key below `key`, with dotted keys: setting a table as a whole would drop its other keys.
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

/// Refuses a name that would not do as part of a file's name.
pub fn check_name(check: Check<'_>, key: &str, name: &str) -> Result<(), InputError> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let named = !name.is_empty() && name.len() <= 40 && name.chars().all(plain);
    let allowed = "allowed are up to 40 lower-case letters, digits and `-`";
    check.require(named, key, format!("`{name}`"), allowed)
}

/// Refuses a list that names something twice or, unless it `may_be_empty`, nothing.
pub fn check_list<T: PartialEq + std::fmt::Debug>(
    check: Check<'_>,
    key: &str,
    list: &[T],
    may_be_empty: bool,
) -> Result<(), InputError> {
    check.require(may_be_empty || !list.is_empty(), key, "empty", "at least one value is needed")?;
    let twice = list.iter().enumerate().any(|(k, value)| list[..k].contains(value));
    check.require(!twice, key, format!("{list:?}"), "each value may stand there once")
}
