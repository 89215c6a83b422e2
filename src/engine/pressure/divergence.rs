//! The source from the velocity's divergence: `b_i = -(1 / dt) div u_i + (1 / (tau dt)) (n_i - n0) / n0`, Pa/m2 per
//! (kg/m3).
//!
//! `div u_i = tr(M_i^-1 sum_j v_ij r_ij (u_j - u_i)^T)` with `v_ij = w(r_ij, re_n) / r_ij^2`, the moment matrix `M_i` of all
//! neighbours and the velocities after the explicit half of the step; everyone within `re_n` takes part, walls with the
//! velocity that they have. It is right for a linear velocity wherever the particles lie; with `n0 / D` in place of the
//! matrix, vortices whose particles are no longer on a lattice blow up within a turn. Only where the matrix has no useful
//! inverse is it that. After the correction the divergence is
//! `(n - n0) / (tau n0)`, so that a density error decays as `exp(-t / tau)` however long the steps are. A feedback of a
//! share `gamma / dt^2` of the error, as the textbook's, grows without bound as steps become shorter. Steps longer than
//! `tau` take the whole error back at once. Tanaka & Masunaga 2010 with a time in place of their share. Where walls are
//! [mirrors](super::mirror) they take part as images.

use crate::base::parallel::Rows;
use crate::base::vec3::{ZERO, add_scaled, dot, sub};
use crate::engine::kernel::Kernel;
use crate::engine::parameters::Parameters;
use crate::engine::pressure::Pressure;
use crate::engine::pressure::free_surface::{Label, Unknowns};
use crate::engine::pressure::mirror::Mirror;
use crate::engine::pressure::moment::Moment;
use crate::engine::pressure::options::Gradient;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::State;

/// The share of `n0` that is no error where it lacks beside a surface particle, if walls are mirrors: on a lattice with
/// `re_n = 2.1 l0` the second layer lacks 0.008, fed back it would pull that layer up for good. This is twice as much, as
/// a moving surface is not a lattice; it was chosen by a standing wave of 20 layers, whose kinetic energy after five
/// periods is up by 0.10 with 0.01 (noise at the surface) and down by 0.02 with 0.015.
const LACKING: f64 = 0.015;

#[derive(Debug, Clone, Copy)]
pub struct DivergenceSource {
    kernel: Kernel,
    /// `D / n0`.
    factor: f64,
    n0: f64,
    dimensions: usize,
    /// Whether the sum stays as it is: the pairwise gradient is the negative transpose of the plain divergence, and only
    /// both together conserve.
    plain: bool,
    /// `tau`, seconds.
    feedback_s: f64,
}

impl DivergenceSource {
    pub fn new(feedback_s: f64, pressure: &Pressure, parameters: &Parameters) -> Self {
        let radius_m = parameters.number_density_radius_m();
        let n0 = parameters.reference(radius_m).number_density;
        DivergenceSource {
            kernel: pressure.kernel(radius_m, parameters),
            factor: parameters.dimensions.count() / n0,
            n0,
            dimensions: parameters.dimensions.count() as usize,
            plain: pressure.gradient == Gradient::Pairwise,
            feedback_s,
        }
    }

    /// Writes the source of each row.
    pub fn set<C: CandidateSearch, T: DistanceTest>(
        &self,
        source: &mut Vec<f64>,
        unknowns: &Unknowns,
        mirror: Option<&Mirror>,
        state: &State<C>,
    ) {
        let (near, rows, dt) = (state.neighborhood(), &unknowns.rows, state.time_step_s);
        let (n, u) = (&state.particles.number_density, &state.particles.velocity);
        let (kernel, feedback_1_s) = (self.kernel, 1.0 / self.feedback_s.max(dt));
        source.resize(rows.len(), 0.0);
        state.team().fill(Rows::new(source), |range, source| {
            for (&i, b) in rows[range].iter().zip(source) {
                let i = i as usize;
                let (mut sum, mut moment, mut products) = (0.0, Moment::default(), [ZERO; 3]);
                let mut near_surface = false;
                near.for_each_neighbor::<T>(i, kernel.radius_m, |j, r_ij, r| {
                    let (r, u_ij) = (kernel.distance(r), sub(u[j], u[i]));
                    let v = kernel.weight(r) / (r * r);
                    let (u_ij, r_ij) = match mirror {
                        Some(mirror) => mirror.image(j, u_ij, r_ij),
                        None => (u_ij, r_ij),
                    };
                    near_surface |= unknowns.label[j] == Label::Surface;
                    sum += v * dot(u_ij, r_ij);
                    moment.add(v, r_ij);
                    for (product, u) in products.iter_mut().zip(u_ij) {
                        *product = add_scaled(*product, v * u, r_ij);
                    }
                });
                let share = if self.plain { 0.0 } else { moment.usefulness(self.dimensions) };
                let mut divergence = self.factor * sum;
                if share > 0.0 {
                    let inverse = moment.inverse(self.dimensions);
                    let corrected = (0..self.dimensions).map(|d| dot(inverse[d], products[d])).sum::<f64>();
                    divergence = (1.0 - share) * divergence + share * corrected;
                }
                let error = (n[i] - self.n0) / self.n0;
                // On the surface neighbours are missing; too many of them are an error there as well.
                let error = match unknowns.label[i] {
                    Label::Surface => error.max(0.0),
                    _ if near_surface && mirror.is_some() && error < 0.0 => (error + LACKING).min(0.0),
                    _ => error,
                };
                *b = (feedback_1_s * error - divergence) / dt;
            }
        });
    }
}
