//! The length, the speed and the time of a scene, and what its fluid is like.

use serde::Serialize;

use crate::base::vec3::{Vec3, dot};
use crate::engine::particles::{InitialParticle, Kind};
use crate::scene::Scene;

/// What a scene's effects are measured by. `None` is what nobody said about the fluid.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Scales {
    /// The fluid's extent against gravity at the start or, without gravity, its smallest extent.
    pub length_m: f64,
    /// The largest of: speeds at the start, of walls and inflows, of a fall by the length, of rising warm fluid.
    pub speed_m_s: f64,
    /// The simulated time.
    pub time_s: f64,
    pub particle_distance_m: f64,
    pub time_step_s: f64,
    pub density_kg_m3: f64,
    pub gravity_m_s2: f64,
    pub compressibility_1_pa: f64,
    pub viscosity_m2_s: Option<f64>,
    pub surface_tension_n_m: Option<f64>,
    pub thermal_diffusivity_m2_s: Option<f64>,
    pub thermal_expansion_1_k: Option<f64>,
    /// Between the warmest and the coldest particle; `None` in a scene without heat.
    pub temperature_difference_k: Option<f64>,
    pub yield_stress_pa: Option<f64>,
}

impl Scales {
    /// Those of a scene whose particles start as `initial`.
    pub fn of(scene: &Scene, initial: &[InitialParticle]) -> Scales {
        let effects = &scene.effects;
        let moving: Vec<&InitialParticle> = initial.iter().filter(|p| p.kind.moves()).collect();
        let extent = extent(&moving, scene.particle_distance_m);
        let gravity = effects.gravity.as_ref().map_or([0.0; 3], |gravity| gravity.acceleration_m_s2);
        let gravity_m_s2 = dot(gravity, gravity).sqrt();
        let length_m = match gravity_m_s2 > 0.0 {
            true => (0..3).map(|d| extent[d] * gravity[d].abs() / gravity_m_s2).sum(),
            false => extent[..scene.dimensions as usize].iter().copied().fold(f64::INFINITY, f64::min),
        };
        let temperatures = || initial.iter().filter(|p| p.kind != Kind::Ghost).map(|p| p.temperature);
        let (coldest, warmest) =
            (temperatures().fold(f64::INFINITY, f64::min), temperatures().fold(f64::NEG_INFINITY, f64::max));
        let mut scales = Scales {
            length_m,
            speed_m_s: 0.0,
            time_s: scene.end_time_s,
            particle_distance_m: scene.particle_distance_m,
            time_step_s: scene.time_step_s,
            density_kg_m3: scene.fluid.density_kg_m3,
            gravity_m_s2,
            compressibility_1_pa: effects
                .pressure
                .as_ref()
                .map_or(0.0, |pressure| pressure.compressibility_1_pa),
            viscosity_m2_s: scene.kinematic_viscosity_m2_s(),
            surface_tension_n_m: scene.surface_tension_n_m(),
            thermal_diffusivity_m2_s: scene.thermal_diffusivity_m2_s(),
            thermal_expansion_1_k: scene.thermal_expansion_1_k(),
            temperature_difference_k: effects.heat.is_some().then_some(warmest - coldest),
            yield_stress_pa: scene.yield_stress_pa(),
        };
        scales.speed_m_s = scales.speed(scene, &moving);
        scales
    }

    /// `U dt / l0`.
    pub fn courant(&self) -> f64 {
        self.speed_m_s * self.time_step_s / self.particle_distance_m
    }

    fn speed(&self, scene: &Scene, moving: &[&InitialParticle]) -> f64 {
        let start = moving.iter().map(|p| dot(p.velocity, p.velocity).sqrt()).fold(0.0, f64::max);
        // In a full, warmed domain nothing falls: the warm fluid rises instead.
        let rise = match (self.thermal_expansion_1_k, self.temperature_difference_k) {
            (Some(expansion), Some(difference)) if scene.effects.buoyancy.is_some() => {
                Some((self.gravity_m_s2 * expansion * difference.abs() * self.length_m).sqrt())
            }
            _ => None,
        };
        let fall = (2.0 * self.gravity_m_s2 * self.length_m).sqrt();
        let driven = scene.driven_speed_m_s();
        let smallest = f64::MIN_POSITIVE;
        start.max(rise.unwrap_or(fall)).max(driven).max(smallest)
    }
}

/// The extent of the moving particles, each counted with a particle distance.
fn extent(moving: &[&InitialParticle], particle_distance_m: f64) -> Vec3 {
    [0, 1, 2].map(|d| {
        let along = || moving.iter().map(|p| p.position[d]);
        let (low, high) = (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max));
        (high - low).max(0.0) + particle_distance_m
    })
}
