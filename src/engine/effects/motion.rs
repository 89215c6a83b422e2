//! Motion of the fluid: under the accelerations gathered so far, before the pressure is known and after, and to
//! velocities that an impact gave.

use crate::base::parallel::Rows;
use crate::base::vec3::{Vec3, ZERO, add_scaled, sub};
use crate::engine::error::SimulationError;
use crate::engine::particles::Particles;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::CandidateSearch;
use crate::engine::stage::{Stage, State};

/// The explicit half of the step: `u += a dt`, then `x += u dt`.
#[derive(Debug, Clone, Copy)]
pub struct Predictor;

/// The correction by the pressure gradient: `u += a dt`, `x += a dt^2`.
#[derive(Debug, Clone, Copy)]
pub struct Corrector;

impl<C: CandidateSearch, T> Stage<C, T> for Predictor {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        let dt = state.time_step_s;
        within(probe, Phase::Move, || {
            advance(state, |x, u, a| {
                *u = add_scaled(*u, dt, a);
                *x = add_scaled(*x, dt, *u);
            });
        });
        Ok(())
    }
}

impl<C: CandidateSearch, T> Stage<C, T> for Corrector {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        let dt = state.time_step_s;
        within(probe, Phase::Correction, || {
            advance(state, |x, u, a| {
                *u = add_scaled(*u, dt, a);
                *x = add_scaled(*x, dt * dt, a);
            });
        });
        Ok(())
    }
}

/// Moves every particle of fluid and bodies, and sets its acceleration back to zero for the stage that follows.
fn advance<C: CandidateSearch>(
    state: &mut State<C>,
    motion: impl Fn(&mut [f64; 3], &mut [f64; 3], [f64; 3]) + Sync,
) {
    let Particles { kind, position, velocity, acceleration, .. } = &mut state.particles;
    let columns = (Rows::new(position), Rows::new(velocity), Rows::new(acceleration));
    state.workers.scheduled().fill(columns, |range, (position, velocity, acceleration)| {
        for (k, &kind) in kind[range].iter().enumerate() {
            if kind.moves() {
                motion(&mut position[k], &mut velocity[k], acceleration[k]);
            }
            acceleration[k] = ZERO;
        }
    });
    state.positions_changed();
}

/// Gives every particle of fluid and bodies the velocity it has after an impact, and moves it as if it had had it in this step:
/// `x += (u_after - u) dt`, `u = u_after`.
pub fn take_over<C: CandidateSearch>(velocity_after: &[Vec3], state: &mut State<C>) {
    let time_step_s = state.time_step_s;
    let Particles { kind, position, velocity, .. } = &mut state.particles;
    let columns = (Rows::new(position), Rows::new(velocity));
    state.workers.scheduled().fill(columns, |range, (position, velocity)| {
        for (k, i) in range.enumerate() {
            if kind[i].moves() {
                let change = sub(velocity_after[i], velocity[k]);
                position[k] = add_scaled(position[k], time_step_s, change);
                velocity[k] = velocity_after[i];
            }
        }
    });
    state.positions_changed();
}
