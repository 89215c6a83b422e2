//! Pressure, its minimum around each particle, and its gradient.
//!
//! Here is what all forms of the gradient share; each form is a file of its own, compiled apart.

mod conservative;
mod corrected;
mod minimum;
mod pairwise;
mod transposed;

use crate::base::parallel::{FirstIndex, Rows};
use crate::base::vec3::{Vec3, ZERO, add_scaled, is_finite};
use crate::engine::error::SimulationError;
use crate::engine::kernel::Kernel;
use crate::engine::parameters::Parameters;
use crate::engine::phase::Phase;
use crate::engine::pressure::Pressure;
use crate::engine::pressure::free_surface::{Label, Unknowns};
use crate::engine::pressure::options::{Clamp, Gradient};
use crate::engine::search::{CandidateSearch, DistanceTest, NONE, Neighborhood};
use crate::engine::stage::State;
use conservative::Conservative;
use corrected::{Consistent, Corrected, Sums};
use minimum::Minimum;
use pairwise::Pairwise;
use transposed::{Transposed, find_inverses};

/// A form of the gradient.
trait Form: Sync {
    /// What the pairs of particle `i` add up to, times `n0_g / D`: Pa/m.
    fn sum<C: CandidateSearch, T: DistanceTest>(&self, near: &Neighborhood<'_, C>, i: usize) -> Vec3;
}

/// What a form is made from.
#[derive(Clone, Copy)]
struct Around<'a> {
    kernel: Kernel,
    pressure: &'a [f64],
    /// The smallest pressure around each particle, Pa.
    minimum: &'a [f64],
    label: &'a [Label],
}

#[derive(Debug)]
pub struct PressureGradient {
    kernel: Kernel,
    /// `-D / (n0_g rho)`.
    factor: f64,
    /// The same of each group; empty where the density is the same everywhere.
    factor_of_group: Vec<f64>,
    gradient: Gradient,
    clamp: Clamp,
    /// The moment matrix of the reference lattice, a multiple of unity: `n0_g / D`.
    lattice_moment: f64,
    dimensions: usize,
    /// `pmin`, Pa.
    minimum: Vec<f64>,
    /// What multiplies pressures in the transposed form; empty for all others.
    inverse: Vec<[Vec3; 3]>,
}

impl PressureGradient {
    pub fn new<C: CandidateSearch>(pressure: &Pressure, parameters: &Parameters, state: &State<C>) -> Self {
        let transposed = pressure.gradient == Gradient::Transposed;
        let radius_m = match transposed {
            true => parameters.number_density_radius_m(),
            false => parameters.gradient_radius_m(),
        };
        let count = state.particles.len();
        let n0 = parameters.reference(radius_m).number_density;
        let dimensions = parameters.dimensions.count();
        let by_group = pressure.density_by_group_kg_m3.as_deref().unwrap_or_default();
        PressureGradient {
            kernel: pressure.kernel(radius_m, parameters),
            factor: -(dimensions / (n0 * parameters.density_kg_m3)),
            factor_of_group: by_group.iter().map(|rho| -(dimensions / (n0 * rho))).collect(),
            gradient: pressure.gradient,
            clamp: pressure.clamp,
            lattice_moment: n0 / dimensions,
            dimensions: dimensions as usize,
            minimum: state.workers.column(count, 0.0),
            inverse: state.workers.column(if transposed { count } else { 0 }, [ZERO; 3]),
        }
    }

    /// Phase `clamp`: the solution of each unknown, negative ones as zero where they are clamped; zero for all other
    /// particles.
    pub fn set_pressure<C: CandidateSearch, T: DistanceTest>(
        &self,
        unknowns: &Unknowns,
        solution: &[f64],
        state: &mut State<C>,
    ) {
        let mut column = std::mem::take(&mut state.particles.pressure);
        let (near, label, radius_m) = (state.neighborhood(), &unknowns.label, self.kernel.radius_m);
        let near_surface = |i| near.has_neighbor::<T>(i, radius_m, |_| true, |j| label[j] == Label::Surface);
        let clamped = |i| match self.clamp {
            Clamp::Everywhere => true,
            Clamp::NearSurface => near_surface(i),
            Clamp::Never => false,
        };
        state.team().fill(Rows::new(&mut column), |range, pressure| {
            for (i, p) in range.zip(pressure) {
                *p = match unknowns.row_of[i] {
                    NONE => 0.0,
                    row => solution[row as usize],
                };
                if *p < 0.0 && clamped(i) {
                    *p = 0.0;
                }
            }
        });
        state.particles.pressure = column;
    }

    /// Phase `minimum_pressure`, of all particles that have a pressure.
    pub fn find_minimum<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        unknowns: &Unknowns,
        state: &State<C>,
    ) {
        // Where no pressure is below zero, zero needs no further look.
        let least_possible = match self.clamp {
            Clamp::Everywhere => 0.0,
            Clamp::NearSurface | Clamp::Never => f64::NEG_INFINITY,
        };
        let (near, pressure, label, radius_m) =
            (state.neighborhood(), &state.particles.pressure, &unknowns.label, self.kernel.radius_m);
        state.team().fill(Rows::new(&mut self.minimum), |range, minimum| {
            for (i, minimum) in range.zip(minimum) {
                if label[i] == Label::Outside {
                    continue;
                }
                let mut least = pressure[i];
                if least > least_possible {
                    near.any_neighbor::<T>(i, radius_m, |j, _, _| {
                        if label[j] != Label::Outside && pressure[j] < least {
                            least = pressure[j];
                        }
                        least <= least_possible
                    });
                }
                *minimum = least;
            }
        });
    }

    /// Phase `pressure_gradient`, of fluid particles and bodies.
    pub fn accelerate<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        unknowns: &Unknowns,
        state: &mut State<C>,
    ) -> Result<(), SimulationError> {
        if !self.inverse.is_empty() {
            let lattice = (self.lattice_moment, self.dimensions);
            find_inverses::<C, T>(&mut self.inverse, self.kernel, lattice, state);
        }
        let pressure = std::mem::take(&mut state.particles.pressure);
        let around = Around {
            kernel: self.kernel,
            pressure: &pressure,
            minimum: &self.minimum,
            label: &unknowns.label,
        };
        let broken = FirstIndex::default();
        match self.gradient {
            Gradient::Minimum => self.add::<C, T>(&Minimum(around), state, &broken),
            Gradient::Corrected => self.add::<C, T>(&Corrected(self.sums(around)), state, &broken),
            Gradient::Consistent => self.add::<C, T>(&Consistent(self.sums(around)), state, &broken),
            Gradient::Pairwise => self.add::<C, T>(&Pairwise(around), state, &broken),
            Gradient::Transposed => {
                let inverse = &self.inverse;
                self.add::<C, T>(&Transposed { around, inverse }, state, &broken);
            }
            Gradient::Conservative => self.add::<C, T>(&Conservative(around), state, &broken),
        }
        state.particles.pressure = pressure;
        state.require_finite(&broken, Phase::PressureGradient, "acceleration")
    }

    fn sums<'a>(&self, around: Around<'a>) -> Sums<'a> {
        Sums { around, lattice_moment: self.lattice_moment, dimensions: self.dimensions }
    }

    fn add<C: CandidateSearch, T: DistanceTest>(
        &self,
        form: &impl Form,
        state: &mut State<C>,
        broken: &FirstIndex,
    ) {
        let forces = state.forces();
        let (near, fields) = (&forces.near, forces.fields);
        let factor = |i: usize| match self.factor_of_group.is_empty() {
            true => self.factor,
            false => self.factor_of_group[fields.group_of(i) as usize],
        };
        forces.team.fill(Rows::new(forces.acceleration), |range, acceleration| {
            for (i, a) in range.zip(acceleration) {
                if !fields.kind[i].moves() {
                    continue;
                }
                *a = add_scaled(*a, factor(i), form.sum::<C, T>(near, i));
                if !is_finite(*a) {
                    broken.record(i);
                }
            }
        });
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.minimum[..]) + size_of_val(&self.inverse[..])
    }
}
