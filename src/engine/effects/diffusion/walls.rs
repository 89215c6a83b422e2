//! Where the surface of a wall of particles is: half a particle distance in front of its first layer.
//!
//! A wall particle is of the first layer where the particles of the wall around it lie to one side: the normal is the
//! direction of `-sum_k w(r_jk, 1.5 l0) r_jk` over solid particles `k`, taken as an axis if it is within ten degrees of it,
//! since a wall on the lattice bends its normals beside a corner. Deeper particles belong to the nearest particle of the
//! first layer, one of their own group if there is one. Our own model. Worked out once, and anew when walls have moved.

use crate::base::parallel::Rows;
use crate::base::vec3::{Vec3, ZERO, add_scaled, dot, scale};
use crate::engine::kernel::weight;
use crate::engine::parameters::Parameters;
use crate::engine::particles::{Kind, Particles};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::State;

/// Radius within which a surface shows, in particle distances.
const NEAR: f64 = 1.5;
/// `|sum w r| / (l0 sum w)` above which a wall particle is of the first layer.
const ONE_SIDED: f64 = 0.12;
/// The cosine of ten degrees.
const ALONG_AXIS: f64 = 0.985;
/// A particle nearer to a surface than this many particle distances counts as that far away, where it is divided by.
const NEAREST: f64 = 0.25;

/// A wall particle's piece of a surface.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Surface {
    /// Unit normal into the fluid; zero where there is no surface in reach.
    normal: Vec3,
    /// How far behind the surface the particle is, metres.
    depth_m: f64,
}

/// The surfaces of all wall particles.
#[derive(Debug, Clone)]
pub struct Surfaces {
    particle_distance_m: f64,
    radius_m: f64,
    /// Empty until the first step.
    of_particle: Vec<Surface>,
}

/// A surface as a fluid particle sees it past a wall particle.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// Unit normal into the fluid.
    pub normal: Vec3,
    /// How far above the surface the fluid particle is, metres; not less than a quarter of a particle distance.
    pub height_m: f64,
    /// How far behind it the wall particle is.
    pub depth_m: f64,
}

impl Surfaces {
    pub fn new(parameters: &Parameters) -> Self {
        let particle_distance_m = parameters.particle_distance_m;
        Surfaces { particle_distance_m, radius_m: parameters.laplacian_radius_m(), of_particle: Vec::new() }
    }

    /// The surface that fluid particle `i` sees past wall particle `j`; `None` where it is not in front of one.
    #[inline(always)]
    pub fn seen(&self, j: usize, r_ij: Vec3) -> Option<Seen> {
        let Surface { normal, depth_m } = self.of_particle[j];
        let height_m = -dot(r_ij, normal) - depth_m;
        let nearest_m = NEAREST * self.particle_distance_m;
        (height_m > 0.0).then_some(Seen { normal, height_m: height_m.max(nearest_m), depth_m })
    }

    /// Works out the surfaces in the first step and after walls have moved.
    pub fn find<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        if self.of_particle.len() == state.particles.len() && !state.walls_moved {
            return;
        }
        let first = self.first_layer::<C, T>(state);
        let mut of_particle = std::mem::take(&mut self.of_particle);
        of_particle.clone_from(&first);
        state.team().fill(Rows::new(&mut of_particle), |range, surfaces| {
            for (i, surface) in range.zip(surfaces) {
                if is_solid(state.particles.kind[i]) && surface.normal == ZERO {
                    *surface = self.nearest::<C, T>(i, &first, state);
                }
            }
        });
        self.of_particle = of_particle;
    }

    fn first_layer<C: CandidateSearch, T: DistanceTest>(&self, state: &State<C>) -> Vec<Surface> {
        let mut first = state.workers.column(state.particles.len(), Surface::default());
        let (l0, kind) = (self.particle_distance_m, &state.particles.kind);
        state.team().fill(Rows::new(&mut first), |range, first| {
            for (i, surface) in range.zip(first) {
                if kind[i] != Kind::Wall {
                    continue;
                }
                let (mut toward, mut total) = (ZERO, 0.0);
                state.neighborhood().for_each_neighbor::<T>(i, NEAR * l0, |k, r_ik, r| {
                    if is_solid(kind[k]) {
                        let w = weight(r, NEAR * l0);
                        toward = add_scaled(toward, w, r_ik);
                        total += w;
                    }
                });
                let length = dot(toward, toward).sqrt();
                if length > ONE_SIDED * l0 * total {
                    let normal = along_axis(scale(-1.0 / length, toward));
                    *surface = Surface { normal, depth_m: 0.5 * l0 };
                }
            }
        });
        first
    }

    /// The surface of the nearest particle of the first layer, of the same group if possible.
    fn nearest<C: CandidateSearch, T: DistanceTest>(
        &self,
        i: usize,
        first: &[Surface],
        state: &State<C>,
    ) -> Surface {
        let particles: &Particles = &state.particles;
        let (mut found, mut best) = (Surface::default(), (true, f64::INFINITY));
        state.neighborhood().for_each_neighbor::<T>(i, self.radius_m, |k, r_ik, r| {
            let rank = (particles.group_of(k) != particles.group_of(i), r);
            if first[k].normal != ZERO && rank < best {
                let depth_m = dot(r_ik, first[k].normal) + first[k].depth_m;
                (found, best) = (Surface { normal: first[k].normal, depth_m }, rank);
            }
        });
        found
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.of_particle[..])
    }
}

fn is_solid(kind: Kind) -> bool {
    matches!(kind, Kind::Wall | Kind::DummyWall)
}

/// The axis that `normal` all but follows, or itself.
fn along_axis(normal: Vec3) -> Vec3 {
    match (0..3).find(|&d| normal[d].abs() > ALONG_AXIS) {
        Some(d) => {
            let mut axis = ZERO;
            axis[d] = normal[d].signum();
            axis
        }
        None => normal,
    }
}
