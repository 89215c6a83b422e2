//! A shear that varies as a sine across a doubly periodic box decays as `exp(-nu k^2 t)`: the viscosity that is measured
//! from it against the one that was asked for.

use std::f64::consts::TAU;

use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Domain, Effects, Parameters, Property, Radii};
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::engine::viscous::Walls;
use crate::scene::validation::channel::{self, SCHEMES, Scheme};
use crate::scene::validation::{Fidelity, Outcome};

/// The wave's length, metres.
pub const WAVE_M: f64 = 1.0;
const VISCOSITY_M2_S: f64 = 1.0;
/// Particles along the flow.
const ALONG: usize = 8;

/// A box of one wave, `per_wave` particles long.
pub fn parameters(per_wave: usize, time_step_s: f64, effects: Effects) -> Parameters {
    let l0 = WAVE_M / per_wave as f64;
    let high = [(ALONG as f64 - 0.5) * l0, WAVE_M - 0.5 * l0, 0.0];
    Parameters {
        dimensions: Dimensions::Two,
        particle_distance_m: l0,
        time_step_s,
        adaptive: None,
        density_kg_m3: 1000.0,
        radii: Radii { number_density: 2.1, gradient: 2.1, laplacian: 3.1 },
        domain: Domain { periodic: [true, true, false], ..Domain::new([-0.5 * l0, -0.5 * l0, 0.0], high) },
        groups: Vec::new(),
        effects,
    }
}

/// A sine of the amplitude `amplitude_m_s`: so small that nothing moves to speak of.
pub fn particles(per_wave: usize, amplitude_m_s: f64) -> Vec<InitialParticle> {
    let l0 = WAVE_M / per_wave as f64;
    let place = |i: usize, j: usize| InitialParticle {
        velocity: [amplitude_m_s * (TAU * (j as f64 + 0.5) / per_wave as f64).sin(), 0.0, 0.0],
        ..InitialParticle::at_rest(Kind::Fluid, [l0 * i as f64, l0 * j as f64, 0.0])
    };
    (0..ALONG).flat_map(|i| (0..per_wave).map(move |j| place(i, j))).collect()
}

/// The root of the mean square of the velocity, metres per second.
pub fn rms_m_s(particles: &Particles) -> f64 {
    let sum: f64 = particles.velocity.iter().map(|u| u[0] * u[0]).sum();
    (sum / particles.len() as f64).sqrt()
}

/// The viscosity that a sine's decay to about a third shows; steps of a tenth of the explicit limit, so that what is
/// seen is the error in space.
fn measured_m2_s(per_wave: usize, scheme: Scheme) -> Result<f64, String> {
    let (l0, k) = (WAVE_M / per_wave as f64, TAU / WAVE_M);
    let dt = 0.1 * 2.4485 / 4.0 * l0 * l0 / VISCOSITY_M2_S;
    let effects = scheme.effects(Property::Uniform(VISCOSITY_M2_S), Walls::Resting);
    let mut simulation = channel::build(&parameters(per_wave, dt, effects), &particles(per_wave, 1e-6))?;
    let steps = (1.0 / (VISCOSITY_M2_S * k * k * dt)).round() as usize;
    let before = rms_m_s(simulation.particles());
    channel::advance(simulation.as_mut(), steps)?;
    let decay = before / rms_m_s(simulation.particles());
    Ok(decay.ln() / (k * k * steps as f64 * dt))
}

/// 40 particles a wave; 80 in full.
pub fn run(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let per_wave = if fidelity == Fidelity::Full { 80 } else { 40 };
    let outcome = |scheme: Scheme| {
        let value = measured_m2_s(per_wave, scheme)?;
        Ok(Outcome {
            effect: scheme.effect(),
            case: "decay of a sine shear",
            quantity: "viscosity, m2/s",
            value,
            reference: VISCOSITY_M2_S,
            error: (value / VISCOSITY_M2_S - 1.0).abs(),
            gate: 0.01,
            source: "exp(-nu k^2 t)",
        })
    };
    SCHEMES.into_iter().map(outcome).collect()
}
