//! One observed run: a scene from its start to its end, and what is seen on the way.
//!
//! Only the steps are timed; looking happens between them. A run that breaks down is an observation too: it says where
//! and why, and has the numbers up to there.

mod front;
mod profile;
mod watch;

use std::sync::Arc;
use std::time::Instant;

use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};

use crate::base::parallel::Workers;
use crate::engine::diagnostics::digest;
use crate::engine::error::SimulationError;
use crate::engine::phase::NoProbe;
use crate::engine::simulation::{self, Simulation, Start};
use crate::experiment::interrupt;
use crate::experiment::known::known_digests;
use crate::experiment::pinning::pin_order;
use crate::experiment::quantity::Quantity;
use crate::experiment::record::{Observation, Variant};
use crate::scene::library;
use watch::Watch;

/// What to simulate.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObserveRequest {
    pub scene: String,
    pub sets: Vec<String>,
    pub variant: Variant,
    pub threads: usize,
    pub pin: String,
}

/// Simulates the scene and looks after every step.
pub fn run(request: &ObserveRequest) -> Result<Observation> {
    let sets = [&request.sets[..], &request.variant.scene_changes].concat();
    let scene = library::load(&request.scene, &sets)?;
    let initial = scene.particles(&request.scene)?;
    let (parameters, options) = (scene.parameters(&initial), request.variant.options("trial")?);
    let workers = Arc::new(Workers::new(request.threads, options.schedule, &pin_order(&request.pin)?)?);
    let threads_observed = workers.threads();
    let initial = request.variant.memory_order("trial")?.arrange(&initial, &parameters)?;
    let start = Start { particles: &initial, steps_done: 0 };
    let mut simulation = simulation::build(&parameters, &options, start, workers)?;
    let bytes = |simulation: &dyn Simulation| simulation.bytes() as f64 / initial.len() as f64;
    let column_bytes = bytes(&*simulation);
    let mut watch = Watch::new(&initial, &parameters, scene.steps());
    let (mut stepping_s, mut error) = (0.0, None);
    for _ in 0..scene.steps() {
        interrupt::check()?;
        let began = Instant::now();
        let step = simulation.step(&mut NoProbe);
        stepping_s += began.elapsed().as_secs_f64();
        match step {
            Ok(report) => watch.look(simulation.particles(), report),
            Err(broken) => {
                error = Some(broken);
                break;
            }
        }
    }
    let end_digest = if error.is_none() { digest(simulation.particles()) } else { String::new() };
    for known in known_digests(&scene, &request.variant).iter().filter(|known| known.step == watch.steps_done)
    {
        let expected = &known.digest;
        ensure!(end_digest == *expected, "the run ends in the state {end_digest}, expected {expected}");
    }
    let mut quantities = watch.quantities();
    // A number that is none would not survive being written down.
    quantities.retain(|_, value| value.is_finite());
    quantities.insert(Quantity::ColumnBytes, column_bytes);
    quantities.insert(Quantity::BytesPerParticle, bytes(&*simulation));
    Ok(Observation {
        threads_observed,
        particles: initial.len(),
        ended: error.as_ref().map_or(Observation::COMPLETED, kind_of).to_string(),
        error: error.as_ref().map(ToString::to_string).unwrap_or_default(),
        steps: watch.steps_done,
        time_step_s: parameters.time_step_s,
        stepping_s,
        quantities,
        digest: end_digest,
        front: watch.front.samples,
    })
}

fn kind_of(error: &SimulationError) -> &'static str {
    match error {
        SimulationError::Coincident { .. } => "coincident",
        SimulationError::NotFinite { .. } => "not_finite",
        SimulationError::StepTooShort { .. } => "step_too_short",
        SimulationError::ReserveExhausted { .. } => "reserve_exhausted",
        SimulationError::Solver { .. } => "solver",
    }
}
