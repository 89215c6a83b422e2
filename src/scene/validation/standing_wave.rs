//! The first mode of a tank: `eta = A sin(omega t) cos(k x)` with `k = pi / L`, `omega^2 = g k tanh(k H)` (linear theory),
//! started from a flat surface with the velocities of that moment, which are free of divergence:
//! `u = -A omega cosh(k y) / sinh(k H) sin(k x)`, `v = A omega sinh(k y) / sinh(k H) cos(k x)`.

use std::f64::consts::{PI, TAU};

use super::general::{self, G_M_S2, Tank};
use super::{Fidelity, Outcome};
use crate::engine::parameters::Parameters;
use crate::engine::particles::{InitialParticle, Kind, Particles};

/// Depth of the water, metres; the tank is twice as long.
pub const DEPTH_M: f64 = 0.4;
/// `A / H`.
const STEEPNESS: f64 = 0.05;

/// What is read off the wave.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wave {
    /// Mean of the periods over that of linear theory.
    pub period: f64,
    /// Share of the wave's energy, kinetic and potential, that is lost after the periods.
    pub loss: f64,
    /// The amplitude of the last peak over the first.
    pub amplitude: f64,
}

fn k() -> f64 {
    PI / (2.0 * DEPTH_M)
}

/// Of linear theory, 1/s.
pub fn omega() -> f64 {
    (G_M_S2 * k() * (k() * DEPTH_M).tanh()).sqrt()
}

/// Water of `n` layers.
pub fn particles(n: i32) -> Vec<InitialParticle> {
    let tank = Tank { width: 2 * n, height: n + n / 2, lid: false };
    let mut particles = tank.fill(DEPTH_M / f64::from(n), |_, j| j < n);
    let scale = STEEPNESS * DEPTH_M * omega() / (k() * DEPTH_M).sinh();
    for particle in particles.iter_mut().filter(|p| p.kind == Kind::Fluid) {
        let [x, y, _] = particle.position.map(|x| k() * x);
        particle.velocity = [-scale * y.cosh() * x.sin(), scale * y.sinh() * x.cos(), 0.0];
    }
    particles
}

fn fluid(now: &Particles) -> impl Iterator<Item = usize> + Clone + '_ {
    (0..now.len()).filter(|&i| now.kind[i] == Kind::Fluid)
}

/// `sum y cos(k x)`: in proportion to the elevation of the first mode.
fn mode(now: &Particles) -> f64 {
    fluid(now).map(|i| now.position[i][1] * (k() * now.position[i][0]).cos()).sum()
}

/// Energy over the mass of a particle, m2/s2.
fn energy(now: &Particles) -> f64 {
    let kinetic = |[u, v, _]: [f64; 3]| 0.5 * (u * u + v * v);
    fluid(now).map(|i| kinetic(now.velocity[i]) + G_M_S2 * now.position[i][1]).sum()
}

/// Watches `periods` of the wave. The energy of the rest, from which the wave's counts, is that of the flat start.
pub fn swing(parameters: &Parameters, particles: &[InitialParticle], periods: f64) -> Result<Wave, String> {
    let mut simulation = general::build(parameters, particles, 1)?;
    let steps = (periods * TAU / omega() / parameters.time_step_s).ceil() as usize;
    let still: f64 =
        fluid(simulation.particles()).map(|i| G_M_S2 * simulation.particles().position[i][1]).sum();
    let start = energy(simulation.particles()) - still;
    let (mut before, mut crossings, mut peaks) = (mode(simulation.particles()), Vec::new(), vec![0.0f64]);
    for n in 1..=steps {
        let time_s = general::step(simulation.as_mut())?.time_s;
        let now = mode(simulation.particles());
        // The start itself is a crossing, but of particles that have not yet found their places.
        if n > steps / 20 && before * now < 0.0 {
            crossings.push(time_s - parameters.time_step_s * now / (now - before));
            peaks.push(0.0);
        }
        if let Some(peak) = peaks.last_mut() {
            *peak = peak.max(now.abs());
        }
        before = now;
    }
    let halves = (crossings.len().max(2) - 1) as f64;
    let found_s = 2.0 * (crossings.last().unwrap_or(&0.0) - crossings.first().unwrap_or(&0.0)) / halves;
    let last = if peaks.len() > 1 { peaks[peaks.len() - 2] } else { 0.0 };
    Ok(Wave {
        period: found_s * omega() / TAU,
        loss: 1.0 - (energy(simulation.particles()) - still) / start,
        amplitude: last / peaks[0],
    })
}

/// Five periods. Coarse with 20 layers, full with 40; the gates are those of 40.
pub fn first_mode(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let (n, time_step_s) = if fidelity == Fidelity::Full { (40, 5e-4) } else { (20, 1e-3) };
    let particles = particles(n);
    let l0 = DEPTH_M / f64::from(n);
    let parameters = general::parameters(l0, time_step_s, &particles, 20.0, general::water());
    let wave = swing(&parameters, &particles, 5.0)?;
    let outcome = |quantity, value: f64, reference: f64, error: f64, gate| Outcome {
        effect: "pressure",
        case: "standing wave, A / H = 0.05",
        quantity,
        value,
        reference,
        error,
        gate,
        source: "linear theory",
    };
    Ok(vec![
        outcome("period over that of linear theory", wave.period, 1.0, (wave.period - 1.0).abs(), 0.01),
        outcome("share of the wave's energy lost in five periods", wave.loss, 0.0, wave.loss.abs(), 0.1),
    ])
}
