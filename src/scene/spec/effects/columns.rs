//! What an effect's columns take: declared beside its keys, so that memory is told before anything is built.

use crate::scene::Scene;

/// A number.
pub const SCALAR: usize = size_of::<f64>();
/// Three numbers.
pub const VECTOR: usize = 3 * SCALAR;
/// The index of a particle or a row.
pub const INDEX: usize = size_of::<u32>();

/// What columns are as long as.
#[derive(Debug, Clone, Copy)]
pub struct Counted<'a> {
    pub scene: &'a Scene,
    /// All particles, those that wait to be let in among them.
    pub particles: usize,
    /// Of these, the particles of rigid bodies.
    pub bodies: usize,
    /// Of the grid.
    pub buckets: usize,
}
