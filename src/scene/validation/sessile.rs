//! A drop on a wall in a plane, in the units of [`drop`](super::drop): the angle at which its surface meets the wall.
//!
//! It starts as half a disc and flows until its surface meets the wall as the set angle has it. The angle is that of the
//! circular segment with the drop's area whose middle is as high above the wall as the drop's: with the half angle `t` and the
//! radius `r` the area is `r^2 (t - sin t cos t)`, the height `2/3 r sin^3 t / (t - sin t cos t) - r cos t`. The wall's surface
//! lies half a particle distance below the lowest fluid.

use crate::base::vec3::ZERO;
use crate::engine::effects::potential_tension::wetting;
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::scene::validation::drop::{self, Drop, Model};
use crate::scene::validation::{Fidelity, Outcome};

/// Rows of wall with a pressure, and in all.
const LAYERS: [i32; 2] = [2, 4];

/// Neutral walls with both models, and with the potential one that attracts and one that shuns.
pub fn angles(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let cases = [
        (Model::Lack, 90.0, "a drop on a neutral wall"),
        (Model::Potential, 90.0, "a drop on a neutral wall"),
        (Model::Potential, 60.0, "a drop on a wall that attracts"),
        (Model::Potential, 120.0, "a drop on a wall that shuns"),
    ];
    cases.into_iter().map(|(model, angle_deg, case)| sessile(model, angle_deg, case, fidelity)).collect()
}

/// Half a disc that flows for four times `sqrt(rho R^3 / sigma)`; the angle is averaged over the last fourth.
fn sessile(model: Model, angle_deg: f64, case: &'static str, fidelity: Fidelity) -> Result<Outcome, String> {
    let particles_per_radius = match fidelity {
        Fidelity::Coarse => 15,
        Fidelity::Full => 20,
    };
    let drop = Drop::new(model, particles_per_radius, 0.05);
    let mut parameters = drop.parameters();
    if let Some(tension) = &mut parameters.effects.potential_tension {
        tension.wetting = wetting(angle_deg);
    }
    let l0 = drop.particle_distance();
    let mut particles = drop.lattice(|x, y| y > 0.0 && x * x + y * y < 1.0, |_, _| ZERO);
    let fluid = particles.len();
    let half = 3 * particles_per_radius as i32;
    for ix in -half..half {
        for layer in 0..LAYERS[1] {
            let kind = if layer < LAYERS[0] { Kind::Wall } else { Kind::DummyWall };
            let [x, y] = [ix, -1 - layer].map(|k| (f64::from(k) + 0.5) * l0);
            particles.push(InitialParticle::at_rest(kind, [x, y, 0.0]));
        }
    }
    let (mut height, mut count) = (0.0, 0.0);
    drop::run(&parameters, &particles, 4.0, |time, particles| {
        if time > 3.0 {
            height += mean_height(particles, fluid);
            count += 1.0;
        }
    })?;
    let value = segment_angle_deg(fluid as f64 * l0 * l0, height / count);
    Ok(Outcome {
        effect: model.effect(),
        case,
        quantity: "contact angle, degrees (absolute)",
        value,
        reference: angle_deg,
        error: (value - angle_deg).abs(),
        gate: 10.0,
        source: "Young",
    })
}

fn mean_height(particles: &Particles, fluid: usize) -> f64 {
    particles.position[..fluid].iter().map(|x| x[1]).sum::<f64>() / fluid as f64
}

/// The angle of the segment of a disc with this area whose middle is this high above its chord, degrees; by bisection.
pub fn segment_angle_deg(area: f64, height: f64) -> f64 {
    let (mut low, mut high) = (0.01, std::f64::consts::PI - 0.01);
    for _ in 0..60 {
        let t: f64 = 0.5 * (low + high);
        let (sin, cos) = t.sin_cos();
        let share = t - sin * cos;
        let radius = (area / share).sqrt();
        let middle = radius * (2.0 / 3.0 * sin * sin * sin / share - cos);
        if middle < height { low = t } else { high = t }
    }
    (0.5 * (low + high)).to_degrees()
}
