//! Decaying vortices in a periodic box: `u = -U e^(bt) cos 2 pi x sin 2 pi y`, `v = U e^(bt) sin 2 pi x cos 2 pi y`,
//! `b = -8 pi^2 / Re`, for a box of 1 m and `U` = 1 m/s (Taylor & Green 1937; Re = 100).

use super::{Fidelity, Outcome, general};
use crate::engine::effects::viscosity::Viscosity;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Domain, Effects, Parameters, Radii};
use crate::engine::particles::{InitialParticle, Kind, Particles};
use std::f64::consts::{PI, TAU};

/// `nu = U L / Re`, m2/s.
const VISCOSITY_M2_S: f64 = 0.01;

/// What is read off the vortices.
#[derive(Debug, Clone, Copy, Default)]
pub struct Decay {
    /// Mean over t = 1 to 2 s of `mean ||v| - |v_exact|| / mean |v_exact|`.
    pub speed_error: f64,
    /// Smallest distance of two particles met, in particle distances.
    pub closest: f64,
    /// Kinetic energy at the end over the exact one.
    pub energy: f64,
}

fn exact(x: [f64; 3], time_s: f64) -> [f64; 3] {
    let decay = (-8.0 * PI * PI * VISCOSITY_M2_S * time_s).exp();
    let ([sx, cx], [sy, cy]) =
        ([(TAU * x[0]).sin(), (TAU * x[0]).cos()], [(TAU * x[1]).sin(), (TAU * x[1]).cos()]);
    [-decay * cx * sy, decay * sx * cy, 0.0]
}

/// `n` by `n` particles, each moved by up to `jitter` particle distances along either axis.
pub fn particles(n: usize, jitter: f64) -> Vec<InitialParticle> {
    let l0 = 1.0 / n as f64;
    let mut noise = general::Noise(1);
    let mut particles = Vec::new();
    for i in 0..n {
        for j in 0..n {
            let mut x = general::middle(l0, i as i32, j as i32);
            for x in &mut x[..2] {
                *x += jitter * l0 * noise.draw();
            }
            particles.push(InitialParticle {
                velocity: exact(x, 0.0),
                ..InitialParticle::at_rest(Kind::Fluid, x)
            });
        }
    }
    particles
}

/// Parameters of the case with `effects` beside viscosity.
pub fn parameters(n: usize, time_step_s: f64, effects: Effects) -> Parameters {
    Parameters {
        dimensions: Dimensions::Two,
        particle_distance_m: 1.0 / n as f64,
        time_step_s,
        adaptive: None,
        density_kg_m3: 1.0,
        radii: Radii { number_density: 2.1, gradient: 2.1, laplacian: 3.1 },
        domain: Domain { periodic: [true, true, false], ..Domain::new([0.0; 3], [1.0, 1.0, 0.0]) },
        groups: Vec::new(),
        effects: Effects { viscosity: Some(Viscosity::uniform(VISCOSITY_M2_S)), ..effects },
    }
}

fn speed(u: [f64; 3]) -> f64 {
    (u[0] * u[0] + u[1] * u[1]).sqrt()
}

fn error(now: &Particles, time_s: f64) -> f64 {
    let (mut error, mut scale) = (0.0, 0.0);
    for (x, u) in now.position.iter().zip(&now.velocity) {
        let exact = speed(exact(*x, time_s));
        error += (speed(*u) - exact).abs();
        scale += exact;
    }
    error / scale
}

/// The smallest distance of two particles, in a box that repeats itself after a metre.
fn closest(now: &Particles) -> f64 {
    let mut least2 = f64::INFINITY;
    for (i, a) in now.position.iter().enumerate() {
        for b in &now.position[..i] {
            let d = [a[0] - b[0], a[1] - b[1]].map(|d| d - d.round());
            least2 = least2.min(d[0] * d[0] + d[1] * d[1]);
        }
    }
    least2.sqrt()
}

/// Lets them decay for two seconds.
pub fn decay(parameters: &Parameters, particles: &[InitialParticle]) -> Result<Decay, String> {
    let mut simulation = general::build(parameters, particles, 1)?;
    let steps = (2.0 / parameters.time_step_s).round() as usize;
    let mut decay = Decay { closest: f64::INFINITY, ..Decay::default() };
    let mut samples = 0.0;
    for n in 1..=steps {
        let time_s = general::step(simulation.as_mut())?.time_s;
        let now = simulation.particles();
        if 2 * n >= steps {
            decay.speed_error += error(now, time_s);
            samples += 1.0;
        }
        if n % (steps / 20).max(1) == 0 {
            decay.closest = decay.closest.min(closest(now) / parameters.particle_distance_m);
        }
    }
    decay.speed_error /= samples;
    let now = simulation.particles();
    let energy = |u: [f64; 3]| u[0] * u[0] + u[1] * u[1];
    let found: f64 = now.velocity.iter().map(|&u| energy(u)).sum();
    decay.energy = found / now.position.iter().map(|&x| energy(exact(x, 2.0))).sum::<f64>();
    Ok(decay)
}

fn outcomes(case: &'static str, jitter: f64, fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let (n, time_step_s) = if fidelity == Fidelity::Full { (50, 0.004) } else { (30, 0.006) };
    let parameters = parameters(n, time_step_s, general::closed(0.8));
    let decay = decay(&parameters, &particles(n, jitter))?;
    let outcome = |quantity, value: f64, reference: f64, error, gate| Outcome {
        effect: "pressure",
        case,
        quantity,
        value,
        reference,
        error,
        gate,
        source: "Taylor & Green 1937",
    };
    Ok(vec![
        outcome(
            "L1 error of the speed, mean over t = 1 to 2",
            decay.speed_error,
            0.0,
            decay.speed_error,
            0.05,
        ),
        outcome(
            "smallest distance of two particles, by how many particle distances below a half",
            decay.closest,
            0.5,
            (0.5 - decay.closest).max(0.0),
            0.0,
        ),
    ])
}

/// From a lattice. Coarse 30 particles a side, full 50.
pub fn regular(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    outcomes("Taylor-Green vortices at Re 100, regular start", 0.0, fidelity)
}

/// From a lattice whose particles were moved by up to a tenth of a particle distance along each axis.
pub fn jittered(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    outcomes("Taylor-Green vortices at Re 100, jittered start", 0.1, fidelity)
}
