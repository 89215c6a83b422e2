//! `a_i = -(D / (n0_g rho)) sum_j (p_j - pmin_i) r_ij w(r_ij, re_g) / r_ij^2`, where `pmin_i` is the smallest pressure among
//! `i` and its neighbours within `re_g`; dummy walls take no part (Koshizuka & Oka 1996).

use super::{Around, Form};
use crate::base::vec3::{Vec3, ZERO, add_scaled};
use crate::engine::kernel::weight;
use crate::engine::pressure::free_surface::Label;
use crate::engine::search::{CandidateSearch, DistanceTest, Neighborhood};

pub struct Minimum<'a>(pub Around<'a>);

impl Form for Minimum<'_> {
    #[inline(always)]
    fn sum<C: CandidateSearch, T: DistanceTest>(&self, near: &Neighborhood<'_, C>, i: usize) -> Vec3 {
        let Around { kernel, pressure, minimum, label } = self.0;
        let (mut sum, minimum) = (ZERO, minimum[i]);
        near.for_each_neighbor::<T>(i, kernel.radius_m, |j, r_ij, r| {
            if label[j] != Label::Outside {
                let r = kernel.distance(r);
                let magnitude = (pressure[j] - minimum) * weight(r, kernel.radius_m) / (r * r);
                sum = add_scaled(sum, magnitude, r_ij);
            }
        });
        sum
    }
}
