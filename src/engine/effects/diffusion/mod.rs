//! Diffusion of what particles carry: `C_i dT_i/dt = (2D / (n0_L lambda)) sum_j k_ij (T_j - T_i) w(r_ij, re_L)`.
//!
//! Heat and a passive scalar share it. `k_ij = 2 k_i k_j / (k_i + k_j)`, the harmonic mean, lets the same flux pass both
//! halves of the way between two particles of different material; the sum is antisymmetric, so that what is carried is
//! conserved to rounding where no wall gives or takes. The Laplacian model is that of Koshizuka & Oka 1996, exact for
//! parabolas on the lattice. On disordered particles its error does not fall with the spacing: `corrected` fits a parabola
//! instead, which costs a small system of equations a particle and conservation.
//!
//! Walls hold a value at their surface or let a flux through it; see [`walls`] for where a surface is.

pub mod advance;
pub mod corrected;
pub mod lattice;
pub mod walls;

use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Parameters, Property};
use crate::engine::particles::{Kind, Particles};
use crate::engine::phase::Phase;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Fields, Stage};
use crate::engine::terms::{PairPass, PairTerm, Rates};
use corrected::CorrectedDiffusion;
use lattice::LatticeDiffusion;

/// How the Laplacian is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Laplacian {
    /// The model of the lattice: conserves, and is as accurate as particles are regular.
    #[default]
    Lattice,
    /// A parabola fitted to each neighbourhood: converges on disordered particles, and does not conserve.
    Corrected,
}

/// What a wall does to what diffuses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WallCondition {
    /// The value at the surface.
    Value(f64),
    /// What enters the fluid through the surface, per square metre and second.
    Flux(f64),
}

/// A medium in which something diffuses.
#[derive(Debug, Clone, PartialEq)]
pub struct Diffusion {
    /// `k`: W/(m K) for heat, m2/s for a scalar.
    pub conductivity: Property,
    /// `C`: `rho c` in J/(m3 K) for heat, 1 for a scalar.
    pub capacity: Property,
    /// By the group of a wall's particles; the last entry holds for all further groups. Empty: nothing passes any wall.
    pub walls: Vec<WallCondition>,
    pub laplacian: Laplacian,
}

impl Diffusion {
    /// What walls of a group do.
    pub fn wall(&self, group: u8) -> WallCondition {
        let last = self.walls.len().saturating_sub(1);
        self.walls.get((group as usize).min(last)).copied().unwrap_or(WallCondition::Flux(0.0))
    }

    /// `k / C` where it is the same everywhere and nothing passes any wall, m2/s.
    pub fn insulated_uniform_diffusivity(&self) -> Option<f64> {
        let insulated = self.walls.iter().all(|&wall| wall == WallCondition::Flux(0.0));
        let diffusivity = self.conductivity.uniform()? / self.capacity.uniform()?;
        (insulated && self.laplacian == Laplacian::Lattice).then_some(diffusivity)
    }

    /// The largest `k / C` of any group, m2/s.
    pub fn largest_diffusivity(&self) -> f64 {
        let groups = [&self.conductivity, &self.capacity].map(|property| match property {
            Property::Uniform(_) => 1,
            Property::ByGroup(values) => values.len(),
        });
        let of = |group| self.conductivity.of(group as u8) / self.capacity.of(group as u8);
        (0..groups[0].max(groups[1])).map(of).fold(0.0, f64::max)
    }
}

/// What particles carry and what diffuses among them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Carried {
    Temperature,
    Concentration,
}

/// The columns of what is carried, to advance it.
#[derive(Debug)]
pub struct Transport<'a> {
    pub kind: &'a [Kind],
    pub group: &'a [u8],
    pub values: &'a mut [f64],
    pub rates: &'a mut [f64],
}

impl Carried {
    /// The phase in which it diffuses.
    pub fn phase(self) -> Phase {
        match self {
            Carried::Temperature => Phase::Heat,
            Carried::Concentration => Phase::Scalar,
        }
    }

    /// Its name in errors.
    pub fn name(self) -> &'static str {
        match self {
            Carried::Temperature => "temperature",
            Carried::Concentration => "concentration",
        }
    }

    #[inline(always)]
    pub fn values<'a>(self, fields: &Fields<'a>) -> &'a [f64] {
        match self {
            Carried::Temperature => fields.temperature,
            Carried::Concentration => fields.concentration,
        }
    }

    /// Adds to the rate of one particle.
    #[inline(always)]
    pub fn add_rate(self, rates: &mut Rates<'_>, rate: f64) {
        let total = match self {
            Carried::Temperature => &mut rates.temperature,
            Carried::Concentration => &mut rates.concentration,
        };
        if let Some(total) = total {
            **total += rate;
        }
    }

    pub fn columns(self, particles: &mut Particles) -> Transport<'_> {
        let Particles { kind, group, .. } = particles;
        let (values, rates) = match self {
            Carried::Temperature => (&mut particles.temperature, &mut particles.temperature_rate),
            Carried::Concentration => (&mut particles.concentration, &mut particles.concentration_rate),
        };
        Transport { kind, group, values, rates }
    }
}

/// The stage in which something diffuses.
pub fn stage<C: CandidateSearch, T: DistanceTest>(
    carried: Carried,
    diffusion: &Diffusion,
    parameters: &Parameters,
) -> Box<dyn Stage<C, T>> {
    fn pass<P: PairTerm>(term: P, phase: Phase, parameters: &Parameters) -> PairPass<P> {
        PairPass { term, radius_m: parameters.laplacian_radius_m(), phase }
    }
    match (diffusion.laplacian, parameters.dimensions) {
        (Laplacian::Lattice, _) => {
            Box::new(pass(LatticeDiffusion::new(carried, diffusion, parameters), carried.phase(), parameters))
        }
        (Laplacian::Corrected, Dimensions::Two) => Box::new(pass(
            CorrectedDiffusion::<5>::new(carried, diffusion, parameters),
            carried.phase(),
            parameters,
        )),
        (Laplacian::Corrected, Dimensions::Three) => Box::new(pass(
            CorrectedDiffusion::<9>::new(carried, diffusion, parameters),
            carried.phase(),
            parameters,
        )),
    }
}

/// The constants of the medium, worked out once, by group.
#[derive(Debug, Clone)]
struct Medium {
    /// `2D / (n0_L lambda)`, 1/m2.
    factor: f64,
    /// 1 where no property depends on the group.
    groups: usize,
    /// `k_ij` for each pair of groups.
    mean_conductivity: Vec<f64>,
    conductivity: Vec<f64>,
    capacity: Vec<f64>,
}

impl Medium {
    fn new(diffusion: &Diffusion, parameters: &Parameters) -> Self {
        let Diffusion { conductivity, capacity, .. } = diffusion;
        let uniform = matches!((conductivity, capacity), (Property::Uniform(_), Property::Uniform(_)));
        let groups = if uniform { 1 } else { parameters.groups.len() };
        let of = |property: &Property| (0..groups).map(|g| property.of(g as u8)).collect::<Vec<f64>>();
        let (conductivity, capacity) = (of(conductivity), of(capacity));
        let mean = |a: f64, b: f64| if a + b > 0.0 { 2.0 * a * b / (a + b) } else { 0.0 };
        let pairs = conductivity.iter().flat_map(|&a| conductivity.iter().map(move |&b| mean(a, b)));
        let mean_conductivity = pairs.collect();
        Medium { factor: parameters.laplacian_factor(), groups, mean_conductivity, conductivity, capacity }
    }

    /// The row of the tables for a particle.
    #[inline(always)]
    fn row(&self, i: usize, fields: &Fields<'_>) -> usize {
        if self.groups == 1 { 0 } else { fields.group_of(i) as usize }
    }
}
