//! The gradient with the inverse moment matrix: `grad p_i = M_i^-1 sum_j (p_j - p_i) r_ij w(r_ij, re_g) / r_ij^2` with
//! `M_i = sum_j w r_ij r_ij^T / r_ij^2` (Khayyer & Gotoh 2011); dummy walls take no part.
//!
//! Right for a linear pressure wherever the particles lie. On the reference lattice `M_i` is `n0_g / D` times unity and the
//! form is the usual one. It has no part that pushes particles apart: they follow the flow into filaments unless something
//! else, such as shifting, holds them apart. So a share [`REPULSIVE`] is the usual form on differences from the smallest
//! pressure around. Where the neighbours lie nearly in a line, or in a plane in space, `M_i` has no useful inverse, and all
//! is the usual form; in between the share varies.

use super::{Around, Form};
use crate::base::vec3::{Vec3, ZERO, add_scaled, dot, scale};
use crate::engine::kernel::weight;
use crate::engine::pressure::free_surface::Label;
use crate::engine::search::{CandidateSearch, DistanceTest, Neighborhood};

/// The share of the usual, repulsive form.
const REPULSIVE: f64 = 0.3;
/// `det M` over that of the multiple of unity with its trace: 1 for neighbours all around, 0 in a line or plane. At and
/// below the first number the moment matrix is not used, from the second one on wholly.
const SINGULAR: [f64; 2] = [0.1, 0.3];

pub struct Corrected<'a> {
    around: Around<'a>,
    lattice_moment: f64,
    dimensions: usize,
}

/// `M` in the order xx, yy, zz, xy, xz, yz.
type Symmetric = [f64; 6];

impl<'a> Corrected<'a> {
    pub fn new(around: Around<'a>, lattice_moment: f64, dimensions: usize) -> Self {
        Corrected { around, lattice_moment, dimensions }
    }
}

impl Form for Corrected<'_> {
    #[inline(always)]
    fn sum<C: CandidateSearch, T: DistanceTest>(&self, near: &Neighborhood<'_, C>, i: usize) -> Vec3 {
        let Around { kernel, pressure, minimum, label } = self.around;
        let (mut moment, mut differences, mut lopsided) = ([0.0; 6], ZERO, ZERO);
        near.for_each_neighbor::<T>(i, kernel.radius_m, |j, r_ij, r| {
            if label[j] != Label::Outside {
                let r = kernel.distance(r);
                let v = weight(r, kernel.radius_m) / (r * r);
                differences = add_scaled(differences, (pressure[j] - pressure[i]) * v, r_ij);
                lopsided = add_scaled(lopsided, v, r_ij);
                let [x, y, z] = r_ij;
                for (m, product) in moment.iter_mut().zip([x * x, y * y, z * z, x * y, x * z, y * z]) {
                    *m += v * product;
                }
            }
        });
        let usual = add_scaled(differences, pressure[i] - minimum[i], lopsided);
        let share = (1.0 - REPULSIVE) * well_surrounded(moment, self.dimensions);
        if label[i] != Label::Inner || share <= 0.0 {
            return usual;
        }
        let corrected = scale(self.lattice_moment, solve(moment, differences, self.dimensions));
        add_scaled(scale(1.0 - share, usual), share, corrected)
    }
}

/// From 0 where the moment matrix is of no use to 1 where it is.
fn well_surrounded(moment: Symmetric, dimensions: usize) -> f64 {
    let mean = moment[..dimensions].iter().sum::<f64>() / dimensions as f64;
    let isotropic: f64 = (0..dimensions).map(|_| mean).product();
    let ratio = determinant(in_space(moment, dimensions)) / isotropic;
    let share = (ratio - SINGULAR[0]) / (SINGULAR[1] - SINGULAR[0]);
    // Without neighbours the ratio is no number.
    if share > 0.0 { share.min(1.0) } else { 0.0 }
}

/// In a plane with the third direction apart, so that one inverse serves both.
fn in_space(moment: Symmetric, dimensions: usize) -> Symmetric {
    let [xx, yy, zz, xy, xz, yz] = moment;
    if dimensions == 2 { [xx, yy, 1.0, xy, 0.0, 0.0] } else { [xx, yy, zz, xy, xz, yz] }
}

fn determinant([xx, yy, zz, xy, xz, yz]: Symmetric) -> f64 {
    xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
}

/// `M^-1 v` by cofactors.
fn solve(moment: Symmetric, v: Vec3, dimensions: usize) -> Vec3 {
    let moment = in_space(moment, dimensions);
    let [xx, yy, zz, xy, xz, yz] = moment;
    let cofactors = [
        [yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy],
        [xz * yz - xy * zz, xx * zz - xz * xz, xy * xz - xx * yz],
        [xy * yz - xz * yy, xy * xz - xx * yz, xx * yy - xy * xy],
    ];
    scale(1.0 / determinant(moment), cofactors.map(|row| dot(row, v)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_undoes_the_matrix_in_the_plane_and_in_space() {
        let (moment, x) = ([3.0, 2.0, 4.0, 0.5, -0.3, 0.7], [1.0, -2.0, 0.5]);
        let [xx, yy, zz, xy, xz, yz] = moment;
        let v = [dot([xx, xy, xz], x), dot([xy, yy, yz], x), dot([xz, yz, zz], x)];
        let found = solve(moment, v, 3);
        assert!((0..3).all(|d| (found[d] - x[d]).abs() < 1e-14), "{found:?}");
        let v = [xx * 1.0 + xy * -2.0, xy * 1.0 + yy * -2.0, 0.0];
        let found = solve(moment, v, 2);
        assert!((found[0] - 1.0).abs() < 1e-14 && (found[1] + 2.0).abs() < 1e-14 && found[2] == 0.0);
    }

    #[test]
    fn neighbours_in_a_line_are_told_from_those_all_around() {
        assert_eq!(well_surrounded([2.0, 2.0, 0.0, 0.0, 0.0, 0.0], 2), 1.0);
        assert_eq!(well_surrounded([2.0, 2.0, 2.0, 0.0, 0.0, 0.0], 3), 1.0);
        assert_eq!(well_surrounded([2.0, 0.0, 0.0, 0.0, 0.0, 0.0], 2), 0.0);
        assert_eq!(well_surrounded([0.0; 6], 2), 0.0);
    }
}
