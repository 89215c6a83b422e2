//! A run that goes on from a file ends in the same bits as one that was never stopped, and no other file is taken.

mod common;

use std::fs;
use std::sync::Arc;

use repro::base::parallel::Workers;
use repro::base::schedule::Schedule;
use repro::engine::diagnostics::digest;
use repro::engine::phase::NoProbe;
use repro::engine::preset::Preset;
use repro::engine::simulation::{self, Simulation, Start};
use repro::scene::{Scene, checkpoint, library};

fn build(scene: &Scene, preset: Preset) -> Box<dyn Simulation> {
    let particles = scene.particles("test").unwrap();
    let workers = Arc::new(Workers::new(2, Schedule::Static, &[]).unwrap());
    let start = Start { particles: &particles, steps_done: 0 };
    simulation::build(&scene.parameters(&particles), &preset.options(), start, workers).unwrap()
}

fn advance(simulation: &mut dyn Simulation, steps: usize) {
    for _ in 0..steps {
        simulation.step(&mut NoProbe).unwrap();
    }
}

/// The dam break, coarse, with steps of one length or adaptive ones, and what a run of so many steps ends in.
fn scene(sets: &[&str]) -> Scene {
    let coarse = ["particle_distance_m=0.0375"].into_iter().chain(sets.iter().copied());
    library::load("dam-break", &coarse.map(String::from).collect::<Vec<_>>()).unwrap()
}

const ADAPTIVE: [&str; 2] = ["adaptive_time_step.courant=0.3", "adaptive_time_step.shortest_s=1e-6"];

#[test]
fn a_restarted_run_ends_in_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("state.checkpoint");
    let mut random = fastrand::Rng::new();
    for sets in [&[][..], &ADAPTIVE] {
        let scene = scene(sets);
        let parameters = scene.parameters(&scene.particles("test").unwrap());
        let stop = random.usize(1..40);
        let mut whole = build(&scene, Preset::PAPER_LINKED_LIST);
        advance(&mut *whole, stop);
        checkpoint::write(&file, &mut *whole, &parameters).unwrap();
        advance(&mut *whole, 40 - stop);
        let mut restarted = build(&scene, Preset::PAPER_AOS_RELOCATION);
        checkpoint::restore(&file, &mut *restarted, &parameters).unwrap();
        let report = restarted.step(&mut NoProbe).unwrap();
        assert_eq!(report.step, stop + 1);
        advance(&mut *restarted, 40 - stop - 1);
        assert_eq!(digest(restarted.particles()), digest(whole.particles()), "stopped after {stop} steps");
    }
}

#[test]
fn other_files_are_refused_and_leave_the_simulation_alone() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("state.checkpoint");
    let scene = scene(&[]);
    let parameters = scene.parameters(&scene.particles("test").unwrap());
    let mut simulation = build(&scene, Preset::PAPER_LINKED_LIST);
    advance(&mut *simulation, 2);
    checkpoint::write(&file, &mut *simulation, &parameters).unwrap();
    let good = fs::read(&file).unwrap();
    let before = digest(simulation.particles());
    let mut refused = |bytes: &[u8], word: &str| {
        fs::write(&file, bytes).unwrap();
        let error = checkpoint::restore(&file, &mut *simulation, &parameters).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("state.checkpoint"), "{error}");
        assert_eq!(digest(simulation.particles()), before);
    };
    refused(b"", "no checkpoint");
    refused(b"id,kind,x_m\n", "no checkpoint");
    for length in [9, 60, good.len() / 2, good.len() - 1] {
        refused(&good[..length], "cut off or changed");
    }
    let mut changed = good.clone();
    changed[good.len() / 3] ^= 1;
    refused(&changed, "cut off or changed");
    fs::write(&file, &good).unwrap();
    let other = library::load("dam-break", &["particle_distance_m=0.05".to_string()]).unwrap();
    let others = other.parameters(&other.particles("test").unwrap());
    let mut another = build(&other, Preset::PAPER_LINKED_LIST);
    let error = checkpoint::restore(&file, &mut *another, &others).unwrap_err().to_string();
    assert!(error.contains("another scene"), "{error}");
}

/// Steps follow the flow, and one that goes too far is taken back.
#[test]
fn adaptive_steps_keep_the_courant_number_and_are_redone() {
    let scene =
        scene(&["adaptive_time_step.courant=0.2", "adaptive_time_step.shortest_s=1e-7", "time_step_s=0.02"]);
    let mut simulation = build(&scene, Preset::PAPER_AOS_RELOCATION);
    let (mut redone, mut shortest) = (0, f64::INFINITY);
    let mut last = simulation.step(&mut NoProbe).unwrap();
    for _ in 0..120 {
        let before = last.time_s;
        last = simulation.step(&mut NoProbe).unwrap();
        assert!((last.time_s - before - last.time_step_s).abs() < 1e-15);
        let speed2 = simulation.particles().velocity.iter().map(|u| u.iter().map(|c| c * c).sum::<f64>());
        let courant = speed2.fold(0.0, f64::max).sqrt() * last.time_step_s / 0.0375;
        assert!(courant <= 0.4 + 1e-12, "step {}: {courant}", last.step);
        redone += last.redone;
        shortest = last.time_step_s.min(shortest);
    }
    assert!(
        shortest < 0.01 && last.time_s > 0.1,
        "{redone} redone, shortest {shortest} s, {} s",
        last.time_s
    );
}
