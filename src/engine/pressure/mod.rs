//! The implicit half of the step: a Poisson equation for the pressure, and the acceleration by its gradient.
//!
//! Koshizuka & Oka 1996 with the relaxed source and the slight compressibility of the textbook of Koshizuka, Shibata &
//! Murotani (2014). [`PressureSolve::run`] is the algorithm, a line a phase.

pub mod any_matrix;
pub mod conjugate_gradient;
pub mod connectivity;
pub mod divergence;
pub mod enclosed;
pub mod free_surface;
pub mod gradient;
pub mod matrix;
pub mod mirror;
pub mod moment;
pub mod number_density;
pub mod options;
pub mod poisson;
pub mod preconditioned;
pub mod preconditioner;
pub mod system_matrix;
pub mod truncated;
pub mod values;
pub mod wall_pressure;

use crate::engine::error::SimulationError;
use crate::engine::kernel::Kernel;
use crate::engine::parameters::Parameters;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::preset::Options;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Stage, State};
use conjugate_gradient::{CgInfo, ConjugateGradient};
use connectivity::Connectivity;
use enclosed::EnclosedParts;
use free_surface::Unknowns;
use gradient::PressureGradient;
use mirror::Mirror;
use number_density::NumberDensity;
use options::{Clamp, Enclosed, Gradient, Source, Surface, Walls};
use poisson::Poisson;
use preconditioner::Places;
use wall_pressure::WallPressure;

/// Constants of the pressure equation.
#[derive(Debug, Clone, PartialEq)]
pub struct Pressure {
    /// `beta`: below this share of `n0` a particle is on the free surface.
    pub surface_threshold: f64,
    /// `gamma`: the share of a density error that one step's source corrects; unused with [`Source::Divergence`].
    pub source_relaxation: f64,
    /// `alpha`, 1/Pa.
    pub compressibility_1_pa: f64,
    /// Distance in particle distances below which a pair counts as that far apart in number density, matrix and
    /// gradient. The reference lattice has no such pair, so `n0` and `lambda` stay.
    pub kernel_floor: Option<f64>,
    pub source: Source,
    pub gradient: Gradient,
    pub surface: Surface,
    pub clamp: Clamp,
    pub enclosed: Enclosed,
    pub walls: Walls,
    /// Density of each group, kg/m3; `None` where all have the fluid's.
    pub density_by_group_kg_m3: Option<Vec<f64>>,
}

/// The textbook's.
impl Default for Pressure {
    fn default() -> Self {
        Pressure {
            surface_threshold: 0.97,
            source_relaxation: 0.2,
            compressibility_1_pa: 0.45e-9,
            kernel_floor: None,
            source: Source::default(),
            gradient: Gradient::default(),
            surface: Surface::default(),
            clamp: Clamp::default(),
            enclosed: Enclosed::default(),
            walls: Walls::default(),
            density_by_group_kg_m3: None,
        }
    }
}

impl Pressure {
    /// The kernel for an influence radius, metres.
    pub fn kernel(&self, radius_m: f64, parameters: &Parameters) -> Kernel {
        Kernel { radius_m, floor_m: self.kernel_floor.unwrap_or(0.0) * parameters.particle_distance_m }
    }
}

/// What the pressure solve of one step met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureReport {
    pub cg: CgInfo,
    /// Rows of the system: the inner particles.
    pub unknowns: usize,
    /// Values that the matrix holds beside its diagonal, the zeros that fill it up among them.
    pub matrix_entries: usize,
    /// Particles on the free surface, walls among them.
    pub surface: usize,
    /// Inner particles without a path to the free surface.
    pub enclosed: usize,
    /// How many parts they make up; counted only where their constants are projected out.
    pub enclosed_parts: usize,
}

/// The stage and all its columns.
#[derive(Debug)]
pub struct PressureSolve {
    number_density: NumberDensity,
    unknowns: Unknowns,
    poisson: Poisson,
    connectivity: Connectivity,
    /// Stays empty where enclosed rows are anchored.
    parts: EnclosedParts,
    enclosed: Enclosed,
    /// Whether the pressures of an enclosed part start from zero instead of having the mean zero.
    from_zero: bool,
    solver: ConjugateGradient,
    gradient: PressureGradient,
    /// `None` where walls are solved for.
    walls: Option<(Mirror, WallPressure)>,
}

impl PressureSolve {
    pub fn new<C: CandidateSearch>(
        pressure: &Pressure,
        parameters: &Parameters,
        options: &Options,
        state: &State<C>,
    ) -> Self {
        PressureSolve {
            number_density: NumberDensity::new(pressure, parameters, state),
            unknowns: Unknowns::new(pressure, parameters, state),
            poisson: Poisson::new(pressure, parameters, options.storage, options.matrix_values),
            connectivity: Connectivity::new(parameters, state),
            parts: EnclosedParts::default(),
            enclosed: pressure.enclosed,
            from_zero: pressure.clamp == Clamp::Everywhere,
            solver: ConjugateGradient::new(options.cg, parameters.particle_distance_m),
            gradient: PressureGradient::new(pressure, parameters, state),
            walls: (pressure.walls == Walls::Mirrored)
                .then(|| (Mirror::new(parameters, state), WallPressure::new(pressure, parameters, state))),
        }
    }

    /// Phase `connectivity`: makes the system of enclosed rows one that has a solution; returns how many they are.
    fn settle_enclosed<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) -> usize {
        let PressureSolve { unknowns, poisson, connectivity, parts, .. } = self;
        let enclosed = connectivity.find_enclosed::<C, T>(unknowns, state);
        match self.enclosed {
            Enclosed::Anchor => poisson.anchor(enclosed),
            Enclosed::Project => {
                parts.find(enclosed, unknowns.rows.len(), &poisson.matrix);
                poisson.project(parts, state.workers.shared_evenly(), state.time_step_s);
            }
        }
        enclosed.len()
    }

    /// Phase `source`.
    fn set_source<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        let mirror = self.walls.as_mut().map(|(mirror, _)| mirror.refresh::<C, T>(state));
        self.poisson.set_source::<C, T>(&self.unknowns, mirror, state);
        self.poisson.find_missing::<C, T>(&self.unknowns, state);
    }

    /// Phase `cg`.
    fn solve<C: CandidateSearch>(&mut self, state: &State<C>) -> Result<CgInfo, SimulationError> {
        let PressureSolve { unknowns, poisson, parts, solver, .. } = self;
        let places = Places { particle_of: &unknowns.rows, position: &state.particles.position };
        let cg = solver
            .solve(&poisson.system(places), parts, &state.workers)
            .map_err(|source| SimulationError::Solver { step: state.step, source })?;
        if self.from_zero && !parts.is_empty() {
            solver.make_minima_zero(parts, &state.workers);
        }
        Ok(cg)
    }
}

impl<C: CandidateSearch, T: DistanceTest> Stage<C, T> for PressureSolve {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh(probe)?;
        within(probe, Phase::NumberDensity, || self.number_density.sum::<C, T>(state))?;
        let asymmetry = &self.number_density.asymmetry;
        within(probe, Phase::BoundaryCondition, || self.unknowns.find(asymmetry, state));
        within(probe, Phase::Source, || self.set_source::<C, T>(state));
        within(probe, Phase::Matrix, || self.poisson.assemble::<C, T>(&self.unknowns, state));
        let enclosed = within(probe, Phase::Connectivity, || self.settle_enclosed::<C, T>(state));
        let cg = within(probe, Phase::Cg, || self.solve(state))?;
        let PressureSolve { unknowns, poisson, solver, gradient, parts, .. } = self;
        within(probe, Phase::Clamp, || gradient.set_pressure::<C, T>(unknowns, solver.solution(), state));
        within(probe, Phase::MinimumPressure, || gradient.find_minimum::<C, T>(unknowns, state));
        within(probe, Phase::PressureGradient, || gradient.accelerate::<C, T>(unknowns, state))?;
        if let Some((_, pressure)) = &mut self.walls {
            within(probe, Phase::WallMirror, || pressure.read_off::<C, T>(state));
        }
        let (rows, surface, enclosed_parts) = (unknowns.rows.len(), unknowns.surface_count(), parts.count());
        let matrix_entries = poisson.matrix.entries();
        state.pressure =
            Some(PressureReport { cg, unknowns: rows, matrix_entries, surface, enclosed, enclosed_parts });
        Ok(())
    }

    fn bytes(&self) -> usize {
        self.number_density.bytes()
            + self.unknowns.bytes()
            + self.poisson.bytes()
            + self.connectivity.bytes()
            + self.parts.bytes()
            + self.solver.bytes()
            + self.gradient.bytes()
            + self.walls.as_ref().map_or(0, |(mirror, pressure)| mirror.bytes() + pressure.bytes())
    }
}
