//! What explicit and implicit viscosity share: the two forms of the viscous force of a pair, and the viscosity between
//! particles that differ in it.
//!
//! * Laplacian (Koshizuka & Oka 1996): `a_i = nu 2D / (n0_L lambda) sum_j w (u_j - u_i)`. Its forces are not central, so
//!   a body that turns rigidly is slowed at its free surface, where neighbours are missing.
//! * Angular momentum: `a_i = nu 2 / B sum_j g (u_ij . r_ij) r_ij / r^2`. Central forces between pairs: linear and angular
//!   momentum are kept to rounding and rigid rotation feels nothing. In the continuum it is
//!   `nu (laplacian u + 2 grad div u)`, the Laplacian of a flow without divergence. With `g = w`, `B = lambda n0 /
//!   (D (D + 2))` by the isotropic fourth moments, but a lattice is not isotropic: at 3.1 particle distances in a plane
//!   a shear along its axes would be 3 % too weak. Hence `g = w (1 + alpha r^2)` with the `alpha` for which the reference
//!   lattice has `A = 3 B`, where `A = sum g x^4 / r^2` and `B = sum g x^2 y^2 / r^2`, and `B` is the lattice's own. Our
//!   own addition. Where no weight that is positive up to the radius does that, as at 2.4, `alpha` is zero: shear along
//!   the axes is exact then, stretching is not.
//!
//! A pair with the viscosities `nu_i` and `nu_j` has their harmonic mean, `2 nu_i nu_j / (nu_i + nu_j)`, for which the
//! stress is the same on both sides of an interface (Patankar 1980); equal ones are taken as they are. Walls have none: a
//! pair with a wall has the fluid's. It is the kinematic viscosity that is averaged; the pair's density is one.

use crate::base::vec3::{Vec3, dot, scale};
use crate::engine::kernel::{Dimensions, weight};
use crate::engine::parameters::Parameters;

/// What the fluid meets at walls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Walls {
    /// Wall particles have the velocity at which they move: zero where they rest. The textbook's choice.
    #[default]
    Resting,
    /// Behind a surface velocities go on so that the fluid has the wall's velocity at the surface (`engine::wall_mirror`).
    Mirrored,
}

/// The force of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Form {
    /// Along the difference of the velocities.
    #[default]
    Laplacian,
    /// Along the line between the particles: keeps angular momentum.
    AngularMomentum,
}

/// A form with its constants worked out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairForce {
    pub form: Form,
    /// `re_L`, metres.
    pub radius_m: f64,
    /// `2D / (n0_L lambda)` or `2 / B`, 1/m2.
    factor: f64,
    /// `alpha`, 1/m2; zero in the Laplacian form.
    stretch_1_m2: f64,
    /// What the coefficients of a particle on the lattice add up to along an axis, 1/m2.
    pub diagonal_1_m2: f64,
}

/// `sum g x^4 / r^2`, `sum g x^2 y^2 / r^2` and `sum g x^2 / r^2` on the lattice.
type Moments = [f64; 3];

impl PairForce {
    pub fn new(form: Form, parameters: &Parameters) -> Self {
        let radius_m = parameters.laplacian_radius_m();
        let (mut factor, mut stretch_1_m2) = (parameters.laplacian_factor(), 0.0);
        let mut diagonal_1_m2 = factor * parameters.reference(radius_m).number_density;
        if form == Form::AngularMomentum {
            let moments = |weight: &dyn Fn(f64) -> f64| lattice_moments(parameters, weight);
            let [plain, squares] = [moments(&|_| 1.0), moments(&|r| r * r)];
            let isotropic = (3.0 * plain[1] - plain[0]) / (squares[0] - 3.0 * squares[1]);
            if 1.0 + isotropic * radius_m * radius_m > 0.0 {
                stretch_1_m2 = isotropic;
            }
            let total = |k: usize| plain[k] + stretch_1_m2 * squares[k];
            factor = 2.0 / total(1);
            diagonal_1_m2 = factor * total(2);
        }
        PairForce { form, radius_m, factor, stretch_1_m2, diagonal_1_m2 }
    }

    /// The coefficient of a pair at distance `r` with the weight `w(r, re_L)`, 1/m2: times the viscosity and the velocity
    /// difference, or its part along the pair, it is an acceleration.
    #[inline(always)]
    pub fn coefficient(&self, r: f64, w: f64) -> f64 {
        self.factor * (w * (1.0 + self.stretch_1_m2 * (r * r)))
    }

    /// What of the velocity difference counts.
    #[inline(always)]
    pub fn part(&self, difference: Vec3, r_ij: Vec3, r: f64) -> Vec3 {
        match self.form {
            Form::Laplacian => difference,
            Form::AngularMomentum => scale(dot(difference, r_ij) / (r * r), r_ij),
        }
    }

    /// The longest step in which an explicit step with the viscosity `nu` is stable, seconds: by Gershgorin's circles the
    /// largest eigenvalue is at most twice the diagonal, so `dt = 1 / (nu diagonal)`, which is `lambda / (2 D nu)` in the
    /// Laplacian form.
    pub fn longest_step_s(&self, viscosity_m2_s: f64) -> f64 {
        1.0 / (viscosity_m2_s * self.diagonal_1_m2)
    }
}

fn lattice_moments(parameters: &Parameters, factor: &dyn Fn(f64) -> f64) -> Moments {
    let (l0, radius_m) = (parameters.particle_distance_m, parameters.laplacian_radius_m());
    let reach = (radius_m / l0).ceil() as i32;
    let reach_z = if parameters.dimensions == Dimensions::Two { 0 } else { reach };
    let mut moments = [0.0; 3];
    for ix in -reach..=reach {
        for iy in -reach..=reach {
            for iz in -reach_z..=reach_z {
                let x = [ix, iy, iz].map(|i| l0 * f64::from(i));
                let r2 = dot(x, x);
                let r = r2.sqrt();
                if r2 > 0.0 && r < radius_m {
                    let g = weight(r, radius_m) * factor(r) / r2;
                    let (x2, y2) = (x[0] * x[0], x[1] * x[1]);
                    moments[0] += g * (x2 * x2);
                    moments[1] += g * (x2 * y2);
                    moments[2] += g * x2;
                }
            }
        }
    }
    moments
}

/// The viscosity of each particle.
#[derive(Debug, Clone, Copy)]
pub struct Viscosities<'a> {
    /// Where all are the same.
    pub uniform_m2_s: f64,
    /// Of each particle; empty where all are the same.
    pub of_particle: &'a [f64],
}

impl Viscosities<'_> {
    /// That of particle `i`, square metres per second.
    #[inline(always)]
    pub fn of(&self, i: usize) -> f64 {
        self.of_particle.get(i).copied().unwrap_or(self.uniform_m2_s)
    }

    /// That between particle `i`, which has `own`, and another particle.
    #[inline(always)]
    pub fn between(&self, own: f64, j: usize) -> f64 {
        harmonic_mean(own, self.of(j))
    }
}

/// `2 a b / (a + b)`; exactly `a` where both are the same.
#[inline(always)]
pub fn harmonic_mean(a: f64, b: f64) -> f64 {
    if a == b { a } else { 2.0 * (a * b) / (a + b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::parameters::{Domain, Effects, Radii};

    fn parameters(dimensions: Dimensions, laplacian: f64) -> Parameters {
        Parameters {
            dimensions,
            particle_distance_m: 0.5,
            time_step_s: 1.0,
            adaptive: None,
            density_kg_m3: 1.0,
            radii: Radii { number_density: 2.1, gradient: 2.1, laplacian },
            domain: Domain::new([0.0; 3], [1.0; 3]),
            groups: Vec::new(),
            effects: Effects::default(),
        }
    }

    /// The force along x that a particle at the origin of the lattice feels in the flow `u`.
    fn force(form: Form, parameters: &Parameters, u: impl Fn(Vec3) -> Vec3) -> f64 {
        let force = PairForce::new(form, parameters);
        let reach_z = if parameters.dimensions == Dimensions::Two { 0 } else { 4 };
        let mut sum = 0.0;
        for ix in -4..=4 {
            for iy in -4..=4 {
                for iz in -reach_z..=reach_z {
                    let x = [ix, iy, iz].map(|i| 0.5 * f64::from(i));
                    let r = dot(x, x).sqrt();
                    if r > 0.0 && r < force.radius_m {
                        sum += force.coefficient(r, weight(r, force.radius_m)) * force.part(u(x), x, r)[0];
                    }
                }
            }
        }
        sum
    }

    /// `laplacian u` of a shear and, in the angular-momentum form, `laplacian u + 2 grad div u` of a stretching.
    #[test]
    fn both_forms_are_exact_for_parabolas_on_the_lattice() {
        for (dimensions, radius) in [
            (Dimensions::Two, 3.1),
            (Dimensions::Two, 2.1),
            (Dimensions::Three, 3.1),
            (Dimensions::Three, 2.1),
        ] {
            let parameters = parameters(dimensions, radius);
            let shear = |x: Vec3| [3.0 * x[1] * x[1], 0.0, 0.0];
            let stretch = |x: Vec3| [3.0 * x[0] * x[0], 0.0, 0.0];
            for (form, expected) in [(Form::Laplacian, [6.0, 6.0]), (Form::AngularMomentum, [6.0, 18.0])] {
                let found = [force(form, &parameters, shear), force(form, &parameters, stretch)];
                let close = found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-10);
                assert!(close, "{dimensions:?}, {radius}, {form:?}: {found:?}");
            }
        }
        let narrow = parameters(Dimensions::Two, 2.4);
        assert!((force(Form::AngularMomentum, &narrow, |x| [x[1] * x[1], 0.0, 0.0]) - 2.0).abs() < 1e-10);
    }

    #[test]
    fn rigid_rotation_feels_no_central_force_and_the_limit_is_gershgorins() {
        let parameters = parameters(Dimensions::Two, 3.1);
        assert!(force(Form::AngularMomentum, &parameters, |x| [-x[1], x[0], 0.0]).abs() < 1e-14);
        let limit = PairForce::new(Form::Laplacian, &parameters).longest_step_s(2.0);
        let lambda = parameters.reference(parameters.laplacian_radius_m()).lambda_m2;
        assert!((limit / (lambda / 8.0) - 1.0).abs() < 1e-14, "{limit} {lambda}");
    }

    #[test]
    fn the_harmonic_mean_of_equals_is_exact_and_zero_blocks() {
        assert_eq!(harmonic_mean(0.1, 0.1), 0.1);
        assert_eq!(harmonic_mean(0.0, 0.0), 0.0);
        assert_eq!(harmonic_mean(0.0, 3.0), 0.0);
        assert!((harmonic_mean(1.0, 3.0) - 1.5).abs() < 1e-15);
    }
}
