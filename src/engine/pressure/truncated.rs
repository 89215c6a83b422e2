//! Free surfaces without a fixed pressure: what a neighbourhood lacks counts as neighbours with pressure zero.
//!
//! Every particle has a row, those on the surface too. With `c_ij` as in [`poisson`](super::poisson) the diagonal takes in
//! `s max(beta c0 - sum_j c_ij, 0)`, where `c0` is the sum of a whole neighbourhood and the sum runs over everyone, so that
//! walls are no surface (after Nair & Tomar 2014). So no pressure jumps when a particle comes to the surface or leaves it,
//! and the outermost particles keep their volume as all others do.
//!
//! The factor `s` makes that boundary as stiff as the pairwise gradient and the divergence see it. Beneath a plane surface
//! of the lattice they answer a uniform pressure with `4 D^2 / (n0_n n0_g) sum_k S_k^2` over the layers `k`, where `S_k` is the
//! sum of `w(r, re_g) r_y / r^2` over the missing vectors; the equation has `2D / (n0_L lambda) sum_k missing_k`; `s` is their
//! ratio. For the transposed gradient the answer is `sum_k F_k^2` with `F_k = sum_j (B_k + B_j) w r_y / r^2` over the vectors that
//! are there and the moment matrices of their layers. Without it the correction overshoots, and the pressure changes its sign from step to step.

use crate::base::parallel::Rows;
use crate::base::vec3::dot;
use crate::engine::kernel::{Dimensions, Kernel, weight};
use crate::engine::parameters::Parameters;
use crate::engine::pressure::Pressure;
use crate::engine::pressure::free_surface::Unknowns;
use crate::engine::pressure::options::Gradient;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::State;

#[derive(Debug)]
pub struct Truncated {
    /// `beta n0_L`.
    full: f64,
    /// `s`.
    stiffness: f64,
    /// `s max(beta n0_L - n_L, 0)` of each row.
    pub missing: Vec<f64>,
}

impl Truncated {
    pub fn new(pressure: &Pressure, parameters: &Parameters) -> Self {
        let n0 = parameters.reference(parameters.laplacian_radius_m()).number_density;
        Truncated {
            full: pressure.surface_threshold * n0,
            stiffness: stiffness(pressure, parameters),
            missing: Vec::new(),
        }
    }

    /// Finds what the neighbourhoods of all rows lack.
    pub fn find<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        kernel: Kernel,
        unknowns: &Unknowns,
        state: &State<C>,
    ) {
        let (near, rows, full, stiffness) = (state.neighborhood(), &unknowns.rows, self.full, self.stiffness);
        self.missing.resize(rows.len(), 0.0);
        state.team().fill(Rows::new(&mut self.missing), |range, missing| {
            for (missing, &i) in missing.iter_mut().zip(&rows[range]) {
                let mut sum = 0.0;
                near.for_each_neighbor::<T>(i as usize, kernel.radius_m, |_, _, r| sum += kernel.weight(r));
                *missing = stiffness * (full - sum).max(0.0);
            }
        });
    }

    pub fn bytes(&self) -> usize {
        self.missing.capacity() * size_of::<f64>()
    }
}

/// `s`.
fn stiffness(pressure: &Pressure, parameters: &Parameters) -> f64 {
    let threshold = pressure.surface_threshold;
    let (dimensions, l0) = (parameters.dimensions, parameters.particle_distance_m);
    let [re_g, re_l] = [parameters.radii.gradient, parameters.radii.laplacian];
    let reference = |radius_m: f64| parameters.reference(radius_m);
    let n0_n = reference(parameters.number_density_radius_m()).number_density;
    let n0_g = reference(parameters.gradient_radius_m()).number_density;
    let laplacian = reference(parameters.laplacian_radius_m());
    let (mut answers, mut missing) = (0.0, 0.0);
    for layer in 0..re_g.max(re_l).ceil() as i32 {
        let pull = above(dimensions, re_g, layer, |r, rise| weight(r, re_g) * rise / (r * r));
        answers += pull * pull;
        let lost = above(dimensions, re_l, layer, |r, _| weight(r, re_l));
        missing += (lost - (1.0 - threshold) * laplacian.number_density).max(0.0);
    }
    let answers = match pressure.gradient {
        Gradient::Transposed => transposed_answers(dimensions, parameters.radii.number_density),
        _ => 4.0 * dimensions.count() * dimensions.count() * answers / (n0_n * n0_g),
    };
    let lambda = laplacian.lambda_m2 / (l0 * l0);
    laplacian.number_density * lambda * answers / (2.0 * dimensions.count() * missing)
}

/// `sum_k F_k^2`.
fn transposed_answers(dimensions: Dimensions, radius: f64) -> f64 {
    let reach = radius.ceil() as i32;
    let beside = |layer, power: i32| {
        above(dimensions, radius, layer, |r, rise| weight(r, radius) * rise.powi(power) / (r * r))
    };
    // Of `w r_y^2 / r^2`, half lies above a particle inside.
    let inverse = |layer: i32| 1.0 / (2.0 * beside(0, 2) - beside(layer, 2));
    let mut answers = 0.0;
    for layer in 0..2 * reach {
        let mut force = 0.0;
        for rise in -reach..=layer.min(reach) {
            let size = rise.abs();
            let row = if size > 0 { beside(size - 1, 1) - beside(size, 1) } else { 0.0 };
            force += f64::from(rise.signum()) * row * (inverse(layer) + inverse(layer - rise));
        }
        answers += force * force;
    }
    answers
}

/// The sum of `term(r, rise)` over lattice vectors that rise by more than `layer` layers, lengths in particle distances.
fn above(dimensions: Dimensions, radius: f64, layer: i32, term: impl Fn(f64, f64) -> f64) -> f64 {
    let reach = radius.ceil() as i32;
    let reach_z = if dimensions == Dimensions::Two { 0 } else { reach };
    let mut sum = 0.0;
    for rise in layer + 1..=reach {
        for ix in -reach..=reach {
            for iz in -reach_z..=reach_z {
                let point = [ix, rise, iz].map(f64::from);
                let r = dot(point, point).sqrt();
                if r < radius {
                    sum += term(r, f64::from(rise));
                }
            }
        }
    }
    sum
}
