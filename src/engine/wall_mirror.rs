//! Values of a field behind the surface of a wall, such that the field has the wall's value at the surface.
//!
//! Wall particles complete the neighbourhoods of the fluid. Where each has the wall's own value, a Laplacian sees a wall
//! that begins somewhere below its first layer. Here a particle at depth `d` below the surface has
//!
//! `f = f_w - d s`, `s = sum_j w h_j (f_j - f_w) / sum_j w h_j^2`
//!
//! over the fluid particles `j`, at heights `h_j > 0` above the surface, around the mirror point, so that a field which
//! is linear in the height goes on behind the surface without a kink, however the fluid's particles lie, and one on the
//! lattice is reflected: `f = 2 f_w - f(mirror point)`. The weight `w(r, 1.1 l0)` is the method's own, unbounded at the
//! mirror point: a particle that lies there counts alone. The idea is that of Takeda, Miyama & Sekiya (1994) and Morris,
//! Fox & Zhu (1997); weight and slope are our own.
//!
//! The surface is the plane half a particle distance above the first layer of the wall, where the space ends that the
//! fluid's particles fill: `N` layers of fluid make a channel of width `N l0`, and plane Couette and Poiseuille flow are of
//! second order in `l0`. (The plane through the first layer would be of second order too, with a channel of `(N + 1) l0`.)
//! A wall particle belongs to the surface of the nearest wall particle with a normal. `f_w` is the value there. Mirror
//! points deeper in the fluid than walks reach are moved towards the surface by whole layers; the slope stays.

use crate::base::parallel::Rows;
use crate::base::vec3::{self, Vec3, add, add_scaled, dot, scale, sub};
use crate::engine::facing::Facing;
use crate::engine::kernel::Kernel;
use crate::engine::parameters::Parameters;
use crate::engine::particles::{Kind, Particles};
use crate::engine::search::{CandidateSearch, DistanceTest, NONE};
use crate::engine::stage::State;

/// Height of the surface above the first layer, in particle distances.
pub const SURFACE_ABOVE_LAYER: f64 = 0.5;
/// Radius of the weight around a mirror point, in particle distances: the nearest layers alone.
const RADIUS: f64 = 1.1;
/// The least height of a fluid particle that [`WallMirror::steepness`] divides by, in particle distances.
const LEAST_HEIGHT: f64 = 0.25;
/// Share of the radius below which a particle is at the mirror point: small enough to outweigh all others to rounding.
const AT_THE_POINT: f64 = 1e-30;

/// A field that can be extrapolated: scalars and vectors.
pub trait Field: Copy + Default + Send + Sync {
    fn minus(self, other: Self) -> Self;
    /// `self + s other`.
    fn plus_scaled(self, s: f64, other: Self) -> Self;
}

impl Field for f64 {
    #[inline(always)]
    fn minus(self, other: f64) -> f64 {
        self - other
    }

    #[inline(always)]
    fn plus_scaled(self, s: f64, other: f64) -> f64 {
        self + s * other
    }
}

impl Field for Vec3 {
    #[inline(always)]
    fn minus(self, other: Vec3) -> Vec3 {
        sub(self, other)
    }

    #[inline(always)]
    fn plus_scaled(self, s: f64, other: Vec3) -> Vec3 {
        add_scaled(self, s, other)
    }
}

/// A wall particle and the surface that it lies behind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Behind {
    /// The wall particle.
    pub particle: u32,
    /// The nearest wall particle with a normal; [`NONE`] where no surface is near.
    pub nearest: u32,
    /// Unit normal of the surface, out of the wall.
    pub normal: Vec3,
    /// From the wall particle to the nearest one of the surface, metres.
    pub to_nearest: Vec3,
    /// Below the surface, metres.
    pub depth_m: f64,
}

impl Default for Behind {
    fn default() -> Self {
        Behind { particle: NONE, nearest: NONE, normal: vec3::ZERO, to_nearest: vec3::ZERO, depth_m: 0.0 }
    }
}

/// All wall particles with their surfaces, found anew whenever a wall particle has moved.
#[derive(Debug)]
pub struct WallMirror {
    facing: Facing,
    /// How far walks reach, metres.
    reach_m: f64,
    kernel: Kernel,
    /// [`SURFACE_ABOVE_LAYER`], metres.
    above_m: f64,
    least_height_m: f64,
    /// The greatest height of a mirror point, metres.
    highest_m: f64,
    walls: Vec<Behind>,
    /// Where the wall particles were when their surfaces were found.
    found_at: Vec<Vec3>,
    /// The place in `walls` of each particle; [`NONE`] for all others.
    place: Vec<u32>,
    /// Of each place, zero where the wall particle is not on a surface.
    normal: Vec<Vec3>,
}

impl WallMirror {
    /// For walks that reach as far as the Laplacian's.
    pub fn new(parameters: &Parameters) -> Self {
        let l0 = parameters.particle_distance_m;
        let whole_layers = (parameters.radii.laplacian - RADIUS - 2.0 * SURFACE_ABOVE_LAYER + 1e-9).floor();
        WallMirror {
            facing: Facing::new(parameters),
            reach_m: parameters.laplacian_radius_m(),
            kernel: Kernel { radius_m: RADIUS * l0, floor_m: AT_THE_POINT * RADIUS * l0 },
            above_m: SURFACE_ABOVE_LAYER * l0,
            least_height_m: LEAST_HEIGHT * l0,
            highest_m: (whole_layers.max(0.0) + SURFACE_ABOVE_LAYER) * l0,
            walls: Vec::new(),
            found_at: Vec::new(),
            place: Vec::new(),
            normal: Vec::new(),
        }
    }

    /// Finds the surfaces, if a wall particle moved since the last time. The state's buckets must be fresh.
    pub fn refresh<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        if !self.are_known(&state.particles) {
            self.list_walls(&state.particles);
            self.find_normals::<C, T>(state);
            self.find_surfaces::<C, T>(state);
        }
    }

    /// The wall particles in ascending order.
    pub fn walls(&self) -> &[Behind] {
        &self.walls
    }

    /// The surface that wall particle `j` lies behind; `None` for other particles and where no surface is near.
    #[inline(always)]
    pub fn surface_of(&self, j: usize) -> Option<&Behind> {
        self.walls.get(self.place[j] as usize).filter(|behind| behind.nearest != NONE)
    }

    /// `d_j / h_i`: by how many times the difference of fluid particle `i` to the wall's value wall particle `j = i + r_ij`
    /// differs from it in the other direction, if the field is a line through both. For solvers that want the value
    /// behind the wall as a function of the row's own unknown.
    #[inline(always)]
    pub fn steepness(&self, behind: &Behind, r_ij: Vec3) -> f64 {
        let height_m = -dot(add(r_ij, behind.to_nearest), behind.normal) - self.above_m;
        behind.depth_m / height_m.max(self.least_height_m)
    }

    /// The value that each of [`WallMirror::walls`] takes.
    pub fn extrapolate<C: CandidateSearch, T: DistanceTest, F: Field>(
        &self,
        state: &State<C>,
        field: &[F],
        mirrored: &mut Vec<F>,
    ) {
        mirrored.resize(self.walls.len(), F::default());
        state.team().fill(Rows::new(mirrored), |range, mirrored| {
            for (behind, mirrored) in self.walls[range].iter().zip(mirrored) {
                *mirrored = self.value::<C, T, F>(state, field, behind);
            }
        });
    }

    /// Exchanges the values of wall particles in `field` with those in `mirrored`: once to let walks see them, once more to
    /// have the walls' own back.
    pub fn exchange<F: Field>(&self, field: &mut [F], mirrored: &mut [F]) {
        for (behind, mirrored) in self.walls.iter().zip(mirrored) {
            std::mem::swap(&mut field[behind.particle as usize], mirrored);
        }
    }

    fn value<C: CandidateSearch, T: DistanceTest, F: Field>(
        &self,
        state: &State<C>,
        field: &[F],
        behind: &Behind,
    ) -> F {
        if behind.nearest == NONE {
            return field[behind.particle as usize];
        }
        let (kind, nearest) = (&state.particles.kind, behind.nearest as usize);
        let of_wall = field[nearest];
        let above_m = behind.depth_m + behind.depth_m.min(self.highest_m);
        let point = sub(scale(above_m, behind.normal), behind.to_nearest);
        let (mut rise, mut total) = (F::default(), 0.0);
        state.neighborhood().for_each_neighbor::<T>(nearest, self.reach_m, |j, from_nearest, _| {
            let height = dot(from_nearest, behind.normal) - self.above_m;
            if kind[j] == Kind::Fluid && height > 0.0 {
                let away = sub(from_nearest, point);
                let r = dot(away, away).sqrt();
                if r < self.kernel.radius_m {
                    let w = self.kernel.weight(r) * height;
                    rise = rise.plus_scaled(w, field[j].minus(of_wall));
                    total += w * height;
                }
            }
        });
        if total > 0.0 { of_wall.plus_scaled(-behind.depth_m / total, rise) } else { of_wall }
    }

    fn are_known(&self, particles: &Particles) -> bool {
        let mut known = self.walls.iter().zip(&self.found_at);
        let same = (0..particles.len()).filter(|&i| is_wall(particles.kind[i])).all(|i| {
            known
                .next()
                .is_some_and(|(behind, at)| behind.particle as usize == i && *at == particles.position[i])
        });
        same && known.next().is_none() && self.place.len() == particles.len()
    }

    fn list_walls(&mut self, particles: &Particles) {
        self.walls.clear();
        self.found_at.clear();
        self.place.clear();
        self.place.resize(particles.len(), NONE);
        for i in (0..particles.len()).filter(|&i| is_wall(particles.kind[i])) {
            self.place[i] = self.walls.len() as u32;
            self.walls.push(Behind { particle: i as u32, ..Behind::default() });
            self.found_at.push(particles.position[i]);
        }
    }

    fn find_normals<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        let (walls, facing) = (&self.walls, self.facing);
        self.normal.resize(walls.len(), vec3::ZERO);
        state.team().fill(Rows::new(&mut self.normal), |range, normal| {
            for (behind, normal) in walls[range].iter().zip(normal) {
                let i = behind.particle as usize;
                *normal = match state.particles.kind[i] {
                    Kind::Wall => facing.normal::<C, T>(state, i),
                    _ => vec3::ZERO,
                };
            }
        });
    }

    fn find_surfaces<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        let (place, normal) = (&self.place, &self.normal);
        let (reach_m, above_m) = (self.reach_m, self.above_m);
        state.team().fill(Rows::new(&mut self.walls), |range, walls| {
            for (at, behind) in range.zip(walls) {
                let i = behind.particle as usize;
                let mut least = f64::INFINITY;
                if normal[at] != vec3::ZERO {
                    (behind.nearest, behind.normal, least) = (behind.particle, normal[at], 0.0);
                }
                state.neighborhood().for_each_neighbor::<T>(i, reach_m, |j, r_ij, r| {
                    let there = normal.get(place[j] as usize).copied().unwrap_or(vec3::ZERO);
                    if r < least && there != vec3::ZERO {
                        (behind.nearest, behind.normal, behind.to_nearest) = (j as u32, there, r_ij);
                        least = r;
                    }
                });
                behind.depth_m = dot(behind.to_nearest, behind.normal).max(0.0) + above_m;
            }
        });
    }

    /// Bytes of all columns.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.walls[..])
            + size_of_val(&self.found_at[..])
            + size_of_val(&self.place[..])
            + size_of_val(&self.normal[..])
    }
}

fn is_wall(kind: Kind) -> bool {
    matches!(kind, Kind::Wall | Kind::DummyWall)
}

#[cfg(test)]
mod tests;
