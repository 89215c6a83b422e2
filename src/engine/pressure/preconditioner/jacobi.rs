//! The diagonal as the preconditioner: `M = D`, `z_i = r_i / A_ii` (Jacobi 1845).
//!
//! Symmetric positive definite, one multiplication a row. It evens out rows of different size, and here rows are alike but
//! for those beside the free surface: it saves a tenth of the iterations at best.

use crate::base::parallel::{Rows, Team, Workers};
use crate::engine::pressure::conjugate_gradient::CgError;
use crate::engine::pressure::preconditioner::{Places, Preconditioner};
use crate::engine::pressure::system_matrix::{BLOCK, SystemMatrix};

#[derive(Debug, Default)]
pub struct Jacobi {
    /// `1 / A_ii`.
    inverse: Vec<f64>,
}

impl Preconditioner for Jacobi {
    fn set_up<M: SystemMatrix>(
        &mut self,
        matrix: &M,
        _: Places<'_>,
        team: Team<'_>,
        _: &Workers,
    ) -> Result<(), CgError> {
        invert(matrix.diagonal(), &mut self.inverse, team);
        Ok(())
    }

    fn apply<M: SystemMatrix>(&mut self, _: &M, residual: &[f64], result: &mut [f64], team: Team<'_>) {
        let inverse = &self.inverse;
        team.fill(Rows::of_width(result, BLOCK), |blocks, result| {
            let first = blocks.start * BLOCK;
            for ((z, r), inverse) in result.iter_mut().zip(&residual[first..]).zip(&inverse[first..]) {
                *z = r * inverse;
            }
        });
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.inverse[..])
    }
}

/// `inverse = 1 / diagonal`.
pub(super) fn invert(diagonal: &[f64], inverse: &mut Vec<f64>, team: Team<'_>) {
    inverse.resize(diagonal.len(), 0.0);
    team.fill(Rows::of_width(inverse, BLOCK), |blocks, inverse| {
        for (inverse, diagonal) in inverse.iter_mut().zip(&diagonal[blocks.start * BLOCK..]) {
            *inverse = 1.0 / diagonal;
        }
    });
}
