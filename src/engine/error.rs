//! How a simulation can end before its time.

use crate::engine::phase::Phase;
use crate::engine::pressure::conjugate_gradient::CgError;

/// Why a step could not be completed. Nothing of the broken step is ever reported as a result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    #[error(
        "step {step}, phase {phase}: particles {particle} and {other} are at distance zero, where the weight function \
         has no value; move one of them apart in the scene, or shorten the time step"
    )]
    Coincident { step: usize, phase: Phase, particle: usize, other: usize },
    #[error(
        "step {step}, phase {phase}: the {quantity} of particle {particle} is not finite; shorten the time step \
         (`--set time_step_s=...`) or look at the particle's neighbourhood in the step before"
    )]
    NotFinite { step: usize, phase: Phase, particle: usize, quantity: &'static str },
    #[error(
        "step {step}: {reason} asks for a step of {time_step_s:e} s, below the shortest that is allowed; look at the \
         fastest particles of the step before, lower `adaptive_time_step.shortest_s`, or lower `particle_distance_m`"
    )]
    StepTooShort { step: usize, time_step_s: f64, reason: &'static str },
    #[error(
        "step {step}: inflow {inflow} finds no particle left in the reserve; raise `effects.flow_boundaries.reserve`, or \
         let more fluid out"
    )]
    ReserveExhausted { step: usize, inflow: usize },
    #[error("step {step}, phase cg: {source}")]
    Solver { step: usize, source: CgError },
    #[error("step {step}, phase implicit_viscosity: {source}")]
    Viscosity { step: usize, source: CgError },
}

impl SimulationError {
    /// The kind in a word, as records and experiments name it.
    pub fn kind(&self) -> &'static str {
        match self {
            SimulationError::Coincident { .. } => "coincident",
            SimulationError::NotFinite { .. } => "not_finite",
            SimulationError::StepTooShort { .. } => "step_too_short",
            SimulationError::ReserveExhausted { .. } => "reserve_exhausted",
            SimulationError::Solver { .. } => "solver",
            SimulationError::Viscosity { .. } => "viscosity",
        }
    }
}
