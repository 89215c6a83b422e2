//! The implicit half of the step: a Poisson equation for the pressure, and the acceleration by its gradient.
//!
//! Koshizuka & Oka 1996 with the relaxed source and the slight compressibility of the textbook of Koshizuka, Shibata &
//! Murotani (2014). [`PressureSolve::run`] is the algorithm, a line a phase.

pub mod conjugate_gradient;
pub mod connectivity;
pub mod free_surface;
pub mod gradient;
pub mod matrix;
pub mod number_density;
pub mod poisson;

use crate::engine::effects::surface_tension::SurfacePressure;
use crate::engine::error::SimulationError;
use crate::engine::kernel::Kernel;
use crate::engine::parameters::Parameters;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::preset::Options;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Stage, State};
use crate::engine::time_step::StepLimit;
use conjugate_gradient::{CgInfo, ConjugateGradient};
use connectivity::Connectivity;
use free_surface::Unknowns;
use gradient::PressureGradient;
use number_density::NumberDensity;
use poisson::Poisson;

/// Constants of the pressure equation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pressure {
    /// `beta`: below this share of `n0` a particle is on the free surface.
    pub surface_threshold: f64,
    /// `gamma`: the share of a density error that one step's source corrects.
    pub source_relaxation: f64,
    /// `alpha`, 1/Pa.
    pub compressibility_1_pa: f64,
    /// Distance in particle distances below which a pair counts as that far apart in number density, matrix and
    /// gradient. The reference lattice has no such pair, so `n0` and `lambda` stay.
    pub kernel_floor: Option<f64>,
}

impl Pressure {
    /// The kernel for an influence radius, metres.
    fn kernel(&self, radius_m: f64, parameters: &Parameters) -> Kernel {
        Kernel { radius_m, floor_m: self.kernel_floor.unwrap_or(0.0) * parameters.particle_distance_m }
    }
}

/// What the pressure solve of one step met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureReport {
    pub cg: CgInfo,
    /// Rows of the system: the inner particles.
    pub unknowns: usize,
    /// Particles on the free surface, walls among them.
    pub surface: usize,
    /// Inner particles without a path to the free surface.
    pub enclosed: usize,
}

/// The stage and all its columns.
#[derive(Debug)]
pub struct PressureSolve {
    number_density: NumberDensity,
    unknowns: Unknowns,
    /// `None` where the free surface has no pressure.
    tension: Option<SurfacePressure>,
    poisson: Poisson,
    connectivity: Connectivity,
    solver: ConjugateGradient,
    gradient: PressureGradient,
}

impl PressureSolve {
    pub fn new<C: CandidateSearch>(
        pressure: Pressure,
        parameters: &Parameters,
        options: &Options,
        state: &State<C>,
    ) -> Self {
        PressureSolve {
            number_density: NumberDensity::new(pressure, parameters),
            unknowns: Unknowns::new(pressure, parameters, state),
            tension: parameters
                .effects
                .surface_tension
                .map(|tension| SurfacePressure::new(tension, parameters, state)),
            poisson: Poisson::new(pressure, parameters, options.storage),
            connectivity: Connectivity::new(parameters, state),
            solver: ConjugateGradient::new(options.cg),
            gradient: PressureGradient::new(pressure, parameters, state),
        }
    }
}

impl<C: CandidateSearch, T: DistanceTest> Stage<C, T> for PressureSolve {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        let PressureSolve { number_density, unknowns, tension, poisson, connectivity, solver, gradient } =
            self;
        state.refresh(probe)?;
        within(probe, Phase::NumberDensity, || number_density.sum::<C, T>(state))?;
        within(probe, Phase::BoundaryCondition, || unknowns.find(state));
        if let Some(tension) = tension {
            within(probe, Phase::SurfaceTension, || tension.find::<C, T>(&unknowns.label, state));
        }
        let surface: &[f64] = tension.as_ref().map_or(&[], |tension| &tension.pressure);
        within(probe, Phase::Source, || {
            poisson.set_source(unknowns, state);
            poisson.add_surface_pressure::<C, T>(surface, unknowns, state);
        });
        within(probe, Phase::Matrix, || poisson.assemble::<C, T>(unknowns, state));
        let enclosed = within(probe, Phase::Connectivity, || {
            let enclosed = connectivity.find_enclosed::<C, T>(unknowns, state);
            poisson.anchor(enclosed);
            enclosed.len()
        });
        let cg = within(probe, Phase::Cg, || solver.solve(poisson, &state.workers))
            .map_err(|source| SimulationError::Solver { step: state.step, source })?;
        within(probe, Phase::Clamp, || gradient.set_pressure(unknowns, solver.solution(), surface, state));
        within(probe, Phase::MinimumPressure, || gradient.find_minimum::<C, T>(unknowns, state));
        within(probe, Phase::PressureGradient, || gradient.accelerate::<C, T>(unknowns, state))?;
        let (rows, on_surface) = (unknowns.rows.len(), unknowns.surface_count());
        state.pressure = Some(PressureReport { cg, unknowns: rows, surface: on_surface, enclosed });
        Ok(())
    }

    fn bytes(&self) -> usize {
        self.unknowns.bytes()
            + self.tension.as_ref().map_or(0, SurfacePressure::bytes)
            + self.poisson.bytes()
            + self.connectivity.bytes()
            + self.solver.bytes()
            + self.gradient.bytes()
    }

    fn longest_step(&self, _state: &State<C>) -> Option<StepLimit> {
        self.tension.as_ref().map(SurfacePressure::longest_step)
    }
}
