//! The pressure Poisson equation of one step, `A p = b` over the inner particles.
//!
//! * Source `b_i = gamma / dt^2 (n_i - n0) / n0`, Pa/m2 per (kg/m3), or that of [`divergence`](super::divergence).
//! * Rows `A_ij = -c_ij`, `A_ii = sum_j c_ij + alpha / dt^2` with `c_ij = 2D / (n0_L lambda) w(r_ij, re_L) / rho`, over
//!   all `j` within `re_L` that have a pressure. Surface particles count in `A_ii`; their pressure is zero.

use std::marker::PhantomData;

use crate::base::parallel::Team;
use crate::engine::kernel::Kernel;
use crate::engine::parameters::Parameters;
use crate::engine::particles::Particles;
use crate::engine::pressure::Pressure;
use crate::engine::pressure::any_matrix::{AnyMatrix, BuildRow};
use crate::engine::pressure::divergence::DivergenceSource;
use crate::engine::pressure::enclosed::EnclosedParts;
use crate::engine::pressure::free_surface::{Label, Unknowns};
use crate::engine::pressure::matrix::{RowWriter, Storage};
use crate::engine::pressure::mirror::Mirror;
use crate::engine::pressure::options::{Source, Surface, Walls};
use crate::engine::pressure::preconditioner::Places;
use crate::engine::pressure::system_matrix::System;
use crate::engine::pressure::truncated::Truncated;
use crate::engine::pressure::values::{MatrixValues, Value};
use crate::engine::search::{CandidateSearch, DistanceTest, NONE, Neighborhood};
use crate::engine::stage::State;

/// A number density this close to `n0`, relative to it, is no density error: a block in free fall has rounding noise
/// of this size, and a solver that divides by its norm would iterate on it.
pub const QUIET: f64 = 1e-10;

/// What pairs of particles of different density have in place of `1 / rho`: `2 / (rho_i + rho_j)`, so that the matrix stays
/// symmetric and the flux through an interface is that of the mean density. A wall has the density of the fluid or body
/// beside it: the pressure on it must carry that one's weight.
#[derive(Debug)]
struct PairDensity {
    /// `2D / (n0_L lambda)`.
    laplacian_factor: f64,
    by_group_kg_m3: Vec<f64>,
}

impl PairDensity {
    #[inline(always)]
    fn coefficient(&self, i: usize, j: usize, particles: &Particles) -> f64 {
        let [rho_i, rho_j] = [i, j].map(|k| self.by_group_kg_m3[particles.group_of(k) as usize]);
        let density = match (particles.kind[i].moves(), particles.kind[j].moves()) {
            (true, false) => rho_i,
            (false, true) => rho_j,
            _ => 0.5 * (rho_i + rho_j),
        };
        self.laplacian_factor / density
    }
}

#[derive(Debug)]
pub struct Poisson {
    kernel: Kernel,
    /// `2D / (n0_L lambda rho)`.
    coefficient: f64,
    /// `None` where the density is the same everywhere.
    densities: Option<PairDensity>,
    /// `alpha`, 1/Pa.
    compressibility_1_pa: f64,
    /// `gamma`.
    source_relaxation: f64,
    /// `n0` of the number density.
    n0: f64,
    /// `None` where the source is the density's.
    divergence: Option<DivergenceSource>,
    /// `None` where the pressure of surface particles is zero.
    truncated: Option<Truncated>,
    /// Whether walls are mirrors, so that a row may have no neighbour.
    mirrored: bool,
    pub matrix: AnyMatrix,
    pub source: Vec<f64>,
    /// Whether the whole source is rounding noise.
    pub quiet: bool,
}

impl Poisson {
    pub fn new(pressure: &Pressure, parameters: &Parameters, storage: Storage, values: MatrixValues) -> Self {
        let lattice = parameters.reference(parameters.laplacian_radius_m());
        Poisson {
            kernel: pressure.kernel(parameters.laplacian_radius_m(), parameters),
            coefficient: parameters.laplacian_factor() / parameters.density_kg_m3,
            densities: pressure.density_by_group_kg_m3.as_ref().map(|by_group_kg_m3| PairDensity {
                laplacian_factor: parameters.laplacian_factor(),
                by_group_kg_m3: by_group_kg_m3.clone(),
            }),
            compressibility_1_pa: pressure.compressibility_1_pa,
            source_relaxation: pressure.source_relaxation,
            n0: parameters.reference(parameters.number_density_radius_m()).number_density,
            divergence: match pressure.source {
                Source::Density => None,
                Source::Divergence { density_feedback_s } => {
                    Some(DivergenceSource::new(density_feedback_s, pressure, parameters))
                }
            },
            truncated: (pressure.surface == Surface::Truncated).then(|| Truncated::new(pressure, parameters)),
            mirrored: pressure.walls == Walls::Mirrored,
            matrix: AnyMatrix::new(values, storage, lattice.neighbors),
            source: Vec::new(),
            quiet: true,
        }
    }

    /// Phase `source`.
    pub fn set_source<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        unknowns: &Unknowns,
        mirror: Option<&Mirror>,
        state: &State<C>,
    ) {
        if let Some(divergence) = self.divergence {
            divergence.set::<C, T>(&mut self.source, unknowns, mirror, state);
            return self.note_noise(state.time_step_s);
        }
        let (n, n0) = (&state.particles.number_density, self.n0);
        let relaxation = self.source_relaxation / (state.time_step_s * state.time_step_s);
        self.source.clear();
        self.source.extend(unknowns.rows.iter().map(|&i| relaxation * ((n[i as usize] - n0) / n0)));
        self.quiet = unknowns.rows.iter().all(|&i| (n[i as usize] - n0).abs() <= QUIET * n0);
    }

    /// Finds what the neighbourhoods of all rows lack, if that counts.
    pub fn find_missing<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        unknowns: &Unknowns,
        state: &State<C>,
    ) {
        if let Some(truncated) = &mut self.truncated {
            truncated.find::<C, T>(self.kernel, unknowns, state);
        }
    }

    /// Sets `quiet`: `dt^2 b` is what density errors the step would make, relative to `n0`.
    fn note_noise(&mut self, dt: f64) {
        self.quiet = self.source.iter().all(|b| (dt * dt * b).abs() <= QUIET);
    }

    /// Phase `matrix`.
    pub fn assemble<C: CandidateSearch, T: DistanceTest>(&mut self, unknowns: &Unknowns, state: &State<C>) {
        let (coefficient, particles) = (self.coefficient, &state.particles);
        match self.densities.take() {
            None => self.fill::<C, T>(unknowns, state, |_, _| coefficient),
            Some(densities) => {
                self.fill::<C, T>(unknowns, state, |i, j| densities.coefficient(i, j, particles));
                self.densities = Some(densities);
            }
        }
    }

    /// Fills the matrix with `coefficient(i, j)` times the weight of each pair.
    fn fill<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        unknowns: &Unknowns,
        state: &State<C>,
        coefficient: impl Fn(usize, usize) -> f64 + Sync,
    ) {
        let build = PairRows::<C, T, _> {
            near: state.neighborhood(),
            unknowns,
            kernel: self.kernel,
            coefficient,
            missing: self.truncated.as_ref().map(|truncated| &truncated.missing[..]),
            alone_may_be: self.mirrored,
            compressibility: self.compressibility_1_pa / (state.time_step_s * state.time_step_s),
            test: PhantomData,
        };
        self.matrix.assemble(unknowns.rows.len(), &state.workers, &build);
    }

    /// The system as it stands, its rows those of `unknowns`.
    pub fn system<'a>(&'a self, places: Places<'a>) -> System<'a, AnyMatrix> {
        System { matrix: &self.matrix, source: &self.source, quiet: self.quiet, places }
    }

    /// Takes the part out of the source that no pressure can fulfil where there is no surface.
    pub fn project(&mut self, parts: &mut EnclosedParts, team: Team<'_>, time_step_s: f64) {
        if !parts.is_empty() {
            parts.subtract_means(&mut self.source, team);
            self.note_noise(time_step_s);
        }
    }

    /// Doubles the diagonal of rows without a path to a known pressure, whose system would be singular but for the
    /// compressibility.
    pub fn anchor(&mut self, enclosed: &[u32]) {
        for &row in enclosed {
            self.matrix.diagonal_mut()[row as usize] *= 2.0;
        }
    }

    pub fn bytes(&self) -> usize {
        self.matrix.bytes()
            + self.source.capacity() * size_of::<f64>()
            + self.truncated.as_ref().map_or(0, Truncated::bytes)
    }
}

/// Rows from pairs of neighbours.
struct PairRows<'a, C, T, F> {
    near: Neighborhood<'a, C>,
    unknowns: &'a Unknowns,
    kernel: Kernel,
    coefficient: F,
    /// What the neighbourhood of each row lacks, where that counts.
    missing: Option<&'a [f64]>,
    /// Whether a row may have no neighbour: a particle among walls that are mirrors.
    alone_may_be: bool,
    /// `alpha / dt^2`.
    compressibility: f64,
    test: PhantomData<fn() -> T>,
}

impl<C, T, F> BuildRow for PairRows<'_, C, T, F>
where
    C: CandidateSearch,
    T: DistanceTest,
    F: Fn(usize, usize) -> f64 + Sync,
{
    #[inline(always)]
    fn row<V: Value>(&self, row: usize, entries: &mut RowWriter<'_, V>) -> f64 {
        let PairRows { near, kernel, coefficient, .. } = self;
        let Unknowns { label, rows, row_of, .. } = self.unknowns;
        let (i, mut sum) = (rows[row] as usize, 0.0);
        if let Some(missing) = self.missing {
            sum = coefficient(i, i) * missing[row];
            near.for_each_neighbor::<T>(i, kernel.radius_m, |j, _, r| {
                if row_of[j] != NONE {
                    let c = coefficient(i, j) * kernel.weight(r);
                    sum += c;
                    entries.push(row_of[j], -c);
                }
            });
        } else {
            near.for_each_neighbor::<T>(i, kernel.radius_m, |j, _, r| match label[j] {
                Label::Outside => {}
                Label::Surface => sum += coefficient(i, j) * kernel.weight(r),
                Label::Inner => {
                    let c = coefficient(i, j) * kernel.weight(r);
                    sum += c;
                    entries.push(row_of[j], -c);
                }
            });
        }
        if sum == 0.0 && self.alone_may_be {
            sum = coefficient(i, i);
        }
        sum + self.compressibility
    }
}
