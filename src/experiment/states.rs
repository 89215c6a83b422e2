//! States of a scene on its way: left by one run, started from by many trials.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::experiment::known::known_digests;
use crate::experiment::record::{StateDigest, Variant, Window};
use crate::scene::{Scene, snapshot};

/// The states of one run that windows need. Two experiments with the same scene and tolerance start from the same ones.
#[derive(Debug, Clone)]
pub struct States {
    scene: Scene,
    cg_tolerance: f64,
    /// Steps after which windows start, 0 left out.
    pub start_steps: BTreeSet<usize>,
    /// Steps after which they end.
    pub end_steps: BTreeSet<usize>,
}

impl States {
    /// The place in `all` of the states of `scene` to this tolerance, with those that `windows` need added.
    pub fn needed(all: &mut Vec<States>, scene: &Scene, cg_tolerance: f64, windows: &[Window]) -> usize {
        let same = |states: &States| states.scene == *scene && states.cg_tolerance == cg_tolerance;
        let place = all.iter().position(same).unwrap_or_else(|| {
            let (start_steps, end_steps) = (BTreeSet::new(), BTreeSet::new());
            all.push(States { scene: scene.clone(), cg_tolerance, start_steps, end_steps });
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
        Variant { cg_tolerance: self.cg_tolerance, ..Variant::default() }
    }

    /// The folder of a run that holds the states, named by the scene and a hash of all that decides them.
    pub fn folder(&self, run: &Path) -> PathBuf {
        let name: String =
            self.scene.name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        let hash = Sha256::digest(format!("{:?} {}", self.scene, self.cg_tolerance));
        let hash: String = hash.iter().take(6).map(|byte| format!("{byte:02x}")).collect();
        run.join("states").join(format!("{name}-{hash}"))
    }

    /// Whether every state lies in its folder.
    pub fn are_in(&self, run: &Path) -> bool {
        let folder = self.folder(run);
        self.start_steps.iter().all(|&step| folder.join(snapshot::file_name(step)).is_file())
    }

    /// Digests of the run's states that are known before any trial.
    pub fn known_digests(&self) -> Vec<StateDigest> {
        known_digests(&self.scene, &self.variant())
    }
}
