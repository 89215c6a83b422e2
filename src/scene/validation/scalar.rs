//! A passive scalar that spreads in a box which repeats itself.

use std::f64::consts::PI;

use super::carried::{self, PlaneBox, medium, relative_l2};
use super::{Fidelity, Outcome};
use crate::base::vec3::{Vec3, dot, sub};
use crate::engine::effects::diffusion::Laplacian;
use crate::engine::effects::diffusion::WallCondition::Flux;
use crate::engine::parameters::Effects;

const SOURCE: &str = "the heat kernel";
/// When the spot was a point, seconds before the start, at a diffusivity of 1.
const AGE_S: f64 = 0.01;
const END_S: f64 = 0.01;

/// `c = sum exp(-r^2 / (4 D t)) / (4 pi D t)`, for a spot of amount 1 in the middle of the unit box and those of the boxes
/// around it.
fn spot(x: Vec3, t: f64) -> f64 {
    let boxes = (-2..=2).flat_map(|a| (-2..=2).map(move |b| [f64::from(a), f64::from(b)]));
    let share = |[a, b]: [f64; 2]| {
        let from_centre = sub(x, [a + 0.5, b + 0.5, 0.0]);
        (-dot(from_centre, from_centre) / (4.0 * t)).exp() / (4.0 * PI * t)
    };
    boxes.map(share).sum()
}

/// The relative error of the spot at twice its age, and by how much the total amount has changed.
fn spread(across: i32, jitter: f64, laplacian: Laplacian) -> Result<[f64; 2], String> {
    let l0 = 1.0 / f64::from(across);
    let plane =
        PlaneBox { particle_distance_m: l0, nx: across, ny: across, walls_x: false, walls_y: false, jitter };
    let particles = plane.fill(|x| spot(x, AGE_S));
    let scalar = Some(medium(1.0, Flux(0.0), Flux(0.0), laplacian));
    let steps = (END_S / (0.1 * l0 * l0)).ceil();
    let parameters = plane.parameters(END_S / steps, Effects { scalar, ..Effects::default() });
    let mut simulation = carried::build(&parameters, &particles)?;
    carried::run(simulation.as_mut(), steps as usize)?;
    let after = simulation.particles();
    let exact = after.position.iter().map(|&x| spot(x, AGE_S + END_S));
    let error = relative_l2(after.concentration.iter().copied().zip(exact));
    let before: f64 = particles.iter().map(|particle| particle.concentration).sum();
    let change = (after.concentration.iter().sum::<f64>() - before) / before;
    Ok([error, change.abs()])
}

fn outcome(case: &'static str, quantity: &'static str, error: f64, gate: f64) -> Outcome {
    let source = if gate < 1e-6 { "conservation of the amount" } else { SOURCE };
    Outcome { effect: "scalar", case, quantity, value: error, reference: 0.0, error, gate, source }
}

fn across(fidelity: Fidelity) -> i32 {
    if fidelity == Fidelity::Full { 80 } else { 40 }
}

/// A round spot on the lattice, and on displaced particles with the amount that the lattice's Laplacian must keep.
pub fn spreading(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let case = "spreading dye";
    let [error, change] = spread(across(fidelity), 0.0, Laplacian::Lattice)?;
    let [_, jittered] = spread(across(fidelity), 0.2, Laplacian::Lattice)?;
    Ok(vec![
        outcome(case, "L2 of c, lattice Laplacian", error, 0.01),
        outcome(case, "change of the amount, lattice", change, 1e-12),
        outcome(case, "change of the amount, jitter 0.2", jittered, 1e-12),
    ])
}

/// A round spot on particles displaced by up to 0.2 particle distances, with the corrected Laplacian.
pub fn jittered_spreading(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let [error, _] = spread(across(fidelity), 0.2, Laplacian::Corrected)?;
    Ok(vec![outcome("spreading dye, jitter 0.2", "L2 of c, corrected Laplacian", error, 0.01)])
}
