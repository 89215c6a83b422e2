//! The pressure of water that should be still.

use std::collections::BTreeMap;

use crate::base::statistics::standard_deviation;
use crate::base::vec3::{dot, sub};
use crate::engine::parameters::Parameters;
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::experiment::quantity::Quantity;

/// The pressure of still water: its mean over time in layers one particle distance high, and its course at the middle of
/// the floor.
pub struct Profile {
    particle_distance_m: f64,
    surface_m: f64,
    /// Pascals a metre.
    gradient_pa_m: f64,
    depth_m: f64,
    /// Sums of pressure and of height, and the count, by layer.
    layers: BTreeMap<i64, (f64, f64, f64)>,
    /// The wall particle under the middle of the fluid.
    floor: usize,
    floor_pressure_pa: Vec<f64>,
}

impl Profile {
    /// `None` where there is no pressure, no gravity along -y, or where walls do not hold the fluid on all sides.
    pub fn new(initial: &[InitialParticle], parameters: &Parameters, surface_m: f64) -> Option<Self> {
        parameters.effects.pressure.as_ref()?;
        let [gx, gy, gz] = parameters.effects.gravity?.acceleration_m_s2;
        let fluid = || initial.iter().filter(|p| p.kind == Kind::Fluid);
        let count = fluid().count() as f64;
        let lowest = fluid().map(|p| p.position[1]).fold(f64::INFINITY, f64::min);
        let middle = |d: usize| fluid().map(|p| p.position[d]).sum::<f64>() / count;
        let centre = [middle(0), lowest - parameters.particle_distance_m, middle(2)];
        let off = |i: &usize| {
            let away = sub(initial[*i].position, centre);
            dot(away, away)
        };
        let walls = (0..initial.len()).filter(|&i| initial[i].kind == Kind::Wall);
        let floor = walls.min_by(|a, b| off(a).total_cmp(&off(b)))?;
        let still = gx == 0.0 && gz == 0.0 && gy < 0.0 && is_held(initial, parameters.particle_distance_m);
        still.then_some(Profile {
            particle_distance_m: parameters.particle_distance_m,
            surface_m,
            gradient_pa_m: -gy * parameters.density_kg_m3,
            depth_m: surface_m - lowest + 0.5 * parameters.particle_distance_m,
            layers: BTreeMap::new(),
            floor,
            floor_pressure_pa: Vec::new(),
        })
    }

    pub fn look(&mut self, particles: &Particles) {
        for (i, kind) in particles.kind.iter().enumerate() {
            let height_m = particles.position[i][1];
            if *kind == Kind::Fluid && height_m < self.surface_m {
                let layer = (height_m / self.particle_distance_m).round() as i64;
                let (pressure, height, count) = self.layers.entry(layer).or_default();
                (*pressure, *height) = (*pressure + particles.pressure[i], *height + height_m);
                *count += 1.0;
            }
        }
        self.floor_pressure_pa.push(particles.pressure[self.floor]);
    }

    /// `sqrt(sum (p - rho g h)^2 / sum (rho g h)^2)` over the layers' means, and the noise.
    pub fn quantities(&self) -> Vec<(Quantity, f64)> {
        let (mut wrong, mut right) = (0.0, 0.0);
        for (pressure, height, count) in self.layers.values() {
            let exact = self.gradient_pa_m * (self.surface_m - height / count);
            wrong += (pressure / count - exact).powi(2);
            right += exact * exact;
        }
        let (Some(deviation), true) = (standard_deviation(&self.floor_pressure_pa), right > 0.0) else {
            return Vec::new();
        };
        let noise = deviation / (self.gradient_pa_m * self.depth_m);
        vec![(Quantity::ProfileError, (wrong / right).sqrt()), (Quantity::PressureNoise, noise)]
    }
}

/// Whether a wall particle stands a particle distance beyond the fluid on each of its four upright sides.
fn is_held(initial: &[InitialParticle], particle_distance_m: f64) -> bool {
    let fluid = || initial.iter().filter(|p| p.kind == Kind::Fluid);
    let low = [0, 1, 2].map(|d| fluid().map(|p| p.position[d]).fold(f64::INFINITY, f64::min));
    let high = [0, 1, 2].map(|d| fluid().map(|p| p.position[d]).fold(f64::NEG_INFINITY, f64::max));
    let wall_at = |d: usize, x: f64| {
        initial.iter().any(|p| {
            let beside = (0..3).all(|e| e == d || (low[e]..=high[e]).contains(&p.position[e]));
            p.kind == Kind::Wall && (p.position[d] - x).abs() < 0.1 * particle_distance_m && beside
        })
    };
    let l0 = particle_distance_m;
    [0, 2].into_iter().all(|d| wall_at(d, low[d] - l0) && wall_at(d, high[d] + l0))
}
