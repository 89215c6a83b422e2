//! Particle number density `n_i = sum_j w(r_ij, re_n)` of every particle, walls and dummy walls too.

use crate::base::parallel::{FirstIndex, Rows};
use crate::engine::error::SimulationError;
use crate::engine::kernel::Kernel;
use crate::engine::parameters::Parameters;
use crate::engine::particles::Kind;
use crate::engine::phase::Phase;
use crate::engine::pressure::Pressure;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::State;

#[derive(Debug, Clone, Copy)]
pub struct NumberDensity {
    kernel: Kernel,
}

impl NumberDensity {
    pub fn new(pressure: Pressure, parameters: &Parameters) -> Self {
        NumberDensity { kernel: pressure.kernel(parameters.number_density_radius_m(), parameters) }
    }

    /// Sums the weights of all neighbours into `state.particles.number_density`.
    pub fn sum<C: CandidateSearch, T: DistanceTest>(
        &self,
        state: &mut State<C>,
    ) -> Result<(), SimulationError> {
        let broken = FirstIndex::default();
        let mut column = std::mem::take(&mut state.particles.number_density);
        let (near, kind, kernel) = (state.neighborhood(), &state.particles.kind, self.kernel);
        state.team().fill(Rows::new(&mut column), |range, number_density| {
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
        state.particles.number_density = column;
        state.require_finite(&broken, Phase::NumberDensity, "number density")
    }
}
