//! Digests of whole runs that are known before any trial, from `experiments/digests.toml`.

use serde::Deserialize;

use crate::experiment::record::{StateDigest, Variant};
use crate::scene::{Scene, library};

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

/// The digests of `scene` as `variant` computes it.
pub fn known_digests(scene: &Scene, variant: &Variant) -> Vec<StateDigest> {
    let embedded: KnownDigests = toml::from_str(include_str!("../../experiments/digests.toml"))
        .expect("the embedded digests are valid");
    let same_run = |known: &KnownDigest| {
        let distance = format!("particle_distance_m={}", known.particle_distance_m);
        let answer = Variant { cg_tolerance: known.cg_tolerance, ..Variant::default() };
        variant.has_answer_of(&answer) && library::load(&known.scene, &[distance]).is_ok_and(|s| s == *scene)
    };
    let known = embedded.state.into_iter().filter(same_run);
    known.map(|known| StateDigest { step: known.step, digest: known.digest }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_same_run_has_a_known_digest() {
        let scene = |set: &str| library::load("dam-break", &[set.to_string()]).unwrap();
        let usual = Variant::default();
        assert_eq!(known_digests(&scene("particle_distance_m=0.0375"), &usual).len(), 1);
        assert_eq!(known_digests(&scene("particle_distance_m=0.03"), &usual), []);
        assert_eq!(known_digests(&scene("time_step_s=0.002"), &usual), []);
        let loose = Variant { cg_tolerance: 1e-4, ..usual };
        assert_eq!(known_digests(&scene("particle_distance_m=0.0375"), &loose), []);
    }
}
