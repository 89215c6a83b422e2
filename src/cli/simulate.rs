use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::base::files::is_leftover;
use crate::base::input::InputError;
use crate::cli::Exit;
use crate::cli::engine_options::EngineOptions;
use crate::cli::output::Output;
use crate::engine::diagnostics::{FlowState, LeakWatch, digest};
use crate::engine::particles::Kind;
use crate::engine::simulation::{self, Simulation, Start, StepReport};
use crate::experiment::timer::PhaseClock;
use crate::experiment::{interrupt, memory};
use crate::report::samples::write_csv;
use crate::scene::{Scene, library, snapshot};

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
    /// Write the particles after every K-th step, not only after the last
    #[arg(long, value_name = "K", requires = "output")]
    every: Option<usize>,
    /// Folder for the particles; those of a former simulation in it are replaced
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Format of the particles
    #[arg(long, value_enum, default_value_t = Format::Csv)]
    format: Format,
    /// File for the time of each phase
    #[arg(long)]
    timings: Option<PathBuf>,
    #[command(flatten)]
    engine: EngineOptions,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    Csv,
}

/// A row of the timings.
#[derive(Debug, Serialize)]
struct Timing {
    phase: &'static str,
    calls: u64,
    time_s: f64,
}

impl Simulate {
    pub fn run(self, output: Output) -> Result<Exit> {
        let scene = library::load(&self.scene, &self.set)?;
        scene.require_memory(&self.scene, 1, memory::available_bytes())?;
        let options = self.engine.resolve()?;
        if let Some(0) = self.every {
            return Err(InputError::new("command line", "--every", 0, "allowed are numbers from 1 up").into());
        }
        self.prepare_outputs()?;
        let particles = scene.particles(&self.scene)?;
        let workers = self.engine.workers(options.schedule)?;
        let start = Start { particles: &particles, steps_done: 0 };
        let mut simulation = simulation::build(&scene.parameters(&particles), &options, start, workers)?;
        let mut clock = PhaseClock::default();
        let mut leaks = LeakWatch::new(&particles, scene.particle_distance_m);
        let (last, wall_s) = self.advance(&scene, &mut *simulation, &mut clock, &mut leaks)?;
        self.write_timings(&clock, last.step as u64, wall_s)?;
        let ended = Ended::new(&*simulation, &last, leaks.count(), wall_s);
        output.show(&ended, |out| ended.print(out))?;
        Ok(Exit::Done)
    }

    /// Refuses outputs that cannot be written before any work is done.
    fn prepare_outputs(&self) -> Result<()> {
        if let Some(folder) = &self.output {
            prepare_folder(folder)?;
        }
        if let Some(file) = &self.timings {
            let parent = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let probe = parent.join(format!("repro-probe.{}.part", std::process::id()));
            let writable = fs::write(&probe, b"").is_ok();
            let _ = fs::remove_file(probe);
            if (file.exists() && !file.is_file()) || !writable {
                let found = format!("`{}`", file.display());
                let allowed = "allowed is a file in a folder that exists and can be written";
                return Err(InputError::new("command line", "--timings", found, allowed).into());
            }
        }
        Ok(())
    }

    fn advance(
        &self,
        scene: &Scene,
        simulation: &mut dyn Simulation,
        clock: &mut PhaseClock,
        leaks: &mut LeakWatch,
    ) -> Result<(StepReport, f64)> {
        let steps = self.steps.unwrap_or_else(|| scene.steps());
        let style = ProgressStyle::with_template("{bar:30} step {pos}/{len}, {eta} left")
            .expect("the template is valid");
        let bar = ProgressBar::new(steps as u64).with_style(style);
        let mut last = StepReport::default();
        let mut wall_s = 0.0;
        for step in 1..=steps {
            interrupt::check()?;
            let began = std::time::Instant::now();
            last = simulation.step(clock)?;
            wall_s += began.elapsed().as_secs_f64();
            leaks.look(simulation.particles());
            bar.inc(1);
            let due = step == steps || self.every.is_some_and(|k| step % k == 0);
            if let Some(folder) = self.output.as_ref().filter(|_| due) {
                snapshot::write(&folder.join(snapshot::file_name(step)), simulation.particles())?;
            }
        }
        if let Some(folder) = self.output.as_ref().filter(|_| steps == 0) {
            snapshot::write(&folder.join(snapshot::file_name(0)), simulation.particles())?;
        }
        bar.finish_and_clear();
        Ok((last, wall_s))
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

/// The state in which a simulation ended.
#[derive(Debug, Serialize)]
struct Ended {
    particles: usize,
    particles_by_kind: BTreeMap<&'static str, usize>,
    leaks: usize,
    steps: usize,
    wall_s: f64,
    bytes_per_particle: f64,
    front_max_m: f64,
    front_p99_m: f64,
    top_m: f64,
    max_speed_m_s: f64,
    max_pressure_fluid_pa: f64,
    max_pressure_pa: f64,
    /// Of the last step; `None` where the scene names no pressure.
    pressure: Option<LastSolve>,
    digest: String,
}

#[derive(Debug, Serialize)]
struct LastSolve {
    surface: usize,
    unknowns: usize,
    cg_iterations: usize,
    cg_residual: f64,
}

impl Ended {
    fn new(simulation: &dyn Simulation, last: &StepReport, leaks: usize, wall_s: f64) -> Ended {
        let particles = simulation.particles();
        let flow = FlowState::of(particles);
        Ended {
            particles: particles.len(),
            particles_by_kind: Kind::ALL
                .into_iter()
                .map(|kind| (kind.name(), particles.count(kind)))
                .collect(),
            leaks,
            steps: last.step,
            wall_s,
            bytes_per_particle: simulation.bytes() as f64 / particles.len() as f64,
            front_max_m: flow.front_max_m,
            front_p99_m: flow.front_p99_m,
            top_m: flow.top_m,
            max_speed_m_s: flow.max_speed_m_s,
            max_pressure_fluid_pa: flow.max_pressure_fluid_pa,
            max_pressure_pa: flow.max_pressure_pa,
            pressure: last.pressure.map(|pressure| LastSolve {
                surface: pressure.surface,
                unknowns: pressure.unknowns,
                cg_iterations: pressure.cg.iterations,
                cg_residual: pressure.cg.residual,
            }),
            digest: digest(particles),
        }
    }

    fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        let counts: Vec<String> =
            self.particles_by_kind.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
        writeln!(out, "particles {} ({})", self.particles, counts.join(", "))?;
        writeln!(out, "leaks {}", self.leaks)?;
        writeln!(out, "steps {}", self.steps)?;
        writeln!(out, "wall_s {:.3}", self.wall_s)?;
        writeln!(out, "bytes_per_particle {:.0}", self.bytes_per_particle)?;
        writeln!(out, "front_max_m {:.9}", self.front_max_m)?;
        writeln!(out, "front_p99_m {:.9}", self.front_p99_m)?;
        writeln!(out, "top_m {:.9}", self.top_m)?;
        writeln!(out, "max_speed_m_s {:.6}", self.max_speed_m_s)?;
        writeln!(out, "max_pressure_fluid_pa {:.4}", self.max_pressure_fluid_pa)?;
        writeln!(out, "max_pressure_pa {:.4}", self.max_pressure_pa)?;
        if let Some(pressure) = &self.pressure {
            writeln!(out, "surface {}", pressure.surface)?;
            writeln!(out, "unknowns {}", pressure.unknowns)?;
            writeln!(out, "cg_iterations {}", pressure.cg_iterations)?;
            writeln!(out, "cg_residual {:e}", pressure.cg_residual)?;
        }
        writeln!(out, "digest {}", self.digest)
    }
}

/// Makes sure that `folder` is there, can be written and holds nothing but particles; those of a former simulation are
/// removed, so that a folder never mixes two.
fn prepare_folder(folder: &Path) -> Result<()> {
    let refused = |found: &str| {
        let found = format!("`{}`, which {found}", folder.display());
        let allowed = "allowed is a folder that is new, empty or holds only particles-*.csv";
        InputError::new("command line", "--output", found, allowed)
    };
    if folder.exists() && !folder.is_dir() {
        return Err(refused("is a file").into());
    }
    fs::create_dir_all(folder).map_err(|error| refused(&format!("cannot be created: {error}")))?;
    let mut former = Vec::new();
    let ours = |name: &str| name.starts_with("particles-") && name.ends_with(".csv") || is_leftover(name);
    for entry in fs::read_dir(folder).map_err(|error| refused(&format!("cannot be read: {error}")))? {
        let entry = entry.context("cannot list the output folder")?;
        let name = entry.file_name();
        former.push(entry.path());
        if !ours(&name.to_string_lossy()) {
            return Err(refused(&format!("holds `{}`", name.to_string_lossy())).into());
        }
    }
    let probe = folder.join(format!("particles-probe.csv.{}.part", std::process::id()));
    fs::write(&probe, b"").map_err(|error| refused(&format!("cannot be written: {error}")))?;
    let _ = fs::remove_file(probe);
    for file in former {
        fs::remove_file(&file)
            .map_err(|error| refused(&format!("holds files that cannot be removed: {error}")))?;
    }
    Ok(())
}
