//! A probe with all that it needs to know about its scene.

use crate::base::input::{Check, InputError};
use crate::base::vec3::{Vec3, ZERO};
use crate::engine::diagnostics::energy;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::Domain;
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::scene::Scene;
use crate::scene::probe::measure::{
    ForceModel, Rectangle, SmoothKernel, centre_of_mass, crossings, front, point_pressure, pressure_force,
    surface_height,
};
use crate::scene::probe::spec::{Axis, Measure, ProbeSpec};

/// Radius of the smooth kernel where a probe names none, particle distances.
const SMOOTH_RADIUS: f64 = 3.0;

/// What probes need to know about their scene.
#[derive(Debug, Clone)]
pub struct Setting {
    domain: Domain,
    particle_distance_m: f64,
    density_kg_m3: f64,
    gravity: Vec3,
    has_pressure: bool,
    /// Whether the scene is a plane, which makes volumes areas.
    pub planar: bool,
    /// Of one particle: m3, in a planar scene m2.
    pub volume: f64,
    force: ForceModel,
    has_walls: bool,
}

impl Setting {
    pub fn new(scene: &Scene, initial: &[InitialParticle]) -> Setting {
        let parameters = scene.parameters(initial);
        let (l0, radius_m) = (parameters.particle_distance_m, parameters.gradient_radius_m());
        let planar = parameters.dimensions == Dimensions::Two;
        let (dimensions, reference) =
            (parameters.dimensions.count(), parameters.reference(radius_m).number_density);
        let volume = parameters.dimensions.volume(l0);
        Setting {
            domain: parameters.domain,
            particle_distance_m: l0,
            density_kg_m3: parameters.density_kg_m3,
            gravity: parameters.effects.gravity.map_or(ZERO, |gravity| gravity.acceleration_m_s2),
            has_pressure: parameters.effects.pressure.is_some(),
            planar,
            volume,
            force: ForceModel { radius_m, reference, dimensions, volume },
            has_walls: initial.iter().any(|particle| particle.kind == Kind::Wall),
        }
    }

    fn require_inside(&self, check: Check<'_>, key: &str, point: Vec3) -> Result<(), InputError> {
        let Domain { low, high, .. } = self.domain;
        let inside = (0..3).all(|d| (low[d]..=high[d]).contains(&point[d]));
        let allowed = format!(
            "allowed are places inside the scene's domain, {low:?} .. {high:?} m: move the probe, or widen `domain.margin_m`"
        );
        check.require(inside, key, format!("{point:?}"), allowed)
    }
}

/// A probe that fits its scene.
#[derive(Debug)]
pub struct Prepared {
    pub name: String,
    pub every_steps: usize,
    measure: Measure,
    /// The number of the group whose force is measured.
    group: Option<u8>,
}

impl Prepared {
    /// Holds a probe against its scene. `key` is that of what it measures.
    pub fn new(
        spec: &ProbeSpec,
        setting: &Setting,
        file: &str,
        key: &str,
        group_number: &dyn Fn(&str) -> Option<u8>,
    ) -> Result<Prepared, InputError> {
        let check = Check { file };
        let mut group = None;
        match &spec.measure {
            Measure::PointPressure(at) => {
                setting.require_inside(check, &format!("{key}.point_pressure.at_m"), at.at_m)?;
            }
            Measure::Gauge(line) => {
                let foot = [line.x_m, setting.domain.low[1], line.z_m];
                setting.require_inside(check, &format!("{key}.gauge"), foot)?;
            }
            Measure::Flux(plane) => {
                setting.require_inside(check, &format!("{key}.flux.from_m"), plane.from_m)?;
                setting.require_inside(check, &format!("{key}.flux.to_m"), plane.to_m)?;
            }
            Measure::GroupForce(force) => {
                if let Some(name) = &force.group {
                    group = group_number(name);
                    let allowed =
                        "allowed are the groups that the scene names; without the key all walls count";
                    check.require(
                        group.is_some(),
                        &format!("{key}.group_force.group"),
                        format!("`{name}`"),
                        allowed,
                    )?;
                }
                let remedy = "a force needs wall particles: give the scene a region of `wall`";
                check.require(
                    setting.has_walls,
                    &format!("{key}.group_force"),
                    "in a scene without walls",
                    remedy,
                )?;
            }
            Measure::Energy | Measure::CentreOfMass | Measure::Front(_) => {}
        }
        if matches!(spec.measure, Measure::PointPressure(_) | Measure::GroupForce(_)) {
            let remedy = "pressure can be measured where there is one: name `effects.pressure`, or leave the probe out";
            check.require(setting.has_pressure, key, "in a scene without pressure", remedy)?;
        }
        Ok(Prepared {
            name: spec.name.clone(),
            every_steps: spec.every_steps,
            measure: spec.measure.clone(),
            group,
        })
    }

    /// The names of the columns after the probe's own: quantity and unit.
    pub fn quantities(&self, planar: bool) -> Vec<&'static str> {
        match (&self.measure, planar) {
            (Measure::PointPressure(_), _) => vec!["pressure_pa"],
            (Measure::Gauge(_), _) => vec!["height_m"],
            (Measure::Flux(_), false) => vec!["flux_m3_s"],
            (Measure::Flux(_), true) => vec!["flux_m2_s"],
            (Measure::GroupForce(_), false) => vec!["force_x_n", "force_y_n", "force_z_n"],
            (Measure::GroupForce(_), true) => vec!["force_x_n_m", "force_y_n_m", "force_z_n_m"],
            (Measure::Energy, false) => vec!["kinetic_j", "potential_j"],
            (Measure::Energy, true) => vec!["kinetic_j_m", "potential_j_m"],
            (Measure::CentreOfMass, _) => vec!["x_m", "y_m", "z_m"],
            (Measure::Front(_), _) => vec!["max_m", "p99_m"],
        }
    }

    /// Where this probe counts what goes through a rectangle.
    pub fn flow(&self) -> Option<Flow> {
        let Measure::Flux(flux) = &self.measure else {
            return None;
        };
        let axis = (0..3).find(|&d| flux.from_m[d] == flux.to_m[d])?;
        Some(Flow { rectangle: Rectangle { axis, low: flux.from_m, high: flux.to_m }, net: 0, since_s: None })
    }

    /// The values of a probe that depends on this moment only; a value a quantity.
    pub fn values(&self, setting: &Setting, particles: &Particles, groups: &[u8]) -> Vec<Option<f64>> {
        let Particles { kind, position, pressure, .. } = particles;
        let radius_m = SMOOTH_RADIUS * setting.particle_distance_m;
        match &self.measure {
            Measure::PointPressure(at) => {
                let kernel = SmoothKernel::new(at.radius_m.unwrap_or(radius_m), setting.planar);
                vec![point_pressure(at.at_m, kernel, kind, position, pressure)]
            }
            Measure::Gauge(line) => {
                let (kernel, l0) = (SmoothKernel::new(radius_m, setting.planar), setting.particle_distance_m);
                vec![surface_height([line.x_m, line.z_m], kernel, setting.volume, l0, kind, position)]
            }
            Measure::GroupForce(_) => {
                let belongs = |i: usize| self.group.is_none_or(|group| groups[i] == group);
                pressure_force(&setting.force, kind, position, pressure, belongs).map(Some).to_vec()
            }
            Measure::Energy => {
                let (mass, energy) =
                    (setting.density_kg_m3 * setting.volume, energy(particles, setting.gravity));
                vec![Some(mass * energy.kinetic), Some(mass * energy.potential)]
            }
            Measure::CentreOfMass => spread(centre_of_mass(kind, position)),
            Measure::Front(along) => {
                let axis = match along.axis {
                    Axis::X => 0,
                    Axis::Y => 1,
                    Axis::Z => 2,
                };
                spread(front(axis, kind, position))
            }
            // A flux needs the moment before, too: `Flow` keeps count.
            Measure::Flux(_) => vec![None],
        }
    }
}

fn spread<const N: usize>(values: Option<[f64; N]>) -> Vec<Option<f64>> {
    values.map_or(vec![None; N], |values| values.map(Some).to_vec())
}

/// Counts what goes through a rectangle between two rows.
#[derive(Debug)]
pub struct Flow {
    rectangle: Rectangle,
    /// Particles since the last row, those upwards along the axis less those downwards.
    net: i64,
    since_s: Option<f64>,
}

impl Flow {
    pub fn count(&mut self, before: &(Vec<Kind>, Vec<Vec3>), after: &Particles) {
        let then = (before.0.as_slice(), before.1.as_slice());
        self.net += crossings(self.rectangle, then, (&after.kind, &after.position));
    }

    /// The mean since the last row, in volume a second; nothing at the first look. Begins to count anew.
    pub fn rate(&mut self, time_s: f64, volume: f64) -> Option<f64> {
        let since_s = self.since_s.replace(time_s);
        let net = std::mem::take(&mut self.net);
        since_s.filter(|&since_s| time_s > since_s).map(|since_s| net as f64 * volume / (time_s - since_s))
    }
}
