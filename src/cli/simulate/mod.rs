//! `repro simulate`: one scene, from its start, and what is written about it.

mod ended;
mod folder;
mod outputs;
mod progress;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use crate::base::input::InputError;
use crate::cli::Exit;
use crate::cli::engine_options::EngineOptions;
use crate::cli::output::Output;
use crate::engine::diagnostics::LeakWatch;
use crate::engine::simulation::{self, Simulation, Start, StepReport};
use crate::experiment::timer::PhaseClock;
use crate::experiment::{interrupt, memory};
use crate::report::samples::write_csv;
use crate::scene::output::Moment;
use crate::scene::{Scene, library};
use ended::Ended;
use outputs::{OutputArgs, Outputs};
use progress::Progress;

#[derive(Debug, Args)]
pub struct Simulate {
    /// A scene's name (see `repro list`) or file
    scene: String,
    /// Change a key of the scene, such as particle_distance_m=0.0375
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Time steps [default: up to the scene's end time]
    #[arg(long)]
    steps: Option<usize>,
    #[command(flatten)]
    outputs: OutputArgs,
    /// File for the time of each phase
    #[arg(long)]
    timings: Option<PathBuf>,
    /// Say nothing about progress
    #[arg(long, short)]
    quiet: bool,
    #[command(flatten)]
    engine: EngineOptions,
}

/// A row of the timings.
#[derive(Debug, Serialize)]
struct Timing {
    phase: &'static str,
    calls: u64,
    time_s: f64,
}

/// What is known after the last step.
struct Done {
    last: StepReport,
    leaks: usize,
    wall_s: f64,
}

impl Simulate {
    pub fn run(self, output: Output) -> Result<Exit> {
        let scene = library::load(&self.scene, &self.set)?;
        scene.require_memory(&self.scene, 1, memory::available_bytes())?;
        let options = self.engine.resolve()?;
        let folder = self.outputs.folder()?;
        self.check_timings()?;
        let particles = scene.particles(&self.scene)?;
        let workers = self.engine.workers(options.schedule)?;
        let start = Start { particles: &particles, steps_done: 0 };
        let mut simulation = simulation::build(&scene.parameters(&particles), &options, start, workers)?;
        let mut outputs = folder
            .map(|folder| {
                let named = (&scene, self.scene.as_str());
                Outputs::new(&self.outputs, folder, named, &particles, simulation.particles())
            })
            .transpose()?;
        let mut clock = PhaseClock::default();
        let leaks = LeakWatch::new(&particles, scene.particle_distance_m);
        let done = self.advance(&scene, &mut *simulation, &mut clock, leaks, outputs.as_mut())?;
        outputs.map_or(Ok(()), Outputs::finish)?;
        self.write_timings(&clock, done.last.step as u64, done.wall_s)?;
        let ended = Ended::new(&*simulation, &done.last, done.leaks, done.wall_s);
        output.show(&ended, |out| ended.print(out))?;
        Ok(Exit::Done)
    }

    /// Refuses a file that cannot be written before any work is done.
    fn check_timings(&self) -> Result<()> {
        let Some(file) = &self.timings else {
            return Ok(());
        };
        let parent = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let probe = parent.join(format!("repro-probe.{}.part", std::process::id()));
        let writable = fs::write(&probe, b"").is_ok();
        let _ = fs::remove_file(probe);
        if (file.exists() && !file.is_file()) || !writable {
            let found = format!("`{}`", file.display());
            let allowed = "allowed is a file in a folder that exists and can be written";
            return Err(InputError::new("command line", "--timings", found, allowed).into());
        }
        Ok(())
    }

    /// All steps, with the progress line, which is gone however they end.
    fn advance(
        &self,
        scene: &Scene,
        simulation: &mut dyn Simulation,
        clock: &mut PhaseClock,
        leaks: LeakWatch,
        outputs: Option<&mut Outputs>,
    ) -> Result<Done> {
        let steps = self.steps.unwrap_or_else(|| scene.steps());
        let mut progress = Progress::new(steps, scene.particle_distance_m, self.quiet);
        let done = take_steps(steps, scene, simulation, clock, leaks, outputs, &mut progress);
        progress.finish();
        done
    }

    fn write_timings(&self, clock: &PhaseClock, steps: u64, wall_s: f64) -> Result<()> {
        let Some(file) = &self.timings else {
            return Ok(());
        };
        let mut rows: Vec<Timing> = clock
            .phases()
            .map(|(phase, time)| Timing { phase: phase.name(), calls: time.calls, time_s: time.time_s })
            .collect();
        rows.push(Timing { phase: "total", calls: steps, time_s: wall_s });
        write_csv(file, &rows)
    }
}

fn take_steps(
    steps: usize,
    scene: &Scene,
    simulation: &mut dyn Simulation,
    clock: &mut PhaseClock,
    mut leaks: LeakWatch,
    mut outputs: Option<&mut Outputs>,
    progress: &mut Progress,
) -> Result<Done> {
    let time_s = |step: usize| step as f64 * scene.time_step_s;
    let mut last = StepReport { step: 0, ghosts: 0, pressure: None };
    let mut wall_s = 0.0;
    if let Some(outputs) = &mut outputs {
        let moment = Moment { step: 0, time_s: 0.0, particles: simulation.particles() };
        outputs.start(&moment)?;
        if steps == 0 {
            outputs.only(&moment)?;
        }
    }
    for step in 1..=steps {
        interrupt::check()?;
        let began = Instant::now();
        last = simulation.step(clock)?;
        wall_s += began.elapsed().as_secs_f64();
        let particles = simulation.particles();
        leaks.look(particles);
        if let Some(outputs) = &mut outputs {
            outputs.step(&Moment { step, time_s: time_s(step), particles }, step == steps)?;
        }
        progress.step(&last, (time_s(step), scene.time_step_s), particles);
    }
    Ok(Done { last, leaks: leaks.count(), wall_s })
}
