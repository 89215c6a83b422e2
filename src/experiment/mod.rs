//! Experiments: what to measure, and the measuring.
//!
//! `spec` says what an experiment asks, with `factors` for timed cells, `observed` and `sweep` for runs to look at; `plan`
//! turns it into rounds of trials; `execute` runs them, each in a `child`, which does what `trial` or `observe`
//! says; `record` is what they leave behind, and `run` the folder that it is left in. `cluster` spreads rounds over nodes;
//! `twin` and `peaks` are kinds of trials of their own. A run folder may come from anywhere: `foreign` reads it safely, `fit` holds it to
//! its own plan.

pub mod ablation;
pub mod calibration;
pub mod child;
pub mod cluster;
pub mod execute;
pub mod factors;
mod fit;
pub mod foreign;
pub mod gate;
pub mod interrupt;
pub mod known;
pub mod library;
pub mod machine;
pub mod memory;
pub mod memory_order;
pub mod observe;
pub mod observed;
pub mod peaks;
pub mod pinning;
pub mod placement;
pub mod plan;
pub mod progress;
pub mod quantity;
pub mod record;
pub mod rounds;
pub mod run;
pub mod scene_files;
pub mod schema;
pub mod selection;
pub mod spec;
pub mod states;
pub mod stopping;
pub mod sweep;
pub mod timer;
pub mod trial;
pub mod twin;
pub mod validation;
