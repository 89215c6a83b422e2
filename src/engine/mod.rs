//! The semi-implicit MPS engine: moving particles, nothing else.
//!
//! It knows no file, no clock and no file format. Modules stand in the order in which they build on one another:
//! `particles <- kernel <- search <- terms <- {effects, pressure} <- simulation <- diagnostics`.

pub mod clustered;
pub mod columns;
pub mod curve;
pub mod diagnostics;
pub mod effects;
pub mod error;
pub mod facing;
pub mod kernel;
pub mod own_stages;
pub mod parameters;
pub mod particles;
pub mod phase;
pub mod preset;
pub mod pressure;
pub mod rotation;
pub mod search;
pub mod shared_walk;
pub mod simulation;
pub mod stage;
pub mod terms;
pub mod time_step;
pub mod viscous;
pub mod viscous_stages;
pub mod wall_leaks;
pub mod wall_mirror;
