//! What several tests need: the dam break, run as asked.
#![allow(dead_code)]

use std::sync::Arc;

use repro::base::parallel::Workers;
use repro::engine::phase::NoProbe;
use repro::engine::preset::{Options, Preset};
use repro::engine::simulation::{self, Simulation, Start, StepReport};
use repro::scene::{Scene, library};

/// A change to a preset's options.
pub type Change = fn(&mut Options);

/// How to run the dam break.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    pub l0: f64,
    pub steps: usize,
    pub preset: &'a str,
    pub threads: usize,
    pub schedule: &'a str,
    pub change: Change,
}

impl Default for Run<'_> {
    fn default() -> Self {
        Run {
            l0: 0.01875,
            steps: 0,
            preset: "paper-linked-list",
            threads: 1,
            schedule: "dynamic:64",
            change: |_| {},
        }
    }
}

pub fn dam_break(l0: f64) -> Scene {
    library::load("dam-break", &[format!("particle_distance_m={l0}")]).unwrap()
}

/// The simulation after its steps, and the report of the last one.
pub fn run_dam_break(run: &Run<'_>) -> (Box<dyn Simulation>, StepReport) {
    run_scene(&dam_break(run.l0), run)
}

pub fn run_scene(scene: &Scene, run: &Run<'_>) -> (Box<dyn Simulation>, StepReport) {
    let particles = scene.particles("test").unwrap();
    let mut options = run.preset.parse::<Preset>().unwrap().options();
    options.schedule = run.schedule.parse().unwrap();
    (run.change)(&mut options);
    let workers = Arc::new(Workers::new(run.threads, options.schedule, &[]).unwrap());
    let start = Start { particles: &particles, steps_done: 0 };
    let mut simulation = simulation::build(&scene.parameters(&particles), &options, start, workers).unwrap();
    let mut report = StepReport::default();
    for _ in 0..run.steps {
        report = simulation.step(&mut NoProbe).unwrap();
    }
    (simulation, report)
}
