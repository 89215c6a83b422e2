//! Surface tension and wetting from a potential between particles (Kondo, Koshizuka, Suzuki & Takimoto 2007).
//!
//! Two particles at distance `r < re` have the energy `E(r) = -(C/3) (r - 3/2 l0 + re/2) (r - re)^2`: zero with its slope at
//! `re`, least at `l0`. So `j` pulls `i` with `E'(r) = C (r - l0) (re - r)` along `e = r_ij / r`, and pushes it below `l0`:
//! `a_i += C / m sum_j (r - l0) (re - r) e`, `m = rho l0^D`. Forces of a pair are opposite and central, so momentum and
//! angular momentum stay. Units: C in N/m2.
//!
//! `C` follows from the work of separation. Pulling a body apart on the reference lattice makes two surfaces: it takes
//! `2 sigma` for each square metre, and what is lost is the energy of all pairs across the cut. Of the lattice vectors
//! that rise by `k` layers, `k` pairs cross the cut for each particle of a layer, so `2 sigma l0^(D-1) = C l0^3 S` with
//! `S = sum_(k > 0) k (r - 3/2 + re/2) (r - re)^2 / 3` over lattice vectors in units of `l0`. In space `C = 2 sigma / (S l0)`,
//! in a plane, for a metre of depth, `C = 2 sigma / (S l0^2)`; either way `C / m = 2 sigma / (S rho l0^4)`.
//!
//! Fluid and solid attract each other by `(1 + cos theta) / 2` of that: the work of separating them is then
//! `sigma (1 + cos theta)`, as Young and Dupre have it. A body is a solid to the fluid; its own particles do not attract
//! each other.
//!
//! Limits: it is good for a work of separation and for splashes, not for what a curved surface does. Two causes, both inside
//! the fluid, where a tension should do nothing:
//! * Cohesion is borne by the pressure, which is higher by `sum r E' / (2 D l0^D)`, in a plane 2.06 `sigma / l0`, curved or
//!   not. In a drop of fifteen particles' radius that is 31 times Laplace's jump, which is left as a difference of 3 %.
//! * The energy of a pair depends on how particles lie, not on their density alone. The second derivative of the energy by
//!   a stretch of the plane that keeps areas is, for each square metre, -1.08 to 0.60 `sigma / l0` on the square lattice, by
//!   direction, and -0.62 on the hexagonal one (`re = 3.1 l0`), where the surface of a drop has `3 sigma / R`: 0.2. So the drop
//!   is a soft solid that has to yield before it can swing, the more so the finer it is resolved.
//!
//! A wider radius helps slowly (-0.63 to 1.11 at 4.1 `l0`, -0.51 to -0.35 at 5.1). Smooth potentials,
//! `(1 - q^2)^a (b (1 - q^2) - 1)`, have either 0.2 and more for `re < 6 l0` where repulsion is to leave no pressure, or leave 1.7
//! `sigma / l0` to it. What does nothing inside is an energy of the density around a particle instead of one of pairs:
//! `surface_tension`.

use crate::base::vec3::{Vec3, add_scaled, dot};
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::Parameters;
use crate::engine::particles::{Kind, Particles};
use crate::engine::stage::Fields;
use crate::engine::terms::{Pair, PairTerm, Rates};
use crate::engine::time_step::StepLimit;

/// Tension of the fluid's surface by attraction among its particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PotentialTension {
    /// `sigma`, newtons per metre.
    pub surface_tension_n_m: f64,
    /// `re`, in particle distances; `None` for the Laplacian's, so that both share a walk.
    pub radius: Option<f64>,
    /// `(1 + cos theta) / 2`: how strongly a solid attracts the fluid, as a share of the fluid's own attraction.
    pub wetting: f64,
}

impl PotentialTension {
    /// `re` in metres.
    pub fn radius_m(&self, parameters: &Parameters) -> f64 {
        self.radius.unwrap_or(parameters.radii.laplacian) * parameters.particle_distance_m
    }
}

/// `(1 + cos theta) / 2` for a contact angle in degrees.
pub fn wetting(contact_angle_deg: f64) -> f64 {
    0.5 * (1.0 + contact_angle_deg.to_radians().cos())
}

/// The longest step in which an explicit scheme follows the shortest capillary wave that particles can show, seconds
/// (Brackbill, Kothe & Zemach 1992, with nothing outside the fluid): `sqrt(rho l0^3 / (4 pi sigma))`.
pub fn capillary_limit_s(surface_tension_n_m: f64, parameters: &Parameters) -> f64 {
    let l0 = parameters.particle_distance_m;
    let mass_kg = parameters.density_kg_m3 * l0 * l0 * l0;
    (mass_kg / (4.0 * std::f64::consts::PI * surface_tension_n_m)).sqrt()
}

/// `S`: the energy of all pairs across a plane, for each particle of a layer beside it, in units of `C l0^3`. The radius is in
/// particle distances.
pub fn separation_sum(dimensions: Dimensions, radius: f64) -> f64 {
    let reach = radius.ceil() as i32;
    let reach_z = if dimensions == Dimensions::Two { 0 } else { reach };
    let mut sum = 0.0;
    for k in 1..=reach {
        for ix in -reach..=reach {
            for iz in -reach_z..=reach_z {
                let point = [ix, k, iz].map(f64::from);
                let r = dot(point, point).sqrt();
                if r < radius {
                    sum += f64::from(k) * (r - 1.5 + 0.5 * radius) * (r - radius) * (r - radius) / 3.0;
                }
            }
        }
    }
    sum
}

/// The term: its constants worked out once.
#[derive(Debug, Clone, Copy)]
pub struct PairAttraction {
    /// `C / m`, 1/(m s2).
    factor: f64,
    particle_distance_m: f64,
    radius_m: f64,
    wetting: f64,
    longest_step_s: f64,
}

impl PairAttraction {
    pub fn new(tension: PotentialTension, parameters: &Parameters) -> Self {
        let (sigma, l0) = (tension.surface_tension_n_m, parameters.particle_distance_m);
        let radius_m = tension.radius_m(parameters);
        let sum = separation_sum(parameters.dimensions, radius_m / l0);
        PairAttraction {
            factor: 2.0 * sigma / (sum * parameters.density_kg_m3 * l0 * l0 * l0 * l0),
            particle_distance_m: l0,
            radius_m,
            wetting: tension.wetting,
            longest_step_s: capillary_limit_s(sigma, parameters),
        }
    }

    /// How strongly two kinds attract each other, as a share of what fluid does.
    #[inline(always)]
    fn affinity(&self, one: Kind, other: Kind) -> f64 {
        match (one, other) {
            (Kind::Fluid, Kind::Fluid) => 1.0,
            (Kind::Fluid, _) | (_, Kind::Fluid) => self.wetting,
            _ => 0.0,
        }
    }
}

impl PairTerm for PairAttraction {
    type Sum = Vec3;

    #[inline(always)]
    fn add(&self, sum: &mut Vec3, pair: &Pair, fields: &Fields<'_>) {
        let share = self.affinity(fields.kind[pair.i], fields.kind[pair.j]);
        let pull = share * (pair.r - self.particle_distance_m) * (self.radius_m - pair.r);
        *sum = add_scaled(*sum, pull / pair.r, pair.r_ij);
    }

    #[inline(always)]
    fn finish(&self, sum: Vec3, _i: usize, _fields: &Fields<'_>, rates: &mut Rates<'_>) {
        *rates.acceleration = add_scaled(*rates.acceleration, self.factor, sum);
    }

    fn longest_step(&self, _particles: &Particles) -> Option<StepLimit> {
        Some(StepLimit { time_step_s: self.longest_step_s, reason: "the fastest capillary wave" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_separation_sums_are_the_published_ones() {
        let stated = [
            (Dimensions::Two, 2.1, 0.534482),
            (Dimensions::Two, 3.1, 9.69734),
            (Dimensions::Two, 4.1, 64.9978),
            (Dimensions::Three, 2.1, 1.06823),
            (Dimensions::Three, 3.1, 26.4577),
            (Dimensions::Three, 4.1, 231.420),
        ];
        for (dimensions, radius, sum) in stated {
            let found = separation_sum(dimensions, radius);
            assert!((found - sum).abs() < 1e-5 * sum, "{dimensions:?} {radius}: {found}");
        }
    }

    #[test]
    fn wetting_follows_young_and_dupre() {
        let close = |angle: f64, share: f64| (wetting(angle) - share).abs() < 1e-15;
        assert!(close(0.0, 1.0) && close(60.0, 0.75) && close(90.0, 0.5) && close(180.0, 0.0));
    }
}
