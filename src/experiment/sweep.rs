//! Sweeps: one scene with many settings, each varied alone around a baseline and then together at random.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::experiment::observed::ObservedRun;
use crate::experiment::record::{Variant, checked_tolerance};
use crate::experiment::spec::{Mode, check_list, check_name, scene_sets};

/// The settings that accuracy depends on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    pub particle_distance_m: f64,
    pub time_step_s: f64,
    pub cg_tolerance: f64,
}

/// Which setting differs from the baseline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Knob {
    Baseline,
    ParticleDistance,
    TimeStep,
    CgTolerance,
    /// Several, drawn at random.
    Several,
}

/// A scene and the settings to try.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    pub id: String,
    pub title: String,
    pub scene: String,
    #[serde(default = "Mode::every")]
    pub modes: Vec<Mode>,
    /// Changes to keys of the scene for all its runs.
    #[serde(default)]
    pub set: BTreeMap<String, toml::Value>,
    /// What a run is wrong by.
    pub error: ErrorOf,
    pub baseline: Settings,
    /// Values that each setting takes while the others stay at the baseline.
    pub particle_distance_m: Vec<f64>,
    pub time_step_s: Vec<f64>,
    pub cg_tolerance: Vec<f64>,
    /// Settings drawn at random from the lists, all at a time.
    pub random: Option<Random>,
    /// The finest run, which stands for the truth where no formula does.
    pub reference: Option<Settings>,
}

/// Where the error of a run comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorOf {
    /// The mean pressure profile against `rho g h`.
    PressureProfile,
    /// The front's course against that of the reference.
    Front,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Random {
    pub count: usize,
    pub seed: u64,
}

/// One setting of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The id of its observed run.
    pub run_id: String,
    pub knob: Knob,
    pub settings: Settings,
    pub is_reference: bool,
}

impl Settings {
    fn id(&self) -> String {
        format!("l0={},dt={},tol={:e}", self.particle_distance_m, self.time_step_s, self.cg_tolerance)
    }
}

impl Sweep {
    pub(super) fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let key = |name: &str| format!("{key}.{name}");
        check_name(check, &key("id"), &self.id)?;
        check_list(check, &key("particle_distance_m"), &self.particle_distance_m, true)?;
        check_list(check, &key("time_step_s"), &self.time_step_s, true)?;
        check_list(check, &key("cg_tolerance"), &self.cg_tolerance, true)?;
        let needs_reference = self.error == ErrorOf::Front;
        let allowed = "the error `front` needs a `reference`, and no other has one";
        check.require(
            self.reference.is_some() == needs_reference,
            &key("reference"),
            needs_reference,
            allowed,
        )?;
        for Setting { settings, .. } in self.settings() {
            check.positive(&key("particle_distance_m"), settings.particle_distance_m)?;
            check.positive(&key("time_step_s"), settings.time_step_s)?;
            checked_tolerance(check.file, settings.cg_tolerance)?;
        }
        Ok(())
    }

    /// Every setting once: the reference, the baseline, each knob's values, the random ones.
    pub fn settings(&self) -> Vec<Setting> {
        let base = self.baseline;
        let mut all: Vec<(Knob, Settings, bool)> = Vec::new();
        all.extend(self.reference.map(|settings| (Knob::Several, settings, true)));
        all.push((Knob::Baseline, base, false));
        let distances = self.particle_distance_m.iter();
        let distance = |&value: &f64| Settings { particle_distance_m: value, ..base };
        all.extend(distances.map(|value| (Knob::ParticleDistance, distance(value), false)));
        let time_step = |&value: &f64| Settings { time_step_s: value, ..base };
        all.extend(self.time_step_s.iter().map(|value| (Knob::TimeStep, time_step(value), false)));
        let tolerance = |&value: &f64| Settings { cg_tolerance: value, ..base };
        all.extend(self.cg_tolerance.iter().map(|value| (Knob::CgTolerance, tolerance(value), false)));
        all.extend(self.drawn().into_iter().map(|settings| (Knob::Several, settings, false)));
        let mut unique: Vec<Setting> = Vec::new();
        for (knob, settings, is_reference) in all {
            if unique.iter().all(|known| known.settings != settings) {
                let run_id = format!("{}/{}", self.id, settings.id());
                unique.push(Setting { run_id, knob, settings, is_reference });
            }
        }
        unique
    }

    fn drawn(&self) -> Vec<Settings> {
        let Some(Random { count, seed }) = self.random else {
            return Vec::new();
        };
        let mut random = fastrand::Rng::with_seed(seed);
        let mut draw = |values: &[f64], or: f64| random.choice(values).copied().unwrap_or(or);
        let base = self.baseline;
        (0..count)
            .map(|_| Settings {
                particle_distance_m: draw(&self.particle_distance_m, base.particle_distance_m),
                time_step_s: draw(&self.time_step_s, base.time_step_s),
                cg_tolerance: draw(&self.cg_tolerance, base.cg_tolerance),
            })
            .collect()
    }

    pub(super) fn runs(&self, fixed: &Variant) -> Vec<ObservedRun> {
        let run = |Setting { run_id, settings, .. }: Setting| {
            let own = BTreeMap::from([
                ("particle_distance_m".to_string(), toml::Value::Float(settings.particle_distance_m)),
                ("time_step_s".to_string(), toml::Value::Float(settings.time_step_s)),
            ]);
            ObservedRun {
                id: run_id,
                scene: self.scene.clone(),
                sets: scene_sets([&self.set, &own]),
                variant: Variant { cg_tolerance: settings.cg_tolerance, ..fixed.clone() },
            }
        };
        self.settings().into_iter().map(run).collect()
    }
}
