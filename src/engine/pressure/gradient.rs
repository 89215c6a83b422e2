//! Pressure, its minimum around each particle, and its gradient.
//!
//! `p_i = max(p_i, 0)`; `a_i = -(D / (n0_g rho)) sum_j (p_j - pmin_i) r_ij w(r_ij, re_g) / r_ij^2`, where `pmin_i` is the
//! smallest pressure among `i` and its neighbours within `re_g`; dummy walls take no part (Koshizuka & Oka 1996).

use crate::base::parallel::{FirstIndex, Rows};
use crate::base::vec3::{ZERO, add_scaled, is_finite};
use crate::engine::error::SimulationError;
use crate::engine::kernel::{Kernel, weight};
use crate::engine::parameters::Parameters;
use crate::engine::phase::Phase;
use crate::engine::pressure::Pressure;
use crate::engine::pressure::free_surface::{Label, Unknowns};
use crate::engine::search::{CandidateSearch, DistanceTest, NONE};
use crate::engine::stage::State;

#[derive(Debug)]
pub struct PressureGradient {
    kernel: Kernel,
    /// `-D / (n0_g rho)`.
    factor: f64,
    /// `pmin`, Pa.
    minimum: Vec<f64>,
}

impl PressureGradient {
    pub fn new<C: CandidateSearch>(pressure: Pressure, parameters: &Parameters, state: &State<C>) -> Self {
        let radius_m = parameters.gradient_radius_m();
        let n0 = parameters.reference(radius_m).number_density;
        PressureGradient {
            kernel: pressure.kernel(radius_m, parameters),
            factor: -(parameters.dimensions.count() / (n0 * parameters.density_kg_m3)),
            minimum: state.workers.column(state.particles.len(), 0.0),
        }
    }

    /// Phase `clamp`: the solution of each unknown, negative ones as zero; what `surface` says of all other particles, or
    /// zero where it is empty.
    pub fn set_pressure<C: CandidateSearch>(
        &self,
        unknowns: &Unknowns,
        solution: &[f64],
        surface: &[f64],
        state: &mut State<C>,
    ) {
        let team = state.workers.scheduled();
        team.fill(Rows::new(&mut state.particles.pressure), |range, pressure| {
            for (i, p) in range.zip(pressure) {
                *p = match unknowns.row_of[i] {
                    NONE => surface.get(i).map_or(0.0, |p| p.max(0.0)),
                    row => solution[row as usize].max(0.0),
                };
            }
        });
    }

    /// Phase `minimum_pressure`, of fluid and wall particles.
    pub fn find_minimum<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        unknowns: &Unknowns,
        state: &State<C>,
    ) {
        let (near, pressure, label, radius_m) =
            (state.neighborhood(), &state.particles.pressure, &unknowns.label, self.kernel.radius_m);
        state.team().fill(Rows::new(&mut self.minimum), |range, minimum| {
            for (i, minimum) in range.zip(minimum) {
                if label[i] == Label::Outside {
                    continue;
                }
                // No pressure is below zero, so zero needs no further look.
                let mut least = pressure[i];
                if least > 0.0 {
                    near.any_neighbor::<T>(i, radius_m, |j, _, _| {
                        if label[j] != Label::Outside && pressure[j] < least {
                            least = pressure[j];
                        }
                        least <= 0.0
                    });
                }
                *minimum = least;
            }
        });
    }

    /// Phase `pressure_gradient`, of fluid particles and bodies.
    pub fn accelerate<C: CandidateSearch, T: DistanceTest>(
        &self,
        unknowns: &Unknowns,
        state: &mut State<C>,
    ) -> Result<(), SimulationError> {
        let broken = FirstIndex::default();
        let forces = state.forces();
        let (near, fields, label) = (&forces.near, forces.fields, &unknowns.label);
        let (kernel, pressure) = (self.kernel, fields.pressure);
        forces.team.fill(Rows::new(forces.acceleration), |range, acceleration| {
            for (i, a) in range.zip(acceleration) {
                if !fields.kind[i].moves() {
                    continue;
                }
                let (mut sum, minimum) = (ZERO, self.minimum[i]);
                near.for_each_neighbor::<T>(i, kernel.radius_m, |j, r_ij, r| {
                    if label[j] != Label::Outside {
                        let r = kernel.distance(r);
                        let magnitude = (pressure[j] - minimum) * weight(r, kernel.radius_m) / (r * r);
                        sum = add_scaled(sum, magnitude, r_ij);
                    }
                });
                *a = add_scaled(*a, self.factor, sum);
                if !is_finite(*a) {
                    broken.record(i);
                }
            }
        });
        state.require_finite(&broken, Phase::PressureGradient, "acceleration")
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.minimum[..])
    }
}
