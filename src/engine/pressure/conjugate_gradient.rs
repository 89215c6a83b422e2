//! The conjugate gradient method (Hestenes & Stiefel 1952) for symmetric positive definite systems.
//!
//! It starts from zero and stops when the residual of its recurrence, `|A p - b|` in the 2-norm, is at most
//! `tolerance |b|`. The true residual is computed at the end: a recurrence that drifted away from it is an error, never
//! a silent acceptance. Dot products run in fixed blocks of [`BLOCK`] rows that are added in order, so that the bits do
//! not depend on the number of threads. On parts of the fluid without a surface every product is projected onto the
//! complement of the constants, where the source already is, and so are all vectors. With a preconditioner the iterations
//! are those of [`preconditioned`](super::preconditioned); start, stopping rule and final check are these.

use crate::base::parallel::{Rows, Team, Workers};
use crate::engine::pressure::enclosed::EnclosedParts;
use crate::engine::pressure::preconditioner::{AnyPreconditioner, Preconditioner, Preconditioning};
pub use crate::engine::pressure::system_matrix::BLOCK;
use crate::engine::pressure::system_matrix::{System, SystemMatrix};

/// Who computes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CgMode {
    Serial,
    Parallel,
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CgParams {
    /// Largest residual relative to the source, in the 2-norm.
    pub tolerance: f64,
    pub max_iterations: usize,
    pub mode: CgMode,
    /// Of the pressure's solve; implicit viscosity always has the diagonal.
    pub preconditioner: Preconditioning,
}

impl CgParams {
    pub const DEFAULT_TOLERANCE: f64 = 1e-8;
    pub const DEFAULT_MAX_ITERATIONS: usize = 10_000;

    /// The largest true residual that is accepted: rounding lets the recurrence run ahead of it by a little.
    fn acceptable(&self) -> f64 {
        10.0 * self.tolerance + 1e-12
    }
}

impl Default for CgParams {
    fn default() -> Self {
        CgParams {
            tolerance: Self::DEFAULT_TOLERANCE,
            max_iterations: Self::DEFAULT_MAX_ITERATIONS,
            mode: CgMode::Parallel,
            preconditioner: Preconditioning::None,
        }
    }
}

/// What a solve took.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CgInfo {
    pub iterations: usize,
    /// True residual relative to the source; 0 where the source is zero.
    pub residual: f64,
}

/// Why a solve gave no solution.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CgError {
    #[error(
        "the matrix is not positive definite (d.Ad = {curvature:e} in iteration {iteration}, relative residual \
         {residual:e})"
    )]
    NotPositiveDefinite { curvature: f64, iteration: usize, residual: f64 },
    #[error(
        "the preconditioner broke down (r.z = {slope:e} before iteration {iteration}, relative residual {residual:e}); \
         choose another `--preconditioner`"
    )]
    Preconditioner { slope: f64, iteration: usize, residual: f64 },
    #[error(
        "the incomplete factorisation broke down before iteration 1, relative residual 1: row {row} has the pivot \
         {pivot:e}; choose another `--preconditioner`"
    )]
    Pivot { row: usize, pivot: f64 },
    #[error(
        "the conjugate gradient method did not converge: relative residual {residual:e} after {iterations} iterations; \
         allow a larger `--cg-tolerance`"
    )]
    NotConverged { residual: f64, iterations: usize },
}

/// The solver and its vectors, a row an unknown.
#[derive(Debug)]
pub struct ConjugateGradient {
    pub(super) params: CgParams,
    pub(super) preconditioner: AnyPreconditioner,
    solution: Vec<f64>,
    pub(super) residual: Vec<f64>,
    pub(super) direction: Vec<f64>,
    pub(super) product: Vec<f64>,
    /// Stays empty without a preconditioner.
    pub(super) preconditioned: Vec<f64>,
    partial: Vec<f64>,
    pub(super) partial_pair: Vec<[f64; 2]>,
}

impl ConjugateGradient {
    /// A solver for particles of that distance.
    pub fn new(params: CgParams, particle_distance_m: f64) -> Self {
        ConjugateGradient {
            params,
            preconditioner: AnyPreconditioner::new(params.preconditioner, particle_distance_m),
            solution: Vec::new(),
            residual: Vec::new(),
            direction: Vec::new(),
            product: Vec::new(),
            preconditioned: Vec::new(),
            partial: Vec::new(),
            partial_pair: Vec::new(),
        }
    }

    /// The pressures of the last solve, Pa.
    pub fn solution(&self) -> &[f64] {
        &self.solution
    }

    /// Groups of rows that share columns are unequal: those of dry walls are next to nothing.
    fn team<'a>(&self, in_lanes: bool, workers: &'a Workers) -> Team<'a> {
        match self.params.mode {
            CgMode::Serial => Team::SERIAL,
            CgMode::Parallel if in_lanes => workers.dealt_out(),
            CgMode::Parallel => workers.shared_evenly(),
        }
    }

    /// Makes the pressures of each part without a surface start from zero.
    pub fn make_minima_zero(&mut self, parts: &mut EnclosedParts, workers: &Workers) {
        let team = self.team(false, workers);
        parts.subtract_minima(&mut self.solution, team);
    }

    /// Solves the system of this step.
    pub fn solve<M: SystemMatrix>(
        &mut self,
        system: &System<'_, M>,
        parts: &mut EnclosedParts,
        workers: &Workers,
    ) -> Result<CgInfo, CgError> {
        let team = self.team(M::IN_LANES, workers);
        self.start(system.source, team, workers);
        if system.quiet {
            return Ok(CgInfo::default());
        }
        let source_norm2 = blocked_dot(system.source, system.source, &mut self.partial, team);
        let iterations = match self.params.preconditioner {
            Preconditioning::None => self.iterate(system, source_norm2, parts, team)?,
            _ => self.iterate_preconditioned(system, source_norm2, parts, team, workers)?,
        };
        let residual = self.true_residual(system, parts, team) / source_norm2.sqrt();
        if residual > self.params.acceptable() || !residual.is_finite() {
            return Err(CgError::NotConverged { residual, iterations });
        }
        Ok(CgInfo { iterations, residual })
    }

    /// Iterates until the recurrence's residual is small enough; returns how often.
    fn iterate<M: SystemMatrix>(
        &mut self,
        system: &System<'_, M>,
        source_norm2: f64,
        parts: &mut EnclosedParts,
        team: Team<'_>,
    ) -> Result<usize, CgError> {
        let target = self.params.tolerance * source_norm2.sqrt();
        let (mut norm2, mut iterations) = (source_norm2, 0);
        while norm2.sqrt() > target {
            let residual = norm2.sqrt() / source_norm2.sqrt();
            if iterations == self.params.max_iterations {
                return Err(CgError::NotConverged { residual, iterations });
            }
            iterations += 1;
            let curvature = self.multiply(system.matrix, team);
            if !(curvature > 0.0 && curvature.is_finite()) {
                return Err(CgError::NotPositiveDefinite { curvature, iteration: iterations, residual });
            }
            if !parts.is_empty() {
                parts.subtract_means(&mut self.product, team);
            }
            let before = norm2;
            norm2 = self.advance(before / curvature, team);
            self.turn(norm2 / before, team);
        }
        Ok(iterations)
    }

    /// `solution = 0`, `residual = direction = source`.
    fn start(&mut self, source: &[f64], team: Team<'_>, workers: &Workers) {
        let rows = source.len();
        for vector in [&mut self.solution, &mut self.residual, &mut self.direction, &mut self.product] {
            if vector.capacity() < rows {
                *vector = workers.column(rows + rows / 8, 0.0);
            }
            vector.resize(rows, 0.0);
        }
        self.partial.resize(rows.div_ceil(BLOCK), 0.0);
        let columns = (
            Rows::of_width(&mut self.solution, BLOCK),
            Rows::of_width(&mut self.residual, BLOCK),
            Rows::of_width(&mut self.direction, BLOCK),
        );
        team.fill(columns, |blocks, (solution, residual, direction)| {
            let first = blocks.start * BLOCK;
            let source = &source[first..first + solution.len()];
            solution.fill(0.0);
            residual.copy_from_slice(source);
            direction.copy_from_slice(source);
        });
    }

    /// `product = A direction`; returns `direction . product`.
    pub(super) fn multiply<M: SystemMatrix>(&mut self, matrix: &M, team: Team<'_>) -> f64 {
        let direction = &self.direction;
        let columns = (Rows::of_width(&mut self.product, BLOCK), Rows::new(&mut self.partial));
        team.fill(columns, |blocks, (product, partial)| {
            for ((block, product), partial) in blocks.zip(product.chunks_mut(BLOCK)).zip(partial) {
                let first = block * BLOCK;
                matrix.multiply_rows(first, direction, product);
                *partial = dot(product, &direction[first..first + product.len()]);
            }
        });
        self.partial.iter().sum()
    }

    /// `solution += alpha direction`, `residual -= alpha product`; returns the residual's square.
    pub(super) fn advance(&mut self, alpha: f64, team: Team<'_>) -> f64 {
        let (direction, product) = (&self.direction, &self.product);
        let columns = (
            Rows::of_width(&mut self.solution, BLOCK),
            Rows::of_width(&mut self.residual, BLOCK),
            Rows::new(&mut self.partial),
        );
        team.fill(columns, |blocks, (solution, residual, partial)| {
            let vectors = solution.chunks_mut(BLOCK).zip(residual.chunks_mut(BLOCK)).zip(partial);
            for (block, ((solution, residual), partial)) in blocks.zip(vectors) {
                let rows = block * BLOCK..block * BLOCK + solution.len();
                for (x, d) in solution.iter_mut().zip(&direction[rows.clone()]) {
                    *x += alpha * d;
                }
                for (r, q) in residual.iter_mut().zip(&product[rows]) {
                    *r -= alpha * q;
                }
                *partial = dot(residual, residual);
            }
        });
        self.partial.iter().sum()
    }

    /// `direction = residual + beta direction`.
    fn turn(&mut self, beta: f64, team: Team<'_>) {
        let residual = &self.residual;
        team.fill(Rows::of_width(&mut self.direction, BLOCK), |blocks, direction| {
            let first = blocks.start * BLOCK;
            for (d, r) in direction.iter_mut().zip(&residual[first..]) {
                *d = r + beta * *d;
            }
        });
    }

    /// `|A solution - b|`, without what lies in the null space.
    fn true_residual<M: SystemMatrix>(
        &mut self,
        system: &System<'_, M>,
        parts: &mut EnclosedParts,
        team: Team<'_>,
    ) -> f64 {
        let solution = &self.solution;
        team.fill(Rows::of_width(&mut self.residual, BLOCK), |blocks, residual| {
            for (block, residual) in blocks.zip(residual.chunks_mut(BLOCK)) {
                system.matrix.multiply_rows(block * BLOCK, solution, residual);
                for (residual, source) in residual.iter_mut().zip(&system.source[block * BLOCK..]) {
                    *residual -= source;
                }
            }
        });
        if !parts.is_empty() {
            parts.subtract_means(&mut self.solution, team);
            parts.subtract_means(&mut self.residual, team);
        }
        blocked_dot(&self.residual, &self.residual, &mut self.partial, team).sqrt()
    }

    pub fn bytes(&self) -> usize {
        let vectors = [
            &self.solution,
            &self.residual,
            &self.direction,
            &self.product,
            &self.preconditioned,
            &self.partial,
            self.partial_pair.as_flattened(),
        ];
        vectors.map(size_of_val).iter().sum::<usize>() + self.preconditioner.bytes()
    }
}

/// `a . b` in fixed blocks.
fn blocked_dot(a: &[f64], b: &[f64], partial: &mut [f64], team: Team<'_>) -> f64 {
    team.fill(Rows::new(partial), |blocks, partial| {
        for (block, partial) in blocks.zip(partial) {
            let rows = block * BLOCK..a.len().min((block + 1) * BLOCK);
            *partial = dot(&a[rows.clone()], &b[rows]);
        }
    });
    partial.iter().sum()
}

/// `a . b` in eight interleaved strands, which the compiler may keep in vector registers.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a8, a_rest), (b8, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut strand = [0.0; 8];
    for (a, b) in a8.iter().zip(b8) {
        for k in 0..8 {
            strand[k] += a[k] * b[k];
        }
    }
    for (strand, (a, b)) in strand.iter_mut().zip(a_rest.iter().zip(b_rest)) {
        *strand += a * b;
    }
    ((strand[0] + strand[1]) + (strand[2] + strand[3])) + ((strand[4] + strand[5]) + (strand[6] + strand[7]))
}
