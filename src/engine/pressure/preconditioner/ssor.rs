//! Symmetric successive over-relaxation (Young 1954; Axelsson 1972 as a preconditioner).
//!
//! With `A = L + D + L^T` and the weight `w`, `M = (D / w + L) (D / w)^-1 (D / w + L^T) / (2 - w)`: one substitution downwards,
//! one upwards. Symmetric positive definite for `0 < w < 2`; the best weight is flat between 1.2 and 1.4. Needs no memory and
//! no set-up, but each application visits every entry twice, one row after another: it saves more than half of the
//! iterations and little time. Within [ranges of rows](super::subdomain).

use crate::base::parallel::{Rows, Team, Workers};
use crate::engine::pressure::conjugate_gradient::CgError;
use crate::engine::pressure::preconditioner::jacobi::invert;
use crate::engine::pressure::preconditioner::subdomain::{self, rows_of};
use crate::engine::pressure::preconditioner::{Places, Preconditioner};
use crate::engine::pressure::system_matrix::SystemMatrix;

/// `w`.
const WEIGHT: f64 = 1.3;

#[derive(Debug, Default)]
pub struct Ssor {
    /// `1 / A_ii`.
    inverse: Vec<f64>,
}

impl Preconditioner for Ssor {
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

    fn apply<M: SystemMatrix>(&mut self, matrix: &M, residual: &[f64], result: &mut [f64], team: Team<'_>) {
        let (inverse, diagonal, count) = (&self.inverse, matrix.diagonal(), residual.len());
        team.fill(Rows::of_width(result, subdomain::ROWS), |subdomains, result| {
            for (subdomain, z) in subdomains.zip(result.chunks_mut(subdomain::ROWS)) {
                let rows = rows_of(subdomain, count);
                for row in rows.clone() {
                    let mut sum = residual[row];
                    matrix.for_each_entry(row, |column, value| {
                        let column = column as usize;
                        if column < row && column >= rows.start {
                            sum -= value * z[column - rows.start];
                        }
                    });
                    z[row - rows.start] = WEIGHT * inverse[row] * sum;
                }
                for row in rows.clone().rev() {
                    let mut sum = (2.0 - WEIGHT) / WEIGHT * diagonal[row] * z[row - rows.start];
                    matrix.for_each_entry(row, |column, value| {
                        let column = column as usize;
                        if column > row && column < rows.end {
                            sum -= value * z[column - rows.start];
                        }
                    });
                    z[row - rows.start] = WEIGHT * inverse[row] * sum;
                }
            }
        });
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.inverse[..])
    }
}
