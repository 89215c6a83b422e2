//! Ranges of rows that are substituted apart from one another.
//!
//! A substitution goes from row to row and cannot be shared out. So rows are cut into fixed ranges, and entries between two
//! ranges are left out of the preconditioner (block Jacobi): each thread substitutes in ranges of its own, and the bits do not
//! depend on how many they are. Ranges are long: a whole range's neighbours lie mostly inside it.

use std::ops::Range;

/// Rows of a range.
pub const ROWS: usize = 1 << 14;

/// The rows of a range of a matrix of `rows` rows.
pub fn rows_of(subdomain: usize, rows: usize) -> Range<usize> {
    subdomain * ROWS..rows.min((subdomain + 1) * ROWS)
}
