//! Periodic axes and planes: the same flow wherever the period is cut, by every search.

use std::sync::Arc;

use repro::base::parallel::Workers;
use repro::base::schedule::Schedule;
use repro::engine::effects::viscosity::Viscosity;
use repro::engine::kernel::Dimensions;
use repro::engine::parameters::{Domain, Effects, Parameters, Radii};
use repro::engine::particles::{InitialParticle, Kind};
use repro::engine::phase::NoProbe;
use repro::engine::preset::{Preset, Search};
use repro::engine::simulation::{self, Start};

const L0: f64 = 0.1;
const N: i32 = 12;

fn parameters() -> Parameters {
    let (low, high) = ([-0.05, -0.05, 0.0], [-0.05 + L0 * f64::from(N), -0.05 + L0 * f64::from(N), 0.0]);
    Parameters {
        dimensions: Dimensions::Two,
        particle_distance_m: L0,
        time_step_s: 1e-3,
        adaptive: None,
        density_kg_m3: 1000.0,
        radii: Radii { number_density: 2.1, gradient: 2.1, laplacian: 3.1 },
        domain: Domain { periodic: [true, true, false], ..Domain::new(low, high) },
        groups: Vec::new(),
        effects: Effects { viscosity: Some(Viscosity::uniform(0.5)), ..Effects::default() },
    }
}

/// Shear that varies as a sine along y, on the lattice: the discrete Laplacian has it as an eigenvector, so that every
/// particle, wherever the period is cut, decays by the same factor.
fn shear() -> Vec<InitialParticle> {
    let mut particles = Vec::new();
    for i in 0..N {
        for j in 0..N {
            let u = (std::f64::consts::TAU * f64::from(j) / f64::from(N)).sin();
            let position = [L0 * f64::from(i), L0 * f64::from(j), 0.0];
            particles.push(InitialParticle {
                velocity: [1e-6 * u, 0.0, 0.0],
                ..InitialParticle::at_rest(Kind::Fluid, position)
            });
        }
    }
    particles
}

#[test]
fn a_sine_decays_by_one_factor_everywhere_with_every_search() {
    let particles = shear();
    let mut decays: Vec<f64> = Vec::new();
    for preset in Preset::all() {
        let workers = Arc::new(Workers::new(2, Schedule::Static, &[]).unwrap());
        let start = Start { particles: &particles, steps_done: 0 };
        let mut simulation = simulation::build(&parameters(), &preset.options(), start, workers).unwrap();
        simulation.step(&mut NoProbe).unwrap();
        let velocity = &simulation.particles().velocity;
        let decay = velocity[1][0] / particles[1].velocity[0];
        for (u, start) in velocity.iter().zip(&particles) {
            assert!((u[0] - decay * start.velocity[0]).abs() < 1e-18, "{u:?}");
        }
        if preset.options().search == Search::BruteForce {
            assert!((decay - decays[0]).abs() < 1e-12);
        } else {
            decays.push(decay);
            assert_eq!(decay, decays[0], "{preset}: all searches by buckets sum in one order");
        }
    }
    // exp(-nu k^2 dt) with k = 2 pi / 1.2 m, to the error of twelve particles a wave.
    let exact = (-0.5 * (std::f64::consts::TAU / 1.2).powi(2) * 1e-3f64).exp();
    assert!((decays[0] - exact).abs() < 0.1 * (1.0 - exact), "{} {exact}", decays[0]);
}

#[test]
fn particles_come_in_again_at_the_other_end() {
    let thrown = InitialParticle {
        velocity: [40.0, -70.0, 0.0],
        ..InitialParticle::at_rest(Kind::Fluid, [1.1, 0.0, 0.0])
    };
    let mut parameters = parameters();
    parameters.effects = Effects::default();
    let workers = Arc::new(Workers::new(1, Schedule::Static, &[]).unwrap());
    let start = Start { particles: &[thrown], steps_done: 0 };
    let options = Preset::PAPER_LINKED_LIST.options();
    parameters.effects.collision =
        Some(repro::engine::effects::collision::Collision { distance: 0.5, restitution: 0.2 });
    let mut simulation = simulation::build(&parameters, &options, start, workers).unwrap();
    for _ in 0..30 {
        let report = simulation.step(&mut NoProbe).unwrap();
        assert_eq!(report.ghosts, 0);
    }
    // 1.1 + 1.2 and 0 - 2.1, in a period of 1.2 from -0.05 up.
    let x = simulation.particles().position[0];
    assert!((x[0] - (1.1 + 1.2 - 1.2)).abs() < 1e-12 && (x[1] - (-2.1 + 2.4)).abs() < 1e-12, "{x:?}");
}
