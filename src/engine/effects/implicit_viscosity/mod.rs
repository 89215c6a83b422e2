//! Viscosity, implicit in time: `u = u* + dt nu L u`, where `u* = u_old + dt a` has all other explicit forces and `L` is
//! either form of `engine::viscous`. Stable for every step; of first order in time.
//!
//! Solved for the change `d = u - u*`, `(I - dt nu L) d = dt nu L u*`, so that a viscosity of zero changes nothing and the
//! velocities before the step are the first guess. All components are one system: the Laplacian form couples none of them
//! and needs one matrix for all, the angular-momentum form couples those of a pair.
//!
//! Walls are known. Where they rest, a pair with a wall draws the fluid to the wall's velocity `u_w`. Mirrored ones are
//! part of the matrix: were they taken from the last step, steps far above the explicit limit would oscillate. A wall
//! particle at depth `d` has `u_w - d / h (u_i - u_w)` for the fluid particle `i` at height `h` (Morris, Fox & Zhu 1997), so
//! that the pair counts `1 + d / h` times; heights below a quarter of a particle distance count as one.

mod solver;
mod system;

use crate::base::parallel::Rows;
use crate::base::vec3::add_scaled;
use crate::engine::error::SimulationError;
use crate::engine::parameters::{Parameters, Property};
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::preset::Options;
use crate::engine::pressure::conjugate_gradient::{CgError, CgInfo};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Stage, State};
use crate::engine::viscous::{Form, Walls};
use solver::Solver;
use system::System;

/// A viscous fluid whose viscosity limits no step.
#[derive(Debug, Clone, PartialEq)]
pub struct ImplicitViscosity {
    /// `nu`, square metres per second.
    pub kinematic_viscosity_m2_s: Property,
    pub walls: Walls,
    pub form: Form,
}

/// The stage and its columns.
#[derive(Debug)]
pub struct ImplicitViscositySolve {
    system: System,
    solver: Solver,
}

impl ImplicitViscositySolve {
    /// `uniform_m2_s` counts where the particles have no viscosities of their own.
    pub fn new(
        viscosity: &ImplicitViscosity,
        uniform_m2_s: f64,
        parameters: &Parameters,
        options: &Options,
    ) -> Self {
        ImplicitViscositySolve {
            system: System::new(viscosity.form, viscosity.walls, uniform_m2_s, parameters, options.storage),
            solver: Solver::new(options.cg),
        }
    }

    fn solve<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        state: &mut State<C>,
    ) -> Result<CgInfo, CgError> {
        let ImplicitViscositySolve { system, solver } = self;
        system.assemble::<C, T>(state);
        let info = solver.solve(system, &state.workers)?;
        let (change, per_step) = (solver.solution(), 1.0 / state.time_step_s);
        let kind = &state.particles.kind;
        state.workers.scheduled().fill(
            Rows::new(&mut state.particles.acceleration),
            |range, acceleration| {
                for (i, acceleration) in range.zip(acceleration) {
                    if kind[i].moves() {
                        *acceleration = add_scaled(*acceleration, per_step, change[i]);
                    }
                }
            },
        );
        Ok(info)
    }
}

impl<C: CandidateSearch, T: DistanceTest> Stage<C, T> for ImplicitViscositySolve {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh(probe)?;
        let info = within(probe, Phase::ImplicitViscosity, || self.solve::<C, T>(state))
            .map_err(|source| SimulationError::Viscosity { step: state.step, source })?;
        state.viscosity = Some(info);
        Ok(())
    }

    fn bytes(&self) -> usize {
        self.system.bytes() + self.solver.bytes()
    }
}
