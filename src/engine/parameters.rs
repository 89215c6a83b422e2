//! The constants of a simulation, as data: what a scene says about the fluid, the scheme and its effects.

use crate::base::vec3::Vec3;
use crate::engine::effects::buoyancy::Buoyancy;
use crate::engine::effects::collision::Collision;
use crate::engine::effects::diffusion::Diffusion;
use crate::engine::effects::flow_boundaries::FlowBoundaries;
use crate::engine::effects::frame::Frame;
use crate::engine::effects::gravity::Gravity;
use crate::engine::effects::implicit_viscosity::ImplicitViscosity;
use crate::engine::effects::potential_tension::PotentialTension;
use crate::engine::effects::rheology::Rheology;
use crate::engine::effects::rigid_bodies::RigidBodies;
use crate::engine::effects::shifting::Shifting;
use crate::engine::effects::surface_tension::SurfaceTension;
use crate::engine::effects::turbulence::Turbulence;
use crate::engine::effects::viscosity::Viscosity;
use crate::engine::effects::wall_contact::WallContact;
use crate::engine::effects::wall_motion::WallMotion;
use crate::engine::kernel::{Dimensions, Reference};
use crate::engine::pressure::Pressure;
use crate::engine::search::Lengths;

/// Everything that does not change while a simulation runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    pub dimensions: Dimensions,
    /// Spacing `l0` of the particles, metres.
    pub particle_distance_m: f64,
    /// Length of a time step, seconds; the longest one where steps adapt.
    pub time_step_s: f64,
    /// `None` where all steps are equally long.
    pub adaptive: Option<AdaptiveTimeStep>,
    /// Density of the fluid, kg/m3.
    pub density_kg_m3: f64,
    pub radii: Radii,
    pub domain: Domain,
    /// What particles are called, by the number in their column `group`; empty where the scene names no groups.
    pub groups: Vec<String>,
    pub effects: Effects,
}

/// How steps adapt to the flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveTimeStep {
    /// The share of a particle distance that the fastest particle may move in a step.
    pub courant: f64,
    /// The share of the longest stable step that effects may use, such as explicit viscosity's.
    pub safety: f64,
    /// By how much a step may be longer than the last one.
    pub growth: f64,
    /// A simulation that would need a shorter step than this, seconds, ends with an error.
    pub shortest_s: f64,
}

/// A property of the fluid: the same everywhere, or by the group of a particle.
#[derive(Debug, Clone, PartialEq)]
pub enum Property {
    Uniform(f64),
    ByGroup(Vec<f64>),
}

impl Property {
    /// The value for a particle of a group.
    #[inline(always)]
    pub fn of(&self, group: u8) -> f64 {
        match self {
            Property::Uniform(value) => *value,
            Property::ByGroup(values) => values[group as usize],
        }
    }

    /// The value, if it is the same for all groups.
    pub fn uniform(&self) -> Option<f64> {
        match self {
            Property::Uniform(value) => Some(*value),
            Property::ByGroup(values) => {
                values.first().copied().filter(|first| values.iter().all(|value| value == first))
            }
        }
    }

    /// The largest value of any group.
    pub fn largest(&self) -> f64 {
        match self {
            Property::Uniform(value) => *value,
            Property::ByGroup(values) => values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }
}

/// Influence radii in units of the particle distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radii {
    pub number_density: f64,
    pub gradient: f64,
    pub laplacian: f64,
}

/// The box in which particles are sorted into buckets; outside of it a fluid particle becomes a ghost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// Lower corner, metres.
    pub low: Vec3,
    /// Upper corner, metres.
    pub high: Vec3,
    /// Along which axes the box repeats itself.
    pub periodic: [bool; 3],
}

impl Domain {
    /// A box that repeats itself along no axis.
    pub const fn new(low: Vec3, high: Vec3) -> Self {
        Domain { low, high, periodic: [false; 3] }
    }
}

/// The effects that a scene names. What is `None` has no stage, no phase and no column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Effects {
    pub gravity: Option<Gravity>,
    pub buoyancy: Option<Buoyancy>,
    pub viscosity: Option<Viscosity>,
    pub heat: Option<Diffusion>,
    pub scalar: Option<Diffusion>,
    pub implicit_viscosity: Option<ImplicitViscosity>,
    pub rheology: Option<Rheology>,
    pub turbulence: Option<Turbulence>,
    pub potential_tension: Option<PotentialTension>,
    pub collision: Option<Collision>,
    pub wall_contact: Option<WallContact>,
    pub surface_tension: Option<SurfaceTension>,
    pub pressure: Option<Pressure>,
    pub frame: Option<Frame>,
    pub wall_motion: Option<WallMotion>,
    pub flow_boundaries: Option<FlowBoundaries>,
    pub rigid_bodies: Option<RigidBodies>,
    pub shifting: Option<Shifting>,
}

impl Effects {
    /// Whether the scene names nothing beyond the textbook's step: gravity, one viscosity, collisions, contact with walls,
    /// pressure.
    pub fn are_the_textbooks(&self) -> bool {
        let textbook = Effects {
            gravity: self.gravity,
            viscosity: self.viscosity.clone().filter(Viscosity::is_the_textbooks),
            collision: self.collision,
            wall_contact: self.wall_contact,
            pressure: self.pressure.clone(),
            ..Effects::default()
        };
        *self == textbook
    }
}

impl Parameters {
    /// `re_n` in metres.
    pub fn number_density_radius_m(&self) -> f64 {
        self.radii.number_density * self.particle_distance_m
    }

    /// `re_g` in metres.
    pub fn gradient_radius_m(&self) -> f64 {
        self.radii.gradient * self.particle_distance_m
    }

    /// `re_L` in metres.
    pub fn laplacian_radius_m(&self) -> f64 {
        self.radii.laplacian * self.particle_distance_m
    }

    /// The largest radius, metres: what the buckets around a particle must reach.
    pub fn largest_radius_m(&self) -> f64 {
        let contact_m = self.effects.wall_contact.map_or(0.0, |c| c.radius() * self.particle_distance_m);
        let attraction_m = self.effects.potential_tension.map_or(0.0, |tension| tension.radius_m(self));
        let colour_m = self.effects.surface_tension.map_or(0.0, |tension| tension.radius_m(self));
        let radii = [self.number_density_radius_m(), self.gradient_radius_m(), self.laplacian_radius_m()];
        radii.into_iter().chain([attraction_m, colour_m]).fold(contact_m, f64::max)
    }

    /// What a neighbour search is asked for.
    pub fn lengths(&self) -> Lengths {
        Lengths {
            particle_distance_m: self.particle_distance_m,
            small_m: self.number_density_radius_m().max(self.gradient_radius_m()),
            large_m: self.largest_radius_m(),
        }
    }

    /// The reference sums `n0` and `lambda` for a radius in metres.
    pub fn reference(&self, radius_m: f64) -> Reference {
        Reference::on_lattice(self.dimensions, self.particle_distance_m, radius_m)
    }

    /// The factor `2 D / (n0_L lambda)` of the Laplacian model, 1/m2 (Koshizuka & Oka 1996).
    pub fn laplacian_factor(&self) -> f64 {
        let reference = self.reference(self.laplacian_radius_m());
        2.0 * self.dimensions.count() / (reference.number_density * reference.lambda_m2)
    }
}
