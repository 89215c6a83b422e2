//! Scenes: what to simulate, as a TOML file says it.

pub mod geometry;
pub mod library;
pub mod output;
pub mod probe;
pub mod snapshot;
pub mod spec;

pub use spec::Scene;
