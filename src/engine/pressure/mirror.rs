//! Walls as mirrors of the fluid's velocity.
//!
//! Wall particles with unknown pressures are a second fluid to the equation: one that conducts pressure but has no weight
//! and never moves. Along the walls of a tank pressure flows off, and the fluid beside the floor is held by half the
//! difference of pressures that would bear it: water on a lattice at rest falls with 0.1 to 0.4 g in its first step. Here
//! walls have no rows, so that nothing flows through the surface between them and the fluid (pairs that are left out are a
//! zero normal derivative), and the divergence sees images: to particle `i` wall particle `j` moves with
//! `2 (u_w - u_i)_n` relative to it, as the image of `i` does, so that the velocity is the wall's half way between them.
//! Along a plane wall a flow slips: there `j` tells nothing about derivatives along the surface, neither in the sum nor in
//! its moment matrix. In a corner, where no normal is that of one plane, all components are turned. Our own form of the
//! mirrors of Cummins & Rudman 1999.
//!
//! Normals are those of the lattice's faces, `-sum_k r_ik / r_ik` over the solid particles next to a wall particle: a
//! smoother one would tilt beside corners, and falling water would seem to flow into the walls.

use crate::base::parallel::Rows;
use crate::base::vec3::{Vec3, ZERO, add_scaled, dot, scale, sub};
use crate::engine::parameters::Parameters;
use crate::engine::particles::Kind;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::State;

/// Neighbours on the lattice lie within this many particle distances.
const NEXT: f64 = 1.2;
/// Length of the sum of unit vectors above which a wall particle has a face: one face makes 1.
const OPEN: f64 = 0.5;
/// How far off the normal a wall particle lies that is behind a face, in particle distances.
const STRAIGHT: f64 = 0.3;

/// The normals of all wall particles, found anew whenever walls have moved.
#[derive(Debug)]
pub struct Mirror {
    next_m: f64,
    straight_m: f64,
    /// How far behind its surface a wall particle is seen, metres.
    reach_m: f64,
    known: bool,
    /// Unit normals of those on a surface, zero for all others.
    face: Vec<Vec3>,
    /// The same, and behind a face that face's; zero in corners, and for all that are no walls.
    normal: Vec<Vec3>,
    wall: Vec<bool>,
}

impl Mirror {
    pub fn new<C: CandidateSearch>(parameters: &Parameters, state: &State<C>) -> Self {
        let (l0, count) = (parameters.particle_distance_m, state.particles.len());
        Mirror {
            next_m: NEXT * l0,
            straight_m: STRAIGHT * l0,
            reach_m: parameters.number_density_radius_m(),
            known: false,
            face: state.workers.column(count, ZERO),
            normal: state.workers.column(count, ZERO),
            wall: state.workers.column(count, false),
        }
    }

    /// Finds the normals, if walls moved since the last time. The state's buckets must be fresh.
    pub fn refresh<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) -> &Mirror {
        if !self.known || state.walls_moved {
            for (wall, kind) in self.wall.iter_mut().zip(&state.particles.kind) {
                *wall = matches!(kind, Kind::Wall | Kind::DummyWall);
            }
            self.find_faces::<C, T>(state);
            self.find_normals::<C, T>(state);
            self.known = true;
        }
        self
    }

    fn find_faces<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        let (near, wall, next_m) = (state.neighborhood(), &self.wall, self.next_m);
        state.team().fill(Rows::new(&mut self.face), |range, face| {
            for (i, face) in range.zip(face) {
                let mut open = ZERO;
                if wall[i] {
                    near.for_each_neighbor::<T>(i, next_m, |j, r_ij, r| {
                        open = if wall[j] { add_scaled(open, -1.0 / r, r_ij) } else { open };
                    });
                }
                let length = dot(open, open).sqrt();
                *face = if length > OPEN { scale(1.0 / length, open) } else { ZERO };
            }
        });
    }

    fn find_normals<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        let (near, wall, face) = (state.neighborhood(), &self.wall, &self.face);
        let (reach_m, straight_m) = (self.reach_m, self.straight_m);
        state.team().fill(Rows::new(&mut self.normal), |range, normal| {
            for (i, normal) in range.zip(normal) {
                *normal = face[i];
                if !wall[i] || face[i] != ZERO {
                    continue;
                }
                let mut nearest_m = f64::INFINITY;
                near.for_each_neighbor::<T>(i, reach_m, |j, r_ij, r| {
                    let above_m = dot(r_ij, face[j]);
                    let aside = sub(r_ij, scale(above_m, face[j]));
                    if r < nearest_m && above_m > 0.0 && dot(aside, aside) < straight_m * straight_m {
                        (*normal, nearest_m) = (face[j], r);
                    }
                });
            }
        });
    }

    /// Velocity and place of particle `j` relative to another, `u_ij` and `r_ij`, as far as the divergence sees them: its
    /// own, or of a wall particle those of an image.
    #[inline(always)]
    pub fn image(&self, j: usize, u_ij: Vec3, r_ij: Vec3) -> (Vec3, Vec3) {
        if !self.wall[j] {
            return (u_ij, r_ij);
        }
        match self.normal[j] {
            ZERO => (scale(2.0, u_ij), r_ij),
            n => (scale(2.0 * dot(u_ij, n), n), scale(dot(r_ij, n), n)),
        }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.face[..]) + size_of_val(&self.normal[..]) + size_of_val(&self.wall[..])
    }
}
