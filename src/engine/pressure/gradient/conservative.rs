//! `a_i = -(D / (n0_g rho)) sum_j ((p_i + p_j) - (pmin_i + pmin_j)) r_ij w(r_ij, re_g) / r_ij^2` (Khayyer & Gotoh 2008).
//!
//! Antisymmetric in a pair and along its line, so that it changes neither linear nor angular momentum of a fluid without
//! walls by more than rounding. Not even constant pressures next to a jump in the minima cancel where particles lie in
//! disorder: the error of the sum does not shrink with the particle distance.

use super::{Around, Form};
use crate::base::vec3::{Vec3, ZERO, add_scaled};
use crate::engine::kernel::weight;
use crate::engine::pressure::free_surface::Label;
use crate::engine::search::{CandidateSearch, DistanceTest, Neighborhood};

pub struct Conservative<'a>(pub Around<'a>);

impl Form for Conservative<'_> {
    #[inline(always)]
    fn sum<C: CandidateSearch, T: DistanceTest>(&self, near: &Neighborhood<'_, C>, i: usize) -> Vec3 {
        let Around { kernel, pressure, minimum, label } = self.0;
        let (mut sum, above_i) = (ZERO, pressure[i] - minimum[i]);
        near.for_each_neighbor::<T>(i, kernel.radius_m, |j, r_ij, r| {
            if label[j] != Label::Outside {
                let r = kernel.distance(r);
                // Each pressure less its own minimum first: the sum of the two is the same seen from `j`.
                let above = above_i + (pressure[j] - minimum[j]);
                sum = add_scaled(sum, above * weight(r, kernel.radius_m) / (r * r), r_ij);
            }
        });
        sum
    }
}
