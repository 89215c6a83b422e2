//! Scenes: what to simulate, as a TOML file says it.

pub mod adviser;
pub mod checkpoint;
pub mod geometry;
pub mod library;
pub mod number_table;
pub mod output;
pub mod probe;
pub mod snapshot;
pub mod spec;
pub mod validation;

pub use spec::Scene;
