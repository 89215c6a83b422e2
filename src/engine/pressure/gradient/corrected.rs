//! The gradient with the inverse moment matrix: `grad p_i = M_i^-1 sum_j (p_j - p_i) r_ij v_ij` with
//! `M_i = sum_j v_ij r_ij r_ij^T` and `v_ij = w(r_ij, re_g) / r_ij^2` (Khayyer & Gotoh 2011); dummy walls take no part.
//!
//! * [`Consistent`]: just this. Right for a linear pressure wherever the particles lie, but without any part that pushes
//!   particles apart.
//! * [`Corrected`]: on differences `p_j - pmin_i` from the smallest pressure around, and a share [`USUAL`] of the form
//!   without the matrix. It pushes particles apart, and its error for a linear pressure grows with their disorder.
//!
//! Where the moment matrix has no useful inverse both are the form without it.

use super::{Around, Form};
use crate::base::vec3::{Vec3, ZERO, add_scaled, dot, scale};
use crate::engine::kernel::weight;
use crate::engine::pressure::free_surface::Label;
use crate::engine::pressure::moment::Moment;
use crate::engine::search::{CandidateSearch, DistanceTest, Neighborhood};

/// The share of the form without the moment matrix.
const USUAL: f64 = 0.3;

pub struct Corrected<'a>(pub Sums<'a>);
pub struct Consistent<'a>(pub Sums<'a>);

/// What both forms are made from.
pub struct Sums<'a> {
    pub around: Around<'a>,
    /// The moment matrix of the reference lattice, a multiple of unity: `n0_g / D`.
    pub lattice_moment: f64,
    pub dimensions: usize,
}

impl Form for Corrected<'_> {
    #[inline(always)]
    fn sum<C: CandidateSearch, T: DistanceTest>(&self, near: &Neighborhood<'_, C>, i: usize) -> Vec3 {
        let (moment, differences, lopsided) = self.0.gather::<C, T>(near, i);
        let Around { pressure, minimum, .. } = self.0.around;
        self.0.blend(moment, add_scaled(differences, pressure[i] - minimum[i], lopsided), USUAL)
    }
}

impl Form for Consistent<'_> {
    #[inline(always)]
    fn sum<C: CandidateSearch, T: DistanceTest>(&self, near: &Neighborhood<'_, C>, i: usize) -> Vec3 {
        let (moment, differences, _) = self.0.gather::<C, T>(near, i);
        self.0.blend(moment, differences, 0.0)
    }
}

impl Sums<'_> {
    /// The moment matrix, `sum (p_j - p_i) r_ij v_ij` and `sum r_ij v_ij`.
    #[inline(always)]
    fn gather<C: CandidateSearch, T: DistanceTest>(
        &self,
        near: &Neighborhood<'_, C>,
        i: usize,
    ) -> (Moment, Vec3, Vec3) {
        let Around { kernel, pressure, label, .. } = self.around;
        let (mut moment, mut differences, mut lopsided) = (Moment::default(), ZERO, ZERO);
        near.for_each_neighbor::<T>(i, kernel.radius_m, |j, r_ij, r| {
            if label[j] != Label::Outside {
                let r = kernel.distance(r);
                let v = weight(r, kernel.radius_m) / (r * r);
                moment.add(v, r_ij);
                differences = add_scaled(differences, (pressure[j] - pressure[i]) * v, r_ij);
                lopsided = add_scaled(lopsided, v, r_ij);
            }
        });
        (moment, differences, lopsided)
    }

    /// A share of the sum as it is, and the rest through the inverse of the moment matrix as far as that is of use.
    fn blend(&self, moment: Moment, sum: Vec3, usual: f64) -> Vec3 {
        let corrected = (1.0 - usual) * moment.usefulness(self.dimensions);
        if corrected <= 0.0 {
            return sum;
        }
        let through = moment.inverse(self.dimensions).map(|row| self.lattice_moment * dot(row, sum));
        add_scaled(scale(1.0 - corrected, sum), corrected, through)
    }
}
