//! The step of what diffuses: `T += dT/dt dt`, explicit.
//!
//! Stable while `dt` times the diagonal of the operator stays below 1 (Gershgorin): `dt <= lambda / (2 D alpha)` amid the
//! fluid, and less beside a wall that holds a value, whose mirrored particles weigh `(h + d) / h` each.

use super::{Carried, Diffusion, Transport, WallCondition};
use crate::base::parallel::{FirstIndex, Rows};
use crate::engine::error::SimulationError;
use crate::engine::kernel::{Dimensions, weight};
use crate::engine::parameters::Parameters;
use crate::engine::particles::Kind;
use crate::engine::phase::{Probe, within};
use crate::engine::search::CandidateSearch;
use crate::engine::stage::{Stage, State};
use crate::engine::time_step::StepLimit;

/// The stage.
#[derive(Debug)]
pub struct Advance {
    carried: Carried,
    /// Seconds.
    longest_s: f64,
    /// By group, what walls show.
    walls: Vec<WallCondition>,
}

impl Advance {
    pub fn new(carried: Carried, diffusion: &Diffusion, parameters: &Parameters) -> Self {
        let held = diffusion.walls.iter().any(|wall| matches!(wall, WallCondition::Value(_)));
        let diagonal = parameters.laplacian_factor() * diagonal(parameters, held);
        let groups = parameters.groups.len().max(1);
        Advance {
            carried,
            longest_s: 1.0 / (diffusion.largest_diffusivity() * diagonal),
            walls: (0..groups).map(|group| diffusion.wall(group as u8)).collect(),
        }
    }

    /// The value of a particle after the step. Walls that hold a value show it, so that output need not know of them.
    #[inline(always)]
    fn after(&self, kind: Kind, group: u8, value: f64, change: f64) -> f64 {
        match (kind, self.walls[group as usize]) {
            (Kind::Wall | Kind::DummyWall, WallCondition::Value(held)) => held,
            _ => value + change,
        }
    }
}

/// `sum w f` on the lattice half a particle distance beside two or three walls that hold values, or amid the fluid.
fn diagonal(parameters: &Parameters, walls_hold_values: bool) -> f64 {
    let (l0, radius_m) = (parameters.particle_distance_m, parameters.laplacian_radius_m());
    let reach = (radius_m / l0).ceil() as i32;
    let reach_z = if parameters.dimensions == Dimensions::Two { 0 } else { reach };
    let mut sum = 0.0;
    for x in -reach..=reach {
        for y in -reach..=reach {
            for z in -reach_z..=reach_z {
                let r = l0 * f64::from(x * x + y * y + z * z).sqrt();
                if r > 0.0 && r < radius_m {
                    let behind = f64::from(-x.min(y).min(z));
                    let mirrored = if walls_hold_values && behind > 0.0 { 2.0 * behind } else { 1.0 };
                    sum += weight(r, radius_m) * mirrored;
                }
            }
        }
    }
    sum
}

impl<C: CandidateSearch, T> Stage<C, T> for Advance {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        let (broken, dt) = (FirstIndex::default(), state.time_step_s);
        within(probe, self.carried.phase(), || {
            let Transport { kind, group, values, rates } = self.carried.columns(&mut state.particles);
            let columns = (Rows::new(values), Rows::new(rates));
            state.workers.scheduled().fill(columns, |range, (values, rates)| {
                for (k, i) in range.enumerate() {
                    let group = group.get(i).copied().unwrap_or(0);
                    values[k] = self.after(kind[i], group, values[k], dt * rates[k]);
                    rates[k] = 0.0;
                    if !values[k].is_finite() {
                        broken.record(i);
                    }
                }
            });
        });
        state.require_finite(&broken, self.carried.phase(), self.carried.name())
    }

    fn longest_step(&self, _state: &State<C>) -> Option<StepLimit> {
        let reason = match self.carried {
            Carried::Temperature => "heat conduction",
            Carried::Concentration => "diffusion of the passive scalar",
        };
        self.longest_s.is_finite().then_some(StepLimit { time_step_s: self.longest_s, reason })
    }
}
