//! The textbook's pressure on clusters, a line a phase as in [`PressureSolve`](crate::engine::pressure::PressureSolve).

use super::density::{ClusterDensity, Numbers};
use super::dry_walls::DryWalls;
use super::entries::Kept;
use super::gradient::Gradient;
use super::matrix::ClusterMatrix;
use super::reached::Reached;
use super::rows::RowSpace;
use super::{PIECE, lane, scatter};
use crate::base::parallel::{FirstIndex, Rows};
use crate::base::simd::{LANES, dispatch};
use crate::base::vec3::{add_scaled, is_finite};
use crate::engine::error::SimulationError;
use crate::engine::parameters::Parameters;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::preset::{self, Options};
use crate::engine::pressure::conjugate_gradient::{CgInfo, CgParams, ConjugateGradient};
use crate::engine::pressure::enclosed::EnclosedParts;
use crate::engine::pressure::options::{self, Clamp, Enclosed, Source, Surface};
use crate::engine::pressure::poisson::QUIET;
use crate::engine::pressure::preconditioner::Places;
use crate::engine::pressure::system_matrix::{BLOCK, System};
use crate::engine::pressure::{Pressure, PressureReport};
use crate::engine::search::NONE;
use crate::engine::search::clusters::{Clusters, Lanes, Section};
use crate::engine::stage::{Stage, State};

/// A number density beyond this is that of two particles at one place.
const COINCIDENT: f64 = 1e100;

/// Whether these stages cover what a scene says about its pressure.
pub fn covers(pressure: &Pressure) -> bool {
    pressure.source == Source::Density
        && pressure.gradient == options::Gradient::Minimum
        && pressure.surface == Surface::Density
        && pressure.clamp == Clamp::Everywhere
        && pressure.enclosed == Enclosed::Anchor
        && pressure.walls == options::Walls::Solved
        && pressure.density_by_group_kg_m3.is_none()
}

#[derive(Debug)]
pub struct ClusterPressure<V> {
    /// `re_L`, metres.
    radius_m: f64,
    gradient_kernel: crate::engine::kernel::Kernel,
    /// `n0` of the number density, and the share of it below which a particle is on the surface.
    n0: f64,
    surface_threshold: f64,
    source_relaxation: f64,
    compressibility_1_pa: f64,
    /// `-D / (n0_g rho)`.
    gradient_factor: f64,
    rows: RowSpace,
    density: ClusterDensity,
    matrix: ClusterMatrix<V>,
    /// `None` where all walls have rows.
    dry_walls: Option<DryWalls>,
    cg: CgParams,
    source: Vec<Numbers>,
    /// The particle of each row with an unknown, [`NONE`] for others.
    particle_of: Vec<u32>,
    reached: Reached,
    solver: ConjugateGradient,
    sums: Vec<Lanes>,
}

impl<V: Kept> ClusterPressure<V> {
    pub fn new(
        pressure: &Pressure,
        parameters: &Parameters,
        options: &Options,
        state: &State<Clusters>,
    ) -> Self {
        let radius_m = parameters.laplacian_radius_m();
        let gradient_n0 = parameters.reference(parameters.gradient_radius_m()).number_density;
        let coefficient = parameters.laplacian_factor() / parameters.density_kg_m3;
        let walls_rest = parameters.effects.wall_motion.is_none() && parameters.adaptive.is_none();
        ClusterPressure {
            radius_m,
            gradient_kernel: pressure.kernel(parameters.gradient_radius_m(), parameters),
            n0: parameters.reference(parameters.number_density_radius_m()).number_density,
            surface_threshold: pressure.surface_threshold,
            source_relaxation: pressure.source_relaxation,
            compressibility_1_pa: pressure.compressibility_1_pa,
            gradient_factor: -(parameters.dimensions.count() / (gradient_n0 * parameters.density_kg_m3)),
            rows: RowSpace::of(&state.candidates),
            density: ClusterDensity::new(pressure.kernel(parameters.number_density_radius_m(), parameters)),
            matrix: ClusterMatrix::new(pressure.kernel(radius_m, parameters), coefficient),
            dry_walls: (options.dry_walls == preset::DryWalls::Known && walls_rest).then(DryWalls::default),
            cg: options.cg,
            source: Vec::new(),
            particle_of: Vec::new(),
            reached: Reached::default(),
            solver: ConjugateGradient::new(options.cg, parameters.particle_distance_m),
            sums: Vec::new(),
        }
    }

    /// Phase `number_density`.
    fn find_density(&mut self, state: &mut State<Clusters>) -> Result<(), SimulationError> {
        self.rows = RowSpace::of(&state.candidates);
        self.density.sum(&state.candidates, &self.rows, state.workers.scheduled_over(PIECE * LANES));
        let (n, broken) = (self.density.n.as_flattened(), FirstIndex::default());
        let first = self.rows.first_slot();
        let team = state.workers.scheduled();
        scatter(&mut state.particles.number_density, &state.candidates.slots, first, team, |i, slot, own| {
            *own = n[slot - first];
            if own.is_nan() || *own >= COINCIDENT {
                broken.record(i);
            }
        });
        state.require_finite(&broken, Phase::NumberDensity, "number density")
    }

    /// The lanes of a cluster, counted from that of row 0, that hold particles.
    fn filled(state: &State<Clusters>, rows: &RowSpace, row: usize) -> u8 {
        let cluster = row + rows.walls().start;
        let section = if row < rows.walls().len() { Section::Wall } else { Section::Mobile };
        (0xFF_u16 >> (LANES - state.candidates.slots.filled_lanes(section, cluster))) as u8
    }

    /// Phase `boundary_condition`: who is on the surface, and which particle each row is.
    fn find_unknowns(&mut self, state: &State<Clusters>) {
        let (threshold, rows, n) = (self.surface_threshold * self.n0, &self.rows, &self.density.n);
        let team = state.workers.shared_evenly();
        let unknown = &mut self.matrix.unknown;
        unknown.resize(n.len(), 0);
        team.fill(Rows::new(unknown), |range, unknown| {
            for (row, unknown) in range.zip(unknown) {
                let inner = (0..LANES).fold(0, |bits, k| bits | u8::from(n[row][k] >= threshold) << k);
                *unknown = inner & Self::filled(state, rows, row);
            }
        });
        if let Some(dry_walls) = &mut self.dry_walls {
            dry_walls.leave_out(&state.candidates, rows, unknown);
        }
        let unknown = &self.matrix.unknown;
        let particles = &state.candidates.slots.particle[rows.slots()];
        self.particle_of.resize(rows.rows(), NONE);
        team.fill(Rows::new(&mut self.particle_of), |range, particle_of| {
            for (row, own) in range.zip(particle_of) {
                *own = if unknown[row / LANES] >> (row % LANES) & 1 == 1 { particles[row] } else { NONE };
            }
        });
    }

    /// Phase `source`: `b_i = gamma / dt^2 (n_i - n0) / n0`; tells whether it is all rounding noise.
    fn set_source(&mut self, time_step_s: f64) -> bool {
        let n0 = self.n0;
        let quiet = |(n, unknown): (&Numbers, &u8)| {
            (0..LANES).all(|k| unknown >> k & 1 == 0 || (n[k] - n0).abs() <= QUIET * n0)
        };
        let quiet = self.density.n.iter().zip(&self.matrix.unknown).all(quiet);
        self.source.clear();
        self.source.extend(self.sources(&self.density.n, &self.matrix.unknown, time_step_s));
        match &self.dry_walls {
            Some(dry_walls) => {
                dry_walls.add_to(&self.matrix, &self.rows, &mut self.source);
                // Where everything with an unknown was left out nothing is to be solved.
                quiet && dry_walls.rows == 0 || self.source.as_flattened().iter().all(|&b| b == 0.0)
            }
            None => quiet,
        }
    }

    /// The sources of clusters with these densities and unknowns.
    fn sources<'a>(
        &self,
        n: &'a [Numbers],
        unknown: &'a [u8],
        time_step_s: f64,
    ) -> impl Iterator<Item = Numbers> + use<'a, V> {
        let (n0, relaxation) = (self.n0, self.source_relaxation / (time_step_s * time_step_s));
        n.iter().zip(unknown).map(move |(n, unknown)| {
            std::array::from_fn(|k| match unknown >> k & 1 {
                0 => 0.0,
                _ => relaxation * ((n[k] - n0) / n0),
            })
        })
    }

    /// Takes up walls that were sorted anew.
    fn take_up_walls(&mut self, state: &State<Clusters>) -> Result<(), SimulationError> {
        let unknown = self.density.resting_at_least(self.surface_threshold * self.n0);
        let team = state.workers.scheduled_over(BLOCK);
        self.matrix.take_up_walls(&state.candidates, &self.rows, &unknown, team);
        let Some(mut dry_walls) = self.dry_walls.take() else { return Ok(()) };
        let source: Vec<Numbers> =
            self.sources(self.density.of_walls_alone(), &unknown, state.time_step_s).collect();
        let compressibility = self.compressibility_1_pa / (state.time_step_s * state.time_step_s);
        dry_walls
            .take_up(&self.matrix, unknown, &source, compressibility, self.cg, &state.workers)
            .map_err(|source| SimulationError::Solver { step: state.step, source })?;
        self.dry_walls = Some(dry_walls);
        Ok(())
    }

    /// Phase `connectivity`: anchors rows that no path of neighbours joins to the surface.
    fn settle_enclosed(&mut self, state: &State<Clusters>) {
        let team = state.workers.scheduled_over(LANES);
        self.reached.find(&self.matrix, |row| Self::filled(state, &self.rows, row), team);
        self.matrix.anchor(&self.reached.enclosed);
    }

    /// Phase `cg`.
    fn solve(&mut self, quiet: bool, state: &State<Clusters>) -> Result<CgInfo, SimulationError> {
        let places = Places { particle_of: &self.particle_of, position: &state.particles.position };
        let system = System { matrix: &self.matrix, source: self.source.as_flattened(), quiet, places };
        self.solver
            .solve(&system, &mut EnclosedParts::default(), &state.workers)
            .map_err(|source| SimulationError::Solver { step: state.step, source })
    }

    /// Phase `clamp`: negative pressures as zero.
    fn set_pressure(&self, state: &mut State<Clusters>) {
        let (solution, first) = (self.solver.solution(), self.rows.first_slot());
        let known = |row| self.dry_walls.as_ref().and_then(|dry_walls| dry_walls.pressure(row));
        let pressure = |row: usize| known(row).unwrap_or(solution[row]).max(0.0);
        let (team, slots) = (state.workers.scheduled(), &mut state.candidates.slots);
        team.evenly().fill(Rows::new(&mut slots.points[self.rows.slots()]), |range, points| {
            for (row, point) in range.zip(points) {
                point[3] = pressure(row);
            }
        });
        slots.show_pressures_to_images();
        scatter(&mut state.particles.pressure, &state.candidates.slots, first, team, |_, slot, p| {
            *p = pressure(slot - first);
        });
    }

    /// Phase `pressure_gradient`.
    fn accelerate(&mut self, state: &mut State<Clusters>) -> Result<(), SimulationError> {
        let (clusters, mobile, kernel) = (&state.candidates, self.rows.mobile(), self.gradient_kernel);
        self.sums.resize(mobile.len(), [[0.0; LANES]; 3]);
        state.workers.scheduled_over(PIECE * LANES).fill(
            Rows::of_width(&mut self.sums, PIECE),
            |pieces, sums| {
                let first = mobile.start + pieces.start * PIECE;
                let pieces = first..first + sums.len();
                dispatch(Gradient { clusters, kernel, pieces, sums });
            },
        );
        let (sums, factor, broken) = (&self.sums, self.gradient_factor, FirstIndex::default());
        let team = state.workers.scheduled();
        let first = mobile.start * LANES;
        scatter(&mut state.particles.acceleration, &clusters.slots, first, team, |i, slot, a| {
            *a = add_scaled(*a, factor, lane(sums, mobile.start, slot));
            if !is_finite(*a) {
                broken.record(i);
            }
        });
        state.require_finite(&broken, Phase::PressureGradient, "acceleration")
    }
}

impl<V: Kept, T> Stage<Clusters, T> for ClusterPressure<V> {
    fn run(&mut self, state: &mut State<Clusters>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh_within(self.radius_m, probe)?;
        within(probe, Phase::NumberDensity, || self.find_density(state))?;
        if self.matrix.has_old_walls(&state.candidates) {
            within(probe, Phase::Matrix, || self.take_up_walls(state))?;
        }
        within(probe, Phase::BoundaryCondition, || self.find_unknowns(state));
        let quiet = within(probe, Phase::Source, || self.set_source(state.time_step_s));
        let compressibility = self.compressibility_1_pa / (state.time_step_s * state.time_step_s);
        within(probe, Phase::Matrix, || {
            let team = state.workers.scheduled_over(BLOCK);
            self.matrix.assemble(&state.candidates, &self.rows, compressibility, team);
        });
        within(probe, Phase::Connectivity, || self.settle_enclosed(state));
        let cg = within(probe, Phase::Cg, || self.solve(quiet, state))?;
        within(probe, Phase::Clamp, || self.set_pressure(state));
        within(probe, Phase::PressureGradient, || self.accelerate(state))?;
        let unknowns = self.matrix.unknown.iter().map(|bits| bits.count_ones() as usize).sum();
        let slots = &state.candidates.slots;
        let with_pressure = slots.of(Section::Wall).len() + slots.of(Section::Mobile).len();
        let known = self.dry_walls.as_ref().map_or(0, |dry_walls| dry_walls.rows);
        let (surface, enclosed) = (with_pressure - unknowns - known, self.reached.enclosed.len());
        let matrix_entries = self.matrix.stored();
        state.pressure =
            Some(PressureReport { cg, unknowns, matrix_entries, surface, enclosed, enclosed_parts: 0 });
        Ok(())
    }

    fn bytes(&self) -> usize {
        self.density.bytes()
            + self.matrix.bytes()
            + self.dry_walls.as_ref().map_or(0, DryWalls::bytes)
            + self.source.capacity() * size_of::<Numbers>()
            + self.particle_of.capacity() * size_of::<u32>()
            + self.reached.bytes()
            + self.solver.bytes()
            + self.sums.capacity() * size_of::<Lanes>()
    }
}
