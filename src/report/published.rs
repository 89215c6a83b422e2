//! The paper's numbers, from `paper/published.toml`.

use serde::Deserialize;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    pub particles: usize,
    pub steps: usize,
    pub time_step_s: f64,
    pub machine: String,
    pub table2: Table2,
    pub figure4: Figure4,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table2 {
    pub linked_list: Seconds,
    pub aos_relocation: Seconds,
    pub speed_up: Ratios,
}

/// Seconds of a whole run.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Seconds {
    pub cg_s: f64,
    pub non_cg_s: f64,
    pub total_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ratios {
    pub cg: f64,
    pub non_cg: f64,
    pub total: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure4 {
    pub threads: usize,
    pub total_speed_up: f64,
    pub non_cg_speed_up: f64,
}

impl Published {
    pub fn load() -> Published {
        toml::from_str(include_str!("../../paper/published.toml"))
            .expect("the embedded numbers of the paper are valid")
    }
}
