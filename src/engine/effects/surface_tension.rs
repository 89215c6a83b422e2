//! Surface tension as the pressure of the free surface: `p = sigma kappa` just inside it, as Laplace has it.
//!
//! The curvature is that of the level lines of a smooth colour: with `q = |r_ij| / re` and `W = (1 - q^2)^3`,
//! `C(x) = sum_j s_j W(x_j - x)`, and `kappa = -div (grad C / |grad C|) = (n . H n - tr H) / |grad C|` with `n = grad C / |grad C|`
//! and the second derivatives `H` of `C`, both exact sums of derivatives of `W` (the colour function of Brackbill, Kothe &
//! Zemach 1992 and Morris 2000, whose normals need no neighbour's normal here). It has the unit 1/m and is positive where
//! the fluid is convex; in space it is the sum of both curvatures. Only particles on the free surface gather these sums.
//!
//! * A particle is a little below the surface, at a depth `d = (C - C0 / 2) / |grad C|` with `C0` inside the fluid, where the
//!   level line is more curved than the surface: `kappa_s = kappa / (1 + kappa d / (D - 1))`.
//! * `p_i = sigma sum_j kappa_sj |grad C|_j (1 - q^2) / sum_j |grad C|_j (1 - q^2)` over `i` and the surface's particles around it
//!   evens out what the arrangement of particles adds. Walls at the surface take the mean of the fluid beside them.
//! * `s_j` is 1 for fluid and `(1 + cos theta) / 2` for solids, so that a level line meets a plane wall at the contact angle
//!   `theta`: at a right angle where walls count one half, by symmetry.
//!
//! Why this and no force in the layer at the surface: a round drop then has the same pressure everywhere, exactly, and no
//! gradient of it, while a force that is spread over three particles leaves what its sums and the pressure's differ by.
//! Limits: curvature up to one over a particle distance; as the curvature is not a sum over pairs, momentum is kept only as
//! well as the pressure gradient keeps it.

use crate::base::parallel::Rows;
use crate::base::vec3::{Vec3, ZERO, add_scaled, dot};
use crate::engine::effects::potential_tension::capillary_limit_s;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::Parameters;
use crate::engine::particles::Kind;
use crate::engine::pressure::free_surface::Label;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::State;
use crate::engine::time_step::StepLimit;

/// Tension of the fluid's surface by its curvature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceTension {
    /// `sigma`, newtons per metre.
    pub surface_tension_n_m: f64,
    /// `re` of the colour, in particle distances; `None` for the Laplacian's.
    pub radius: Option<f64>,
    /// `(1 + cos theta) / 2`: what solids count in the colour.
    pub wetting: f64,
}

impl SurfaceTension {
    /// `re` in metres.
    pub fn radius_m(&self, parameters: &Parameters) -> f64 {
        self.radius.unwrap_or(parameters.radii.laplacian) * parameters.particle_distance_m
    }
}

/// What the colour says about the surface at a particle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Bend {
    /// `kappa_s`, 1/m.
    curvature_1_m: f64,
    /// `re |grad C|`: how sharp the surface is there; zero where there is none.
    sharpness: f64,
}

/// The pressures of the free surface and what they are made from.
#[derive(Debug)]
pub struct SurfacePressure {
    surface_tension_n_m: f64,
    longest_step_s: f64,
    colour: Colour,
    bend: Vec<Bend>,
    /// `sigma kappa` of each particle on the free surface, Pa; zero for all others.
    pub pressure: Vec<f64>,
}

impl SurfacePressure {
    pub fn new<C: CandidateSearch>(
        tension: SurfaceTension,
        parameters: &Parameters,
        state: &State<C>,
    ) -> Self {
        SurfacePressure {
            surface_tension_n_m: tension.surface_tension_n_m,
            longest_step_s: capillary_limit_s(tension.surface_tension_n_m, parameters),
            colour: Colour::new(tension, parameters),
            bend: state.workers.column(state.particles.len(), Bend::default()),
            pressure: state.workers.column(state.particles.len(), 0.0),
        }
    }

    /// Finds the pressure of every particle on the free surface.
    pub fn find<C: CandidateSearch, T: DistanceTest>(&mut self, label: &[Label], state: &State<C>) {
        let (near, kind, colour) = (state.neighborhood(), &state.particles.kind, self.colour);
        let has_bend = |i: usize| label[i] == Label::Surface && kind[i] == Kind::Fluid;
        state.team().fill(Rows::new(&mut self.bend), |range, bend| {
            for (i, bend) in range.zip(bend) {
                *bend = Bend::default();
                if has_bend(i) {
                    let mut sums = ColourSums::default();
                    near.for_each_neighbor::<T>(i, colour.radius_m, |j, r_ij, r| {
                        sums.add(colour.share(kind[j]), r_ij, r, colour.radius_m);
                    });
                    *bend = colour.bend(&sums);
                }
            }
        });
        let (bend, radius_m, sigma) = (&self.bend, self.colour.radius_m, self.surface_tension_n_m);
        state.team().fill(Rows::new(&mut self.pressure), |range, pressure| {
            for (i, pressure) in range.zip(pressure) {
                *pressure = 0.0;
                if label[i] != Label::Surface {
                    continue;
                }
                let mut weights = bend[i].sharpness;
                let mut sum = weights * bend[i].curvature_1_m;
                near.for_each_neighbor::<T>(i, radius_m, |j, _, r| {
                    let q = r / radius_m;
                    let weight = bend[j].sharpness * (1.0 - q * q);
                    weights += weight;
                    sum += weight * bend[j].curvature_1_m;
                });
                if weights > 0.0 {
                    *pressure = sigma * (sum / weights);
                }
            }
        });
    }

    /// The longest step in which the surface's waves are stable.
    pub fn longest_step(&self) -> StepLimit {
        StepLimit { time_step_s: self.longest_step_s, reason: "the fastest capillary wave" }
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.bend[..]) + size_of_val(&self.pressure[..])
    }
}

/// The constants of the colour.
#[derive(Debug, Clone, Copy)]
struct Colour {
    radius_m: f64,
    dimensions: usize,
    /// `s` of solids.
    wetting: f64,
    /// `C0 / 2`.
    half_inside: f64,
    /// The strongest curvature that particles can show, 1/m: that of a drop of one particle.
    strongest_1_m: f64,
}

/// `C`, `re grad C` and `re^2 H` at a particle; of `H` the entries xx, yy, zz, xy, xz, yz.
#[derive(Debug, Clone, Copy)]
struct ColourSums {
    colour: f64,
    gradient: Vec3,
    second: [f64; 6],
}

/// What the particle itself adds.
impl Default for ColourSums {
    fn default() -> Self {
        ColourSums { colour: 1.0, gradient: ZERO, second: [-6.0, -6.0, -6.0, 0.0, 0.0, 0.0] }
    }
}

impl ColourSums {
    /// Adds a neighbour: with `a = 1 - q^2` and `y = r_ij / re`, `W = a^3`, `re grad W = 6 a^2 y` and
    /// `re^2 H = 24 a y y - 6 a^2 I`.
    #[inline(always)]
    fn add(&mut self, share: f64, r_ij: Vec3, r: f64, radius_m: f64) {
        let [x, y, z] = [r_ij[0] / radius_m, r_ij[1] / radius_m, r_ij[2] / radius_m];
        let q = r / radius_m;
        let a = 1.0 - q * q;
        self.colour += share * a * a * a;
        let (slope, bend) = (6.0 * share * a * a, 24.0 * share * a);
        self.gradient = add_scaled(self.gradient, slope, [x, y, z]);
        for (sum, product) in self.second.iter_mut().zip([x * x, y * y, z * z, x * y, x * z, y * z]) {
            *sum += bend * product;
        }
        for sum in &mut self.second[..3] {
            *sum -= slope;
        }
    }
}

/// Below this `re |grad C|`, as a share of `C0`, no surface is near: a flat one has about 1.6 in a plane.
const FAINT: f64 = 0.2;

impl Colour {
    fn new(tension: SurfaceTension, parameters: &Parameters) -> Self {
        let (l0, radius_m) = (parameters.particle_distance_m, tension.radius_m(parameters));
        let dimensions = parameters.dimensions.count();
        Colour {
            radius_m,
            dimensions: dimensions as usize,
            wetting: tension.wetting,
            half_inside: 0.5 * colour_inside(parameters.dimensions, radius_m / l0),
            strongest_1_m: 2.0 * (dimensions - 1.0) / l0,
        }
    }

    /// `s` of a kind.
    #[inline(always)]
    fn share(&self, kind: Kind) -> f64 {
        if kind == Kind::Fluid { 1.0 } else { self.wetting }
    }

    fn bend(&self, sums: &ColourSums) -> Bend {
        let ColourSums { colour, gradient: [x, y, z], second } = *sums;
        let steep2 = x * x + y * y + z * z;
        let steep = steep2.sqrt();
        if steep <= FAINT * 2.0 * self.half_inside {
            return Bend::default();
        }
        let products = [x * x, y * y, z * z, 2.0 * x * y, 2.0 * x * z, 2.0 * y * z];
        let across = products.iter().zip(&second).map(|(p, h)| p * h).sum::<f64>() / steep2;
        let all: f64 = second[..self.dimensions].iter().sum();
        let curvature = (across - all) / (steep * self.radius_m);
        let depth_m = self.radius_m * (colour - self.half_inside) / steep;
        let to_surface = 1.0 + curvature * depth_m / (self.dimensions as f64 - 1.0);
        let limit = self.strongest_1_m;
        // Beyond its centre of curvature a particle sees what no line of level can tell.
        let at_surface = if to_surface > 0.0 { curvature / to_surface } else { limit };
        Bend { curvature_1_m: at_surface.clamp(-limit, limit), sharpness: steep }
    }
}

/// `C0`: the colour inside the fluid, on the reference lattice. The radius is in particle distances.
fn colour_inside(dimensions: Dimensions, radius: f64) -> f64 {
    let reach = radius.ceil() as i32;
    let reach_z = if dimensions == Dimensions::Two { 0 } else { reach };
    let mut sum = 0.0;
    for ix in -reach..=reach {
        for iy in -reach..=reach {
            for iz in -reach_z..=reach_z {
                let point = [ix, iy, iz].map(f64::from);
                let a = 1.0 - dot(point, point) / (radius * radius);
                if a > 0.0 {
                    sum += a * a * a;
                }
            }
        }
    }
    sum
}
