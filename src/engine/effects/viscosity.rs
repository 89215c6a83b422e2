//! Viscosity with the Laplacian model: `a_i += nu 2D / (n0_L lambda) sum_j (u_j - u_i) w(r_ij, re_L)`.
//!
//! Koshizuka & Oka 1996. Every other particle within `re_L` takes part, dummy walls too. Explicit: stable while
//! `nu dt` stays below about half of `lambda / (2 D)`.

use crate::base::vec3::{Vec3, add_scaled, sub};
use crate::engine::parameters::Parameters;
use crate::engine::stage::Fields;
use crate::engine::terms::{Pair, PairTerm, Rates};

/// A Newtonian fluid's viscosity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viscosity {
    /// `nu`, square metres per second.
    pub kinematic_viscosity_m2_s: f64,
}

/// The term: its constant worked out once.
#[derive(Debug, Clone, Copy)]
pub struct ExplicitViscosity {
    /// `nu 2D / (n0_L lambda)`, 1/s.
    factor: f64,
}

impl ExplicitViscosity {
    pub fn new(viscosity: Viscosity, parameters: &Parameters) -> Self {
        ExplicitViscosity { factor: viscosity.kinematic_viscosity_m2_s * parameters.laplacian_factor() }
    }
}

impl PairTerm for ExplicitViscosity {
    type Sum = Vec3;

    #[inline(always)]
    fn add(&self, sum: &mut Vec3, pair: &Pair, fields: &Fields<'_>) {
        *sum = add_scaled(*sum, pair.w, sub(fields.velocity[pair.j], fields.velocity[pair.i]));
    }

    #[inline(always)]
    fn finish(&self, sum: Vec3, _i: usize, _fields: &Fields<'_>, rates: &mut Rates<'_>) {
        *rates.acceleration = add_scaled(*rates.acceleration, self.factor, sum);
    }
}
