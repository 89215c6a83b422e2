//! Gravity: `a_i = g` for fluid particles.

use crate::base::parallel::Rows;
use crate::base::vec3::{Vec3, add};
use crate::engine::error::SimulationError;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::CandidateSearch;
use crate::engine::stage::{Stage, State};

/// A constant acceleration of the fluid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gravity {
    /// `g`, metres per second squared.
    pub acceleration_m_s2: Vec3,
}

impl<C: CandidateSearch, T> Stage<C, T> for Gravity {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        within(probe, Phase::Gravity, || {
            let forces = state.forces();
            forces.team.fill(Rows::new(forces.acceleration), |range, acceleration| {
                for (&kind, a) in forces.fields.kind[range].iter().zip(acceleration) {
                    if kind.moves() {
                        *a = add(*a, self.acceleration_m_s2);
                    }
                }
            });
        });
        Ok(())
    }
}
