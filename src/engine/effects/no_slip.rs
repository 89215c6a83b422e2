//! Walls to which the fluid sticks: the stages inside see wall particles with the velocities that
//! [`WallMirror`] extrapolates behind their surfaces, all others see the walls' own.

use crate::base::vec3::Vec3;
use crate::engine::columns::Visitor;
use crate::engine::error::SimulationError;
use crate::engine::parameters::Parameters;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Stage, State};
use crate::engine::time_step::StepLimit;
use crate::engine::wall_mirror::WallMirror;

/// The stages that see extrapolated velocities.
pub struct NoSlipWalls<C, T> {
    mirror: WallMirror,
    /// The walls' velocities that are not in the particles' column now.
    mirrored: Vec<Vec3>,
    inside: Vec<Box<dyn Stage<C, T>>>,
}

impl<C, T> NoSlipWalls<C, T> {
    pub fn new(inside: Vec<Box<dyn Stage<C, T>>>, parameters: &Parameters) -> Self {
        NoSlipWalls { mirror: WallMirror::new(parameters), mirrored: Vec::new(), inside }
    }
}

impl<C: CandidateSearch, T: DistanceTest> Stage<C, T> for NoSlipWalls<C, T> {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh(probe)?;
        let NoSlipWalls { mirror, mirrored, inside } = self;
        within(probe, Phase::WallMirror, || {
            mirror.refresh::<C, T>(state);
            mirror.extrapolate::<C, T, Vec3>(state, &state.particles.velocity, mirrored);
            mirror.exchange(&mut state.particles.velocity, mirrored);
        });
        let result = inside.iter_mut().try_for_each(|stage| stage.run(state, probe));
        mirror.exchange(&mut state.particles.velocity, mirrored);
        result
    }

    fn bytes(&self) -> usize {
        let own = self.mirror.bytes() + size_of_val(&self.mirrored[..]);
        own + self.inside.iter().map(|stage| stage.bytes()).sum::<usize>()
    }

    fn visit(&mut self, visitor: &mut Visitor<'_>) {
        self.inside.iter_mut().for_each(|stage| stage.visit(visitor));
    }

    fn longest_step(&self, state: &State<C>) -> Option<StepLimit> {
        self.inside.iter().filter_map(|stage| stage.longest_step(state)).reduce(StepLimit::or)
    }
}
