//! What is written while a simulation runs, and when.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};

use crate::base::files::write_whole;
use crate::base::input::InputError;
use crate::cli::simulate::folder::Folder;
use crate::engine::parameters::Parameters;
use crate::engine::particles::{InitialParticle, Particles};
use crate::engine::simulation::Simulation;
use crate::report::picture::{self, Painter, Range};
use crate::scene::output::Moment;
use crate::scene::output::probes::ProbeFile;
use crate::scene::output::pvd::Series;
use crate::scene::probe::Probes;
use crate::scene::{Scene, checkpoint, snapshot};

#[derive(Debug, Args)]
pub struct OutputArgs {
    /// Write particles and pictures after every K-th step, not only after the last
    #[arg(long, value_name = "K", requires = "output")]
    every: Option<usize>,
    /// The same every so many seconds of simulated time
    #[arg(long, value_name = "SECONDS", requires = "output", conflicts_with = "every")]
    every_s: Option<f64>,
    /// Folder for particles, pictures and probes; those of a former simulation in it are replaced
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Formats of the particles: csv reads back to the same bits, vtu (with particles.pvd) opens in ParaView
    #[arg(long, value_enum, value_delimiter = ',', default_value = "csv")]
    format: Vec<Format>,
    /// Keep particles that left the domain in vtu files
    #[arg(long)]
    with_ghosts: bool,
    /// Write pictures of the particles, too (PNG)
    #[arg(long, requires = "output")]
    frames: bool,
    /// Field that colours the fluid in pictures [default: speed]
    #[arg(long, value_name = "FIELD", requires = "frames")]
    color: Option<String>,
    /// Values at the ends of the colours [default: what each picture needs]
    #[arg(long, value_name = "LOW:HIGH", requires = "frames", allow_hyphen_values = true)]
    color_range: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    Csv,
    Vtu,
    /// No particles: pictures or probes only
    None,
}

/// When particles and pictures are due, beside the end.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Cadence {
    AtTheEnd,
    Steps(usize),
    Seconds(f64),
}

impl Cadence {
    /// Whether a step that went from one simulated time to the next is one to write. Rounding of sums of time steps must
    /// not shift a moment by a step.
    fn is_due(self, step: usize, before_s: f64, time_s: f64) -> bool {
        let passed = |time_s: f64, every_s: f64| (time_s / every_s + 1e-9).floor();
        match self {
            Cadence::AtTheEnd => false,
            Cadence::Steps(every) => step.is_multiple_of(every),
            Cadence::Seconds(every_s) => passed(time_s, every_s) > passed(before_s, every_s),
        }
    }
}

impl OutputArgs {
    /// Refuses what cannot be used before any work is done. `None` where nothing is to be written.
    pub fn folder(&self) -> Result<Option<Folder>> {
        let refused = |key: &str, found: String, allowed: &str| {
            Err(InputError::new("command line", key, found, allowed).into())
        };
        if let Some(0) = self.every {
            return refused("--every", "0".to_string(), "allowed are numbers from 1 up");
        }
        if let Some(every_s) = self.every_s.filter(|every_s| !(every_s.is_finite() && *every_s > 0.0)) {
            return refused(
                "--every-s",
                every_s.to_string(),
                "allowed are finite numbers of seconds above 0",
            );
        }
        if self.format.contains(&Format::None) && self.format.len() > 1 {
            let allowed = "allowed are `none` alone, or csv and vtu";
            return refused("--format", "`none` beside other formats".to_string(), allowed);
        }
        self.color_range()?;
        self.output.as_deref().map(Folder::check).transpose()
    }

    fn color_range(&self) -> Result<Option<Range>, InputError> {
        let read = |text: &String| {
            text.parse().map_err(|allowed| {
                InputError::new("command line", "--color-range", format!("`{text}`"), allowed)
            })
        };
        self.color_range.as_ref().map(read).transpose()
    }

    fn cadence(&self) -> Cadence {
        match (self.every, self.every_s) {
            (Some(every), _) => Cadence::Steps(every),
            (None, Some(every_s)) => Cadence::Seconds(every_s),
            (None, None) => Cadence::AtTheEnd,
        }
    }
}

/// The files of a simulation that runs.
#[derive(Debug)]
pub struct Outputs {
    folder: PathBuf,
    cadence: Cadence,
    csv: bool,
    series: Option<Series>,
    painter: Option<Painter>,
    probes: Option<(Probes, ProbeFile)>,
    before_s: f64,
    checkpoint_every: Option<usize>,
}

impl Outputs {
    /// Holds what is asked for against the scene, and only then clears the folder. `file` names the scene in errors.
    pub fn new(
        args: &OutputArgs,
        checkpoint_every: Option<usize>,
        folder: Folder,
        (scene, file): (&Scene, &str),
        initial: &[InitialParticle],
        particles: &Particles,
    ) -> Result<Outputs> {
        let groups = scene.geometry.group_names();
        let number = |name: &str| groups.iter().position(|group| group == name).map(|k| k as u8);
        let probes = Probes::new(scene, file, initial, &number)?;
        let color = args.color.as_deref().unwrap_or("speed");
        let range = args.color_range()?;
        let painter =
            args.frames.then(|| Painter::new(&scene.name, initial, scene.particle_distance_m, color, range));
        if let Some(painter) = &painter {
            painter.check(particles)?;
        }
        let folder = folder.clear()?;
        let has = |format: Format| args.format.contains(&format);
        Ok(Outputs {
            cadence: args.cadence(),
            csv: has(Format::Csv),
            series: has(Format::Vtu).then(|| Series::new(&folder, args.with_ghosts)),
            painter,
            probes: match probes.is_empty() {
                true => None,
                false => {
                    let columns = probes.columns();
                    Some((probes, ProbeFile::create(&folder, &columns)?))
                }
            },
            folder,
            before_s: 0.0,
            checkpoint_every,
        })
    }

    /// The particles as they start. Series and pictures that have a cadence begin with them.
    pub fn start(&mut self, moment: &Moment<'_>) -> Result<()> {
        self.before_s = moment.time_s;
        self.probe(moment)?;
        if self.cadence != Cadence::AtTheEnd {
            self.show(moment)?;
        }
        Ok(())
    }

    /// The particles after a step.
    pub fn step(&mut self, moment: &Moment<'_>, is_last: bool) -> Result<()> {
        self.probe(moment)?;
        let before_s = std::mem::replace(&mut self.before_s, moment.time_s);
        if is_last || self.cadence.is_due(moment.step, before_s, moment.time_s) {
            self.particles(moment)?;
            self.show(moment)?;
        }
        Ok(())
    }

    /// The end of a simulation without a step: its particles as they start.
    pub fn only(&mut self, moment: &Moment<'_>) -> Result<()> {
        self.particles(moment)?;
        if self.cadence == Cadence::AtTheEnd { self.show(moment) } else { Ok(()) }
    }

    /// The whole state, where it is due, in place of the one before.
    pub fn keep(
        &self,
        step: usize,
        is_last: bool,
        simulation: &mut dyn Simulation,
        parameters: &Parameters,
    ) -> Result<()> {
        match self.checkpoint_every {
            Some(every) if is_last || step.is_multiple_of(every) => {
                checkpoint::write(&self.folder.join(checkpoint::FILE_NAME), simulation, parameters)
            }
            _ => Ok(()),
        }
    }

    pub fn finish(self) -> Result<()> {
        self.probes.map_or(Ok(()), |(_, file)| file.finish())
    }

    fn probe(&mut self, moment: &Moment<'_>) -> Result<()> {
        if let Some((probes, file)) = &mut self.probes
            && let Some(row) = probes.look(moment.step, moment.time_s, moment.particles)
        {
            file.add(moment.step, moment.time_s, &row)?;
        }
        Ok(())
    }

    fn particles(&self, moment: &Moment<'_>) -> Result<()> {
        if self.csv {
            snapshot::write(&self.folder.join(snapshot::file_name(moment.step)), moment.particles)?;
        }
        Ok(())
    }

    fn show(&mut self, moment: &Moment<'_>) -> Result<()> {
        if let Some(series) = &mut self.series {
            series.add(moment)?;
        }
        if let Some(painter) = &self.painter {
            let path = self.folder.join(picture::file_name(moment.step));
            write_whole(&path, &painter.paint(moment)?)
                .with_context(|| format!("cannot write {}", path.display()))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cadence_in_seconds_hits_each_multiple_once() {
        let due = |every_s: f64, dt: f64| {
            let step = |k: usize| {
                let (before_s, time_s) = ((k - 1) as f64 * dt, k as f64 * dt);
                Cadence::Seconds(every_s).is_due(k, before_s, time_s).then_some(k)
            };
            (1..=12).filter_map(step).collect::<Vec<_>>()
        };
        assert_eq!(due(0.3, 0.1), [3, 6, 9, 12], "0.1 + 0.2 and its kin do not shift a moment");
        assert_eq!(due(0.25, 0.1), [3, 5, 8, 10]);
        assert_eq!(due(0.01, 0.1), (1..=12).collect::<Vec<_>>(), "at most one a step");
        assert!(Cadence::Steps(4).is_due(8, 0.0, 0.0) && !Cadence::AtTheEnd.is_due(8, 0.0, 0.0));
    }
}
