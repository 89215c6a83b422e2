//! Buoyancy of warm fluid: `a_i = -beta (T_i - T0) g` (Boussinesq 1903): density varies with temperature where it is
//! weighed, and nowhere else. Good while `beta (T - T0)` is small against 1.

use crate::base::parallel::Rows;
use crate::base::vec3::{Vec3, add_scaled};
use crate::engine::error::SimulationError;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::CandidateSearch;
use crate::engine::stage::{Forces, Stage, State};

/// A fluid that expands with temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Buoyancy {
    /// `beta`, 1/K.
    pub expansion_1_k: f64,
    /// `T0`, the temperature at which the fluid has its density.
    pub reference_k: f64,
    /// `g`, metres per second squared.
    pub gravity_m_s2: Vec3,
    /// Whether the weight of the fluid at `T0` is left out. In a box without a free surface it only adds a hydrostatic
    /// pressure, many times that of the flow, and its errors with it; pressure is then what is beyond it.
    pub without_weight: bool,
}

impl<C: CandidateSearch, T> Stage<C, T> for Buoyancy {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        within(probe, Phase::Buoyancy, || {
            let Forces { fields, acceleration, team, .. } = state.forces();
            team.fill(Rows::new(acceleration), |range, acceleration| {
                for (a, i) in acceleration.iter_mut().zip(range) {
                    if fields.kind[i].moves() {
                        let excess = fields.temperature[i] - self.reference_k;
                        *a = add_scaled(*a, -(self.expansion_1_k * excess), self.gravity_m_s2);
                    }
                }
            });
        });
        Ok(())
    }
}
