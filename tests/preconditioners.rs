//! Each preconditioner gives the pressures of plain conjugate gradients, in how many iterations, from real flows.

mod common;

use std::sync::Arc;

use common::{Run, dam_break, run_scene};
use repro::base::parallel::Workers;
use repro::engine::particles::InitialParticle;
use repro::engine::phase::NoProbe;
use repro::engine::preset::{Options, Preset};
use repro::engine::pressure::PressureReport;
use repro::engine::pressure::preconditioner::Preconditioning;
use repro::engine::pressure::values::MatrixValues;
use repro::engine::simulation::{self, Simulation, Start};
use repro::scene::Scene;

/// A state of a flow, from which the next step is computed in several ways.
struct Flow {
    scene: Scene,
    particles: Vec<InitialParticle>,
    steps: usize,
}

impl Flow {
    fn after(scene: Scene, steps: usize) -> Flow {
        let run = Run { steps, threads: 2, preset: "general", ..Run::default() };
        let (simulation, _) = run_scene(&scene, &run);
        let particles = state(simulation.as_ref());
        Flow { scene, particles, steps }
    }

    /// The next step's pressures, and what its solve took.
    fn step(&self, threads: usize, change: impl FnOnce(&mut Options)) -> (Vec<f64>, PressureReport) {
        let mut options = Preset::GENERAL.options();
        change(&mut options);
        let workers = Arc::new(Workers::new(threads, options.schedule, &[]).unwrap());
        let start = Start { particles: &self.particles, steps_done: self.steps };
        let parameters = self.scene.parameters(&self.particles);
        let mut simulation = simulation::build(&parameters, &options, start, workers).unwrap();
        let report = simulation.step(&mut NoProbe).unwrap();
        (simulation.particles().pressure.clone(), report.pressure.unwrap())
    }
}

fn state(simulation: &dyn Simulation) -> Vec<InitialParticle> {
    let particles = simulation.particles();
    let one = |i: usize| InitialParticle {
        velocity: particles.velocity[i],
        pressure: particles.pressure[i],
        group: particles.group_of(i),
        ..InitialParticle::at_rest(particles.kind[i], particles.position[i])
    };
    (0..particles.len()).map(one).collect()
}

/// The largest difference over the largest value.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let largest = b.iter().fold(0.0, |largest: f64, p| largest.max(p.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest
}

#[test]
fn explore() {
    for l0 in [0.0375, 0.01875] {
        let flow = Flow::after(dam_break(l0), 60);
        let (exact, _) = flow.step(1, |o| o.cg.tolerance = 1e-13);
        for name in Preconditioning::ALL {
            let (p, solve) = flow.step(1, |o| o.cg.preconditioner = name);
            println!(
                "{l0} {name}: {} of {}, {:e}, {:e}",
                solve.cg.iterations,
                solve.unknowns,
                solve.cg.residual,
                difference(&p, &exact)
            );
        }
        let (p, solve) = flow.step(1, |o| {
            o.matrix_values = MatrixValues::F32;
            o.cg.tolerance = 1e-13;
        });
        println!(
            "{l0} f32: {} of {}, {:e}, {:e}",
            solve.cg.iterations,
            solve.unknowns,
            solve.cg.residual,
            difference(&p, &exact)
        );
    }
}
