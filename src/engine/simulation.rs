//! A simulation: the list of stages that a scene calls for, run once a step.

use std::sync::Arc;

use crate::base::parallel::Workers;
use crate::engine::columns::Visitor;
use crate::engine::effects::diffusion::advance::Advance;
use crate::engine::effects::diffusion::{self, Carried};
use crate::engine::effects::flow_boundaries::{FlowBoundary, FlowReport, ghosts_outside};
use crate::engine::effects::frame::FrameAcceleration;
use crate::engine::effects::motion::{Corrector, Predictor};
use crate::engine::effects::potential_tension::PairAttraction;
use crate::engine::effects::rigid_bodies::BodyMotion;
use crate::engine::effects::shifting::Shifts;
use crate::engine::effects::surface_tension::Lacking;
use crate::engine::effects::wall_contact::WallContacts;
use crate::engine::effects::wall_motion::WallMotions;
use crate::engine::error::SimulationError;
use crate::engine::own_stages::OwnStages;
use crate::engine::parameters::Parameters;
use crate::engine::particles::{InitialParticle, Particles};
use crate::engine::phase::{Phase, Probe};
use crate::engine::preset::{Options, PairTerms, Search, Test};
use crate::engine::pressure::PressureReport;
use crate::engine::pressure::conjugate_gradient::CgInfo;
use crate::engine::search::aos_relocation::AosRelocation;
use crate::engine::search::aosoa::Aosoa;
use crate::engine::search::brute_force::BruteForce;
use crate::engine::search::cell_list::CellList;
use crate::engine::search::clusters::Clusters;
use crate::engine::search::erased::Erased;
use crate::engine::search::grid::{BadDomain, Grid};
use crate::engine::search::linked_list::LinkedList;
use crate::engine::search::neighbor_list::{Moved, NeighborList};
use crate::engine::search::periodic::Periodic;
use crate::engine::search::soa::Soa;
use crate::engine::search::sorted_particles::SortedParticles;
use crate::engine::search::{CandidateSearch, DistanceTest, Lengths, RootFirst, SquaredFirst};
use crate::engine::shared_walk::SharedWalk;
use crate::engine::stage::{Stage, State};
use crate::engine::terms::PairPass;
use crate::engine::time_step::{Adaptive, StepLimit};
use crate::engine::viscous_stages;

/// What every step does once the explicit forces are known: particles move, meet others and walls, and are corrected by the
/// pressure.
fn push_motion<C: OwnStages, T: DistanceTest>(
    stages: &mut Vec<Box<dyn Stage<C, T>>>,
    parameters: &Parameters,
    options: &Options,
    state: &State<C>,
) {
    let effects = &parameters.effects;
    stages.push(Box::new(Predictor));
    if let Some(collision) = effects.collision {
        stages.push(C::collisions(collision, parameters, state));
    }
    if let Some(contact) = effects.wall_contact {
        stages.push(Box::new(WallContacts::new(contact, parameters, state)));
    }
    if let Some(pressure) = &effects.pressure {
        stages.push(C::pressure(pressure, parameters, options, state));
        stages.push(Box::new(Corrector));
    }
}

/// The stages of one step of the textbook's semi-implicit MPS method, in order. A stage that the scene does not call for is
/// not in the list, has no phase and no columns.
fn textbook_stages<C: OwnStages, T: DistanceTest>(
    parameters: &Parameters,
    options: &Options,
    state: &State<C>,
) -> Vec<Box<dyn Stage<C, T>>> {
    let effects = &parameters.effects;
    let mut stages: Vec<Box<dyn Stage<C, T>>> = Vec::new();
    if let Some(gravity) = effects.gravity {
        stages.push(Box::new(gravity));
    }
    if let Some(viscosity) = &effects.viscosity {
        stages.push(viscous_stages::explicit(viscosity, parameters));
    }
    push_motion(&mut stages, parameters, options, state);
    stages
}

/// The same with every effect that a scene may name.
fn stages<C: OwnStages, T: DistanceTest>(
    parameters: &Parameters,
    options: &Options,
    state: &State<C>,
) -> Vec<Box<dyn Stage<C, T>>> {
    if parameters.effects.are_the_textbooks() && options.pair_terms != PairTerms::Joined {
        return textbook_stages(parameters, options, state);
    }
    let effects = &parameters.effects;
    let mut stages: Vec<Box<dyn Stage<C, T>>> = Vec::new();
    if let Some(boundaries) = &effects.flow_boundaries {
        stages.push(Box::new(FlowBoundary::new(boundaries.clone(), parameters, state)));
    }
    if let Some(motion) = &effects.wall_motion {
        stages.push(Box::new(WallMotions::new(motion.clone(), state.time_s, state)));
    }
    let weightless = effects.buoyancy.is_some_and(|buoyancy| buoyancy.without_weight);
    if let Some(gravity) = effects.gravity.filter(|_| !weightless) {
        stages.push(Box::new(gravity));
    }
    if let Some(buoyancy) = effects.buoyancy {
        stages.push(Box::new(buoyancy));
    }
    let shared = SharedWalk::of(parameters, options);
    if !shared.viscosity && !shared.is_empty() {
        stages.push(C::shared_walk(shared, parameters));
    }
    if let Some(heat) = effects.heat.as_ref().filter(|_| !shared.temperature) {
        stages.push(diffusion::stage::<C, T>(Carried::Temperature, heat, parameters));
    }
    if let Some(scalar) = effects.scalar.as_ref().filter(|_| !shared.concentration) {
        stages.push(diffusion::stage::<C, T>(Carried::Concentration, scalar, parameters));
    }
    if let Some(frame) = &effects.frame {
        let (frame, dimensions) = (frame.clone(), parameters.dimensions);
        stages.push(Box::new(FrameAcceleration { frame, dimensions }));
    }
    stages.extend(viscous_stages::stages::<C, T>(parameters, options, shared));
    if let Some(heat) = &effects.heat {
        stages.push(Box::new(Advance::new(Carried::Temperature, heat, parameters)));
    }
    if let Some(scalar) = &effects.scalar {
        stages.push(Box::new(Advance::new(Carried::Concentration, scalar, parameters)));
    }
    if let Some(tension) = effects.potential_tension.filter(|_| !shared.tension) {
        let (term, radius_m) = (PairAttraction::new(tension, parameters), tension.radius_m(parameters));
        stages.push(Box::new(PairPass { term, radius_m, phase: Phase::PotentialTension }));
    }
    if let Some(tension) = effects.surface_tension {
        stages.push(Box::new(Lacking::new(tension, parameters, state)));
    }
    push_motion(&mut stages, parameters, options, state);
    if let Some(bodies) = &effects.rigid_bodies {
        stages.push(Box::new(BodyMotion::new(bodies.clone(), parameters, state)));
    }
    if let Some(shifting) = effects.shifting {
        stages.push(Box::new(Shifts::new(shifting, parameters, state)));
    }
    stages
}

/// What one step met.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepReport {
    /// The number of the step, from 1.
    pub step: usize,
    /// Simulated time at its end, seconds.
    pub time_s: f64,
    /// Its length, seconds.
    pub time_step_s: f64,
    /// How often it was taken back and begun anew with half the length.
    pub redone: usize,
    /// Particles that left the bucket domain so far.
    pub ghosts: usize,
    /// `None` in a scene without pressure.
    pub pressure: Option<PressureReport>,
    /// `None` in a scene without flow boundaries.
    pub flow: Option<FlowReport>,
    /// `None` in a scene without implicit viscosity.
    pub viscosity: Option<CgInfo>,
}

/// A simulation whose search and distance test were chosen when it was built.
pub trait Simulation: Send {
    /// Computes one step. After an error the simulation is broken and its particles mean nothing.
    fn step(&mut self, probe: &mut dyn Probe) -> Result<StepReport, SimulationError>;

    /// The particles after the last step.
    fn particles(&self) -> &Particles;

    /// Shows every column and number that the next step depends on, always in the same order. What a visitor writes
    /// there is what the simulation goes on from.
    fn visit(&mut self, visitor: &mut Visitor<'_>);

    /// Bytes of all columns of particles, search and stages.
    fn bytes(&self) -> usize;
}

struct Composed<C, T> {
    state: State<C>,
    stages: Vec<Box<dyn Stage<C, T>>>,
    /// `None` where all steps are equally long.
    adaptive: Option<Adaptive>,
}

impl<C: CandidateSearch, T: DistanceTest> Composed<C, T> {
    /// One attempt at a step of the present length.
    fn attempt(&mut self, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        let Composed { state, stages, .. } = self;
        state.step += 1;
        stages.iter_mut().try_for_each(|stage| stage.run(state, probe))?;
        state.time_s += state.time_step_s;
        Ok(())
    }

    /// A step whose length follows from the flow; taken back and begun anew with half the length if it went too far.
    fn adaptive_step(
        &mut self,
        adaptive: &mut Adaptive,
        probe: &mut dyn Probe,
    ) -> Result<usize, SimulationError> {
        let stable = self.stages.iter().filter_map(|stage| stage.longest_step(&self.state));
        let mut limit = adaptive.next_step(&self.state.particles, stable);
        adaptive.before.keep(|visitor| self.show(visitor));
        for redone in 0.. {
            if limit.time_step_s < adaptive.rules.shortest_s {
                let (step, reason) = (self.state.step + 1, limit.reason);
                return Err(SimulationError::StepTooShort { step, time_step_s: limit.time_step_s, reason });
            }
            self.state.time_step_s = limit.time_step_s;
            let error = match self.attempt(probe) {
                Ok(()) if adaptive.accepts(&self.state.particles, self.state.time_step_s) => {
                    return Ok(redone);
                }
                Ok(()) => None,
                Err(error) => Some(error),
            };
            // A pair at one place stays one however short the step is.
            if let Some(error @ SimulationError::Coincident { .. }) = error {
                return Err(error);
            }
            let before = std::mem::take(&mut adaptive.before);
            before.restore(|visitor| self.show(visitor));
            adaptive.before = before;
            limit = StepLimit { time_step_s: 0.5 * limit.time_step_s, reason: "a step that went too far" };
        }
        unreachable!("a step that is halved again and again becomes too short")
    }

    fn show(&mut self, visitor: &mut Visitor<'_>) {
        self.state.visit(visitor);
        self.stages.iter_mut().for_each(|stage| stage.visit(visitor));
    }
}

impl<C: CandidateSearch, T: DistanceTest> Simulation for Composed<C, T> {
    fn step(&mut self, probe: &mut dyn Probe) -> Result<StepReport, SimulationError> {
        let workers = Arc::clone(&self.state.workers);
        let redone = workers.install(|| match self.adaptive.take() {
            None => self.attempt(probe).map(|()| 0),
            Some(mut adaptive) => {
                let redone = self.adaptive_step(&mut adaptive, probe);
                self.adaptive = Some(adaptive);
                redone
            }
        })?;
        let State { step, time_s, time_step_s, ghosts, pressure, flow, viscosity, .. } = self.state;
        Ok(StepReport { step, time_s, time_step_s, redone, ghosts, pressure, flow, viscosity })
    }

    fn particles(&self) -> &Particles {
        &self.state.particles
    }

    fn visit(&mut self, visitor: &mut Visitor<'_>) {
        self.show(visitor);
        if let Some(adaptive) = &mut self.adaptive {
            adaptive.visit(visitor);
        }
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

/// Builds the simulation that `parameters` describe, computed as `options` say by `workers`. Roots before the distance test
/// are the paper's own way: they are compiled for the textbook's effects and its two searches; all else compares squares.
/// Effects beyond the textbook's are compiled for relocation and clusters, and once for all other searches behind a pointer.
pub fn build(
    parameters: &Parameters,
    options: &Options,
    start: Start<'_>,
    workers: Arc<Workers>,
) -> Result<Box<dyn Simulation>, BadDomain> {
    let textbook = parameters.effects.are_the_textbooks() && parameters.domain.periodic == [false; 3];
    let root_first = textbook && options.distance_test == Test::Sqrt;
    let plan = (parameters, options, start, workers);
    match options.search {
        Search::LinkedList if root_first => {
            composed(LinkedList::new, textbook_stages::<LinkedList, RootFirst>, plan)
        }
        Search::AosRelocation if root_first => {
            composed(AosRelocation::new, textbook_stages::<AosRelocation, RootFirst>, plan)
        }
        Search::AosRelocation => relocated(plan),
        Search::LinkedList => another::<LinkedList, Periodic<LinkedList>>(textbook, plan),
        Search::BruteForce => another::<BruteForce, Periodic<BruteForce>>(textbook, plan),
        Search::CellList => another::<CellList, Periodic<CellList>>(textbook, plan),
        Search::SortedParticles => another::<SortedParticles, Periodic<SortedParticles>>(textbook, plan),
        Search::NeighborList => another::<NeighborList<u32>, NeighborList<Moved>>(textbook, plan),
        Search::Soa => another::<Soa, Periodic<Soa>>(textbook, plan),
        Search::Aosoa => another::<Aosoa, Periodic<Aosoa>>(textbook, plan),
        Search::Clusters => composed(Clusters::new, stages::<Clusters, SquaredFirst>, plan),
    }
}

/// What a simulation is built from.
type Plan<'a> = (&'a Parameters, &'a Options, Start<'a>, Arc<Workers>);

/// Makes a search.
type MakeSearch<C> = fn(&Grid, Lengths, usize) -> C;

/// Makes the stages of a step.
type Stages<C, T> = fn(&Parameters, &Options, &State<C>) -> Vec<Box<dyn Stage<C, T>>>;

/// All effects with relocation.
fn relocated(plan: Plan<'_>) -> Result<Box<dyn Simulation>, BadDomain> {
    match plan.0.domain.periodic {
        [false, false, false] => composed(AosRelocation::new, stages::<AosRelocation, SquaredFirst>, plan),
        _ => composed(Periodic::new, stages::<Periodic<AosRelocation>, SquaredFirst>, plan),
    }
}

/// A search that only the textbook's step is compiled for: `C`, or `P` in a domain that repeats itself along an axis.
fn another<C, P>(textbook: bool, plan: Plan<'_>) -> Result<Box<dyn Simulation>, BadDomain>
where
    C: OwnStages,
    P: CandidateSearch + 'static,
{
    match plan.0.domain.periodic {
        _ if textbook => composed(C::new, textbook_stages::<C, SquaredFirst>, plan),
        [false, false, false] => composed(Erased::of::<C>, stages::<Erased, SquaredFirst>, plan),
        _ => composed(Erased::of::<P>, stages::<Erased, SquaredFirst>, plan),
    }
}

fn composed<C: OwnStages, T: DistanceTest>(
    search: MakeSearch<C>,
    stages: Stages<C, T>,
    (parameters, options, start, workers): Plan<'_>,
) -> Result<Box<dyn Simulation>, BadDomain> {
    let grid = Grid::new(parameters.domain, parameters.largest_radius_m(), options.buckets_per_radius.get())?;
    let mut particles = Particles::new(start.particles, &workers);
    if parameters.effects.pressure.is_some() {
        particles.add_pressure_columns(start.particles, &workers);
    }
    if parameters.effects.heat.is_some() {
        particles.add_temperature(start.particles, &workers);
    }
    if parameters.effects.scalar.is_some() {
        particles.add_concentration(start.particles, &workers);
    }
    if !parameters.groups.is_empty() {
        particles.add_groups(start.particles, &workers);
    }
    viscous_stages::add_columns(&mut particles, parameters, &workers);
    let lengths = parameters.lengths();
    let search = search(&grid, lengths, particles.len());
    let mut state = State::with_search(search, particles, grid, lengths, workers, parameters.time_step_s);
    state.step = start.steps_done;
    state.time_s = start.steps_done as f64 * parameters.time_step_s;
    if parameters.effects.flow_boundaries.is_some() {
        state.ghosts = ghosts_outside(&state.particles, &parameters.domain);
    }
    let stages = stages(parameters, options, &state);
    let adaptive = parameters.adaptive.map(|rules| Adaptive::new(rules, parameters));
    Ok(Box::new(Composed { state, stages, adaptive }))
}
