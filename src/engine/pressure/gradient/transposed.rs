//! `a_i = -(1 / rho) sum_j (p_i B_i + p_j B_j) r_ij w(r_ij, re_n) / r_ij^2`; dummy walls take no part.
//!
//! `B_i` is what the [divergence](crate::engine::pressure::divergence) multiplies its sum by: the inverse of the moment matrix
//! of all neighbours within `re_n`, and `D / n0` as far as that is of no use. So this is the divergence's negative transpose:
//! as with the [`pairwise`](super::pairwise) form the correction takes energy and never gives any, and pairs are
//! antisymmetric. Forces of a pair need not lie along its line, but the divergence of a rotation is zero, so their torques
//! add up to zero.
//!
//! What it is for: the plain divergence of `u = (x, -y)` is zero on a lattice, but not beneath a surface, where neighbours
//! along it count 1.7 times those across it. Layers there would have to swell when the surface shrinks, and a drop's surface
//! is then a skin with an elasticity of its own. With moment matrices motions that are linear keep their volume everywhere.
//!
//! Limits: the correction moves particles by `a dt^2` after torques were taken, which costs angular momentum of the order of
//! the step. A drop that swung twice in a plane then turned at 3 % of its angular frequency, and at 0.3 % with half the step;
//! the pairwise form, with less pressure near the surface, kept it to 0.02 %. And not for splashes. A coarse drop that fell into a
//! pool broke down within 200 steps; the pairwise form stands that.

use super::{Around, Form};
use crate::base::parallel::Rows;
use crate::base::vec3::{Vec3, ZERO, add_scaled, dot, scale};
use crate::engine::kernel::{Kernel, weight};
use crate::engine::pressure::free_surface::Label;
use crate::engine::pressure::moment::Moment;
use crate::engine::search::{CandidateSearch, DistanceTest, Neighborhood};
use crate::engine::stage::State;

pub struct Transposed<'a> {
    pub around: Around<'a>,
    /// `n0 / D B_i`.
    pub inverse: &'a [[Vec3; 3]],
}

/// Finds `n0 / D B_i` of all particles.
pub fn find_inverses<C: CandidateSearch, T: DistanceTest>(
    inverse: &mut [[Vec3; 3]],
    kernel: Kernel,
    (lattice_moment, dimensions): (f64, usize),
    state: &State<C>,
) {
    let near = state.neighborhood();
    state.team().fill(Rows::new(inverse), |range, inverse| {
        for (i, inverse) in range.zip(inverse) {
            let mut moment = Moment::default();
            near.for_each_neighbor::<T>(i, kernel.radius_m, |_, r_ij, r| {
                let r = kernel.distance(r);
                moment.add(kernel.weight(r) / (r * r), r_ij);
            });
            let share = moment.usefulness(dimensions);
            *inverse = [0, 1, 2].map(|d| {
                let mut row = ZERO;
                row[d] = 1.0 - share;
                row
            });
            if share > 0.0 {
                for (row, through) in inverse.iter_mut().zip(moment.inverse(dimensions)) {
                    *row = add_scaled(*row, share * lattice_moment, through);
                }
            }
        }
    });
}

impl Form for Transposed<'_> {
    #[inline(always)]
    fn sum<C: CandidateSearch, T: DistanceTest>(&self, near: &Neighborhood<'_, C>, i: usize) -> Vec3 {
        let Around { kernel, pressure, label, .. } = self.around;
        let (mut own, mut others) = (ZERO, ZERO);
        near.for_each_neighbor::<T>(i, kernel.radius_m, |j, r_ij, r| {
            if label[j] != Label::Outside {
                let r = kernel.distance(r);
                let v = weight(r, kernel.radius_m) / (r * r);
                own = add_scaled(own, v, r_ij);
                let theirs = self.inverse[j].map(|row| dot(row, r_ij));
                others = add_scaled(others, pressure[j] * v, theirs);
            }
        });
        add_scaled(others, 1.0, scale(pressure[i], self.inverse[i].map(|row| dot(row, own))))
    }
}
