//! Validating cases as trials: which ones, how finely, and what each found.

use anyhow::{Context, Result, ensure};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::experiment::plan::{PlannedExperiment, PlannedRound, PlannedTrial, Work};
use crate::experiment::record::Stage;
use crate::experiment::spec::Mode;
use crate::scene::validation::{self, Case, Fidelity, Outcome};

/// The cases of an experiment, by name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Validation {
    /// Names of validating cases; all of them where the list is empty.
    pub cases: Vec<String>,
}

/// How finely a mode computes them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ValidationMeasurement {
    pub fidelity: NamedFidelity,
}

/// A fidelity by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NamedFidelity {
    /// Seconds a case.
    Coarse,
    /// Minutes a case.
    Full,
}

/// What a child process is asked to do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ValidationRequest {
    pub case: String,
    pub fidelity: NamedFidelity,
}

/// What a case found, as recorded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Validated {
    /// Why the case could not be computed to its end; empty where it was.
    pub error: String,
    pub found: Vec<Found>,
}

/// One comparison with a known answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Found {
    pub effect: String,
    pub case: String,
    /// With its unit.
    pub quantity: String,
    pub value: f64,
    pub reference: f64,
    pub error: f64,
    /// The largest error that passes; `None` for what is only reported.
    pub gate: Option<f64>,
    pub source: String,
}

impl Found {
    pub fn verdict(&self) -> &'static str {
        match self.gate {
            None => "reported",
            Some(gate) if self.error.abs() <= gate => "pass",
            Some(_) => "fail",
        }
    }
}

impl From<Outcome> for Found {
    fn from(outcome: Outcome) -> Found {
        Found {
            effect: outcome.effect.to_string(),
            case: outcome.case.to_string(),
            quantity: outcome.quantity.to_string(),
            value: outcome.value,
            reference: outcome.reference,
            error: outcome.error,
            gate: Some(outcome.gate).filter(|gate| gate.is_finite()),
            source: outcome.source.to_string(),
        }
    }
}

impl Validation {
    pub fn check(&self, check: Check<'_>) -> Result<(), InputError> {
        for (k, name) in self.cases.iter().enumerate() {
            let known: Vec<&str> = validation::CASES.iter().map(|case| case.name).collect();
            let allowed = format!("allowed are {}", known.join(", "));
            let key = format!("validation.cases[{k}]");
            check.require(known.contains(&name.as_str()), &key, format!("`{name}`"), allowed)?;
        }
        Ok(())
    }

    /// The cases in the order of the program's list.
    pub fn cases(&self) -> Vec<&'static Case> {
        let wanted = |case: &&Case| self.cases.is_empty() || self.cases.iter().any(|name| name == case.name);
        validation::CASES.iter().filter(wanted).collect()
    }
}

impl NamedFidelity {
    /// About how long a case takes, seconds.
    fn estimate_s(self) -> f64 {
        match self {
            NamedFidelity::Coarse => 5.0,
            NamedFidelity::Full => 60.0,
        }
    }
}

/// The one round that computes every case once: the answers are the same whenever they are computed.
pub fn round(experiment: &PlannedExperiment, index: usize, mode: Mode) -> Option<PlannedRound> {
    let validation = experiment.spec.validation.as_ref()?;
    let fidelity = experiment.spec.measurement(mode).validation?.fidelity;
    let trial = |case: &&Case| PlannedTrial {
        threads: 1,
        estimate_s: fidelity.estimate_s(),
        work: Work::Validation(ValidationRequest { case: case.name.to_string(), fidelity }),
    };
    let trials = validation.cases().iter().map(trial).collect();
    Some(PlannedRound { experiment: index, stage: Stage::Validation, round: 0, trials })
}

/// Computes a case. One that breaks down is an answer too: it failed.
pub fn run(request: &ValidationRequest) -> Result<Validated> {
    let case = validation::CASES.iter().find(|case| case.name == request.case);
    let case = case.with_context(|| format!("there is no validating case `{}`", request.case))?;
    let fidelity = match request.fidelity {
        NamedFidelity::Coarse => Fidelity::Coarse,
        NamedFidelity::Full => Fidelity::Full,
    };
    Ok(match (case.run)(fidelity) {
        Ok(found) => Validated { error: String::new(), found: found.into_iter().map(Found::from).collect() },
        Err(error) => Validated { error, found: Vec::new() },
    })
}

impl Validated {
    /// Refuses numbers that no case can have found.
    pub fn check(&self) -> Result<()> {
        ensure!(self.error.is_empty() != self.found.is_empty(), "a case found something, or says why not");
        for found in &self.found {
            let numbers = [found.value, found.reference, found.error, found.gate.unwrap_or(0.0)];
            ensure!(numbers.iter().all(|number| number.is_finite()), "{}: {numbers:?} cannot be", found.case);
        }
        Ok(())
    }
}
