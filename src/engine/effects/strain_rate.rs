//! The viscosity of every particle from the strain rate around it, for fluids whose viscosity depends on it and for
//! turbulence below the particle distance: one walk for both.
//!
//! `grad u_i = (sum_j w u_ij (x) r_ij / r^2) M_i^-1` with `M_i = sum_j w r_ij (x) r_ij / r^2` and `w(r, re_g)` is exact for a
//! linear flow on any arrangement of particles (the corrected gradient of Khayyer & Gotoh 2011). Where the neighbours lie
//! nearly in a line or a plane, `M_i = n0_g / D I` takes its place, the plain gradient of MPS. Of it
//! `S = (grad u + grad u^T) / 2` and the strain rate `sqrt(2 S:S)`, 1/s.
//!
//! It is the strain rate before the step's own forces: the viscosity lags by a step.

use crate::base::parallel::{FirstIndex, Rows};
use crate::base::vec3::{Vec3, add_scaled, dot, scale, sub};
use crate::engine::effects::rheology::Rheology;
use crate::engine::effects::turbulence::Turbulence;
use crate::engine::error::SimulationError;
use crate::engine::kernel::{Dimensions, weight};
use crate::engine::parameters::{Parameters, Property};
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Stage, State};

/// `det M` over that of an isotropic `M` of the same trace, below which `M` counts as singular: eigenvalues as 1 to 400.
const SINGULAR: f64 = 0.01;

/// Three rows.
pub type Matrix = [Vec3; 3];

/// What makes a particle's viscosity.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// Of the fluid itself where no rheology holds, square metres per second.
    pub newtonian_m2_s: Property,
    pub rheology: Option<Rheology>,
    pub turbulence: Option<Turbulence>,
    density_kg_m3: f64,
    particle_distance_m: f64,
}

impl Law {
    pub fn new(newtonian_m2_s: Property, parameters: &Parameters) -> Self {
        Law {
            newtonian_m2_s,
            rheology: parameters.effects.rheology,
            turbulence: parameters.effects.turbulence,
            density_kg_m3: parameters.density_kg_m3,
            particle_distance_m: parameters.particle_distance_m,
        }
    }

    /// The viscosity of a particle at the strain rate `strain_rate_1_s`, square metres per second.
    pub fn viscosity_m2_s(&self, group: u8, strain_rate_1_s: f64) -> f64 {
        let own = match self.rheology.filter(|rheology| rheology.holds_for(group)) {
            Some(rheology) => rheology.viscosity_m2_s(strain_rate_1_s, self.density_kg_m3),
            None => self.newtonian_m2_s.of(group),
        };
        let turbulent = |model: Turbulence| model.viscosity_m2_s(strain_rate_1_s, self.particle_distance_m);
        own + self.turbulence.map_or(0.0, turbulent)
    }
}

/// The stage: writes the particles' column of viscosities.
#[derive(Debug)]
pub struct StrainRate {
    law: Law,
    gradient: VelocityGradient,
}

/// The corrected gradient, its constants worked out once.
#[derive(Debug, Clone, Copy)]
struct VelocityGradient {
    radius_m: f64,
    dimensions: Dimensions,
    /// `n0_g / D`.
    plain: f64,
}

impl StrainRate {
    pub fn new(law: Law, parameters: &Parameters) -> Self {
        let (radius_m, dimensions) = (parameters.gradient_radius_m(), parameters.dimensions);
        let plain = parameters.reference(radius_m).number_density / dimensions.count();
        StrainRate { law, gradient: VelocityGradient { radius_m, dimensions, plain } }
    }

    fn set_viscosities<C: CandidateSearch, T: DistanceTest>(
        &self,
        state: &mut State<C>,
        broken: &FirstIndex,
    ) {
        let mut column = std::mem::take(&mut state.particles.viscosity);
        let (particles, law, gradient) = (&state.particles, &self.law, self.gradient);
        state.team().fill(Rows::new(&mut column), |range, viscosity| {
            for (i, viscosity) in range.zip(viscosity) {
                if particles.kind[i].moves() {
                    let strain_rate_1_s = strain_rate(&gradient.of::<C, T>(state, i));
                    *viscosity = law.viscosity_m2_s(particles.group_of(i), strain_rate_1_s);
                    if !viscosity.is_finite() {
                        broken.record(i);
                    }
                }
            }
        });
        state.particles.viscosity = column;
    }
}

impl VelocityGradient {
    /// `G[a][b] = d u_a / d x_b` at particle `i`, 1/s.
    fn of<C: CandidateSearch, T: DistanceTest>(&self, state: &State<C>, i: usize) -> Matrix {
        let velocity = &state.particles.velocity;
        let (mut slopes, mut moments) = (Matrix::default(), Matrix::default());
        state.neighborhood().for_each_neighbor::<T>(i, self.radius_m, |j, r_ij, r| {
            let weighted = scale(weight(r, self.radius_m) / (r * r), r_ij);
            let u_ij = sub(velocity[j], velocity[i]);
            for a in 0..3 {
                slopes[a] = add_scaled(slopes[a], u_ij[a], weighted);
                moments[a] = add_scaled(moments[a], r_ij[a], weighted);
            }
        });
        let inverse = self.inverse(moments);
        // Symmetric, so that rows are columns.
        slopes.map(|slope| inverse.map(|row| dot(slope, row)))
    }

    fn inverse(&self, mut moments: Matrix) -> Matrix {
        let mean = (moments[0][0] + moments[1][1] + moments[2][2]) / self.dimensions.count();
        if self.dimensions == Dimensions::Two {
            moments[2][2] = mean;
        }
        let [a, b, c] = moments;
        let adjugate = [cross(b, c), cross(c, a), cross(a, b)];
        let determinant = dot(a, adjugate[0]);
        if determinant > SINGULAR * (mean * mean * mean) {
            adjugate.map(|row| scale(1.0 / determinant, row))
        } else {
            let one = 1.0 / self.plain;
            [[one, 0.0, 0.0], [0.0, one, 0.0], [0.0, 0.0, one]]
        }
    }
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `sqrt(2 S:S)` of a velocity gradient.
pub fn strain_rate(gradient: &Matrix) -> f64 {
    let square = |a: usize, b: usize| {
        let s = 0.5 * (gradient[a][b] + gradient[b][a]);
        s * s
    };
    let [x, y, z] = [0, 1, 2].map(|a| square(a, 0) + square(a, 1) + square(a, 2));
    (2.0 * (x + y + z)).sqrt()
}

impl<C: CandidateSearch, T: DistanceTest> Stage<C, T> for StrainRate {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh(probe)?;
        let broken = FirstIndex::default();
        within(probe, Phase::StrainRate, || self.set_viscosities::<C, T>(state, &broken));
        state.require_finite(&broken, Phase::StrainRate, "viscosity")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_strain_rate_of_a_shear_is_its_slope_and_of_a_rotation_zero() {
        assert_eq!(strain_rate(&[[0.0, 3.0, 0.0], [0.0; 3], [0.0; 3]]), 3.0);
        assert_eq!(strain_rate(&[[0.0, 3.0, 0.0], [-3.0, 0.0, 0.0], [0.0; 3]]), 0.0);
        assert_eq!(strain_rate(&[[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0; 3]]), 2.0);
    }

    #[test]
    fn a_singular_moment_falls_back_to_the_plain_gradient() {
        let gradient = VelocityGradient { radius_m: 1.0, dimensions: Dimensions::Three, plain: 4.0 };
        let line = [[5.0, 0.0, 0.0], [0.0; 3], [0.0; 3]];
        for moments in [line, Matrix::default()] {
            assert_eq!(gradient.inverse(moments)[1], [0.0, 0.25, 0.0]);
        }
        let regular = [[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 4.0]];
        let inverse = gradient.inverse(regular);
        let expected = [[2.0 / 3.0, -1.0 / 3.0, 0.0], [-1.0 / 3.0, 2.0 / 3.0, 0.0], [0.0, 0.0, 0.25]];
        for (row, expected) in inverse.iter().zip(&expected) {
            assert!(row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{inverse:?}");
        }
    }
}
