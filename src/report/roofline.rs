//! What a loop computes and moves, by a stated model, and what a machine's peaks allow for it.
//!
//! The roofline model of Williams, Waterman & Patterson (Communications of the ACM 52, 2009): of a loop with `I` flops a byte
//! a machine that computes `P` flops and moves `B` bytes a second runs at most `min(P, I B)`. Operations and bytes are the
//! fewest that the algorithm needs, not counted ones: a vector that is used again while it is in a cache counts once a loop.

/// What a loop computes and moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Work {
    pub flops: f64,
    pub bytes: f64,
}

impl Work {
    /// Flops a byte.
    pub fn intensity(self) -> f64 {
        self.flops / self.bytes
    }

    /// The most flops a second for a machine with these peaks.
    pub fn roof(self, flops_per_s: f64, bytes_per_s: f64) -> f64 {
        flops_per_s.min(self.intensity() * bytes_per_s)
    }
}

/// A matrix as it lies in memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stored {
    pub rows: f64,
    /// Beside the diagonal, zeros that fill it up among them.
    pub values: f64,
    /// Of a value and its share of an index.
    pub bytes_a_value: f64,
}

/// Of an entry of a matrix: three differences, a square of five operations, a root, a quotient, a difference, a factor and
/// the diagonal's sum.
const FLOPS_AN_ENTRY: f64 = 13.0;
/// Of a row in an iteration beside its entries: its diagonal (2), two dot products (4) and three updates (6).
const FLOPS_A_ROW: f64 = 12.0;
/// The same in bytes: the product reads a direction and the diagonal and writes (24); each of three updates reads two
/// vectors and writes one (72).
const BYTES_A_ROW: f64 = 96.0;

/// Conjugate gradients without what a preconditioner does.
pub fn of_solve(matrix: Stored, iterations: f64) -> Work {
    Work {
        flops: iterations * (2.0 * matrix.values + FLOPS_A_ROW * matrix.rows),
        bytes: iterations * (matrix.bytes_a_value * matrix.values + BYTES_A_ROW * matrix.rows),
    }
}

/// The matrix's making: positions are read once, entries and the diagonal written.
pub fn of_assembly(matrix: Stored) -> Work {
    Work {
        flops: FLOPS_AN_ENTRY * matrix.values,
        bytes: matrix.bytes_a_value * matrix.values + (24.0 + 8.0) * matrix.rows,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_and_its_roof_are_as_counted_by_hand() {
        // Ten rows of six packed 64-bit values with 32-bit indices.
        let matrix = Stored { rows: 10.0, values: 60.0, bytes_a_value: 12.0 };
        let solve = of_solve(matrix, 3.0);
        assert_eq!(solve, Work { flops: 3.0 * (120.0 + 120.0), bytes: 3.0 * (720.0 + 960.0) });
        assert_eq!(of_assembly(matrix), Work { flops: 780.0, bytes: 720.0 + 320.0 });
        assert_eq!(solve.intensity(), 1.0 / 7.0);
        assert_eq!([solve.roof(1e9, 14e9), solve.roof(1e9, 3.5e9)], [1e9, 0.5e9]);
    }
}
