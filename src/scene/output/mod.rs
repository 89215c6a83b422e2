//! What a simulation writes about its particles: their fields by name, and a file a format.
//!
//! The CSV of [`crate::scene::snapshot`] is the one format that is also read back to the same bits.

pub mod field;
pub mod probes;
pub mod pvd;
pub mod vtu;

use crate::engine::particles::Particles;

/// The particles at one moment of a simulation.
#[derive(Debug, Clone, Copy)]
pub struct Moment<'a> {
    pub step: usize,
    /// Simulated time, seconds.
    pub time_s: f64,
    pub particles: &'a Particles,
}
