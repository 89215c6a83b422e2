//! Whatever effects a scene names, a run that goes on from a file ends in the bits of one that was never stopped.

#[path = "common/toy.rs"]
mod toy;

use std::sync::Arc;

use repro::base::parallel::Workers;
use repro::base::schedule::Schedule;
use repro::engine::diagnostics::digest;
use repro::engine::phase::NoProbe;
use repro::engine::preset::Preset;
use repro::engine::simulation::{self, Simulation, Start};
use repro::scene::spec::effects::EffectsSpec;
use repro::scene::{Scene, checkpoint, library};
use toy::{TOYS, Toy};

const STEPS: usize = 24;
/// Draws the steps after which runs are stopped; `REPRO_RESTART_SEED` names another one.
const SEED: u64 = 20_140_613;
const FIXED: &[&str] = &["adaptive_time_step=false"];
const ADAPTIVE: &[&str] = &["adaptive_time_step.courant=0.2", "adaptive_time_step.shortest_s=1e-9"];

fn build(scene: &Scene, threads: usize) -> Box<dyn Simulation> {
    let particles = scene.particles("test").unwrap();
    let workers = Arc::new(Workers::new(threads, Schedule::Static, &[]).unwrap());
    let start = Start { particles: &particles, steps_done: 0 };
    let options = Preset::GENERAL.options();
    simulation::build(&scene.parameters(&particles), &options, start, workers).unwrap()
}

fn advance(simulation: &mut dyn Simulation, steps: usize, what: &str) {
    for _ in 0..steps {
        simulation.step(&mut NoProbe).unwrap_or_else(|error| panic!("{what}: {error}"));
    }
}

/// Everything that the next step depends on, not the particles alone.
fn whole_state(simulation: &mut dyn Simulation) -> String {
    let mut text = digest(simulation.particles());
    simulation.visit(&mut |name, column| text += &format!("\n{name} {column:?}"));
    text
}

fn stopped_and_restarted(toy: Toy, stepping: &[&str], stop: usize) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("state.checkpoint");
    let scene = toy::load(toy, stepping);
    let what = format!("{} with {:?} {stepping:?}, stopped after {stop} steps", toy.0, toy.1);
    let parameters = scene.parameters(&scene.particles("test").unwrap());
    let mut whole = build(&scene, 2);
    advance(&mut *whole, stop, &what);
    checkpoint::write(&file, &mut *whole, &parameters).unwrap();
    advance(&mut *whole, STEPS - stop, &what);
    let mut restarted = build(&scene, 1);
    checkpoint::restore(&file, &mut *restarted, &parameters).unwrap();
    advance(&mut *restarted, STEPS - stop, &what);
    assert!(whole_state(&mut *restarted) == whole_state(&mut *whole), "{what}");
}

#[test]
fn every_scene_goes_on_to_the_same_bits_with_equal_and_adaptive_steps() {
    let seed = std::env::var("REPRO_RESTART_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(SEED);
    println!("REPRO_RESTART_SEED={seed}");
    let mut random = fastrand::Rng::with_seed(seed);
    for &toy in TOYS {
        let adapts = library::load(toy.0, &[]).unwrap().adaptive_time_step.is_some();
        let fixed = if adapts { FIXED } else { &[] };
        for stepping in [fixed, ADAPTIVE] {
            stopped_and_restarted(toy, stepping, random.usize(1..STEPS));
        }
    }
}

/// So that an effect without a scene of its own is not forgotten above.
#[test]
fn the_scenes_name_every_effect_between_them() {
    let named: Vec<&str> = TOYS.iter().flat_map(|&toy| toy::load(toy, &[]).effects.named()).collect();
    for effect in EffectsSpec::NAMES {
        assert!(named.contains(effect), "no scene of tests/common/toy.rs names `{effect}`");
    }
    // It must end in its first step.
    for scene in library::names().filter(|scene| *scene != "coincident-pair") {
        assert!(TOYS.iter().any(|(name, _)| *name == scene), "tests/common/toy.rs lacks `{scene}`");
    }
}
