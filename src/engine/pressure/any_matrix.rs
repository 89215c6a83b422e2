//! The matrix with its values in the precision that was asked for.
//!
//! Which one is asked a block of rows at a time, so that all that stands around the matrix is compiled once.

use crate::base::parallel::Workers;
use crate::engine::pressure::matrix::{RowWriter, SparseMatrix, Storage};
use crate::engine::pressure::system_matrix::SystemMatrix;
use crate::engine::pressure::values::{MatrixValues, Value};

#[derive(Debug)]
pub enum AnyMatrix {
    F64(SparseMatrix<f64>),
    F32(SparseMatrix<f32>),
}

/// Builds rows of any precision.
pub trait BuildRow: Sync {
    /// Pushes the entries of a row beside its diagonal; returns the diagonal.
    fn row<V: Value>(&self, row: usize, entries: &mut RowWriter<'_, V>) -> f64;
}

/// The same of whichever matrix it is.
macro_rules! whichever {
    ($any:expr, $matrix:ident => $value:expr) => {
        match $any {
            AnyMatrix::F64($matrix) => $value,
            AnyMatrix::F32($matrix) => $value,
        }
    };
}

impl AnyMatrix {
    pub fn new(values: MatrixValues, storage: Storage, width: usize) -> Self {
        match values {
            MatrixValues::F64 => AnyMatrix::F64(SparseMatrix::new(storage, width)),
            MatrixValues::F32 => AnyMatrix::F32(SparseMatrix::new(storage, width)),
        }
    }

    pub fn assemble(&mut self, rows: usize, workers: &Workers, build: &impl BuildRow) {
        whichever!(self, matrix => matrix.assemble(rows, workers, |row, entries| build.row(row, entries)));
    }

    pub fn diagonal_mut(&mut self) -> &mut [f64] {
        whichever!(self, matrix => &mut matrix.diagonal)
    }

    /// `(A x)_row`.
    pub fn row_product(&self, row: usize, x: &[f64]) -> f64 {
        whichever!(self, matrix => matrix.row_product(row, x))
    }

    /// Entries beside the diagonal.
    pub fn entries(&self) -> usize {
        whichever!(self, matrix => matrix.entries())
    }

    pub fn bytes(&self) -> usize {
        whichever!(self, matrix => matrix.bytes())
    }
}

impl SystemMatrix for AnyMatrix {
    fn rows(&self) -> usize {
        whichever!(self, matrix => matrix.rows())
    }

    fn diagonal(&self) -> &[f64] {
        whichever!(self, matrix => matrix.diagonal())
    }

    fn multiply_rows(&self, first: usize, x: &[f64], y: &mut [f64]) {
        whichever!(self, matrix => matrix.multiply_rows(first, x, y));
    }

    fn for_each_entry(&self, row: usize, visit: impl FnMut(u32, f64)) {
        whichever!(self, matrix => matrix.for_each_entry(row, visit));
    }
}
