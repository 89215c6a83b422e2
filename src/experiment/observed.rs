//! Observed runs: a scene simulated from its start, and the numbers that mean that it went well.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::experiment::quantity::Quantity;
use crate::experiment::record::Variant;
use crate::experiment::spec::{Mode, check_list, check_name, scene_sets};

/// A scene to observe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Case {
    pub id: String,
    pub title: String,
    pub scene: String,
    #[serde(default = "Mode::every")]
    pub modes: Vec<Mode>,
    /// Changes to keys of the scene.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub set: BTreeMap<String, toml::Value>,
    /// Further changes in the quick mode.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub quick: BTreeMap<String, toml::Value>,
    /// Ids of the schemes it is observed with; all when left out.
    pub schemes: Option<Vec<String>>,
    /// The numbers that mean that the run passed. A run that breaks down fails all of them.
    #[serde(default)]
    pub pass: Vec<Criterion>,
    /// The error with which the run must end to pass, where it must not go on: `coincident`, `not_finite` or `solver`.
    pub must_end_with: Option<String>,
}

/// Bounds of a quantity, both included.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Criterion {
    pub quantity: Quantity,
    pub at_least: Option<f64>,
    pub at_most: Option<f64>,
}

/// Changes to a scene that every case is tried with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scheme {
    pub id: String,
    pub title: String,
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub set: BTreeMap<String, toml::Value>,
}

/// One run to observe, with all changes worked in.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedRun {
    /// Unique within the experiment: the case and, where there are schemes, the scheme; or the sweep and its settings.
    pub id: String,
    pub scene: String,
    pub sets: Vec<String>,
    pub variant: Variant,
}

impl Criterion {
    pub fn holds_for(&self, value: f64) -> bool {
        self.at_least.is_none_or(|least| value >= least) && self.at_most.is_none_or(|most| value <= most)
    }

    pub fn in_words(&self) -> String {
        let shown = |b: f64| if b != 0.0 && b.abs() < 1e-3 { format!("{b:e}") } else { b.to_string() };
        let bound = match (self.at_least, self.at_most) {
            (Some(least), Some(most)) if least == most => format!("exactly {}", shown(least)),
            (Some(least), Some(most)) => format!("from {} to {}", shown(least), shown(most)),
            (Some(least), None) => format!("at least {}", shown(least)),
            (None, Some(0.0)) => "none".to_string(),
            (None, Some(most)) => format!("at most {}", shown(most)),
            (None, None) => "any".to_string(),
        };
        format!("{}: {bound}", self.quantity.in_words())
    }
}

impl Case {
    pub(super) fn check(&self, check: Check<'_>, key: &str, schemes: &[Scheme]) -> Result<(), InputError> {
        check_name(check, &format!("{key}.id"), &self.id)?;
        check_list(check, &format!("{key}.modes"), &self.modes, false)?;
        let both = self.must_end_with.is_some() && !self.pass.is_empty();
        let allowed = "a run that must end with an error has no numbers to pass";
        check.require(!both, &format!("{key}.pass"), self.pass.len(), allowed)?;
        for id in self.schemes.iter().flatten() {
            let known = schemes.iter().any(|scheme| scheme.id == *id);
            check.require(
                known,
                &format!("{key}.schemes"),
                format!("`{id}`"),
                "allowed are ids of a `[[scheme]]`",
            )?;
        }
        if let Some(ids) = &self.schemes {
            check_list(check, &format!("{key}.schemes"), ids, false)?;
        }
        for criterion in &self.pass {
            let bounded = criterion.at_least.is_some() || criterion.at_most.is_some();
            let quantity = criterion.quantity.name();
            check.require(bounded, &format!("{key}.pass"), quantity, "`at_least` or `at_most` is needed")?;
            let (least, most) = (criterion.at_least, criterion.at_most);
            let possible = least.zip(most).is_none_or(|(least, most)| least <= most);
            check.require(
                possible,
                &format!("{key}.pass"),
                quantity,
                "`at_least` may not exceed `at_most`",
            )?;
        }
        let known = ["coincident", "not_finite", "solver"];
        if let Some(error) = &self.must_end_with {
            let allowed = format!("allowed are {}", known.join(", "));
            check.require(
                known.contains(&error.as_str()),
                &format!("{key}.must_end_with"),
                error,
                allowed,
            )?;
        }
        Ok(())
    }

    /// The case with each of its schemes.
    pub(super) fn runs(&self, schemes: &[Scheme], fixed: &Variant, mode: Mode) -> Vec<ObservedRun> {
        let none = BTreeMap::new();
        let quick = if mode == Mode::Quick { &self.quick } else { &none };
        let run = |id: String, changes: &BTreeMap<String, toml::Value>| ObservedRun {
            id,
            scene: self.scene.clone(),
            sets: scene_sets([&self.set, quick, changes]),
            variant: fixed.clone(),
        };
        if schemes.is_empty() {
            return vec![run(self.id.clone(), &none)];
        }
        self.schemes_of(schemes).map(|scheme| run(self.run_id(scheme), &scheme.set)).collect()
    }

    /// The schemes that the case is observed with.
    pub fn schemes_of<'a>(&'a self, schemes: &'a [Scheme]) -> impl Iterator<Item = &'a Scheme> {
        let wanted = |scheme: &&Scheme| self.schemes.as_ref().is_none_or(|ids| ids.contains(&scheme.id));
        schemes.iter().filter(wanted)
    }

    /// The id of the case's run with a scheme.
    pub fn run_id(&self, scheme: &Scheme) -> String {
        format!("{}/{}", self.id, scheme.id)
    }
}
