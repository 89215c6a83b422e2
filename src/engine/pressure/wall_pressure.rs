//! Pressures of walls that are mirrors, read off the fluid: `p_w = sum_j w (p_j + (x_w - x_j) . grad p_j) / sum_j w` over
//! the fluid particles within `re_L`, with `w(r, re_L)` and `grad p_j = -rho_j a_j` of what accelerates the fluid. Right for
//! a linear pressure, as that of water at rest is. No equation reads them; they are for those who look at walls.

use crate::base::parallel::Rows;
use crate::base::vec3::dot;
use crate::engine::kernel::Kernel;
use crate::engine::parameters::Parameters;
use crate::engine::particles::{Kind, Particles};
use crate::engine::pressure::Pressure;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::State;

#[derive(Debug)]
pub struct WallPressure {
    kernel: Kernel,
    density_kg_m3: f64,
    /// Empty where the density is the same everywhere.
    by_group_kg_m3: Vec<f64>,
    /// Pascals.
    of_wall: Vec<f64>,
}

impl WallPressure {
    pub fn new<C: CandidateSearch>(pressure: &Pressure, parameters: &Parameters, state: &State<C>) -> Self {
        WallPressure {
            kernel: pressure.kernel(parameters.laplacian_radius_m(), parameters),
            density_kg_m3: parameters.density_kg_m3,
            by_group_kg_m3: pressure.density_by_group_kg_m3.clone().unwrap_or_default(),
            of_wall: state.workers.column(state.particles.len(), 0.0),
        }
    }

    fn density(&self, group: u8) -> f64 {
        self.by_group_kg_m3.get(group as usize).copied().unwrap_or(self.density_kg_m3)
    }

    /// Sets the pressures of all walls, while the accelerations are those by the pressure alone.
    pub fn read_off<C: CandidateSearch, T: DistanceTest>(&mut self, state: &mut State<C>) {
        let mut of_wall = std::mem::take(&mut self.of_wall);
        let (near, particles, kernel) = (state.neighborhood(), &state.particles, self.kernel);
        state.team().fill(Rows::new(&mut of_wall), |range, of_wall| {
            for (i, p) in range.zip(of_wall) {
                let (mut sum, mut total) = (0.0, 0.0);
                if particles.kind[i] == Kind::Wall {
                    near.for_each_neighbor::<T>(i, kernel.radius_m, |j, r_ij, r| {
                        if particles.kind[j] == Kind::Fluid {
                            let (w, rho) = (kernel.weight(r), self.density(particles.group_of(j)));
                            sum += w * (particles.pressure[j] + rho * dot(particles.acceleration[j], r_ij));
                            total += w;
                        }
                    });
                }
                *p = if total > 0.0 { sum / total } else { 0.0 };
            }
        });
        let Particles { kind, pressure, .. } = &mut state.particles;
        for ((pressure, kind), &of_wall) in pressure.iter_mut().zip(kind.iter()).zip(&of_wall) {
            if *kind == Kind::Wall {
                *pressure = of_wall;
            }
        }
        self.of_wall = of_wall;
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.of_wall[..])
    }
}
