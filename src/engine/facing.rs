//! Which way a wall of particles faces.
//!
//! The normal of a wall particle `i` is the direction of `-sum_k w(r_ik, re_n) r_ik` over the solid particles `k` (walls
//! and dummy walls) within `re_n`. A particle has one where that sum is longer than a share of `l0 sum_k w`: the first
//! layer, its edges and its rim. Our own model, after the usual way to find surfaces from particles.

use crate::base::vec3::{Vec3, ZERO, add_scaled, dot, scale};
use crate::engine::kernel::weight;
use crate::engine::parameters::Parameters;
use crate::engine::particles::Kind;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::State;

/// `|sum w r| / (l0 sum w)` above which a wall particle is on a surface: 0 inside a wall of whole layers.
const SURFACE: f64 = 0.12;

/// What makes a normal.
#[derive(Debug, Clone, Copy)]
pub struct Facing {
    radius_m: f64,
    /// `SURFACE l0`, metres.
    least_m: f64,
}

impl Facing {
    pub fn new(parameters: &Parameters) -> Self {
        let least_m = SURFACE * parameters.particle_distance_m;
        Facing { radius_m: parameters.number_density_radius_m(), least_m }
    }

    /// The unit normal of wall particle `i`; zero where it is not on a surface.
    pub fn normal<C: CandidateSearch, T: DistanceTest>(self, state: &State<C>, i: usize) -> Vec3 {
        let (mut toward, mut total) = (ZERO, 0.0);
        state.neighborhood().for_each_neighbor::<T>(i, self.radius_m, |j, r_ij, r| {
            if matches!(state.particles.kind[j], Kind::Wall | Kind::DummyWall) {
                let w = weight(r, self.radius_m);
                toward = add_scaled(toward, w, r_ij);
                total += w;
            }
        });
        let length = dot(toward, toward).sqrt();
        if length > self.least_m * total { scale(-1.0 / length, toward) } else { ZERO }
    }
}
