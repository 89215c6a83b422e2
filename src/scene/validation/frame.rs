//! Frames that turn: a free particle, and water in a cup.

use super::plane::{self, G};
use super::{Fidelity, Outcome};
use crate::base::vec3::{Vec3, add_scaled, cross, dot, sub};
use crate::engine::effects::frame::Frame;
use crate::engine::effects::viscosity::Viscosity;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Domain, Effects, Parameters};
use crate::engine::particles::{InitialParticle, Kind};
use crate::engine::rotation::Rotation;

/// Rotation vector of the spiral's frame, rad/s: oblique, so that every component of every term counts.
const OMEGA: Vec3 = [0.6, -0.4, 0.9];
const POINT: Vec3 = [0.2, 0.1, -0.3];

/// How far a free particle is from where it should be after 3 s, metres.
fn spiral_error(steps: u32) -> Result<f64, String> {
    let (x, u, end_s) = ([1.0, 0.5, 0.25], [0.3, -0.2, 0.4], 3.0);
    let seen = sub(u, cross(OMEGA, sub(x, POINT)));
    let particle = InitialParticle { velocity: seen, ..InitialParticle::at_rest(Kind::Fluid, x) };
    let frame = Frame { angular_velocity_rad_s: OMEGA, point_m: POINT, ..Frame::default() };
    let effects = Effects { frame: Some(frame), ..Effects::default() };
    let parameters = Parameters {
        dimensions: Dimensions::Three,
        domain: Domain::new([-5.0; 3], [5.0; 3]),
        ..plane::parameters(0.5, end_s / f64::from(steps), &[particle], 1.0, effects)
    };
    let mut simulation = plane::start(&parameters, &[particle])?;
    for _ in 0..steps {
        plane::step(&mut *simulation)?;
    }
    let rate = dot(OMEGA, OMEGA).sqrt();
    let turned = Rotation::about(OMEGA.map(|w| w / rate), -rate * end_s);
    let exact = sub(turned.turn(sub(add_scaled(x, end_s, u), POINT)), POINT.map(|p| -p));
    let off = sub(simulation.particles().position[0], exact);
    Ok(dot(off, off).sqrt())
}

/// A particle that no force moves flies straight on; a frame that turns sees it on a spiral. Halving the step halves the
/// error.
pub fn spiral(_: Fidelity) -> Result<Vec<Outcome>, String> {
    let (coarse, fine) = (spiral_error(1500)?, spiral_error(3000)?);
    let outcome = Outcome {
        effect: "frame",
        case: "a free particle seen from a frame that turns",
        quantity: "order of the time step (error: difference)",
        value: (coarse / fine).log2(),
        reference: 1.0,
        error: ((coarse / fine).log2() - 1.0).abs(),
        gate: 0.05,
        source: "straight line in the frame at rest",
    };
    let place = Outcome {
        quantity: "place after 3 s, m (error: distance over the way of 3 m)",
        value: fine,
        reference: 0.0,
        error: fine / 3.0,
        gate: 0.002,
        ..outcome.clone()
    };
    Ok(vec![outcome, place])
}

/// Water in a cup that turns about its axis, seen from the cup in a slice through the axis: at rest the surface is the
/// parabola `y = c + omega^2 x^2 / (2 g)`, `c` by the volume. Viscosity far above water's calms it; it changes nothing at
/// rest. Measured: 0.20 particle distances off with 24 columns, 0.32 with 48.
pub fn rotating_cup(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let (columns, end_s) = match fidelity {
        Fidelity::Coarse => (24, 4.0),
        Fidelity::Full => (48, 6.0),
    };
    let (width_m, depth_m) = (1.0, 0.5);
    let l0 = width_m / f64::from(columns);
    let omega = 3.5;
    let mut particles = plane::walls(l0, columns, columns, 0);
    particles.extend(plane::fluid(l0, 0..columns, |_| depth_m));
    let frame = Frame {
        angular_velocity_rad_s: [0.0, omega, 0.0],
        point_m: [0.5 * width_m, 0.0, 0.0],
        spin_up_s: 1.0,
        ..Frame::default()
    };
    let viscosity = Viscosity::uniform(2e-3);
    let effects = Effects { frame: Some(frame), viscosity: Some(viscosity), ..plane::water_effects() };
    let dt = 0.06 * l0 / (G * depth_m).sqrt();
    let parameters = plane::parameters(l0, dt, &particles, 0.2, effects);
    let mut simulation = plane::start(&parameters, &particles)?;
    let steps = (end_s / dt) as usize;
    let probes: Vec<f64> = (2..columns - 2).map(|i| plane::cell(l0, i, 0)[0]).collect();
    let (mut height, mut samples) = (vec![0.0; probes.len()], 0);
    for step in 0..steps {
        plane::step(&mut *simulation)?;
        if step > steps * 3 / 4 && step % 10 == 0 {
            for (sum, &x) in height.iter_mut().zip(&probes) {
                *sum += plane::surface_m(simulation.particles(), x, l0).ok_or("no fluid above a probe")?;
            }
            samples += 1;
        }
    }
    let curvature = omega * omega / (2.0 * G);
    let lowest = depth_m - curvature * width_m * width_m / 12.0;
    let exact = |x: f64| lowest + curvature * (x - 0.5 * width_m) * (x - 0.5 * width_m);
    let square = |(sum, &x): (&f64, &f64)| (sum / f64::from(samples) - exact(x)).powi(2);
    let rms = (height.iter().zip(&probes).map(square).sum::<f64>() / probes.len() as f64).sqrt();
    Ok(vec![Outcome {
        effect: "frame",
        case: "water in a cup that turns",
        quantity: "surface height, rms of differences in particle distances (error: the same)",
        value: rms / l0,
        reference: 0.0,
        error: rms / l0,
        gate: 0.5,
        source: "hydrostatics: y = c + omega^2 x^2 / (2 g)",
    }])
}
