//! Reruns, measures and judges a published speed-up of the neighbour search in the MPS particle method.
//!
//! ```text
//! DRIVER  experiments/*.toml -> experiment: spec -> plan -> trials in child processes -> records -> report
//! ENGINE  scenes/*.toml      -> scene -> engine: particles, search, stages of a step
//! ```
//!
//! Modules stand in the order in which they build on one another; ARCHITECTURE.md draws the whole.

pub mod base;
pub mod engine;
pub mod scene;

#[cfg(feature = "driver")]
pub mod experiment;
#[cfg(feature = "driver")]
pub mod report;

#[cfg(feature = "driver")]
pub mod cli;
