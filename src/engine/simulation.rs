//! A simulation: the list of stages that a scene calls for, run once a step.

use std::sync::Arc;

use crate::base::parallel::Workers;
use crate::engine::effects::collision::Collisions;
use crate::engine::effects::motion::{Corrector, Predictor};
use crate::engine::effects::viscosity::ExplicitViscosity;
use crate::engine::effects::wall_contact::WallContacts;
use crate::engine::error::SimulationError;
use crate::engine::parameters::Parameters;
use crate::engine::particles::{InitialParticle, Particles};
use crate::engine::phase::Probe;
use crate::engine::preset::{Options, Search, Test};
use crate::engine::pressure::{PressureReport, PressureSolve};
use crate::engine::search::aos_relocation::AosRelocation;
use crate::engine::search::brute_force::BruteForce;
use crate::engine::search::grid::{Grid, TooManyBuckets};
use crate::engine::search::linked_list::LinkedList;
use crate::engine::search::{CandidateSearch, DistanceTest, RootFirst, SquaredFirst};
use crate::engine::stage::{Stage, State};

/// The stages of one step, in order: the semi-implicit MPS method. A stage that the scene does not call for is not in
/// the list, has no phase and no columns.
fn stages<C: CandidateSearch, T: DistanceTest>(
    parameters: &Parameters,
    options: &Options,
    state: &State<C>,
) -> Vec<Box<dyn Stage<C, T>>> {
    let (effects, time_step_s) = (parameters.effects, parameters.time_step_s);
    let mut stages: Vec<Box<dyn Stage<C, T>>> = Vec::new();
    if let Some(gravity) = effects.gravity {
        stages.push(Box::new(gravity));
    }
    if let Some(viscosity) = effects.viscosity {
        stages.push(Box::new(ExplicitViscosity::new(viscosity, parameters)));
    }
    stages.push(Box::new(Predictor { time_step_s }));
    if let Some(collision) = effects.collision {
        stages.push(Box::new(Collisions::new(collision, parameters, state)));
    }
    if let Some(contact) = effects.wall_contact {
        stages.push(Box::new(WallContacts::new(contact, parameters, state)));
    }
    if let Some(pressure) = effects.pressure {
        stages.push(Box::new(PressureSolve::new(pressure, parameters, options, state)));
        stages.push(Box::new(Corrector { time_step_s }));
    }
    stages
}

/// What one step met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepReport {
    /// The number of the step, from 1.
    pub step: usize,
    /// Particles that left the bucket domain so far.
    pub ghosts: usize,
    /// `None` in a scene without pressure.
    pub pressure: Option<PressureReport>,
}

/// A simulation whose search and distance test were chosen when it was built.
pub trait Simulation: Send {
    /// Computes one step. After an error the simulation is broken and its particles mean nothing.
    fn step(&mut self, probe: &mut dyn Probe) -> Result<StepReport, SimulationError>;

    /// The particles after the last step.
    fn particles(&self) -> &Particles;

    /// Bytes of all columns of particles, search and stages.
    fn bytes(&self) -> usize;
}

struct Composed<C, T> {
    state: State<C>,
    stages: Vec<Box<dyn Stage<C, T>>>,
}

impl<C: CandidateSearch, T: DistanceTest> Simulation for Composed<C, T> {
    fn step(&mut self, probe: &mut dyn Probe) -> Result<StepReport, SimulationError> {
        let Composed { state, stages } = self;
        state.step += 1;
        let workers = Arc::clone(&state.workers);
        workers.install(|| stages.iter_mut().try_for_each(|stage| stage.run(state, probe)))?;
        Ok(StepReport { step: state.step, ghosts: state.ghosts, pressure: state.pressure })
    }

    fn particles(&self) -> &Particles {
        &self.state.particles
    }

    fn bytes(&self) -> usize {
        self.state.bytes() + self.stages.iter().map(|stage| stage.bytes()).sum::<usize>()
    }
}

/// Where a simulation starts: the particles after `steps_done` steps.
#[derive(Debug, Clone, Copy)]
pub struct Start<'a> {
    pub particles: &'a [InitialParticle],
    pub steps_done: usize,
}

/// Builds the simulation that `parameters` describe, computed as `options` say by `workers`.
pub fn build(
    parameters: &Parameters,
    options: &Options,
    start: Start<'_>,
    workers: Arc<Workers>,
) -> Result<Box<dyn Simulation>, TooManyBuckets> {
    match options.search {
        Search::LinkedList => with_test::<LinkedList>(parameters, options, start, workers),
        Search::AosRelocation => with_test::<AosRelocation>(parameters, options, start, workers),
        Search::BruteForce => with_test::<BruteForce>(parameters, options, start, workers),
    }
}

fn with_test<C: CandidateSearch + 'static>(
    parameters: &Parameters,
    options: &Options,
    start: Start<'_>,
    workers: Arc<Workers>,
) -> Result<Box<dyn Simulation>, TooManyBuckets> {
    match options.distance_test {
        Test::Sqrt => composed::<C, RootFirst>(parameters, options, start, workers),
        Test::Squared => composed::<C, SquaredFirst>(parameters, options, start, workers),
    }
}

fn composed<C: CandidateSearch + 'static, T: DistanceTest>(
    parameters: &Parameters,
    options: &Options,
    start: Start<'_>,
    workers: Arc<Workers>,
) -> Result<Box<dyn Simulation>, TooManyBuckets> {
    let grid = Grid::new(parameters.domain, parameters.largest_radius_m(), options.buckets_per_radius.get())?;
    let mut particles = Particles::new(start.particles, &workers);
    if parameters.effects.pressure.is_some() {
        particles.add_pressure_columns(start.particles, &workers);
    }
    let mut state = State::<C>::new(particles, grid, workers);
    state.step = start.steps_done;
    let stages = stages::<C, T>(parameters, options, &state);
    Ok(Box::new(Composed { state, stages }))
}
