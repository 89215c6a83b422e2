//! Conduction of heat against closed solutions: slabs, half spaces, bodies in contact, walls with a flux.

use std::f64::consts::PI;

use super::carried::{self, FLUID, PlaneBox, SECOND, medium, relative_l2};
use super::{Fidelity, Outcome};
use crate::engine::effects::diffusion::WallCondition::{Flux, Value};
use crate::engine::effects::diffusion::{Diffusion, Laplacian};
use crate::engine::parameters::{Effects, Property};
use crate::engine::particles::{Kind, Particles};

const TEXTBOOK: &str = "Carslaw & Jaeger 1959, Conduction of Heat in Solids";
/// Rows of the box that repeats itself upwards.
const ROWS: i32 = 13;

/// A slab of unit width and unit diffusivity, `across` particles wide.
fn slab_of(across: i32, jitter: f64) -> PlaneBox {
    PlaneBox {
        particle_distance_m: 1.0 / f64::from(across),
        nx: across,
        ny: ROWS,
        walls_x: true,
        walls_y: false,
        jitter,
    }
}

/// Conducts for `end_s` in steps of a tenth of `l0^2 / alpha`, from the temperature `start(x)`.
fn conduct(
    plane: PlaneBox,
    heat: Diffusion,
    end_s: f64,
    start: impl Fn(f64) -> f64,
) -> Result<Particles, String> {
    let l0 = plane.particle_distance_m;
    let steps = (end_s / (0.1 * l0 * l0 / heat.largest_diffusivity())).ceil();
    let mut particles = plane.fill(|x| start(x[0]));
    // A body of the second kind fills the right half of the box where the heat says that there is one.
    if matches!(heat.conductivity, Property::ByGroup(_)) {
        let half = 0.5 * l0 * f64::from(plane.nx);
        for particle in particles.iter_mut().filter(|p| p.group == FLUID && p.position[0] > half) {
            particle.group = SECOND;
        }
    }
    let parameters = plane.parameters(end_s / steps, Effects { heat: Some(heat), ..Effects::default() });
    let mut simulation = carried::build(&parameters, &particles)?;
    carried::run(simulation.as_mut(), steps as usize)?;
    Ok(simulation.particles().clone())
}

/// Place and temperature of each fluid particle.
fn profile(particles: &Particles) -> impl Iterator<Item = (f64, f64)> {
    (0..particles.len())
        .filter(|&i| particles.kind[i] == Kind::Fluid)
        .map(|i| (particles.position[i][0], particles.temperature[i]))
}

/// The relative error of the temperatures against `exact(x)`.
fn error(particles: &Particles, exact: impl Fn(f64) -> f64) -> f64 {
    relative_l2(profile(particles).map(|(x, found)| (found, exact(x))))
}

fn across(fidelity: Fidelity) -> i32 {
    if fidelity == Fidelity::Full { 80 } else { 40 }
}

/// `T = sum 4 / (n pi) sin(n pi x) exp(-n^2 pi^2 t)` over odd `n`: a slab at 1 whose faces are at 0 from t = 0 on.
fn cooled(x: f64, t: f64) -> f64 {
    (0..100)
        .map(|k| PI * f64::from(2 * k + 1))
        .map(|n_pi| 4.0 / n_pi * (n_pi * x).sin() * (-n_pi * n_pi * t).exp())
        .sum()
}

fn slab_error(across: i32, jitter: f64, laplacian: Laplacian) -> Result<f64, String> {
    let end_s = 0.1;
    let heat = medium(1.0, Value(0.0), Value(0.0), laplacian);
    let particles = conduct(slab_of(across, jitter), heat, end_s, |_| 1.0)?;
    Ok(error(&particles, |x| cooled(x, end_s)))
}

fn l2(case: &'static str, quantity: &'static str, error: f64) -> Outcome {
    Outcome {
        effect: "heat",
        case,
        quantity,
        value: error,
        reference: 0.0,
        error,
        gate: 0.01,
        source: TEXTBOOK,
    }
}

/// A slab that cools from both faces, on the lattice.
pub fn slab(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    [
        ("L2 of T at Fo 0.1, lattice Laplacian", Laplacian::Lattice),
        ("L2 of T at Fo 0.1, corrected Laplacian", Laplacian::Corrected),
    ]
    .into_iter()
    .map(|(quantity, laplacian)| {
        Ok(l2("slab cooling", quantity, slab_error(across(fidelity), 0.0, laplacian)?))
    })
    .collect()
}

/// The same with particles displaced by up to 0.2 particle distances, where only the corrected Laplacian converges.
pub fn jittered_slab(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let error = slab_error(across(fidelity), 0.2, Laplacian::Corrected)?;
    Ok(vec![l2("slab cooling, jitter 0.2", "L2 of T at Fo 0.1, corrected Laplacian", error)])
}

/// What the lattice's Laplacian makes of the jittered slab: no gate, a comparison for people.
pub fn jittered_slab_on_the_lattice(across: i32) -> Result<f64, String> {
    slab_error(across, 0.2, Laplacian::Lattice)
}

/// Two half spaces at 1 and 0 brought into contact at x = 1/2, conductivities 4 and 1, capacities 4 and 2: the interface is
/// at once at `(e1 T1 + e2 T2) / (e1 + e2)`, `e = sqrt(k C)`.
pub fn contact(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let ([k1, k2], [c1, c2], end_s) = ([4.0, 1.0], [4.0, 2.0], 0.01);
    let plane = slab_of(across(fidelity), 0.0);
    let by_group = |one: f64, two: f64| Property::ByGroup(vec![one, one, one, one, two]);
    let heat = Diffusion {
        conductivity: by_group(k1, k2),
        capacity: by_group(c1, c2),
        ..medium(1.0, Value(1.0), Value(0.0), Laplacian::Lattice)
    };
    let particles = conduct(plane, heat, end_s, |x| if x < 0.5 { 1.0 } else { 0.0 })?;
    let interface = (k1 * c1).sqrt() / ((k1 * c1).sqrt() + (k2 * c2).sqrt());
    let exact = |x: f64| {
        let (x, reach) = (x - 0.5, |alpha: f64| 2.0 * (alpha * end_s).sqrt());
        if x < 0.0 {
            interface + (1.0 - interface) * erf(-x / reach(k1 / c1))
        } else {
            interface * (1.0 - erf(x / reach(k2 / c2)))
        }
    };
    // The same flux passes the last half distance on both sides.
    let l0 = plane.particle_distance_m;
    let beside = |side: f64| {
        let near = profile(&particles).filter(|(x, _)| (x - 0.5 - side * 0.5 * l0).abs() < 0.1 * l0);
        let near: Vec<f64> = near.map(|(_, t)| t).collect();
        near.iter().sum::<f64>() / near.len() as f64
    };
    let found = (k1 * beside(-1.0) + k2 * beside(1.0)) / (k1 + k2);
    let case = "bodies in contact";
    Ok(vec![
        l2(case, "L2 of T", error(&particles, exact)),
        Outcome {
            value: found,
            reference: interface,
            ..l2(case, "temperature of the interface", (found - interface).abs() / interface)
        },
    ])
}

/// A half space at 0 whose face is at 1 from t = 0 on: `T = 1 - erf(x / (2 sqrt(alpha t)))`.
pub fn half_space(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let end_s = 0.01;
    let heat = medium(1.0, Value(1.0), Value(0.0), Laplacian::Lattice);
    let particles = conduct(slab_of(across(fidelity), 0.0), heat, end_s, |_| 0.0)?;
    let found = error(&particles, |x| 1.0 - erf(x / (2.0 * end_s.sqrt())));
    Ok(vec![l2("half space", "L2 of T", found)])
}

/// A flux `q = 1` through the left wall, the right one at 0: `T = q (1 - x) / k` in the end; and before any of it has
/// reached the right wall, the fluid holds what entered.
pub fn flux_wall(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let plane = slab_of(across(fidelity) / 2, 0.0);
    let mut outcomes = Vec::new();
    for (quantity, laplacian) in [
        ("L2 of T, lattice Laplacian", Laplacian::Lattice),
        ("L2 of T, corrected Laplacian", Laplacian::Corrected),
    ] {
        let heat = medium(1.0, Flux(1.0), Value(0.0), laplacian);
        let particles = conduct(plane, heat, 3.0, |_| 0.0)?;
        outcomes.push(l2("heat flux wall", quantity, error(&particles, |x| 1.0 - x)));
    }
    let end_s = 0.1;
    let heat = medium(1.0, Flux(1.0), Flux(0.0), Laplacian::Lattice);
    let particles = conduct(plane, heat, end_s, |_| 0.0)?;
    let cell = plane.particle_distance_m * plane.particle_distance_m;
    let held = profile(&particles).map(|(_, t)| t * cell).sum::<f64>()
        / (f64::from(plane.ny) * plane.particle_distance_m);
    outcomes.push(Outcome {
        value: held,
        reference: end_s,
        gate: 1e-9,
        source: "conservation of energy",
        ..l2("heat flux wall", "heat that entered, J/m2", (held - end_s).abs() / end_s)
    });
    Ok(outcomes)
}

/// The error function, by its series up to 3 and as 1 beyond, where it is 2e-5 short of it; absolute error below 3e-5.
fn erf(x: f64) -> f64 {
    if x > 3.0 {
        return 1.0;
    }
    let (mut term, mut sum) = (x, x);
    for n in 1..60 {
        let n = f64::from(n);
        term *= -x * x / n;
        sum += term / (2.0 * n + 1.0);
    }
    2.0 / PI.sqrt() * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_function_has_its_known_values() {
        for (x, value) in [(0.0, 0.0), (0.5, 0.520_499_878), (1.0, 0.842_700_793), (2.0, 0.995_322_265)] {
            assert!((erf(x) - value).abs() < 1e-9, "{x}");
        }
    }
}
