//! Scenes: what to simulate, as a TOML file says it.

pub mod geometry;
pub mod library;
pub mod snapshot;
pub mod spec;
pub mod validation;

pub use spec::Scene;
