//! The pressure in a round drop in space, in the units of [`drop`](super::drop), at the size of a toy. The tension was
//! calibrated in a plane, so this is an independent check. With six particles in a radius the pressure is twice Laplace's:
//! within reach of the surface, `4.1 l0`, the pressure bears what pulls there, and so small a drop has no other inside.

use crate::base::vec3::dot;
use crate::engine::effects::potential_tension::capillary_limit_s;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::Domain;
use crate::engine::particles::{InitialParticle, Kind};
use crate::scene::validation::drop::{self, Drop, Model};
use crate::scene::validation::{Fidelity, Outcome};

/// With `surface_tension` alone: with the potential, what the pressure bears inside is many times the jump.
pub fn laplace(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let particles_per_radius = match fidelity {
        Fidelity::Coarse => 9,
        Fidelity::Full => 12,
    };
    let drop = Drop::new(Model::Lack, particles_per_radius, 0.05);
    let l0 = drop.particle_distance();
    let mut parameters = drop.parameters();
    parameters.dimensions = Dimensions::Three;
    parameters.domain = Domain::new([-2.0; 3], [2.0; 3]);
    parameters.time_step_s = 0.5 * capillary_limit_s(1.0, &parameters);
    let reach = particles_per_radius as i32;
    let mut particles = Vec::new();
    for ix in -reach..reach {
        for iy in -reach..reach {
            for iz in -reach..reach {
                let x = [ix, iy, iz].map(|k| (f64::from(k) + 0.5) * l0);
                if dot(x, x) < 1.0 {
                    particles.push(InitialParticle::at_rest(Kind::Fluid, x));
                }
            }
        }
    }
    let (mut sum, mut count) = (0.0, 0.0);
    drop::run(&parameters, &particles, 1.0, |time, particles| {
        if time > 0.5 {
            for (x, p) in particles.position.iter().zip(&particles.pressure) {
                if dot(*x, *x) < 0.25 {
                    sum += p;
                    count += 1.0;
                }
            }
        }
    })?;
    let volume = particles.len() as f64 * l0 * l0 * l0;
    let radius = (0.75 * volume / std::f64::consts::PI).cbrt();
    let (value, reference) = (sum / count, 2.0 / radius);
    Ok(vec![Outcome {
        effect: Model::Lack.effect(),
        case: "a round drop in space at rest",
        quantity: "pressure inside, sigma / R",
        value,
        reference,
        error: (value - reference).abs() / reference,
        // 5 % at fifteen particles a radius, and in proportion to their distance.
        gate: 0.75 * l0,
        source: "Laplace",
    }])
}
