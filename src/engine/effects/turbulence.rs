//! Turbulence below the particle distance (Smagorinsky 1963; in MPS Gotoh, Shibahara & Sakai 2001): an eddy viscosity
//! `nu_t = (C_s l0)^2 |S|`, `|S| = sqrt(2 S:S)`, is added to the fluid's.
//!
//! `C_s` is 0.1 to 0.2, dimensionless. Nothing damps it towards walls, and it means something only where `l0` lies in the
//! inertial range of the turbulence.

/// Smagorinsky's model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turbulence {
    /// `C_s`, dimensionless.
    pub smagorinsky_constant: f64,
}

impl Turbulence {
    /// `nu_t` at the strain rate `|S|` in 1/s, square metres per second.
    pub fn viscosity_m2_s(&self, strain_rate_1_s: f64, particle_distance_m: f64) -> f64 {
        let length_m = self.smagorinsky_constant * particle_distance_m;
        length_m * length_m * strain_rate_1_s
    }
}
