//! Particle number density `n_i = sum_j w(r_ij, re_n)` of every particle, walls and dummy walls too, and where a scene's
//! surface asks for it the asymmetry `|sum_j w r_ij| / (l0 n_i)` of its neighbours, dimensionless: 0 inside the fluid.

use crate::base::parallel::{FirstIndex, Rows};
use crate::base::vec3::{ZERO, add_scaled, dot};
use crate::engine::error::SimulationError;
use crate::engine::kernel::Kernel;
use crate::engine::parameters::Parameters;
use crate::engine::particles::Kind;
use crate::engine::phase::Phase;
use crate::engine::pressure::Pressure;
use crate::engine::pressure::options::Surface;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::State;

#[derive(Debug)]
pub struct NumberDensity {
    kernel: Kernel,
    particle_distance_m: f64,
    /// Empty unless the surface is told by it.
    pub asymmetry: Vec<f64>,
}

impl NumberDensity {
    pub fn new<C: CandidateSearch>(pressure: &Pressure, parameters: &Parameters, state: &State<C>) -> Self {
        NumberDensity {
            kernel: pressure.kernel(parameters.number_density_radius_m(), parameters),
            particle_distance_m: parameters.particle_distance_m,
            asymmetry: match pressure.surface {
                Surface::Density => Vec::new(),
                Surface::DensityAndAsymmetry | Surface::Truncated => {
                    state.workers.column(state.particles.len(), 0.0)
                }
            },
        }
    }

    /// Sums the weights of all neighbours into `state.particles.number_density`.
    pub fn sum<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        state: &mut State<C>,
    ) -> Result<(), SimulationError> {
        let broken = FirstIndex::default();
        let mut column = std::mem::take(&mut state.particles.number_density);
        match self.asymmetry.is_empty() {
            true => self.sum_weights::<C, T>(state, &mut column, &broken),
            false => self.sum_weights_and_moments::<C, T>(state, &mut column, &broken),
        }
        state.particles.number_density = column;
        state.require_finite(&broken, Phase::NumberDensity, "number density")
    }

    fn sum_weights<C: CandidateSearch, T: DistanceTest>(
        &self,
        state: &State<C>,
        number_density: &mut [f64],
        broken: &FirstIndex,
    ) {
        let (near, kind, kernel) = (state.neighborhood(), &state.particles.kind, self.kernel);
        state.team().fill(Rows::new(number_density), |range, number_density| {
            for (i, n) in range.zip(number_density) {
                if kind[i] == Kind::Ghost {
                    continue;
                }
                let mut sum = 0.0;
                near.for_each_neighbor::<T>(i, kernel.radius_m, |_, _, r| sum += kernel.weight(r));
                *n = sum;
                if !sum.is_finite() {
                    broken.record(i);
                }
            }
        });
    }

    fn sum_weights_and_moments<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        state: &State<C>,
        number_density: &mut [f64],
        broken: &FirstIndex,
    ) {
        let (near, kind, kernel, l0) =
            (state.neighborhood(), &state.particles.kind, self.kernel, self.particle_distance_m);
        let columns = (Rows::new(number_density), Rows::new(&mut self.asymmetry));
        state.team().fill(columns, |range, (number_density, asymmetry)| {
            for (k, i) in range.enumerate() {
                if kind[i] == Kind::Ghost {
                    continue;
                }
                let (mut sum, mut moment) = (0.0, ZERO);
                near.for_each_neighbor::<T>(i, kernel.radius_m, |_, r_ij, r| {
                    let w = kernel.weight(r);
                    sum += w;
                    moment = add_scaled(moment, w, r_ij);
                });
                number_density[k] = sum;
                // A particle alone has no neighbours on any side.
                asymmetry[k] = if sum > 0.0 { dot(moment, moment).sqrt() / (l0 * sum) } else { 0.0 };
                if !sum.is_finite() {
                    broken.record(i);
                }
            }
        });
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&self.asymmetry[..])
    }
}
