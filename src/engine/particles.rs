//! Particles as columns: one entry a particle, its index being its identity for the whole run.

use crate::base::parallel::{Rows, Workers};
use crate::base::vec3::{Vec3, ZERO};
use crate::engine::columns::{Column, Visitor};

/// What a particle is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[repr(u8)]
pub enum Kind {
    /// Moves, has a pressure.
    Fluid,
    /// Stands still, has a pressure: the wall layers next to the fluid.
    Wall,
    /// Stands still, has no pressure: the outer layers, which only complete the walls' neighbourhoods.
    DummyWall,
    /// Not there: left the bucket domain, or waits to be let in. Out of all sums, velocity and pressure zero.
    #[default]
    Ghost,
    /// Moves with the rigid body that it is a part of, has a pressure.
    Body,
}

impl Kind {
    pub const ALL: [Kind; 5] = [Kind::Fluid, Kind::Wall, Kind::DummyWall, Kind::Ghost, Kind::Body];

    /// Whether forces move it.
    #[inline(always)]
    pub fn moves(self) -> bool {
        matches!(self, Kind::Fluid | Kind::Body)
    }

    /// The name in every file.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Fluid => "fluid",
            Kind::Wall => "wall",
            Kind::DummyWall => "dummy_wall",
            Kind::Ghost => "ghost",
            Kind::Body => "body",
        }
    }

    /// The kind with that name.
    pub fn from_name(name: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

/// One particle as a scene places it: at rest unless it says otherwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InitialParticle {
    pub kind: Kind,
    /// Metres.
    pub position: Vec3,
    /// Metres per second.
    pub velocity: Vec3,
    /// Pascals.
    pub pressure: f64,
    /// Which of the scene's named groups it belongs to; 0 where a scene names none.
    pub group: u8,
    /// Kelvin; 0 where a scene names none.
    pub temperature: f64,
    /// Of a dissolved substance, in the scene's unit; 0 where a scene names none.
    pub concentration: f64,
}

impl InitialParticle {
    pub fn at_rest(kind: Kind, position: Vec3) -> Self {
        InitialParticle {
            kind,
            position,
            velocity: ZERO,
            pressure: 0.0,
            group: 0,
            temperature: 0.0,
            concentration: 0.0,
        }
    }
}

/// All particles, a column a field. Columns that no effect of the scene needs are empty.
#[derive(Debug, Clone, Default)]
pub struct Particles {
    pub kind: Vec<Kind>,
    /// Metres.
    pub position: Vec<Vec3>,
    /// Metres per second.
    pub velocity: Vec<Vec3>,
    /// Metres per second squared; zero between two stages that move particles.
    pub acceleration: Vec<Vec3>,
    /// Pascals; empty in a scene without pressure.
    pub pressure: Vec<f64>,
    /// Dimensionless sum of weights; empty in a scene without pressure.
    pub number_density: Vec<f64>,
    /// Which named group each belongs to; empty in a scene that names none.
    pub group: Vec<u8>,
    /// Kelvin, or any other scale that the scene uses throughout; empty in a scene without heat.
    pub temperature: Vec<f64>,
    /// Kelvin per second, gathered by the terms of a step; zero between steps.
    pub temperature_rate: Vec<f64>,
    /// Of a passive scalar, in the scene's own unit; empty in a scene without one.
    pub concentration: Vec<f64>,
    /// Per second, gathered by the terms of a step; zero between steps.
    pub concentration_rate: Vec<f64>,
    /// Kinematic, square metres per second; empty where it is the same for all particles.
    pub viscosity: Vec<f64>,
}

impl Particles {
    /// Columns in memory that the workers touch first, each its own part.
    pub fn new(initial: &[InitialParticle], workers: &Workers) -> Self {
        let count = initial.len();
        let mut particles = Particles {
            kind: workers.column(count, Kind::Ghost),
            position: workers.column(count, ZERO),
            velocity: workers.column(count, ZERO),
            acceleration: workers.column(count, ZERO),
            ..Particles::default()
        };
        let columns = (
            Rows::new(&mut particles.kind),
            Rows::new(&mut particles.position),
            Rows::new(&mut particles.velocity),
        );
        workers.shared_evenly().fill(columns, |range, (kind, position, velocity)| {
            for (k, particle) in initial[range].iter().enumerate() {
                (kind[k], position[k], velocity[k]) = (particle.kind, particle.position, particle.velocity);
            }
        });
        particles
    }

    /// Adds the columns that pressure needs.
    pub fn add_pressure_columns(&mut self, initial: &[InitialParticle], workers: &Workers) {
        self.pressure = workers.column(self.len(), 0.0);
        self.number_density = workers.column(self.len(), 0.0);
        for (pressure, particle) in self.pressure.iter_mut().zip(initial) {
            *pressure = particle.pressure;
        }
    }

    /// Adds the columns that heat needs.
    pub fn add_temperature(&mut self, initial: &[InitialParticle], workers: &Workers) {
        self.temperature_rate = workers.column(self.len(), 0.0);
        self.temperature = workers.column(self.len(), 0.0);
        for (temperature, particle) in self.temperature.iter_mut().zip(initial) {
            *temperature = particle.temperature;
        }
    }

    /// Adds the columns that a passive scalar needs.
    pub fn add_concentration(&mut self, initial: &[InitialParticle], workers: &Workers) {
        self.concentration_rate = workers.column(self.len(), 0.0);
        self.concentration = workers.column(self.len(), 0.0);
        for (concentration, particle) in self.concentration.iter_mut().zip(initial) {
            *concentration = particle.concentration;
        }
    }

    /// Adds the column of groups.
    pub fn add_groups(&mut self, initial: &[InitialParticle], workers: &Workers) {
        self.group = workers.column(self.len(), 0);
        for (group, particle) in self.group.iter_mut().zip(initial) {
            *group = particle.group;
        }
    }

    /// Adds the column of viscosities, `of_group` telling that of each particle.
    pub fn add_viscosity(&mut self, of_group: impl Fn(u8) -> f64, workers: &Workers) {
        self.viscosity = workers.column(self.len(), 0.0);
        for i in 0..self.len() {
            self.viscosity[i] = of_group(self.group_of(i));
        }
    }

    /// The group of a particle, 0 where the scene names none.
    #[inline(always)]
    pub fn group_of(&self, i: usize) -> u8 {
        self.group.get(i).copied().unwrap_or(0)
    }

    /// Shows all columns that the scene calls for, by name.
    pub fn visit(&mut self, visitor: &mut Visitor<'_>) {
        visitor("kind", Column::Kinds(&mut self.kind));
        visitor("position", Column::Vectors(&mut self.position));
        visitor("velocity", Column::Vectors(&mut self.velocity));
        visitor("acceleration", Column::Vectors(&mut self.acceleration));
        let scalars = [
            ("pressure", &mut self.pressure),
            ("number_density", &mut self.number_density),
            ("temperature", &mut self.temperature),
            ("temperature_rate", &mut self.temperature_rate),
            ("concentration", &mut self.concentration),
            ("concentration_rate", &mut self.concentration_rate),
            ("viscosity", &mut self.viscosity),
        ];
        for (name, column) in scalars {
            if !column.is_empty() {
                visitor(name, Column::Scalars(column));
            }
        }
        if !self.group.is_empty() {
            visitor("group", Column::Groups(&mut self.group));
        }
    }

    pub fn len(&self) -> usize {
        self.kind.len()
    }

    pub fn is_empty(&self) -> bool {
        self.kind.is_empty()
    }

    /// How many particles are of `kind` now.
    pub fn count(&self, kind: Kind) -> usize {
        self.kind.iter().filter(|&&k| k == kind).count()
    }

    /// Bytes that the columns take.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.kind[..])
            + size_of_val(&self.group[..])
            + [&self.position, &self.velocity, &self.acceleration]
                .map(|c| size_of_val(&c[..]))
                .iter()
                .sum::<usize>()
            + [
                &self.pressure,
                &self.number_density,
                &self.temperature,
                &self.temperature_rate,
                &self.concentration,
                &self.concentration_rate,
                &self.viscosity,
            ]
            .map(|c| size_of_val(&c[..]))
            .iter()
            .sum::<usize>()
    }
}
