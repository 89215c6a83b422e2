//! `a_i = -(D / (n0_g rho)) sum_j (p_i + p_j) r_ij w(r_ij, re_g) / r_ij^2`; dummy walls take no part.
//!
//! The counterpart of the model of the divergence: what pressures do to velocities is what velocities do to volumes, so
//! that the correction takes energy and never gives any. Antisymmetric in a pair and along its line: it changes neither
//! linear nor angular momentum. Outside the free surface is the pressure zero, by the neighbours that are missing there.
//! Particles in disorder repel each other while pressures are positive, until they are evenly spread; the gradient is as
//! accurate as they are, no more.

use super::{Around, Form};
use crate::base::vec3::{Vec3, ZERO, add_scaled};
use crate::engine::kernel::weight;
use crate::engine::pressure::free_surface::Label;
use crate::engine::search::{CandidateSearch, DistanceTest, Neighborhood};

pub struct Pairwise<'a>(pub Around<'a>);

impl Form for Pairwise<'_> {
    #[inline(always)]
    fn sum<C: CandidateSearch, T: DistanceTest>(&self, near: &Neighborhood<'_, C>, i: usize) -> Vec3 {
        let Around { kernel, pressure, label, .. } = self.0;
        let mut sum = ZERO;
        near.for_each_neighbor::<T>(i, kernel.radius_m, |j, r_ij, r| {
            if label[j] != Label::Outside {
                let r = kernel.distance(r);
                let both = pressure[i] + pressure[j];
                sum = add_scaled(sum, both * weight(r, kernel.radius_m) / (r * r), r_ij);
            }
        });
        sum
    }
}
