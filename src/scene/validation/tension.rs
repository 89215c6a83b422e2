//! Surface tension: the pressure in a round drop, the swing of one that was pulled out, and a square that becomes round.
//!
//! At fifteen particles a radius `surface_tension` has a pressure 1.6 % too high, a spurious capillary number of 0.006, a period
//! 0.2 % too long without viscosity and 0.7 % with, and a square whose radii differ by 0.028 R. Of these the
//! pressure is near what the tension was calibrated by (discs of 10, 20 and 30 particles' radius). Periods are independent: 0.0 to
//! 3.4 % too long from lattices turned by 22.5 and 45 degrees and a hexagonal one, with half and twice the amplitude, 0.4 and
//! half of the step, a feedback 3.4 times slower, and ten and twenty particles a radius. With the gradient `pairwise` the
//! period was 6.9 % too long, and from 3 % too short to 14 % too long from other starts, steps and feedback times: a layer
//! beneath the surface had to swell where the surface shrank.
//!
//! `potential_tension` is 13 % off in pressure, 10 % in period (2.5 % with viscosity), has a capillary number of 0.03 and a square
//! whose radii still differ by 0.125 R: its drop is a soft solid, as `engine/effects/potential_tension.rs` explains. (With
//! the gradient `pairwise`, and the pressure that bears its attraction taken from the lattice instead of from where
//! particles lie, it was 254 % and 38 %.)

use crate::base::vec3::{ZERO, dot, sub};
use crate::engine::effects::potential_tension::separation_sum;
use crate::engine::kernel::Dimensions;
use crate::engine::particles::Particles;
use crate::scene::validation::drop::{
    Crossings, Drop, Model, elongation, max_speed, mean_pressure, middle, outline,
};
use crate::scene::validation::{Fidelity, Outcome};

/// Particles in a radius.
fn particles_per_radius(fidelity: Fidelity) -> u32 {
    match fidelity {
        Fidelity::Coarse => 15,
        Fidelity::Full => 20,
    }
}

/// Both models, one after the other.
fn of_both(case: impl Fn(Model) -> Result<Vec<Outcome>, String>) -> Result<Vec<Outcome>, String> {
    Model::ALL.into_iter().map(case).collect::<Result<Vec<_>, _>>().map(|found| found.concat())
}

/// A round drop at rest, with both models.
pub fn laplace(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    of_both(|model| pressure_jump(model, fidelity))
}

/// A drop that swings, without viscosity, with both models.
pub fn rayleigh(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    of_both(|model| oscillation(model, 0.0, fidelity))
}

/// A square that becomes round, with both models.
pub fn rounding(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    of_both(|model| square(model, fidelity))
}

/// A disc at rest. The pressure within half its radius, averaged over time after it has settled, against `sigma / R`; for
/// the potential less what bears its attraction. And the fastest particle's `mu u / sigma` at the end.
pub fn pressure_jump(model: Model, fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let drop = Drop::new(model, particles_per_radius(fidelity), 0.05);
    let particles = drop.lattice(|x, y| x * x + y * y < 1.0, |_, _| ZERO);
    let (mut sum, mut count, mut speed) = (0.0, 0.0, 0.0);
    drop.run(&particles, 4.0, |time, particles| {
        if time > 2.0 {
            let cohesion = if model == Model::Potential { cohesion(&drop, particles) } else { 0.0 };
            sum += mean_pressure(particles, 0.5) - cohesion;
            count += 1.0;
            speed = max_speed(particles);
        }
    })?;
    let reference = 1.0 / drop.radius_of(particles.len());
    let value = sum / count;
    let outcome = |quantity, value, reference, error, gate, source| Outcome {
        effect: model.effect(),
        case: "a round drop at rest",
        quantity,
        value,
        reference,
        error,
        gate,
        source,
    };
    let jump = (value - reference).abs() / reference;
    let capillary = drop.viscosity * speed;
    Ok(vec![
        outcome("pressure inside, sigma / R", value, reference, jump, 0.05, "Laplace"),
        outcome("spurious capillary number", capillary, 0.0, capillary, 1e-2, "at rest"),
    ])
}

/// The pressure that bears the potential's attraction among particles within half the radius, where they lie now: the mean of
/// `C l0^3 sum r (r - 1) (re - r) / 4` over neighbours, distances in particle distances.
fn cohesion(drop: &Drop, particles: &Particles) -> f64 {
    const RADIUS: f64 = 3.1;
    let (l0, [mx, my, _]) = (drop.particle_distance(), middle(particles));
    let (mut sum, mut count) = (0.0, 0.0);
    for x in &particles.position {
        if (x[0] - mx) * (x[0] - mx) + (x[1] - my) * (x[1] - my) < 0.25 {
            count += 1.0;
            for y in &particles.position {
                let r_ij = sub(*y, *x);
                let r = dot(r_ij, r_ij).sqrt() / l0;
                if r < RADIUS {
                    sum += r * (r - 1.0) * (RADIUS - r);
                }
            }
        }
    }
    0.25 * sum / count * 2.0 / (separation_sum(Dimensions::Two, RADIUS) * l0)
}

/// A disc that is pulled out along x: `u = a (x, -y)`, the motion of mode 2. The period between zeros of its elongation
/// against Rayleigh's `omega^2 = 6 sigma / (rho R^3)`, less `(4 nu / R^2)^2` for the decay of its amplitude.
pub fn oscillation(model: Model, viscosity: f64, fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let drop = Drop::new(model, particles_per_radius(fidelity), viscosity);
    let pull = 0.08 * 6.0f64.sqrt();
    let particles = drop.lattice(|x, y| x * x + y * y < 1.0, |x, y| [pull * x, -pull * y, 0.0]);
    let mut crossings = Crossings::default();
    drop.run(&particles, 5.0, |time, particles| crossings.add(time, elongation(particles)))?;
    let radius = drop.radius_of(particles.len());
    let decay = 4.0 * viscosity / (radius * radius);
    let reference = std::f64::consts::TAU / (6.0 / (radius * radius * radius) - decay * decay).sqrt();
    // A drop that never swings back has no period.
    let value = crossings.period().unwrap_or(f64::INFINITY);
    Ok(vec![Outcome {
        effect: model.effect(),
        case: if viscosity > 0.0 { "a viscous drop swings" } else { "a drop swings" },
        quantity: "period, sqrt(rho R^3 / sigma)",
        value,
        reference,
        error: (value - reference).abs() / reference,
        gate: 0.05,
        source: "Rayleigh in a plane",
    }])
}

/// A square of the area of the unit circle: after three times `sqrt(rho R^3 / sigma)` the outline's largest less its smallest
/// radius, which no lattice makes smaller than about a particle distance. At the start it is 0.37.
pub fn square(model: Model, fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let drop = Drop::new(model, particles_per_radius(fidelity), 0.05);
    let half = 0.5 * std::f64::consts::PI.sqrt();
    let particles = drop.lattice(|x, y| x.abs() < half && y.abs() < half, |_, _| ZERO);
    let mut spread = f64::INFINITY;
    drop.run(&particles, 3.0, |_, particles| {
        let outline = outline::<24>(particles, drop.particle_distance());
        let least = outline.iter().copied().fold(f64::INFINITY, f64::min);
        spread = outline.iter().copied().fold(0.0, f64::max) - least;
    })?;
    Ok(vec![Outcome {
        effect: model.effect(),
        case: "a square becomes round",
        quantity: "spread of its radii, R (absolute)",
        value: spread,
        reference: 0.0,
        error: spread,
        gate: 0.1,
        source: "a circle, to 1.5 particle distances",
    }])
}
