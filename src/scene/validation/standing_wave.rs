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
    /// Share of the wave's energy that is lost in five periods.
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

/// Kinetic energy over the mass of a particle, m2/s2.
fn kinetic(now: &Particles) -> f64 {
    fluid(now).map(|i| now.velocity[i]).map(|[u, v, _]| 0.5 * (u * u + v * v)).sum()
}

/// Half periods that are looked at.
const HALVES: usize = 10;

/// Watches five periods of the wave.
///
/// Its energy counts when the surface is level, where all of it is kinetic. Potential energy does not tell: that of the
/// fluid's centre of mass, which rises by some 0.02 particle distances while the lattice is lost, is as large as the
/// wave's.
pub fn swing(parameters: &Parameters, particles: &[InitialParticle]) -> Result<Wave, String> {
    let mut simulation = general::build(parameters, particles, 1)?;
    let half_s = 0.5 * TAU / omega();
    let start = kinetic(simulation.particles());
    let (mut before, mut end) = (mode(simulation.particles()), 0.0);
    let (mut crossings_s, mut peaks) = (Vec::new(), vec![0.0f64]);
    while crossings_s.len() < HALVES {
        let time_s = general::step(simulation.as_mut())?.time_s;
        let now = mode(simulation.particles());
        // The start itself is a crossing, but of particles that have not yet found their places.
        let since_s = time_s - crossings_s.last().copied().unwrap_or(0.0);
        if since_s > 0.5 * half_s && before * now < 0.0 {
            crossings_s.push(time_s - parameters.time_step_s * now / (now - before));
            end = kinetic(simulation.particles());
            peaks.push(0.0);
        }
        if let Some(peak) = peaks.last_mut() {
            *peak = peak.max(now.abs());
        }
        before = now;
        if time_s > 2.0 * HALVES as f64 * half_s {
            return Err("the wave does not swing".to_string());
        }
    }
    let found_s = (crossings_s[HALVES - 1] - crossings_s[0]) / (HALVES - 1) as f64;
    Ok(Wave { period: found_s / half_s, loss: 1.0 - end / start, amplitude: peaks[HALVES - 1] / peaks[0] })
}

/// Five periods. Coarse with 20 layers, full with 40; the gates are those of 40.
pub fn first_mode(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let (n, time_step_s) = if fidelity == Fidelity::Full { (40, 5e-4) } else { (20, 1e-3) };
    let particles = particles(n);
    let l0 = DEPTH_M / f64::from(n);
    let parameters = general::parameters(l0, time_step_s, &particles, 20.0, general::water());
    let wave = swing(&parameters, &particles)?;
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
        outcome(
            "amplitude of the tenth peak over the first (reported, no gate)",
            wave.amplitude,
            1.0,
            1.0 - wave.amplitude,
            f64::INFINITY,
        ),
    ])
}
