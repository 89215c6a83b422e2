//! Contact of fluid particles with the plane of a wall.
//!
//! A wall of particles has holes: between four of them a fluid particle stays 0.71 particle distances away from each, out
//! of the reach of a collision at 0.5, and the holes of all layers line up. Here a wall particle `j` on the surface of a
//! wall stands for a piece of its plane. With the unit normal `n_j` out of the wall, the height `h = (x_i - x_j) . n_j` of
//! a particle `i` of fluid or a body and its offset `|x_i - x_j - h n_j|` along the plane: if `|h| < height`, `offset < reach` and
//! `(u_i - u_j) . n_j < 0`, then `u_i -= ((u_i - u_j) . n_j) n_j`, one wall particle after another. The wall goes on as it
//! does and gives nothing back. All new velocities take effect together: `x_i += (u_new - u_old) dt`, `u = u_new`, as in a collision.
//!
//! `engine::facing` says what `n_j` is. Our own model.

use crate::base::parallel::{FirstIndex, Rows};
use crate::base::vec3::{Vec3, ZERO, add_scaled, dot, is_finite, sub};
use crate::engine::effects::motion::take_over;
use crate::engine::error::SimulationError;
use crate::engine::facing::Facing;
use crate::engine::parameters::Parameters;
use crate::engine::particles::Kind;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Stage, State};

/// How far a wall particle's piece of the plane reaches, in particle distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallContact {
    /// To either side of the plane.
    pub height: f64,
    /// Along the plane: above 0.71, half the diagonal of a cell, the pieces cover it.
    pub reach: f64,
}

impl WallContact {
    /// The distance within which a wall particle can be touched, in particle distances.
    pub fn radius(&self) -> f64 {
        (self.height * self.height + self.reach * self.reach).sqrt()
    }
}

/// The stage: where walls face, and the velocities after contact beside those from before.
#[derive(Debug)]
pub struct WallContacts {
    height_m: f64,
    reach_m: f64,
    radius_m: f64,
    facing: Facing,
    /// The unit normal out of the wall of each wall particle on its surface, zero for all others. Where walls
    /// stand still it is worked out once, in the first step.
    normal: Vec<Vec3>,
    normals_known: bool,
    velocity_after: Vec<Vec3>,
}

impl WallContacts {
    pub fn new<C: CandidateSearch>(contact: WallContact, parameters: &Parameters, state: &State<C>) -> Self {
        let l0 = parameters.particle_distance_m;
        WallContacts {
            height_m: contact.height * l0,
            reach_m: contact.reach * l0,
            radius_m: contact.radius() * l0,
            facing: Facing::new(parameters),
            normal: state.workers.column(state.particles.len(), ZERO),
            normals_known: false,
            velocity_after: state.workers.column(state.particles.len(), ZERO),
        }
    }

    fn find_normals<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        let (kind, facing) = (&state.particles.kind, self.facing);
        state.team().fill(Rows::new(&mut self.normal), |range, normal| {
            for (i, normal) in range.zip(normal) {
                *normal = match kind[i] {
                    Kind::Wall => facing.normal::<C, T>(state, i),
                    _ => ZERO,
                };
            }
        });
    }

    fn touch<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>, broken: &FirstIndex) {
        let (near, velocity, kind) = (state.neighborhood(), &state.particles.velocity, &state.particles.kind);
        let (height_m, reach_m, radius_m, normal) =
            (self.height_m, self.reach_m, self.radius_m, &self.normal);
        state.team().fill(Rows::new(&mut self.velocity_after), |range, velocity_after| {
            for (i, after) in range.zip(velocity_after) {
                let mut u_i = velocity[i];
                if kind[i].moves() {
                    near.for_each_neighbor::<T>(i, radius_m, |j, r_ij, r| {
                        let n = normal[j];
                        // A wall particle that faces nowhere has height zero and speed zero: it stops nobody.
                        let (height, speed) = (-dot(r_ij, n), dot(sub(u_i, velocity[j]), n));
                        let offset2 = r * r - height * height;
                        if speed < 0.0 && height.abs() < height_m && offset2 < reach_m * reach_m {
                            u_i = add_scaled(u_i, -speed, n);
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

impl<C: CandidateSearch, T: DistanceTest> Stage<C, T> for WallContacts {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh(probe)?;
        let broken = FirstIndex::default();
        within(probe, Phase::WallContact, || {
            if !self.normals_known || state.walls_moved {
                self.find_normals::<C, T>(state);
                self.normals_known = true;
            }
            self.touch::<C, T>(state, &broken);
            state.require_finite(&broken, Phase::WallContact, "velocity")?;
            take_over(&self.velocity_after, state);
            Ok(())
        })
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.normal[..]) + size_of_val(&self.velocity_after[..])
    }
}
