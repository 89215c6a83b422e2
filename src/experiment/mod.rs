//! Experiments: what to measure, and the measuring.
//!
//! `spec` says what an experiment asks; `plan` turns it into rounds of trials; `execute` runs them in child processes,
//! each of which does what `trial` says; `record` is what they leave behind, and `run` the folder that it is left in.

pub mod execute;
pub mod interrupt;
pub mod library;
pub mod machine;
pub mod memory;
pub mod plan;
pub mod record;
pub mod run;
pub mod spec;
pub mod timer;
pub mod trial;
