//! A disc of viscous fluid that turns rigidly in empty space goes on turning: nothing shears. What it keeps of its angular
//! velocity, `sum r x u / sum r^2`, in the time `R^2 / (4 nu)`.

use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Domain, Parameters, Property, Radii};
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::engine::viscous::{Form, Walls};
use crate::scene::validation::channel::{self, SCHEMES, Scheme};
use crate::scene::validation::{Fidelity, Outcome};

const RADIUS_M: f64 = 1.0;
const VISCOSITY_M2_S: f64 = 1.0;
/// So slow that the disc turns by a hundredth of a radian and keeps its shape without a pressure.
const ANGULAR_VELOCITY_1_S: f64 = 0.04;

fn disc(per_radius: usize) -> Vec<InitialParticle> {
    let (l0, reach) = (RADIUS_M / per_radius as f64, per_radius as i32);
    let mut particles = Vec::new();
    for i in -reach..reach {
        for j in -reach..reach {
            let x = [l0 * (f64::from(i) + 0.5), l0 * (f64::from(j) + 0.5), 0.0];
            if x[0] * x[0] + x[1] * x[1] < RADIUS_M * RADIUS_M {
                let velocity = [-ANGULAR_VELOCITY_1_S * x[1], ANGULAR_VELOCITY_1_S * x[0], 0.0];
                particles.push(InitialParticle { velocity, ..InitialParticle::at_rest(Kind::Fluid, x) });
            }
        }
    }
    particles
}

fn parameters(per_radius: usize, time_step_s: f64, scheme: Scheme) -> Parameters {
    Parameters {
        dimensions: Dimensions::Two,
        particle_distance_m: RADIUS_M / per_radius as f64,
        time_step_s,
        adaptive: None,
        density_kg_m3: 1000.0,
        radii: Radii { number_density: 2.1, gradient: 2.1, laplacian: 3.1 },
        domain: Domain::new([-1.5 * RADIUS_M, -1.5 * RADIUS_M, 0.0], [1.5 * RADIUS_M, 1.5 * RADIUS_M, 0.0]),
        groups: Vec::new(),
        effects: scheme.effects(Property::Uniform(VISCOSITY_M2_S), Walls::Resting),
    }
}

/// 1/s, about the origin.
fn angular_velocity(particles: &Particles) -> f64 {
    let pairs = || particles.position.iter().zip(&particles.velocity);
    let momentum: f64 = pairs().map(|(x, u)| x[0] * u[1] - x[1] * u[0]).sum();
    let inertia: f64 = particles.position.iter().map(|x| x[0] * x[0] + x[1] * x[1]).sum();
    momentum / inertia
}

/// The share of its angular velocity that the disc keeps; implicit steps are ten times as long as the explicit limit.
pub fn kept(per_radius: usize, scheme: Scheme) -> Result<f64, String> {
    let l0 = RADIUS_M / per_radius as f64;
    let limits = if scheme.implicit { 10.0 } else { 0.5 };
    let (time_s, limit_s) =
        (0.25 * RADIUS_M * RADIUS_M / VISCOSITY_M2_S, 2.4485 / 4.0 * l0 * l0 / VISCOSITY_M2_S);
    let steps = (time_s / (limits * limit_s)).ceil();
    let parameters = parameters(per_radius, time_s / steps, scheme);
    let mut simulation = channel::build(&parameters, &disc(per_radius))?;
    let before = angular_velocity(simulation.particles());
    channel::advance(simulation.as_mut(), steps as usize)?;
    Ok(angular_velocity(simulation.particles()) / before)
}

/// 12 particles a radius, the angular-momentum form; 24 in full. The disc widens by `(omega t)^2 / 2`, 5e-5, since nothing
/// holds it together: as much of its angular velocity is lost in the moment of inertia.
pub fn run(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let per_radius = if fidelity == Fidelity::Full { 24 } else { 12 };
    let outcome = |scheme: Scheme| {
        let value = kept(per_radius, scheme)?;
        Ok(Outcome {
            effect: scheme.effect(),
            case: "rotating disc",
            quantity: "angular velocity over that at the start",
            value,
            reference: 1.0,
            error: (value - 1.0).abs(),
            gate: 1e-3,
            source: "rigid rotation has no strain",
        })
    };
    SCHEMES.into_iter().filter(|scheme| scheme.form == Form::AngularMomentum).map(outcome).collect()
}
