//! Sparse symmetric matrices by rows, in two storages that hold the same numbers.

use std::fmt;
use std::str::FromStr;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::base::parallel::{Rows, Team, Workers};
use crate::base::prefetch::prefetch;
use crate::engine::pressure::system_matrix::SystemMatrix;
use crate::engine::pressure::values::Value;

/// How many rows ahead a product asks for memory. Padded rows are short runs with gaps, in which the processor's own
/// prefetching never gets going: the hint is what keeps ELL from being a straw man beside CSR.
const PREFETCH_ROWS: usize = 4;

/// How rows lie in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Storage {
    /// Rows padded to the longest one, each row's length kept: our reading of the paper's "extended ELL".
    Ell,
    /// Rows packed one behind the other within the range of rows that one worker assembles; each row's start and
    /// length are kept (the four-array form of compressed sparse rows).
    Csr,
}

impl Storage {
    pub const ALLOWED: &'static str = "`ell` or `csr`";
}

impl fmt::Display for Storage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Storage::Ell => "ell",
            Storage::Csr => "csr",
        })
    }
}

impl FromStr for Storage {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "ell" => Ok(Storage::Ell),
            "csr" => Ok(Storage::Csr),
            _ => Err(format!("`{text}` is no matrix storage: allowed are {}", Storage::ALLOWED)),
        }
    }
}

/// A square matrix: the diagonal apart, and of each row the entries beside it.
#[derive(Debug)]
pub struct SparseMatrix<V = f64> {
    storage: Storage,
    /// Room for the entries of a row.
    width: usize,
    pub diagonal: Vec<f64>,
    start: Vec<usize>,
    len: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<V>,
}

/// Takes the entries of one row.
#[derive(Debug)]
pub struct RowWriter<'a, V = f64> {
    columns: &'a mut [u32],
    values: &'a mut [V],
    len: usize,
    /// What rounding took from the sum of the entries.
    lost: f64,
}

impl<V: Value> RowWriter<'_, V> {
    /// Adds an entry. One beyond the row's room is counted, and the whole assembly repeated with wider rows.
    #[inline(always)]
    pub fn push(&mut self, column: u32, value: f64) {
        let kept = V::rounded(value);
        if V::ROUNDS {
            self.lost += value - kept.widened();
        }
        if self.len < self.columns.len() {
            (self.columns[self.len], self.values[self.len]) = (column, kept);
        }
        self.len += 1;
    }
}

impl<V: Value> SparseMatrix<V> {
    /// An empty matrix whose rows have room for `width` entries until a longer one turns up.
    pub fn new(storage: Storage, width: usize) -> Self {
        SparseMatrix {
            storage,
            width: width.max(1),
            diagonal: Vec::new(),
            start: Vec::new(),
            len: Vec::new(),
            columns: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Entries beside the diagonal.
    pub fn entries(&self) -> usize {
        self.len.iter().map(|&len| len as usize).sum()
    }

    /// Fills `rows` rows: `build(row, writer)` pushes a row's entries and returns its diagonal, which takes up what the entries
    /// lose by rounding.
    pub fn assemble(
        &mut self,
        rows: usize,
        workers: &Workers,
        build: impl Fn(usize, &mut RowWriter<'_, V>) -> f64 + Sync,
    ) {
        self.assemble_by(rows, workers.scheduled(), workers, build);
    }

    /// The same by a team of its own.
    pub fn assemble_by(
        &mut self,
        rows: usize,
        team: Team<'_>,
        workers: &Workers,
        build: impl Fn(usize, &mut RowWriter<'_, V>) -> f64 + Sync,
    ) {
        loop {
            let longest = self.fill(rows, team, workers, &build);
            if longest <= self.width {
                return;
            }
            self.width = longest;
        }
    }

    /// One attempt at the present width; returns the length of the longest row.
    fn fill(
        &mut self,
        rows: usize,
        team: Team<'_>,
        workers: &Workers,
        build: &(impl Fn(usize, &mut RowWriter<'_, V>) -> f64 + Sync),
    ) -> usize {
        let (width, storage, longest) = (self.width, self.storage, AtomicUsize::new(0));
        self.diagonal.resize(rows, 0.0);
        self.start.resize(rows, 0);
        self.len.resize(rows, 0);
        make_room(&mut self.columns, rows * width, workers);
        make_room(&mut self.values, rows * width, workers);
        let all = (
            Rows::new(&mut self.diagonal),
            Rows::new(&mut self.start),
            Rows::new(&mut self.len),
            Rows::of_width(&mut self.columns[..rows * width], width),
            Rows::of_width(&mut self.values[..rows * width], width),
        );
        team.fill(all, |range, (diagonal, start, len, columns, values)| {
            let first = range.start * width;
            let (mut packed, mut longest_here) = (0, 0);
            for (k, row) in range.enumerate() {
                let at = match storage {
                    Storage::Ell => k * width,
                    Storage::Csr => packed,
                };
                let (columns, values) = (&mut columns[at..at + width], &mut values[at..at + width]);
                let mut writer = RowWriter { columns, values, len: 0, lost: 0.0 };
                diagonal[k] = build(row, &mut writer);
                if V::ROUNDS {
                    diagonal[k] += writer.lost;
                }
                longest_here = longest_here.max(writer.len);
                let kept = writer.len.min(width);
                (start[k], len[k]) = (first + at, kept as u32);
                packed = at + kept;
            }
            longest.fetch_max(longest_here, Ordering::Relaxed);
        });
        longest.into_inner()
    }

    /// The columns and values of a row's entries beside the diagonal.
    #[inline]
    pub fn row(&self, row: usize) -> (&[u32], &[V]) {
        let range = self.start[row]..self.start[row] + self.len[row] as usize;
        (&self.columns[range.clone()], &self.values[range])
    }

    /// `(A x)_row`, summed in four interleaved strands: the same order whoever computes it.
    #[inline]
    pub fn row_product(&self, row: usize, x: &[f64]) -> f64 {
        self.diagonal[row] * x[row] + self.entries_product(row, x)
    }

    /// The same without the diagonal.
    #[inline]
    pub fn entries_product(&self, row: usize, x: &[f64]) -> f64 {
        if let Some(&start) = self.start.get(row + PREFETCH_ROWS) {
            let ahead = start..start + self.len[row + PREFETCH_ROWS] as usize;
            prefetch(&self.columns, ahead.clone());
            prefetch(&self.values, ahead);
        }
        let range = self.start[row]..self.start[row] + self.len[row] as usize;
        let (columns, values) = (&self.columns[range.clone()], &self.values[range]);
        let ((columns4, columns_rest), (values4, values_rest)) =
            (columns.as_chunks::<4>(), values.as_chunks::<4>());
        let mut strand = [0.0; 4];
        for (column, value) in columns4.iter().zip(values4) {
            for k in 0..4 {
                strand[k] += value[k].widened() * x[column[k] as usize];
            }
        }
        for (strand, (&column, &value)) in strand.iter_mut().zip(columns_rest.iter().zip(values_rest)) {
            *strand += value.widened() * x[column as usize];
        }
        (strand[0] + strand[1]) + (strand[2] + strand[3])
    }

    pub fn bytes(&self) -> usize {
        (self.diagonal.capacity() + self.start.capacity()) * size_of::<f64>()
            + self.values.capacity() * size_of::<V>()
            + (self.len.capacity() + self.columns.capacity()) * size_of::<u32>()
    }
}

impl<V: Value> SystemMatrix for SparseMatrix<V> {
    fn rows(&self) -> usize {
        self.diagonal.len()
    }

    fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    #[inline]
    fn multiply_rows(&self, first: usize, x: &[f64], y: &mut [f64]) {
        for (k, y) in y.iter_mut().enumerate() {
            *y = self.row_product(first + k, x);
        }
    }

    #[inline]
    fn for_each_entry(&self, row: usize, mut visit: impl FnMut(u32, f64)) {
        let (columns, values) = self.row(row);
        for (&column, value) in columns.iter().zip(values) {
            visit(column, value.widened());
        }
    }
}

/// Makes `column` hold at least `len` elements, each page first touched by the thread that will multiply its rows.
fn make_room<T: Copy + Default + Send + Sync>(column: &mut Vec<T>, len: usize, workers: &Workers) {
    if column.len() < len {
        *column = workers.column(len + len / 8, T::default());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Row `i` of the test matrix: `i % 7` entries and a diagonal of 10.
    fn build<V: Value>(row: usize, writer: &mut RowWriter<'_, V>) -> f64 {
        for k in 0..row % 7 {
            writer.push(((row + 3 * k + 1) % 100) as u32, -1.0 / (k + 1) as f64);
        }
        10.0
    }

    #[test]
    fn both_storages_and_any_schedule_hold_the_same_matrix() {
        let x: Vec<f64> = (0..100).map(|i| (i as f64).sqrt()).collect();
        let expected: Vec<f64> = (0..100)
            .map(|row| {
                let sum: f64 = (0..row % 7).map(|k| -x[(row + 3 * k + 1) % 100] / (k + 1) as f64).sum();
                10.0 * x[row] + sum
            })
            .collect();
        let mut bits = Vec::new();
        for schedule in ["static", "dynamic:3", "guided:2", "rayon:5"] {
            let workers = Workers::new(2, schedule.parse().unwrap(), &[]).unwrap();
            for storage in [Storage::Ell, Storage::Csr] {
                // Room for one entry makes the first attempt fail, so that the wider repeat is tested too.
                let mut matrix = SparseMatrix::<f64>::new(storage, 1);
                matrix.assemble(100, &workers, build);
                assert_eq!(matrix.entries(), (0..100).map(|row| row % 7).sum::<usize>());
                let product: Vec<f64> = (0..100).map(|row| matrix.row_product(row, &x)).collect();
                assert!(product.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-12));
                bits.push(product.iter().map(|p| p.to_bits()).collect::<Vec<_>>());
            }
        }
        assert!(bits.iter().all(|b| *b == bits[0]));
    }
    #[test]
    fn rounded_entries_leave_the_sum_of_each_row_as_it_was() {
        let workers = Workers::new(2, "static".parse().unwrap(), &[]).unwrap();
        let (mut exact, mut rounded) =
            (SparseMatrix::<f64>::new(Storage::Csr, 7), SparseMatrix::<f32>::new(Storage::Csr, 7));
        exact.assemble(100, &workers, build);
        rounded.assemble(100, &workers, build);
        let ones = [1.0; 100];
        for row in 0..100 {
            assert!((exact.row_product(row, &ones) - rounded.row_product(row, &ones)).abs() < 1e-14);
            let values = exact.row(row).1.iter().zip(rounded.row(row).1);
            assert!(values.into_iter().all(|(a, &b)| *a as f32 == b));
        }
        assert!((0..100).any(|row| exact.diagonal[row] != rounded.diagonal[row]));
    }
}
