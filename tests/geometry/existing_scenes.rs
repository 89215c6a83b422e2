//! The scenes that came before shapes: the same particles in the same order, to the last bit.

use repro::scene::library;
use sha2::{Digest, Sha256};

/// A hash of kinds, positions, velocities and pressures in order.
fn digest(scene: &str, sets: &[String]) -> (usize, String) {
    let particles = library::load(scene, sets).unwrap().particles(scene).unwrap();
    let mut hash = Sha256::new();
    for particle in &particles {
        hash.update(particle.kind.name());
        for number in particle.position.iter().chain(&particle.velocity).chain([&particle.pressure]) {
            hash.update(number.to_bits().to_le_bytes());
        }
    }
    (particles.len(), hash.finalize()[..8].iter().map(|byte| format!("{byte:02x}")).collect())
}

#[test]
fn existing_scenes_keep_every_bit() {
    let known = [
        ("dam-break", None, 30_976, "8a320e0625eb17da"),
        ("dam-break", Some(0.0375), 8_176, "571166d1090fe4b5"),
        ("dam-break", Some(0.025), 16_416, "c7c801a465083818"),
        ("dam-break", Some(0.075), 2680, "f021a8ba74e7d172"),
        ("still-water", None, 9120, "ad4d3343ba8d375b"),
        ("still-water", Some(0.01), 9120, "ad4d3343ba8d375b"),
        ("falling-block", None, 1000, "2747260aef9fe6da"),
        ("lone-particle", None, 1, "aa40fd306b5fbd55"),
        ("leaver", None, 217, "06e1f3222d8ab0a7"),
        ("coincident-pair", None, 127, "997c4a7277587922"),
    ];
    let found = known.map(|(scene, l0, _, _)| {
        let sets: Vec<String> = l0.iter().map(|l0: &f64| format!("particle_distance_m={l0}")).collect();
        let (count, hash) = digest(scene, &sets);
        (scene, l0, count, hash)
    });
    for ((scene, l0, count, hash), known) in found.iter().zip(known) {
        assert_eq!((*scene, *l0, *count, hash.as_str()), known);
    }
}
