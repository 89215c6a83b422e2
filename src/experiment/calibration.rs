//! How fast this machine is, for the plan's estimates.

use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;

use crate::base::parallel::Workers;
use crate::engine::phase::NoProbe;
use crate::engine::preset::Preset;
use crate::engine::simulation::{self, Start};
use crate::experiment::record::Window;
use crate::scene::library;

/// Seconds that a particle takes in a step on this machine: measured, not assumed.
#[derive(Debug, Clone, Copy)]
pub struct Calibration {
    pub s_per_particle_step: f64,
}

impl Calibration {
    /// For plans that are only looked at: their estimates mean nothing.
    pub const TIMELESS: Calibration = Calibration { s_per_particle_step: 0.0 };

    /// Times two steps of the paper's dam break. A later, mixed state takes about a quarter longer than these.
    pub fn measure() -> Result<Self> {
        let scene = library::load("dam-break", &[])?;
        let particles = scene.particles("dam-break")?;
        let options = Preset::PAPER_LINKED_LIST.options();
        let workers = Arc::new(Workers::new(1, options.schedule, &[])?);
        let start = Start { particles: &particles, steps_done: 0 };
        let mut simulation = simulation::build(&scene.parameters(&particles), &options, start, workers)?;
        simulation.step(&mut NoProbe)?;
        let began = Instant::now();
        let steps = 2;
        for _ in 0..steps {
            simulation.step(&mut NoProbe)?;
        }
        let per_step = began.elapsed().as_secs_f64() / f64::from(steps);
        Ok(Calibration { s_per_particle_step: 1.25 * per_step / particles.len() as f64 })
    }

    /// Seconds for `steps` steps of `particles` particles each.
    pub fn stepping_s(self, particles: usize, threads: usize, steps: usize) -> f64 {
        let speed_up = 0.3 + 0.7 * threads as f64;
        (steps * particles) as f64 * self.s_per_particle_step / speed_up
    }

    /// Steps cost what was measured; each process and window pays a little to start.
    pub fn timed_s(self, particles: usize, threads: usize, variants: usize, windows: &[Window]) -> f64 {
        let steps: usize = windows.iter().map(|w| w.warmup_steps + w.steps).sum();
        let starting = 0.1 + (windows.len() * (variants + 2) * particles) as f64 * 1e-6;
        self.stepping_s(particles, threads, steps * variants) + starting
    }
}
