//! Smagorinsky's eddy viscosity: on a linear shear, and in a sine shear that it alone makes decay.

use std::f64::consts::TAU;

use crate::engine::effects::turbulence::Turbulence;
use crate::engine::parameters::Property;
use crate::engine::particles::Kind;
use crate::engine::viscous::Walls;
use crate::scene::validation::channel::{self, Channel, SCHEMES};
use crate::scene::validation::decay::{self, WAVE_M};
use crate::scene::validation::{Fidelity, Outcome};

const SMAGORINSKY: f64 = 0.15;
const MODEL: Turbulence = Turbulence { smagorinsky_constant: SMAGORINSKY };

/// `nu + nu_t` on the linear profile between a wall at rest and one that moves, everywhere in the channel.
fn linear_shear() -> Result<Outcome, String> {
    let channel = Channel { across: 20, width_m: 1.0, upper_wall_m_s: 0.01 };
    let (l0, slope, newtonian) = (channel.particle_distance_m(), 0.01, 1e-6);
    let mut effects = SCHEMES[0].effects(Property::Uniform(newtonian), Walls::Mirrored);
    effects.turbulence = Some(MODEL);
    let mut simulation =
        channel::build(&channel.parameters(1e-3, effects), &channel.particles(|y| slope * y))?;
    channel::advance(simulation.as_mut(), 1)?;
    let particles = simulation.particles();
    let reference = newtonian + (SMAGORINSKY * l0) * (SMAGORINSKY * l0) * slope;
    let worst = (0..particles.len())
        .filter(|&i| particles.kind[i] == Kind::Fluid)
        .map(|i| particles.viscosity[i])
        .max_by(|a, b| (a - reference).abs().total_cmp(&(b - reference).abs()));
    let value = worst.unwrap_or(f64::NAN);
    Ok(Outcome {
        effect: "turbulence",
        case: "linear shear",
        quantity: "viscosity of the particle that is farthest from the reference, m2/s",
        value,
        reference,
        error: (value / reference - 1.0).abs(),
        gate: 1e-12,
        source: "nu + (C_s l0)^2 |du/dy|",
    })
}

/// `C_s l0` of the sine shear, metres. By the time that it has halved, fluid has moved by `1 / ((C_s l0)^2 k^3)`, whatever its
/// speed: with a usual constant by thousands of particle distances. With this one it stays on the lattice, and what is
/// seen is the law alone.
const LENGTH_M: f64 = 1.5;

/// A sine shear without any viscosity of its own: its amplitude falls as `1 / (1 + c t)`.
fn sine(per_wave: usize) -> Result<Outcome, String> {
    let (l0, amplitude) = (WAVE_M / per_wave as f64, 1e-6);
    let length2 = LENGTH_M * LENGTH_M;
    let k = TAU / WAVE_M;
    // In this time the amplitude falls to less than a half.
    let (time_s, steps) = (1.0 / (length2 * amplitude * k * k * k), 2000);
    let mut effects = SCHEMES[0].effects(Property::Uniform(0.0), Walls::Resting);
    effects.turbulence = Some(Turbulence { smagorinsky_constant: LENGTH_M / l0 });
    let parameters = decay::parameters(per_wave, time_s / f64::from(steps), effects);
    let mut simulation = channel::build(&parameters, &decay::particles(per_wave, amplitude))?;
    let before = decay::rms_m_s(simulation.particles());
    channel::advance(simulation.as_mut(), steps as usize)?;
    let value = decay::rms_m_s(simulation.particles()) / before;
    let reference = finely_resolved(length2, amplitude, time_s);
    Ok(Outcome {
        effect: "turbulence",
        case: "decay of a sine shear",
        quantity: "root mean square of the velocity over that at the start",
        value,
        reference,
        error: (value / reference - 1.0).abs(),
        gate: 0.03,
        source: "du/dt = d/dy ((C_s l0)^2 |du/dy| du/dy), finite volumes, 400 cells",
    })
}

/// The share of the velocity's root mean square that is left after `time_s`.
fn finely_resolved(length2: f64, amplitude: f64, time_s: f64) -> f64 {
    const CELLS: usize = 400;
    let h = WAVE_M / CELLS as f64;
    let mut u: Vec<f64> =
        (0..CELLS).map(|j| amplitude * (TAU * (j as f64 + 0.5) / CELLS as f64).sin()).collect();
    let rms = |u: &[f64]| (u.iter().map(|u| u * u).sum::<f64>() / CELLS as f64).sqrt();
    let (before, steepest) = (rms(&u), amplitude * TAU / WAVE_M);
    let steps = (time_s / (0.2 * h * h / (2.0 * length2 * steepest))).ceil();
    let dt = time_s / steps;
    for _ in 0..steps as usize {
        let flux = |j: usize| {
            let slope = (u[(j + 1) % CELLS] - u[j]) / h;
            length2 * slope.abs() * slope
        };
        let change: Vec<f64> =
            (0..CELLS).map(|j| dt / h * (flux(j) - flux((j + CELLS - 1) % CELLS))).collect();
        u.iter_mut().zip(&change).for_each(|(u, change)| *u += change);
    }
    rms(&u) / before
}

/// A shear in a channel and a wave of 40 particles; 80 in full.
pub fn run(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let per_wave = if fidelity == Fidelity::Full { 80 } else { 40 };
    Ok(vec![linear_shear()?, sine(per_wave)?])
}
