//! States of a scene on its way: left by one run, started from by many trials.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::experiment::record::{StateDigest, Variant, Window};
use crate::scene::{Scene, snapshot};

/// What decides the states of a run: two experiments with the same key can start from the same ones.
#[derive(Debug, Clone, PartialEq)]
pub struct StatesKey {
    /// Name or file.
    pub scene: String,
    pub sets: Vec<String>,
    pub tolerance: f64,
}

/// The states of one run that windows need.
#[derive(Debug, Clone)]
pub struct States {
    pub key: StatesKey,
    scene_name: String,
    particle_distance_m: f64,
    /// Steps after which windows start, 0 left out.
    pub start_steps: BTreeSet<usize>,
    /// Steps after which they end.
    pub end_steps: BTreeSet<usize>,
}

impl States {
    /// The place of the states with this key in `all`, with those that `windows` need added.
    pub fn needed(all: &mut Vec<States>, key: StatesKey, scene: &Scene, windows: &[Window]) -> usize {
        let place = all.iter().position(|states| states.key == key).unwrap_or_else(|| {
            all.push(States {
                key,
                scene_name: scene.name.clone(),
                particle_distance_m: scene.particle_distance_m,
                start_steps: BTreeSet::new(),
                end_steps: BTreeSet::new(),
            });
            all.len() - 1
        });
        all[place].start_steps.extend(windows.iter().map(|w| w.start_step).filter(|&step| step > 0));
        all[place].end_steps.extend(windows.iter().map(|w| w.end_step()));
        place
    }

    /// The last step that matters to any window.
    pub fn last_step(&self) -> usize {
        self.end_steps.last().copied().unwrap_or(0)
    }

    /// What the run that leaves the states computes with, as far as it decides them.
    pub fn variant(&self) -> Variant {
        Variant { cg_tolerance: self.key.tolerance, ..Variant::default() }
    }

    /// The folder of a run that holds the states.
    pub fn folder(&self, run: &Path) -> PathBuf {
        let name = |text: &str| -> String {
            text.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect()
        };
        let tolerance = format!("cg_tolerance={}", self.key.tolerance);
        let parts = std::iter::once(&self.scene_name).chain(&self.key.sets).chain([&tolerance]);
        run.join("states").join(parts.map(|part| name(part)).collect::<Vec<_>>().join("_"))
    }

    /// Whether every state lies in its folder.
    pub fn are_in(&self, run: &Path) -> bool {
        let folder = self.folder(run);
        self.start_steps.iter().all(|&step| folder.join(snapshot::file_name(step)).is_file())
    }

    /// Digests of the run's states that are known before any trial.
    pub fn known_digests(&self) -> Vec<StateDigest> {
        let embedded: KnownDigests = toml::from_str(include_str!("../../experiments/digests.toml"))
            .expect("the embedded digests are valid");
        let same_run = |known: &KnownDigest| {
            self.key.scene == known.scene
                && self.particle_distance_m == known.particle_distance_m
                && self.key.tolerance == known.cg_tolerance
                && self.key.sets.iter().all(|set| set.starts_with("particle_distance_m="))
        };
        let known = embedded.state.into_iter().filter(same_run);
        known.map(|known| StateDigest { step: known.step, digest: known.digest }).collect()
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct KnownDigests {
    state: Vec<KnownDigest>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct KnownDigest {
    scene: String,
    particle_distance_m: f64,
    cg_tolerance: f64,
    step: usize,
    digest: String,
}
