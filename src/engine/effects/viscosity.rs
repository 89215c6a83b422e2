//! Viscosity with the Laplacian model: `a_i += nu 2D / (n0_L lambda) sum_j (u_j - u_i) w(r_ij, re_L)`.
//!
//! Koshizuka & Oka 1996. Every other particle within `re_L` takes part, dummy walls too. Explicit: stable while
//! `nu dt` stays below about half of `lambda / (2 D)`.

use crate::base::parallel::{FirstIndex, Rows};
use crate::base::vec3::{ZERO, add_scaled, is_finite, sub};
use crate::engine::error::SimulationError;
use crate::engine::kernel::weight;
use crate::engine::parameters::Parameters;
use crate::engine::particles::Kind;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Stage, State};

/// A Newtonian fluid's viscosity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viscosity {
    /// `nu`, square metres per second.
    pub kinematic_viscosity_m2_s: f64,
}

/// The stage: constants worked out once.
#[derive(Debug, Clone, Copy)]
pub struct ExplicitViscosity {
    radius_m: f64,
    /// `nu 2D / (n0_L lambda)`, 1/s.
    factor: f64,
}

impl ExplicitViscosity {
    pub fn new(viscosity: Viscosity, parameters: &Parameters) -> Self {
        ExplicitViscosity {
            radius_m: parameters.laplacian_radius_m(),
            factor: viscosity.kinematic_viscosity_m2_s * parameters.laplacian_factor(),
        }
    }
}

impl<C: CandidateSearch, T: DistanceTest> Stage<C, T> for ExplicitViscosity {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh(probe)?;
        let broken = FirstIndex::default();
        within(probe, Phase::Viscosity, || {
            let forces = state.forces();
            let (near, velocity) = (&forces.near, forces.velocity);
            forces.team.fill(Rows::new(forces.acceleration), |range, acceleration| {
                for (i, a) in range.zip(acceleration) {
                    if forces.kind[i] != Kind::Fluid {
                        continue;
                    }
                    let mut sum = ZERO;
                    near.for_each_neighbor::<T>(i, self.radius_m, |j, _, r| {
                        sum = add_scaled(sum, weight(r, self.radius_m), sub(velocity[j], velocity[i]));
                    });
                    *a = add_scaled(*a, self.factor, sum);
                    if !is_finite(*a) {
                        broken.record(i);
                    }
                }
            });
        });
        state.require_finite(&broken, Phase::Viscosity, "acceleration")
    }
}
