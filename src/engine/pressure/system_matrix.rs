//! What the solver knows of a matrix, whatever its storage.

use crate::base::parallel::{Rows, Team};
use crate::engine::pressure::preconditioner::two_level::lanes::{LaneBoxes, RowBoxes};

/// Rows that one call of [`SystemMatrix::multiply_rows`] gets at most, and whose product with a vector is summed as one.
/// Calls begin at multiples of it.
pub const BLOCK: usize = 256;

/// A symmetric positive (semi)definite matrix: the diagonal apart, and of each row the entries beside it.
///
/// The numbering of rows is the storage's own business: a storage that sorts particles numbers rows in that order and has
/// source, solution and the particle of each row in the same one. A row that counts for nothing (padding, or a particle
/// without an unknown) has the diagonal 1, no entries, no entry of another row pointing to it, and the source 0: its
/// solution is then 0, and it has [no particle](super::preconditioner::Places).
pub trait SystemMatrix: Sync {
    /// Rows, those that count for nothing among them.
    fn rows(&self) -> usize;

    /// A number a row.
    fn diagonal(&self) -> &[f64];

    /// `y = A x` for the rows from `first` on, as many as `y` is long: one block. Each row is summed in an order that depends
    /// on the row alone, so that the bits do not depend on who multiplies what.
    fn multiply_rows(&self, first: usize, x: &[f64], y: &mut [f64]);

    /// Shows the column and the value of each entry beside the diagonal, always in the same order; none twice, unless a period is
    /// shorter than two radii: a particle then meets another from both sides, and the entries of one column add up.
    fn for_each_entry(&self, row: usize, visit: impl FnMut(u32, f64));

    /// Whether eight rows at a time share their columns, so that [`add_up_by_box`](SystemMatrix::add_up_by_box) is there.
    const IN_LANES: bool = false;

    /// Adds the columns of each group of rows up by box.
    fn add_up_by_box(&self, _boxes: RowBoxes<'_>, _into: &mut LaneBoxes, _team: Team<'_>) {}

    /// `y = A x`.
    fn multiply(&self, x: &[f64], y: &mut [f64], team: Team<'_>) {
        team.fill(Rows::of_width(y, BLOCK), |blocks, y| {
            for (block, y) in blocks.zip(y.chunks_mut(BLOCK)) {
                self.multiply_rows(block * BLOCK, x, y);
            }
        });
    }
}

/// A system of equations and what may be known of its rows.
#[derive(Debug)]
pub struct System<'a, M> {
    pub matrix: &'a M,
    pub source: &'a [f64],
    /// Whether the whole source is rounding noise, so that the solution is zero.
    pub quiet: bool,
    pub places: super::preconditioner::Places<'a>,
}
