//! Rigid collision of particles that came too close.
//!
//! For each `i` of fluid and bodies and each `j` within the collision distance, one after another: with `e = r_ij / r`, the current `u_i`
//! and `j`'s velocity from before the phase, `s = (u_i - u_j) . e`; if they approach (`s > 0`),
//! `u_i -= s (1 + restitution) / 2 e`. All new velocities take effect together: `x_i += (u_new - u_old) dt`,
//! `u = u_new` (the textbook's collision model, equal masses).

use crate::base::parallel::{FirstIndex, Rows};
use crate::base::vec3::{Vec3, ZERO, add_scaled, dot, is_finite, scale, sub};
use crate::engine::effects::motion::take_over;
use crate::engine::error::SimulationError;
use crate::engine::parameters::Parameters;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Stage, State};

/// When and how particles collide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collision {
    /// Distance below which two particles collide, in particle distances.
    pub distance: f64,
    /// Coefficient of restitution.
    pub restitution: f64,
}

/// What one collision does to a velocity.
#[derive(Debug, Clone, Copy)]
pub struct Impact {
    /// `(1 + restitution) / 2`.
    share: f64,
}

impl Impact {
    pub fn new(collision: Collision) -> Self {
        Impact { share: (1.0 + collision.restitution) / 2.0 }
    }

    /// Lets `u_i` collide with a particle at `r_ij` and velocity `u_j`; tells whether the outcome is a number.
    #[inline(always)]
    pub fn with(self, u_i: &mut Vec3, u_j: Vec3, r_ij: Vec3, r: f64) -> bool {
        let e = scale(1.0 / r, r_ij);
        let approach = dot(sub(*u_i, u_j), e);
        if approach > 0.0 {
            *u_i = add_scaled(*u_i, -(approach * self.share), e);
        }
        approach.is_finite()
    }
}

/// The stage, with the velocities after the collisions beside those from before.
#[derive(Debug)]
pub struct Collisions {
    distance_m: f64,
    impact: Impact,
    velocity_after: Vec<Vec3>,
}

impl Collisions {
    pub fn new<C: CandidateSearch>(collision: Collision, parameters: &Parameters, state: &State<C>) -> Self {
        Collisions {
            distance_m: collision.distance * parameters.particle_distance_m,
            impact: Impact::new(collision),
            velocity_after: state.workers.column(state.particles.len(), ZERO),
        }
    }

    fn collide<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>, broken: &FirstIndex) {
        let (near, velocity, kind) = (state.neighborhood(), &state.particles.velocity, &state.particles.kind);
        let (distance_m, impact) = (self.distance_m, self.impact);
        state.team().fill(Rows::new(&mut self.velocity_after), |range, velocity_after| {
            for (i, after) in range.zip(velocity_after) {
                let mut u_i = velocity[i];
                if kind[i].moves() {
                    near.for_each_neighbor::<T>(i, distance_m, |j, r_ij, r| {
                        if !impact.with(&mut u_i, velocity[j], r_ij, r) {
                            broken.record(i);
                        }
                    });
                    if !is_finite(u_i) {
                        broken.record(i);
                    }
                }
                *after = u_i;
            }
        });
    }
}

impl<C: CandidateSearch, T: DistanceTest> Stage<C, T> for Collisions {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh(probe)?;
        let broken = FirstIndex::default();
        within(probe, Phase::Collision, || {
            self.collide::<C, T>(state, &broken);
            state.require_finite(&broken, Phase::Collision, "velocity")?;
            take_over(&self.velocity_after, state);
            Ok(())
        })
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.velocity_after[..])
    }
}
