//! Which cells are meant: the values that some of their settings may have.

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::experiment::record::Variant;

/// A setting that tells timed cells apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Setting {
    Group,
    Threads,
    Preset,
    DistanceTest,
    BucketsPerRadius,
    MemoryOrder,
    Storage,
    Schedule,
    Cg,
    CgTolerance,
    Preconditioner,
    MatrixValues,
    PairTerms,
    Scheme,
}

/// A value as a file writes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number or a text")]
pub enum Scalar {
    Number(f64),
    Text(String),
}

/// Cells whose every listed setting has one of the values listed for it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Selection(pub BTreeMap<Setting, Vec<Scalar>>);

/// Cells that an experiment leaves out, as rows that say why.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Exclusion {
    /// The cells: every setting named here has one of the values listed for it.
    #[serde(rename = "where")]
    pub cells: Selection,
    pub reason: String,
}

/// The settings of one timed cell.
#[derive(Debug, Clone, Copy)]
pub struct CellSettings<'a> {
    pub group: &'a str,
    pub threads: usize,
    pub variant: &'a Variant,
}

impl Setting {
    pub const ALL: [Setting; 14] = [
        Setting::Group,
        Setting::Threads,
        Setting::Preset,
        Setting::DistanceTest,
        Setting::BucketsPerRadius,
        Setting::MemoryOrder,
        Setting::Storage,
        Setting::Schedule,
        Setting::Cg,
        Setting::CgTolerance,
        Setting::Preconditioner,
        Setting::MatrixValues,
        Setting::PairTerms,
        Setting::Scheme,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Setting::Group => "group",
            Setting::Threads => "threads",
            Setting::Preset => "preset",
            Setting::DistanceTest => "distance_test",
            Setting::BucketsPerRadius => "buckets_per_radius",
            Setting::MemoryOrder => "memory_order",
            Setting::Storage => "storage",
            Setting::Schedule => "schedule",
            Setting::Cg => "cg",
            Setting::CgTolerance => "cg_tolerance",
            Setting::Preconditioner => "preconditioner",
            Setting::MatrixValues => "matrix_values",
            Setting::PairTerms => "pair_terms",
            Setting::Scheme => "scheme",
        }
    }

    fn of(self, cell: CellSettings<'_>) -> Scalar {
        let CellSettings { group, threads, variant } = cell;
        match self {
            Setting::Threads => Scalar::Number(threads as f64),
            Setting::BucketsPerRadius => Scalar::Number(variant.buckets_per_radius as f64),
            Setting::CgTolerance => Scalar::Number(variant.cg_tolerance),
            Setting::Group => Scalar::Text(group.to_string()),
            Setting::Preset => Scalar::Text(variant.preset.clone()),
            Setting::DistanceTest => Scalar::Text(variant.distance_test.clone()),
            Setting::MemoryOrder => Scalar::Text(variant.memory_order.clone()),
            Setting::Storage => Scalar::Text(variant.storage.clone()),
            Setting::Schedule => Scalar::Text(variant.schedule.clone()),
            Setting::Cg => Scalar::Text(variant.cg.clone()),
            Setting::Preconditioner => Scalar::Text(variant.preconditioner.clone()),
            Setting::MatrixValues => Scalar::Text(variant.matrix_values.clone()),
            Setting::PairTerms => Scalar::Text(variant.pair_terms.clone()),
            Setting::Scheme => Scalar::Text(variant.scheme.clone()),
        }
    }

    fn is_number(self) -> bool {
        matches!(self, Setting::Threads | Setting::BucketsPerRadius | Setting::CgTolerance)
    }
}

impl fmt::Display for Scalar {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Scalar::Number(number) => write!(f, "{number}"),
            Scalar::Text(text) => write!(f, "{text}"),
        }
    }
}

impl Selection {
    pub fn fits(&self, cell: CellSettings<'_>) -> bool {
        self.0.iter().all(|(setting, values)| values.contains(&setting.of(cell)))
    }

    /// The selection as it is written on the command line.
    pub fn in_words(&self) -> String {
        let words = |(setting, values): (&Setting, &Vec<Scalar>)| {
            let values: Vec<String> = values.iter().map(Scalar::to_string).collect();
            format!("{}={}", setting.name(), values.join(","))
        };
        self.0.iter().map(words).collect::<Vec<_>>().join(" ")
    }

    /// Refuses a selection of everything, and numbers for texts or texts for numbers, which could never fit.
    pub(super) fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check.require(!self.0.is_empty(), key, "empty", "at least one setting is needed")?;
        for (setting, values) in &self.0 {
            let key = format!("{key}.{}", setting.name());
            check.require(!values.is_empty(), &key, "empty", "at least one value is needed")?;
            for value in values {
                let number = matches!(value, Scalar::Number(_));
                let allowed = if setting.is_number() { "allowed are numbers" } else { "allowed are texts" };
                check.require(number == setting.is_number(), &key, value, allowed)?;
                let finite = !matches!(value, Scalar::Number(number) if !number.is_finite());
                check.require(finite, &key, value, "allowed are finite numbers")?;
            }
        }
        Ok(())
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

/// One setting and its values, as in `threads=1,2`.
impl FromStr for Selection {
    type Err = String;

    fn from_str(text: &str) -> Result<Selection, String> {
        let known = || Setting::ALL.map(Setting::name).join(", ");
        let (name, values) = text
            .split_once('=')
            .ok_or_else(|| format!("allowed are SETTING=VALUE,VALUE with a setting of: {}", known()))?;
        let setting = Setting::ALL
            .into_iter()
            .find(|setting| setting.name() == name)
            .ok_or_else(|| format!("`{name}` is no setting; allowed are {}", known()))?;
        let value = |text: &str| match setting.is_number() {
            true => number(text).map(Scalar::Number).ok_or_else(|| format!("`{text}` is no number")),
            false => Ok(Scalar::Text(text.to_string())),
        };
        let values = values.split(',').map(value).collect::<Result<Vec<_>, _>>()?;
        Ok(Selection(BTreeMap::from([(setting, values)])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_fits_if_every_listed_setting_does() {
        let variant = Variant { preset: "paper-linked-list".to_string(), ..Variant::default() };
        let cell = CellSettings { group: "", threads: 2, variant: &variant };
        let fits = |text: &str| text.parse::<Selection>().unwrap().fits(cell);
        assert!(fits("threads=1,2") && fits("preset=paper-linked-list") && fits("cg_tolerance=1e-8"));
        assert!(!fits("threads=1") && !fits("preset=paper-aos-relocation") && !fits("group=large"));
        assert!(Selection::default().fits(cell));
    }

    #[test]
    fn what_is_no_setting_is_refused_with_those_that_are() {
        for text in ["threads", "cores=2", "threads=many", "threads=nan", "cg_tolerance=inf"] {
            let error = text.parse::<Selection>().unwrap_err();
            assert!(error.contains("threads") || error.contains("is no number"), "{error}");
        }
    }

    #[test]
    fn names_are_those_of_files() {
        for setting in Setting::ALL {
            assert_eq!(serde_json::to_value(setting).unwrap(), setting.name());
        }
    }
}
