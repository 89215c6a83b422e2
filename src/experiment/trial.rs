//! One timed trial: what a child process does.
//!
//! All variants start from the same state and compute the same steps in turn, their order shuffled anew for each step.
//! Variants that must give the same bits do: a difference in time is then a difference in how, never in what. A trial in
//! which they do not, or in which a state is not the known one, has no outcome.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Result, ensure};
use serde::{Deserialize, Serialize};

use crate::base::parallel::Workers;
use crate::base::schedule::Schedule;
use crate::engine::diagnostics::digest;
use crate::engine::particles::{InitialParticle, Kind};
use crate::engine::phase::{NoProbe, Phase};
use crate::engine::simulation::{self, Simulation, Start, StepReport};
use crate::experiment::interrupt;
use crate::experiment::machine::Noise;
use crate::experiment::observe::{self, ObserveRequest};
use crate::experiment::peaks::{self, PeaksRequest};
use crate::experiment::pinning::pin_order;
use crate::experiment::record::{
    Outcome, PhaseSample, StateDigest, StepSample, Variant, Window, WindowSample,
};
use crate::experiment::timer::PhaseClock;
use crate::experiment::twin::trial::{self as twin, TwinRequest};
use crate::experiment::validation::{self, ValidationRequest};
use crate::scene::{library, snapshot};

/// What a child process is asked to do.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TrialRequest {
    Timed(TimedRequest),
    Observed(ObserveRequest),
    Twin(TwinRequest),
    Validation(ValidationRequest),
    Peaks(PeaksRequest),
}

/// Which steps to compute in which ways.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimedRequest {
    pub scene: String,
    pub sets: Vec<String>,
    pub variants: Vec<Variant>,
    /// What the run that left the states was: variants with its answer must meet its digests.
    pub states_of: Variant,
    pub threads: usize,
    pub pin: String,
    pub windows: Vec<Window>,
    /// Where the states lie from which later windows start.
    pub states: PathBuf,
    /// Steps after which the state is written there.
    pub save_at: Vec<usize>,
    /// Steps after which the state's digest is recorded.
    pub name_at: Vec<usize>,
    /// Digests that states must have.
    pub known: Vec<StateDigest>,
    pub seed: u64,
}

/// Does what is asked, and answers in JSON.
pub fn run(request: &TrialRequest) -> Result<Vec<u8>> {
    Ok(match request {
        TrialRequest::Timed(request) => serde_json::to_vec(&run_timed(request)?)?,
        TrialRequest::Observed(request) => serde_json::to_vec(&observe::run(request)?)?,
        TrialRequest::Twin(request) => twin::run(request)?,
        TrialRequest::Validation(request) => serde_json::to_vec(&validation::run(request)?)?,
        TrialRequest::Peaks(request) => serde_json::to_vec(&peaks::measure(request)?)?,
    })
}

fn run_timed(request: &TimedRequest) -> Result<Outcome> {
    let scene = library::load(&request.scene, &request.sets)?;
    let initial = scene.particles(&request.scene)?;
    let cpus = pin_order(&request.pin)?;
    let workers = Workers::new(request.threads, Schedule::Static, &cpus)?;
    let mut trial = Trial {
        request,
        initial: &initial,
        workers: &workers,
        random: fastrand::Rng::with_seed(request.seed),
        passed: Vec::new(),
        bytes: Vec::new(),
    };
    let noise_before = Noise::sample(Path::new("/"));
    let mut samples = vec![Vec::new(); request.variants.len()];
    for window in &request.windows {
        for (variant, sample) in trial.run_window(*window)?.into_iter().enumerate() {
            samples[variant].push(sample);
        }
    }
    Ok(Outcome {
        threads_observed: workers.threads(),
        noise_before,
        noise_after: Noise::sample(Path::new("/")),
        particles: initial.len(),
        fluid_particles: initial.iter().filter(|p| p.kind == Kind::Fluid).count(),
        bytes: trial.bytes,
        samples,
        passed: trial.passed,
    })
}

struct Trial<'a> {
    request: &'a TimedRequest,
    initial: &'a [InitialParticle],
    workers: &'a Workers,
    random: fastrand::Rng,
    passed: Vec<StateDigest>,
    bytes: Vec<usize>,
}

/// A variant's simulation on its way through a window.
struct Runner {
    simulation: Box<dyn Simulation>,
    clock: PhaseClock,
    steps: Vec<StepSample>,
}

impl Trial<'_> {
    fn run_window(&mut self, window: Window) -> Result<Vec<WindowSample>> {
        let mut runners = self.start(window)?;
        let mut order: Vec<usize> = (0..runners.len()).collect();
        for step in 0..window.warmup_steps + window.steps {
            interrupt::check()?;
            self.random.shuffle(&mut order);
            for &k in &order {
                if step < window.warmup_steps {
                    runners[k].simulation.step(&mut NoProbe)?;
                } else {
                    runners[k].measured_step()?;
                }
            }
            self.pass(window.start_step + step + 1, &*runners[0].simulation)?;
        }
        self.bytes = runners.iter().map(|runner| runner.simulation.bytes()).collect();
        let digests: Vec<String> =
            runners.iter().map(|runner| digest(runner.simulation.particles())).collect();
        self.compare(window.end_step(), &digests)?;
        let samples = runners.into_iter().zip(digests);
        Ok(samples.map(|(runner, digest)| runner.into_sample(window, digest)).collect())
    }

    fn start(&self, window: Window) -> Result<Vec<Runner>> {
        let state = match window.start_step {
            0 => None,
            step => Some(snapshot::read(&self.request.states.join(snapshot::file_name(step)))?),
        };
        let particles = state.as_deref().unwrap_or(self.initial);
        let start = |variant| self.start_variant(variant, particles, window.start_step);
        self.request.variants.iter().map(start).collect()
    }

    fn start_variant(
        &self,
        variant: &Variant,
        particles: &[InitialParticle],
        steps_done: usize,
    ) -> Result<Runner> {
        let sets = [&self.request.sets[..], &variant.scene_changes].concat();
        let parameters = library::load(&self.request.scene, &sets)?.parameters(self.initial);
        let options = variant.options("trial")?;
        let arranged = variant.memory_order("trial")?.arrange(particles, &parameters)?;
        let workers = Arc::new(self.workers.with_schedule(options.schedule));
        let start = Start { particles: &arranged, steps_done };
        let simulation = simulation::build(&parameters, &options, start, workers)?;
        Ok(Runner { simulation, clock: PhaseClock::default(), steps: Vec::new() })
    }

    /// Writes or names the state after `step` if the request says so.
    fn pass(&mut self, step: usize, simulation: &dyn Simulation) -> Result<()> {
        if self.request.save_at.contains(&step) {
            let path = self.request.states.join(snapshot::file_name(step));
            snapshot::write(&path, simulation.particles())?;
        }
        if self.request.name_at.contains(&step) {
            let digest = digest(simulation.particles());
            self.passed.push(StateDigest { step, digest });
        }
        Ok(())
    }

    /// Refuses digests that differ from one another or from a known one, among variants that must end alike.
    fn compare(&self, step: usize, digests: &[String]) -> Result<()> {
        let variants = &self.request.variants;
        for (k, (variant, digest)) in variants.iter().zip(digests).enumerate() {
            let known = self.request.known.iter().find(|known| known.step == step);
            let known =
                known.filter(|_| variant.has_answer_of(&self.request.states_of)).map(|known| &known.digest);
            let twin = (0..k).find(|&twin| variants[twin].has_answer_of(variant)).map(|twin| &digests[twin]);
            for expected in known.into_iter().chain(twin) {
                ensure!(
                    digest == expected,
                    "after step {step} {} is in the state {digest}, expected {expected}: it computed something else",
                    variant.label()
                );
            }
        }
        Ok(())
    }
}

impl Runner {
    fn measured_step(&mut self) -> Result<()> {
        let cg_before = self.clock.time(Phase::Cg).time_s;
        let began = Instant::now();
        let report: StepReport = self.simulation.step(&mut self.clock)?;
        let total_s = began.elapsed().as_secs_f64();
        let solve = report.pressure;
        self.steps.push(StepSample {
            step: report.step,
            total_s,
            cg_s: self.clock.time(Phase::Cg).time_s - cg_before,
            cg_iterations: solve.map_or(0, |solve| solve.cg.iterations),
            cg_residual: solve.map_or(0.0, |solve| solve.cg.residual),
            unknowns: solve.map_or(0, |solve| solve.unknowns),
            matrix_entries: Some(solve.map_or(0, |solve| solve.matrix_entries)),
            ghosts: report.ghosts,
        });
        Ok(())
    }

    fn into_sample(self, window: Window, digest: String) -> WindowSample {
        let phases = self
            .clock
            .phases()
            .map(|(phase, time)| PhaseSample {
                phase: phase.name().to_string(),
                calls: time.calls,
                time_s: time.time_s,
            })
            .collect();
        WindowSample { window, phases, steps: self.steps, digest }
    }
}
