//! The weight function and the constants of the reference lattice.

use crate::base::vec3::dot;

/// The number of space dimensions.
pub const DIMENSIONS: f64 = 3.0;

/// The weight `w(r, re) = re / r - 1` of a neighbour at distance `r < re` (Koshizuka & Oka 1996); dimensionless.
#[inline(always)]
pub fn weight(r: f64, re: f64) -> f64 {
    re / r - 1.0
}

/// Sums over the cubic lattice of spacing `l0` around the origin, the origin left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// `n0 = sum w(r, re)`, dimensionless.
    pub number_density: f64,
    /// `lambda = sum r^2 w / sum w`, square metres.
    pub lambda_m2: f64,
    /// Lattice points within `re`.
    pub neighbors: usize,
}

impl Reference {
    /// The sums for the influence radius `radius_m` on a lattice of spacing `particle_distance_m`.
    pub fn on_lattice(particle_distance_m: f64, radius_m: f64) -> Self {
        let reach = (radius_m / particle_distance_m).ceil() as i32;
        let (mut sum_w, mut sum_r2_w, mut neighbors) = (0.0, 0.0, 0);
        for ix in -reach..=reach {
            for iy in -reach..=reach {
                for iz in -reach..=reach {
                    if (ix, iy, iz) == (0, 0, 0) {
                        continue;
                    }
                    let point = [ix, iy, iz].map(|i| particle_distance_m * f64::from(i));
                    let r2 = dot(point, point);
                    let r = r2.sqrt();
                    if r < radius_m {
                        let w = weight(r, radius_m);
                        sum_w += w;
                        sum_r2_w += r2 * w;
                        neighbors += 1;
                    }
                }
            }
        }
        Reference { number_density: sum_w, lambda_m2: sum_r2_w / sum_w, neighbors }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published constants of the method at l0 = 0.01875 m, and the same in units of l0 at both radii.
    #[test]
    fn the_reference_lattice_gives_the_methods_constants() {
        let l0 = 0.01875;
        let density = Reference::on_lattice(l0, 2.1 * l0);
        let laplacian = Reference::on_lattice(l0, 3.1 * l0);
        let close = |found: f64, stated: f64, digits: f64| (found - stated).abs() <= 0.5 * digits;
        assert!(close(density.number_density, 14.4186, 1e-4), "{density:?}");
        assert!(close(laplacian.number_density, 54.3212, 1e-4), "{laplacian:?}");
        assert!(close(laplacian.lambda_m2, 1.140265e-3, 1e-9), "{laplacian:?}");
        assert!(close(density.lambda_m2 / (l0 * l0), 1.7017, 1e-4));
        assert!(close(laplacian.lambda_m2 / (l0 * l0), 3.2434, 1e-4));
        assert_eq!((density.neighbors, laplacian.neighbors), (32, 122));
    }
}
