//! The flags that say how a simulation is computed.

use std::sync::Arc;

use anyhow::Result;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};

use crate::base::input::InputError;
use crate::base::parallel::{MAX_THREADS, Workers};
use crate::base::schedule::Schedule;
use crate::engine::preset::{DryWalls, Options, PairTerms, Preset, Test};
use crate::engine::pressure::conjugate_gradient::CgMode;
use crate::engine::pressure::matrix::Storage;
use crate::engine::pressure::preconditioner::Preconditioning;
use crate::engine::pressure::values::MatrixValues;
use crate::experiment::pinning::pin_order;
use crate::experiment::record::{checked_buckets, checked_tolerance};

#[derive(Debug, Args)]
pub struct EngineOptions {
    /// Set of options by name; see `repro list`
    #[arg(long, default_value = Preset::GENERAL.name(), value_parser = presets())]
    preset: Preset,
    /// Worker threads
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// Loop schedule: static, dynamic:<chunk>, guided:<chunk> or rayon:<chunk> [default: the preset's, dynamic:64]
    #[arg(long)]
    schedule: Option<Schedule>,
    /// Pin threads to cores: one a physical core before any sibling
    #[arg(long, value_enum, default_value_t = Pin::Off)]
    pin: Pin,
    /// How distances are compared: sqrt (the paper's) or squared [default: the preset's]
    #[arg(long)]
    distance_test: Option<Test>,
    /// Buckets side by side that are as long as the largest radius, 1 to 4: a walk visits 27, 125, 343 or 729
    #[arg(long, default_value_t = 1)]
    buckets_per_radius: usize,
    /// Matrix storage: ell or csr [default: the preset's]
    #[arg(long)]
    storage: Option<Storage>,
    /// Precision of the pressure's matrix beside its diagonal: f64 or f32 [default: the preset's]
    #[arg(long)]
    matrix_values: Option<MatrixValues>,
    /// Walks over the pairs of one radius: separate, shared by all effects, or joined: shared, with room for those that
    /// are not named [default: the preset's]
    #[arg(long)]
    pair_terms: Option<PairTerms>,
    /// Pressures of walls that no fluid comes near: solved like all others, or known, which clusters alone can do [default: the
    /// preset's]
    #[arg(long)]
    dry_walls: Option<DryWalls>,
    /// Who runs the conjugate gradient method
    #[arg(long, value_enum, default_value_t = Cg::Parallel)]
    cg: Cg,
    /// Relative residual at which the conjugate gradient method stops [default: 1e-8]
    #[arg(long)]
    cg_tolerance: Option<f64>,
    /// Preconditioner of the pressure's solve: none, jacobi, ssor, ic0 or two-level [default: the preset's]
    #[arg(long)]
    preconditioner: Option<Preconditioning>,
}

/// Reads a preset's name; a shell that completes knows them all.
fn presets() -> impl TypedValueParser<Value = Preset> {
    PossibleValuesParser::new(Preset::all().map(Preset::name))
        .map(|name| name.parse().expect("each of these names a preset"))
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Pin {
    Off,
    Close,
    Spread,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Cg {
    Serial,
    Parallel,
}

impl EngineOptions {
    /// The preset's options with these changes.
    pub fn resolve(&self) -> Result<Options, InputError> {
        if !(1..=MAX_THREADS).contains(&self.threads) {
            let allowed = format!("allowed are 1 to {MAX_THREADS}");
            return Err(InputError::new("command line", "--threads", self.threads, allowed));
        }
        let mut options = self.preset.options();
        options.schedule = self.schedule.unwrap_or(options.schedule);
        options.distance_test = self.distance_test.unwrap_or(options.distance_test);
        options.buckets_per_radius = checked_buckets("command line", self.buckets_per_radius)?;
        options.storage = self.storage.unwrap_or(options.storage);
        options.matrix_values = self.matrix_values.unwrap_or(options.matrix_values);
        options.cg.preconditioner = self.preconditioner.unwrap_or(options.cg.preconditioner);
        options.pair_terms = self.pair_terms.unwrap_or(options.pair_terms);
        options.dry_walls = self.dry_walls.unwrap_or(options.dry_walls);
        options.cg.mode = match self.cg {
            Cg::Serial => CgMode::Serial,
            Cg::Parallel => CgMode::Parallel,
        };
        if let Some(tolerance) = self.cg_tolerance {
            options.cg.tolerance = checked_tolerance("command line", tolerance)?;
        }
        Ok(options)
    }

    /// The threads that compute.
    pub fn workers(&self, schedule: Schedule) -> Result<Arc<Workers>> {
        let cpus = match self.pin {
            Pin::Off => Vec::new(),
            Pin::Close => pin_order("close")?,
            Pin::Spread => pin_order("spread")?,
        };
        Ok(Arc::new(Workers::new(self.threads, schedule, &cpus)?))
    }
}
