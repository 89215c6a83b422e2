//! The conjugate gradient method with a preconditioner `M`, in its flexible form (Golub & Ye 1999).
//!
//! `z = M^-1 r`, and the next direction is `z + beta d` with `beta = z . (r - r_before) / (r . z)_before`. For a fixed symmetric
//! `M` that is the usual `(r . z) / (r . z)_before`; written with the difference, which is `-alpha A d`, it holds for one that
//! is not quite symmetric as well, for one dot product more.

use std::mem;

use crate::base::parallel::{Rows, Team, Workers};
use crate::engine::pressure::conjugate_gradient::{CgError, ConjugateGradient, dot};
use crate::engine::pressure::enclosed::EnclosedParts;
use crate::engine::pressure::preconditioner::{AnyPreconditioner, Preconditioner};
use crate::engine::pressure::system_matrix::{BLOCK, System, SystemMatrix};

impl ConjugateGradient {
    /// Iterates until the recurrence's residual is small enough; returns how often.
    pub(super) fn iterate_preconditioned<M: SystemMatrix>(
        &mut self,
        system: &System<'_, M>,
        source_norm2: f64,
        parts: &mut EnclosedParts,
        team: Team<'_>,
        workers: &Workers,
    ) -> Result<usize, CgError> {
        self.preconditioned.resize(system.source.len(), 0.0);
        self.partial_pair.resize(system.source.len().div_ceil(BLOCK), [0.0; 2]);
        let mut preconditioner = mem::take(&mut self.preconditioner);
        let found = preconditioner
            .set_up(system.matrix, system.places, team, workers)
            .and_then(|()| self.iterate_with(&mut preconditioner, system, source_norm2, parts, team));
        self.preconditioner = preconditioner;
        found
    }

    fn iterate_with<M: SystemMatrix>(
        &mut self,
        preconditioner: &mut AnyPreconditioner,
        system: &System<'_, M>,
        source_norm2: f64,
        parts: &mut EnclosedParts,
        team: Team<'_>,
    ) -> Result<usize, CgError> {
        let target = self.params.tolerance * source_norm2.sqrt();
        let (mut norm2, mut iterations) = (source_norm2, 0);
        // What the last iteration went by, and its `r . z`.
        let (mut alpha, mut before) = (0.0, f64::INFINITY);
        while norm2.sqrt() > target {
            let residual = norm2.sqrt() / source_norm2.sqrt();
            if iterations == self.params.max_iterations {
                return Err(CgError::NotConverged { residual, iterations });
            }
            preconditioner.apply(system.matrix, &self.residual, &mut self.preconditioned, team);
            if !parts.is_empty() {
                parts.subtract_means(&mut self.preconditioned, team);
            }
            let [slope, overlap] = self.slopes(team);
            iterations += 1;
            if !(slope > 0.0 && slope.is_finite()) {
                return Err(CgError::Preconditioner { slope, iteration: iterations, residual });
            }
            let beta = if iterations == 1 { 0.0 } else { -alpha * overlap / before };
            self.turn_preconditioned(beta, team);
            let curvature = self.multiply(system.matrix, team);
            if !(curvature > 0.0 && curvature.is_finite()) {
                return Err(CgError::NotPositiveDefinite { curvature, iteration: iterations, residual });
            }
            if !parts.is_empty() {
                parts.subtract_means(&mut self.product, team);
            }
            (alpha, before) = (slope / curvature, slope);
            norm2 = self.advance(alpha, team);
        }
        Ok(iterations)
    }

    /// `r . z` and `A d . z`.
    fn slopes(&mut self, team: Team<'_>) -> [f64; 2] {
        let (residual, product, z) = (&self.residual, &self.product, &self.preconditioned);
        team.fill(Rows::new(&mut self.partial_pair), |blocks, partial| {
            for (block, partial) in blocks.zip(partial) {
                let rows = block * BLOCK..z.len().min((block + 1) * BLOCK);
                let z = &z[rows.clone()];
                *partial = [dot(&residual[rows.clone()], z), dot(&product[rows], z)];
            }
        });
        self.partial_pair.iter().fold([0.0; 2], |sum, partial| [sum[0] + partial[0], sum[1] + partial[1]])
    }

    /// `direction = z + beta direction`.
    fn turn_preconditioned(&mut self, beta: f64, team: Team<'_>) {
        let z = &self.preconditioned;
        team.fill(Rows::of_width(&mut self.direction, BLOCK), |blocks, direction| {
            let first = blocks.start * BLOCK;
            for (d, z) in direction.iter_mut().zip(&z[first..]) {
                *d = z + beta * *d;
            }
        });
    }
}
