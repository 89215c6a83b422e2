//! `repro simulate`: one scene, from its start, and what is written about it.

mod advice;
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
use crate::engine::columns::Column;
use crate::engine::diagnostics::LeakWatch;
use crate::engine::parameters::Parameters;
use crate::engine::simulation::{self, Simulation, Start, StepReport};
use crate::experiment::timer::PhaseClock;
use crate::experiment::{interrupt, memory};
use crate::report::samples::write_csv;
use crate::scene::output::Moment;
use crate::scene::{Scene, checkpoint, library};
use advice::Advised;
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
    /// Go on from the state that a former simulation of the scene wrote with `--checkpoint-every`
    #[arg(long, value_name = "FILE")]
    restart: Option<PathBuf>,
    /// Write the whole state to `state.checkpoint` in the output folder after every K-th step, and after the last
    #[arg(long, value_name = "K", requires = "output")]
    checkpoint_every: Option<usize>,
    /// Simulate nothing: print the scene's dimensionless numbers and which effects they call for
    #[arg(long)]
    advise: bool,
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
    /// Those of this simulation alone, without those before a restart.
    steps: usize,
    wall_s: f64,
}

impl Simulate {
    pub fn run(self, output: Output) -> Result<Exit> {
        let scene = library::load(&self.scene, &self.set)?;
        if self.advise {
            let advised = Advised::new(&scene, &scene.particles(&self.scene)?);
            output.show(&advised, |out| advised.print(out))?;
            return Ok(Exit::Done);
        }
        scene.require_memory(&self.scene, 1, memory::available_bytes())?;
        let options = self.engine.resolve()?;
        let folder = self.outputs.folder()?;
        if let Some(0) = self.checkpoint_every {
            let allowed = "allowed are numbers from 1 up";
            return Err(InputError::new("command line", "--checkpoint-every", 0, allowed).into());
        }
        self.check_timings()?;
        let particles = scene.particles(&self.scene)?;
        let workers = self.engine.workers(options.schedule)?;
        let start = Start { particles: &particles, steps_done: 0 };
        let parameters = scene.parameters(&particles);
        let mut simulation = simulation::build(&parameters, &options, start, workers)?;
        if let Some(file) = &self.restart {
            checkpoint::restore(file, &mut *simulation, &parameters)?;
        }
        let mut outputs = folder
            .map(|folder| {
                let named = (&scene, self.scene.as_str());
                Outputs::new(
                    &self.outputs,
                    self.checkpoint_every,
                    folder,
                    named,
                    &particles,
                    simulation.particles(),
                )
            })
            .transpose()?;
        let mut clock = PhaseClock::default();
        let leaks = LeakWatch::new(&particles, scene.particle_distance_m);
        let mut course = Course { scene: &scene, parameters: &parameters, steps: self.steps, leaks };
        let mut progress = Progress::new(&scene, self.steps, self.quiet);
        let done = course.follow(&mut *simulation, &mut clock, outputs.as_mut(), &mut progress);
        progress.finish();
        let done = done?;
        outputs.map_or(Ok(()), Outputs::finish)?;
        self.write_timings(&clock, done.steps as u64, done.wall_s)?;
        let ended = Ended::new(&*simulation, &done.last, course.leaks.count(), done.wall_s);
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

/// The way from a simulation's state to its end.
struct Course<'a> {
    scene: &'a Scene,
    parameters: &'a Parameters,
    /// Those asked for; up to the scene's end where nobody asked.
    steps: Option<usize>,
    leaks: LeakWatch,
}

impl Course<'_> {
    fn follow(
        &mut self,
        simulation: &mut dyn Simulation,
        clock: &mut PhaseClock,
        mut outputs: Option<&mut Outputs>,
        progress: &mut Progress,
    ) -> Result<Done> {
        let (first, mut time_s) = now(simulation);
        let mut done =
            Done { last: StepReport { step: first, time_s, ..StepReport::default() }, steps: 0, wall_s: 0.0 };
        if let Some(outputs) = &mut outputs {
            let moment = Moment { step: first, time_s, particles: simulation.particles() };
            outputs.start(&moment)?;
            if self.is_over(&done) {
                outputs.only(&moment)?;
            }
        }
        while !self.is_over(&done) {
            interrupt::check()?;
            let began = Instant::now();
            done.last = simulation.step(clock)?;
            done.wall_s += began.elapsed().as_secs_f64();
            done.steps += 1;
            time_s = done.last.time_s;
            let (step, is_last) = (done.last.step, self.is_over(&done));
            self.leaks.look(simulation.particles());
            if let Some(outputs) = &mut outputs {
                outputs.step(&Moment { step, time_s, particles: simulation.particles() }, is_last)?;
                outputs.keep(step, is_last, simulation, self.parameters)?;
            }
            progress.step(&done.last, simulation.particles());
        }
        Ok(done)
    }

    fn is_over(&self, done: &Done) -> bool {
        match self.steps {
            Some(steps) => done.steps >= steps,
            None => self.scene.is_over(done.last.step, done.last.time_s),
        }
    }
}

/// The number of steps and the simulated time that a simulation has behind it.
fn now(simulation: &mut dyn Simulation) -> (usize, f64) {
    let (mut step, mut time_s) = (0, 0.0);
    simulation.visit(&mut |name, column| match (name, column) {
        ("step", Column::Count(count)) => step = *count,
        ("time", Column::Number(number)) => time_s = *number,
        _ => {}
    });
    (step, time_s)
}
