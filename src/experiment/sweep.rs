//! Sweeps: one scene with many settings, each varied alone around a baseline and then together at random.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::experiment::observed::ObservedRun;
use crate::experiment::record::{Variant, checked_tolerance};
use crate::experiment::spec::{Mode, check_list, check_name, scene_sets};

/// The settings that accuracy depends on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    pub id: String,
    pub title: String,
    pub scene: String,
    #[serde(default = "Mode::every")]
    pub modes: Vec<Mode>,
    /// Changes to keys of the scene for all its runs.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ErrorOf {
    /// The mean pressure profile against `rho g h`.
    PressureProfile,
    /// The front's course against that of the reference.
    Front,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
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
        format!("l0={} dt={} tol={:e}", self.particle_distance_m, self.time_step_s, self.cg_tolerance)
    }
}

impl Sweep {
    pub(super) fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let key = |name: &str| format!("{key}.{name}");
        check_name(check, &key("id"), &self.id)?;
        check_list(check, &key("modes"), &self.modes, false)?;
        let count = self.random.map_or(0, |random| random.count);
        check.require(count <= 1000, &key("random.count"), count, "allowed are 0 to 1000")?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::particles::Kind;
    use crate::experiment::library::load;
    use crate::scene::library;

    /// Otherwise a sweep would measure how the lattice rounds the fluid's extent.
    #[test]
    fn all_runs_of_a_sweep_simulate_the_same_water() {
        for sweep in load("accuracy-cost").unwrap().sweep {
            let runs = sweep.runs(&Variant::default());
            let distances = sweep.settings().into_iter().map(|setting| setting.settings.particle_distance_m);
            let litres = runs.iter().zip(distances).map(|(run, distance)| {
                let particles = library::load(&run.scene, &run.sets).unwrap().particles("test").unwrap();
                let fluid = particles.iter().filter(|p| p.kind == Kind::Fluid).count();
                1e3 * fluid as f64 * distance.powi(3)
            });
            let litres: Vec<f64> = litres.collect();
            assert!(litres.iter().all(|l| (l / litres[0] - 1.0).abs() < 1e-9), "{}: {litres:?}", sweep.id);
        }
    }

    #[test]
    fn every_setting_stands_there_once_the_reference_first() {
        let sweep = load("accuracy-cost").unwrap().sweep.into_iter().find(|s| s.reference.is_some()).unwrap();
        let settings = sweep.settings();
        assert!(settings[0].is_reference && settings[1].settings == sweep.baseline);
        let ids = settings.iter().map(|s| s.run_id.clone()).collect::<std::collections::BTreeSet<_>>();
        assert_eq!(ids.len(), settings.len());
        assert_eq!(settings, sweep.settings(), "random settings are the same every time");
    }
}
