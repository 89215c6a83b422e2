//! The moment matrix `M = sum_j v_ij r_ij r_ij^T` of a particle's neighbours, whose inverse makes a gradient or divergence
//! right for linear fields wherever the particles lie.
//!
//! Where the neighbours lie nearly in a line, or in a plane in space, it has no useful inverse. How far it is from that is
//! told by its determinant over that of the multiple of unity with its trace: 1 for neighbours all around, 0 in a line.

use crate::base::vec3::{Vec3, scale};

/// Up to the first ratio the inverse is not used, from the second one on wholly.
const SINGULAR: [f64; 2] = [0.1, 0.3];

/// In the order xx, yy, zz, xy, xz, yz.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moment([f64; 6]);

impl Moment {
    /// Adds `v r r^T`.
    #[inline(always)]
    pub fn add(&mut self, v: f64, [x, y, z]: Vec3) {
        for (m, product) in self.0.iter_mut().zip([x * x, y * y, z * z, x * y, x * z, y * z]) {
            *m += v * product;
        }
    }

    /// From 0 where the inverse is of no use to 1 where it is.
    pub fn usefulness(&self, dimensions: usize) -> f64 {
        let mean = self.0[..dimensions].iter().sum::<f64>() / dimensions as f64;
        let isotropic: f64 = (0..dimensions).map(|_| mean).product();
        let ratio = self.in_space(dimensions).determinant() / isotropic;
        let share = (ratio - SINGULAR[0]) / (SINGULAR[1] - SINGULAR[0]);
        // Without neighbours the ratio is no number.
        if share > 0.0 { share.min(1.0) } else { 0.0 }
    }

    /// The rows of the inverse, by cofactors.
    pub fn inverse(&self, dimensions: usize) -> [Vec3; 3] {
        let moment = self.in_space(dimensions);
        let [xx, yy, zz, xy, xz, yz] = moment.0;
        let cofactors = [
            [yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy],
            [xz * yz - xy * zz, xx * zz - xz * xz, xy * xz - xx * yz],
            [xy * yz - xz * yy, xy * xz - xx * yz, xx * yy - xy * xy],
        ];
        cofactors.map(|row| scale(1.0 / moment.determinant(), row))
    }

    /// In a plane with the third direction apart, so that one inverse serves both.
    fn in_space(&self, dimensions: usize) -> Moment {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        Moment(if dimensions == 2 { [xx, yy, 1.0, xy, 0.0, 0.0] } else { [xx, yy, zz, xy, xz, yz] })
    }

    fn determinant(&self) -> f64 {
        let [xx, yy, zz, xy, xz, yz] = self.0;
        xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::vec3::dot;

    #[test]
    fn the_inverse_undoes_the_matrix_in_the_plane_and_in_space() {
        let (moment, x) = (Moment([3.0, 2.0, 4.0, 0.5, -0.3, 0.7]), [1.0, -2.0, 0.5]);
        let [xx, yy, zz, xy, xz, yz] = moment.0;
        let v = [dot([xx, xy, xz], x), dot([xy, yy, yz], x), dot([xz, yz, zz], x)];
        let found = moment.inverse(3).map(|row| dot(row, v));
        assert!((0..3).all(|d| (found[d] - x[d]).abs() < 1e-14), "{found:?}");
        let v = [xx * 1.0 + xy * -2.0, xy * 1.0 + yy * -2.0, 0.0];
        let found = moment.inverse(2).map(|row| dot(row, v));
        assert!((found[0] - 1.0).abs() < 1e-14 && (found[1] + 2.0).abs() < 1e-14 && found[2] == 0.0);
    }

    #[test]
    fn neighbours_in_a_line_are_told_from_those_all_around() {
        assert_eq!(Moment([2.0, 2.0, 0.0, 0.0, 0.0, 0.0]).usefulness(2), 1.0);
        assert_eq!(Moment([2.0, 2.0, 2.0, 0.0, 0.0, 0.0]).usefulness(3), 1.0);
        assert_eq!(Moment([2.0, 0.0, 0.0, 0.0, 0.0, 0.0]).usefulness(2), 0.0);
        assert_eq!(Moment::default().usefulness(2), 0.0);
    }
}
