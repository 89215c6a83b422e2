use std::collections::BTreeMap;

use anyhow::Result;
use clap::Args;

use crate::base::input::InputError;
use crate::cli::Exit;
use crate::cli::measure::Measure;
use crate::cli::output::Output;
use crate::experiment::ablation::Ablation;
use crate::experiment::calibration::Calibration;
use crate::scene::library;

/// Seconds of wall time that a run of the scene may take where nobody says how far to simulate.
const RUN_S: f64 = 2.0;

#[derive(Debug, Args)]
pub struct Effects {
    /// A scene's name (see `repro list`) or file
    scene: String,
    /// Change a key of the scene, such as particle_distance_m=0.0375
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Simulated seconds of each run [default: as many as take some two seconds, at most the scene's end]
    #[arg(long, value_name = "SECONDS")]
    until: Option<f64>,
    /// Rounds, each with every run once
    #[arg(long, default_value_t = 9)]
    rounds: usize,
    /// Print the experiment's file instead of running it
    #[arg(long)]
    print: bool,
    #[command(flatten)]
    measure: Measure,
}

impl Effects {
    pub fn run(self, output: Output) -> Result<Exit> {
        let scene = library::load(&self.scene, &self.set)?;
        let until_s = match self.until {
            Some(until) if until > 0.0 && until <= scene.end_time_s => until,
            Some(until) => {
                let allowed =
                    format!("allowed are seconds above 0 up to the scene's end, {}", scene.end_time_s);
                return Err(InputError::new("command line", "--until", until, allowed).into());
            }
            None => {
                let particles = scene.particles(&self.scene)?.len();
                let step_s = Calibration::measure()?.stepping_s(particles, 1, 1);
                let steps = (RUN_S / step_s).floor().clamp(10.0, scene.steps() as f64);
                (steps * scene.time_step_s).min(scene.end_time_s)
            }
        };
        let sets = self.set.iter().map(|set| as_value(set)).collect::<Result<BTreeMap<_, _>, _>>()?;
        let ablation = Ablation { scene: &self.scene, sets, until_s, rounds: self.rounds };
        let experiment = ablation.experiment(&scene)?;
        if self.print {
            let text = toml::to_string(&experiment)?;
            output.show(&experiment, |out| out.write_all(text.as_bytes()))?;
            return Ok(Exit::Done);
        }
        self.measure.run_loaded(vec![experiment], &format!("effects {}", scene.name), output)
    }
}

/// A change of the command line as an experiment's file has it.
fn as_value(set: &str) -> Result<(String, toml::Value), InputError> {
    let (key, value) = set.split_once('=').ok_or_else(|| {
        InputError::new("command line", "--set", format!("`{set}`"), "allowed is `dotted.key=value`")
    })?;
    let parsed = format!("value = {value}").parse::<toml::Table>().ok().and_then(|mut t| t.remove("value"));
    Ok((key.to_string(), parsed.unwrap_or_else(|| toml::Value::String(value.to_string()))))
}
