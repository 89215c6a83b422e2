//! Diffusion by a parabola fitted to each neighbourhood.
//!
//! The least-squares moving particle method (Tamai & Koshizuka 2014), second order: `T_j - T_i = p(r_ij) . c` is fitted
//! over the neighbours with weights `(1 - r / re_L)^2` and `p` = all monomials of degree 1 and 2; the Laplacian is twice
//! the sum of the coefficients of the squares. A surface takes part with the point of it in front of each particle of the
//! first layer: its value there, or the slope along its normal as an equation of its own. Exact for parabolas wherever the
//! particles are.
//!
//! Where a neighbourhood does not determine the parabola, or holds materials of different conductivity, whose interface
//! bends the profile, the lattice's model stands in.

use super::lattice::LatticeDiffusion;
use super::{Carried, Diffusion, WallCondition};
use crate::base::vec3::{Vec3, add_scaled, dot, scale};
use crate::engine::parameters::Parameters;
use crate::engine::particles::Kind;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Fields, State};
use crate::engine::terms::{Pair, PairTerm, Rates};

/// A pivot below this share of the largest one says that the neighbours do not determine a parabola.
const DETERMINED: f64 = 1e-7;

/// The term; `N` is 5 in a plane and 9 in space.
#[derive(Debug)]
pub struct CorrectedDiffusion<const N: usize> {
    lattice: LatticeDiffusion,
    radius_m: f64,
    particle_distance_m: f64,
}

/// The normal equations of a fit, and the lattice's sum beside them.
#[derive(Debug)]
pub struct Fit<const N: usize> {
    /// The upper triangle.
    matrix: [[f64; N]; N],
    right: [f64; N],
    lattice: f64,
    mixed: bool,
}

impl<const N: usize> Default for Fit<N> {
    fn default() -> Self {
        Fit { matrix: [[0.0; N]; N], right: [0.0; N], lattice: 0.0, mixed: false }
    }
}

/// The monomials at `x`.
#[inline(always)]
fn monomials<const N: usize>([x, y, z]: Vec3) -> [f64; N] {
    let all = if N == 5 {
        [x, y, x * x, y * y, x * y, 0.0, 0.0, 0.0, 0.0]
    } else {
        [x, y, z, x * x, y * y, z * z, x * y, y * z, z * x]
    };
    std::array::from_fn(|k| all[k])
}

/// Their derivatives along `n` at `x`.
#[inline(always)]
fn slopes<const N: usize>([x, y, z]: Vec3, [a, b, c]: Vec3) -> [f64; N] {
    let all = if N == 5 {
        [a, b, 2.0 * x * a, 2.0 * y * b, x * b + y * a, 0.0, 0.0, 0.0, 0.0]
    } else {
        let mixed = [x * b + y * a, y * c + z * b, z * a + x * c];
        [a, b, c, 2.0 * x * a, 2.0 * y * b, 2.0 * z * c, mixed[0], mixed[1], mixed[2]]
    };
    std::array::from_fn(|k| all[k])
}

impl<const N: usize> Fit<N> {
    /// Adds the equation `row . c = value`.
    #[inline(never)]
    fn add(&mut self, weight: f64, row: [f64; N], value: f64) {
        for a in 0..N {
            let scaled = weight * row[a];
            for (m, p) in self.matrix[a][a..].iter_mut().zip(&row[a..]) {
                *m += scaled * p;
            }
            self.right[a] += scaled * value;
        }
    }

    /// The coefficients, by Cholesky's factors `U^T U`; `None` where the equations do not determine them.
    fn solve(&self) -> Option<[f64; N]> {
        let mut u = self.matrix;
        let largest = (0..N).map(|k| u[k][k]).fold(0.0, f64::max);
        for k in 0..N {
            for above in 0..k {
                let row = u[above];
                for (x, y) in u[k][k..].iter_mut().zip(&row[k..]) {
                    *x -= row[k] * y;
                }
            }
            let pivot = u[k][k];
            if pivot.is_nan() || pivot <= DETERMINED * largest {
                return None;
            }
            let root = pivot.sqrt();
            u[k][k..].iter_mut().for_each(|x| *x /= root);
        }
        let mut c = self.right;
        for k in 0..N {
            for above in 0..k {
                c[k] -= u[above][k] * c[above];
            }
            c[k] /= u[k][k];
        }
        for k in (0..N).rev() {
            for column in k + 1..N {
                c[k] -= u[k][column] * c[column];
            }
            c[k] /= u[k][k];
        }
        Some(c)
    }
}

impl<const N: usize> CorrectedDiffusion<N> {
    pub fn new(carried: Carried, diffusion: &Diffusion, parameters: &Parameters) -> Self {
        CorrectedDiffusion {
            lattice: LatticeDiffusion::new(carried, diffusion, parameters),
            radius_m: parameters.laplacian_radius_m(),
            particle_distance_m: parameters.particle_distance_m,
        }
    }

    #[inline(always)]
    fn weight(&self, r: f64) -> f64 {
        let rest = 1.0 - r / self.radius_m;
        if rest > 0.0 { rest * rest } else { 0.0 }
    }

    /// The point of the surface in front of a wall particle of the first layer.
    #[inline(never)]
    fn add_surface(&self, fit: &mut Fit<N>, pair: &Pair, value_i: f64, k_i: f64, fields: &Fields<'_>) {
        let walls = self.lattice.walls();
        let Some(seen) = walls.surfaces.seen(pair.j, pair.r_ij) else {
            return;
        };
        if seen.depth_m > self.particle_distance_m {
            return;
        }
        let point_m = add_scaled(pair.r_ij, seen.depth_m, seen.normal);
        let weight = self.weight(dot(point_m, point_m).sqrt());
        let point = scale(1.0 / self.radius_m, point_m);
        match walls.conditions[fields.group_of(pair.j) as usize] {
            WallCondition::Value(at_surface) => fit.add(weight, monomials(point), at_surface - value_i),
            WallCondition::Flux(flux) if k_i > 0.0 => {
                fit.add(weight, slopes(point, seen.normal), -flux / k_i * self.radius_m);
            }
            WallCondition::Flux(_) => {}
        }
    }
}

impl<const N: usize> PairTerm for CorrectedDiffusion<N> {
    type Sum = Fit<N>;

    fn prepare<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        self.lattice.prepare::<C, T>(state);
    }

    #[inline(always)]
    fn add(&self, fit: &mut Fit<N>, pair: &Pair, fields: &Fields<'_>) {
        self.lattice.add(&mut fit.lattice, pair, fields);
        let (values, medium) = (self.lattice.carried().values(fields), self.lattice.medium());
        let k_i = medium.conductivity[medium.row(pair.i, fields)];
        if matches!(fields.kind[pair.j], Kind::Wall | Kind::DummyWall) {
            return self.add_surface(fit, pair, values[pair.i], k_i, fields);
        }
        fit.mixed |= medium.conductivity[medium.row(pair.j, fields)] != k_i;
        let point = scale(1.0 / self.radius_m, pair.r_ij);
        fit.add(self.weight(pair.r), monomials(point), values[pair.j] - values[pair.i]);
    }

    #[inline(always)]
    fn finish(&self, fit: Fit<N>, i: usize, fields: &Fields<'_>, rates: &mut Rates<'_>) {
        let solved = if fit.mixed { None } else { fit.solve() };
        let Some(c) = solved else {
            return self.lattice.finish(fit.lattice, i, fields, rates);
        };
        let (medium, squares) = (self.lattice.medium(), if N == 5 { &c[2..4] } else { &c[3..6] });
        let laplacian = 2.0 * squares.iter().sum::<f64>() / (self.radius_m * self.radius_m);
        let row = medium.row(i, fields);
        self.lattice.carried().add_rate(rates, medium.conductivity[row] / medium.capacity[row] * laplacian);
    }

    fn bytes(&self) -> usize {
        self.lattice.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Any parabola is found again from scattered points, and three points do not determine one.
    #[test]
    fn a_fit_finds_the_parabola_that_it_is_given() {
        let c = [0.3, -0.7, 1.1, -0.4, 0.9];
        let mut fit = Fit::<5>::default();
        let points = [[0.1, 0.2], [-0.5, 0.3], [0.7, -0.1], [-0.2, -0.6], [0.4, 0.5], [-0.3, 0.8]];
        for (k, [x, y]) in points.into_iter().enumerate() {
            if k == 3 {
                assert_eq!(fit.solve(), None);
            }
            let row = monomials::<5>([x, y, 0.0]);
            fit.add(1.0, row, row.iter().zip(c).map(|(p, c)| p * c).sum());
        }
        for (found, c) in fit.solve().unwrap().into_iter().zip(c) {
            assert!((found - c).abs() < 1e-12);
        }
    }
}
