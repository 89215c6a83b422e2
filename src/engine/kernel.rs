//! The weight function and the constants of the reference lattice.

use crate::base::vec3::dot;

/// Whether particles fill a plane, z = 0, or space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimensions {
    Two,
    Three,
}

impl Dimensions {
    /// `D` of the formulae.
    pub fn count(self) -> f64 {
        match self {
            Dimensions::Two => 2.0,
            Dimensions::Three => 3.0,
        }
    }

    /// What a particle on a lattice of spacing `particle_distance_m` fills: square metres or cubic metres.
    pub fn volume(self, particle_distance_m: f64) -> f64 {
        match self {
            Dimensions::Two => particle_distance_m * particle_distance_m,
            Dimensions::Three => particle_distance_m * particle_distance_m * particle_distance_m,
        }
    }
}

/// The weight `w(r, re) = re / r - 1` of a neighbour at distance `r < re` (Koshizuka & Oka 1996); dimensionless.
#[inline(always)]
pub fn weight(r: f64, re: f64) -> f64 {
    re / r - 1.0
}

/// The weight function with its radius and, where a scene names one, a floor: `w(max(r, floor), re)`.
///
/// The weight grows without bound as two particles meet, and the gradient's `w / r` faster still, so that a single close
/// pair can fling its particles out of the flow. Below the floor they push no harder than at it, and a pair at one place
/// has a weight but no direction to push in. Our own addition; with a floor of zero the method's own kernel, to the last
/// bit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    pub radius_m: f64,
    /// Zero where there is none.
    pub floor_m: f64,
}

impl Kernel {
    /// The distance that counts for a pair at distance `r`, metres.
    #[inline(always)]
    pub fn distance(self, r: f64) -> f64 {
        if r > self.floor_m { r } else { self.floor_m }
    }

    /// The weight of a pair at distance `r` metres, dimensionless.
    #[inline(always)]
    pub fn weight(self, r: f64) -> f64 {
        weight(self.distance(r), self.radius_m)
    }
}

/// Sums over the square or cubic lattice of spacing `l0` around the origin, the origin left out.
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
    pub fn on_lattice(dimensions: Dimensions, particle_distance_m: f64, radius_m: f64) -> Self {
        let reach = (radius_m / particle_distance_m).ceil() as i32;
        let reach_z = if dimensions == Dimensions::Two { 0 } else { reach };
        let (mut sum_w, mut sum_r2_w, mut neighbors) = (0.0, 0.0, 0);
        for ix in -reach..=reach {
            for iy in -reach..=reach {
                for iz in -reach_z..=reach_z {
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

    #[test]
    fn a_floor_of_zero_is_no_floor_and_below_one_nothing_grows() {
        let plain = Kernel { radius_m: 2.1, floor_m: 0.0 };
        for r in [0.0, f64::MIN_POSITIVE, 1e-9, 0.3, 0.5, 1.0, 2.0999] {
            assert_eq!(plain.weight(r).to_bits(), weight(r, 2.1).to_bits());
            assert_eq!(plain.distance(r).to_bits(), r.to_bits());
        }
        let floored = Kernel { floor_m: 0.5, ..plain };
        assert_eq!([0.0, 0.3, 0.5].map(|r| floored.weight(r)), [weight(0.5, 2.1); 3]);
        assert_eq!(floored.weight(0.6), weight(0.6, 2.1));
    }

    /// Published constants of the method at l0 = 0.01875 m, and the same in units of l0 at both radii.
    #[test]
    fn the_reference_lattice_gives_the_methods_constants() {
        let l0 = 0.01875;
        let density = Reference::on_lattice(Dimensions::Three, l0, 2.1 * l0);
        let laplacian = Reference::on_lattice(Dimensions::Three, l0, 3.1 * l0);
        let close = |found: f64, stated: f64, digits: f64| (found - stated).abs() <= 0.5 * digits;
        assert!(close(density.number_density, 14.4186, 1e-4), "{density:?}");
        assert!(close(laplacian.number_density, 54.3212, 1e-4), "{laplacian:?}");
        assert!(close(laplacian.lambda_m2, 1.140265e-3, 1e-9), "{laplacian:?}");
        assert!(close(density.lambda_m2 / (l0 * l0), 1.7017, 1e-4));
        assert!(close(laplacian.lambda_m2 / (l0 * l0), 3.2434, 1e-4));
        assert_eq!((density.neighbors, laplacian.neighbors), (32, 122));
        let plane = [2.1, 3.1].map(|re| Reference::on_lattice(Dimensions::Two, 1.0, re));
        assert!(close(plane[0].number_density, 6.5397, 1e-4) && close(plane[0].lambda_m2, 1.3884, 1e-4));
        assert!(close(plane[1].number_density, 18.9764, 1e-4) && close(plane[1].lambda_m2, 2.4485, 1e-4));
    }
}
