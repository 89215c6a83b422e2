//! The coarsest system, factorised as a dense one: `A = L L^T` (Cholesky).

use crate::engine::pressure::conjugate_gradient::dot;
use crate::engine::pressure::matrix::SparseMatrix;

/// A pivot below this share of its diagonal is that of a part without a fixed value: the part's last unknown is set to
/// zero, which solves its system whenever that has a solution.
const SINGULAR: f64 = 1e-12;

#[derive(Debug, Default)]
pub struct Dense {
    /// `L` below its diagonal, row by row.
    factor: Vec<f64>,
    /// `1 / L_ii`, zero for a singular pivot.
    inverse: Vec<f64>,
}

impl Dense {
    pub fn factorise(&mut self, matrix: &SparseMatrix) {
        let rows = matrix.diagonal.len();
        self.factor.clear();
        self.factor.resize(rows * rows, 0.0);
        self.inverse.clear();
        for i in 0..rows {
            let (above, own) = self.factor.split_at_mut(i * rows);
            let (columns, values) = matrix.row(i);
            for (&j, value) in columns.iter().zip(values).filter(|(j, _)| (**j as usize) < i) {
                own[j as usize] += value;
            }
            for j in 0..i {
                let sum = own[j] - dot(&own[..j], &above[j * rows..j * rows + j]);
                own[j] = sum * self.inverse[j];
            }
            let pivot = matrix.diagonal[i] - dot(&own[..i], &own[..i]);
            let regular = pivot > SINGULAR * matrix.diagonal[i];
            self.inverse.push(if regular { 1.0 / pivot.sqrt() } else { 0.0 });
        }
    }

    /// Turns the right-hand side into the solution.
    pub fn solve(&self, x: &mut [f64]) {
        let rows = x.len();
        for i in 0..rows {
            x[i] = (x[i] - dot(&self.factor[i * rows..i * rows + i], &x[..i])) * self.inverse[i];
        }
        for i in (0..rows).rev() {
            x[i] *= self.inverse[i];
            let here = x[i];
            for (x, l) in x[..i].iter_mut().zip(&self.factor[i * rows..]) {
                *x -= l * here;
            }
        }
    }

    pub fn bytes(&self) -> usize {
        (self.factor.capacity() + self.inverse.capacity()) * size_of::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::parallel::Workers;
    use crate::engine::pressure::matrix::Storage;

    /// Two chains, one fixed at an end and one that is not.
    #[test]
    fn a_singular_part_leaves_the_other_its_solution() {
        let workers = Workers::new(1, "static".parse().unwrap(), &[]).unwrap();
        let mut matrix = SparseMatrix::<f64>::new(Storage::Csr, 2);
        let inside = |row: usize| !row.is_multiple_of(5);
        matrix.assemble(10, &workers, |row, entries| {
            let mut diagonal = if row == 0 { 1.0 } else { 0.0 };
            for other in [inside(row).then(|| row - 1), Some(row + 1).filter(|&next| inside(next))] {
                other.into_iter().for_each(|other| {
                    entries.push(other as u32, -1.0);
                    diagonal += 1.0;
                });
            }
            diagonal
        });
        let known: Vec<f64> = (0..10).map(|row| (row * row) as f64).collect();
        let mut x: Vec<f64> = (0..10).map(|row| matrix.row_product(row, &known)).collect();
        let mut dense = Dense::default();
        dense.factorise(&matrix);
        assert_eq!(dense.inverse.iter().filter(|&&inverse| inverse == 0.0).count(), 1);
        dense.solve(&mut x);
        for (row, x) in x.iter().enumerate() {
            let expected = if row < 5 { known[row] } else { known[row] - known[9] };
            assert!((x - expected).abs() < 1e-10, "row {row}: {x} instead of {expected}");
        }
    }
}
