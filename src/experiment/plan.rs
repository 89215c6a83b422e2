//! From experiments to rounds of trials: which cells, in which order, and how long it will take.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

use crate::base::input::InputError;
use crate::base::parallel::Workers;
use crate::engine::phase::NoProbe;
use crate::engine::preset::Preset;
use crate::engine::simulation::{self, Start};
use crate::experiment::machine::{Topology, allowed_cpus};
use crate::experiment::memory;
use crate::experiment::record::{Stage, StateDigest, Variant, Window};
use crate::experiment::spec::{Experiment, Mode, Paired};
use crate::scene::{Scene, library};

/// Everything a run will do, in order.
#[derive(Debug, Clone)]
pub struct Plan {
    pub mode: Mode,
    pub experiments: Vec<PlannedExperiment>,
    pub rounds: Vec<PlannedRound>,
}

/// An experiment with its scene as this mode sees it.
#[derive(Debug, Clone)]
pub struct PlannedExperiment {
    pub spec: Experiment,
    pub scene: Scene,
    pub sets: Vec<String>,
    pub particles: usize,
    /// Thread counts that this machine has the cores for.
    pub threads: Vec<usize>,
    pub windows: Vec<Window>,
}

/// The trials of one round, in the order in which they run.
#[derive(Debug, Clone)]
pub struct PlannedRound {
    /// Index into [`Plan::experiments`].
    pub experiment: usize,
    pub stage: Stage,
    pub round: usize,
    pub trials: Vec<PlannedTrial>,
}

#[derive(Debug, Clone)]
pub struct PlannedTrial {
    pub threads: usize,
    pub variants: Vec<Variant>,
    pub windows: Vec<Window>,
    pub estimate_s: f64,
    /// Seeds the order of variants within a step.
    pub seed: u64,
    /// Whether the trial leaves the states from which windows start.
    pub saves_states: bool,
}

/// Seconds that a particle takes in a step on this machine: measured, not assumed.
#[derive(Debug, Clone, Copy)]
pub struct Calibration {
    pub s_per_particle_step: f64,
}

impl Calibration {
    /// Times a few steps of a coarse dam break. A later, mixed state takes about a quarter longer than these.
    pub fn measure() -> Result<Self> {
        let scene = library::load("dam-break", &["particle_distance_m=0.0375".to_string()])?;
        let particles = scene.particles("dam-break")?;
        let options = Preset::PAPER_LINKED_LIST.options();
        let workers = Arc::new(Workers::new(1, options.schedule, &[])?);
        let start = Start {
            particles: &particles,
            steps_done: 0,
        };
        let mut simulation =
            simulation::build(&scene.parameters(&particles), &options, start, workers)?;
        simulation.step(&mut NoProbe)?;
        let began = Instant::now();
        let steps = 4;
        for _ in 0..steps {
            simulation.step(&mut NoProbe)?;
        }
        let per_step = began.elapsed().as_secs_f64() / f64::from(steps);
        Ok(Calibration {
            s_per_particle_step: 1.25 * per_step / particles.len() as f64,
        })
    }

    /// Steps cost what was measured; each process and window pays a little to start.
    fn estimate_s(
        self,
        particles: usize,
        threads: usize,
        variants: usize,
        windows: &[Window],
    ) -> f64 {
        let steps: usize = windows.iter().map(|w| w.warmup_steps + w.steps).sum();
        let speed_up = 0.3 + 0.7 * threads as f64;
        let stepping = (steps * variants * particles) as f64 * self.s_per_particle_step / speed_up;
        let starting = 0.1 + windows.len() as f64 * particles as f64 * 3e-6;
        stepping + starting
    }
}

impl Plan {
    /// Plans `experiments` for this machine.
    pub fn new(experiments: Vec<Experiment>, mode: Mode, calibration: Calibration) -> Result<Plan> {
        let topology = Topology::read(Path::new("/"), &allowed_cpus());
        let usable = topology.usable_cores();
        let experiments = experiments
            .into_iter()
            .map(|spec| PlannedExperiment::new(spec, mode, usable))
            .collect::<Result<Vec<_>, InputError>>()?;
        let mut rounds = Vec::new();
        let mut states: Vec<StatesKey> = Vec::new();
        for (k, experiment) in experiments.iter().enumerate() {
            let key = experiment.states_key();
            let provided = states.contains(&key);
            if !provided {
                states.push(key);
            }
            rounds.extend(experiment.rounds(k, mode, calibration, !provided, usable));
        }
        Ok(Plan {
            mode,
            experiments,
            rounds,
        })
    }

    /// Seconds that all rounds will take.
    pub fn estimate_s(&self) -> f64 {
        self.rounds.iter().map(PlannedRound::estimate_s).sum()
    }
}

impl PlannedRound {
    pub fn estimate_s(&self) -> f64 {
        self.trials.iter().map(|trial| trial.estimate_s).sum()
    }
}

/// Experiments with the same key can start from the same states.
type StatesKey = (String, Vec<String>, Vec<Window>);

impl PlannedExperiment {
    fn new(spec: Experiment, mode: Mode, usable_cores: usize) -> Result<Self, InputError> {
        let sets = spec.measurement(mode).scene_sets();
        let scene = library::load(&spec.scene, &sets)?;
        scene.require_memory(
            &spec.scene,
            spec.variants().len(),
            memory::available_bytes(),
        )?;
        let particles = scene.particles(&spec.scene)?.len();
        let threads = spec
            .factors
            .threads
            .iter()
            .copied()
            .filter(|&t| t <= usable_cores)
            .collect();
        let windows = match &spec.measurement(mode).paired {
            Some(paired) => windows(paired, scene.steps()),
            None => Vec::new(),
        };
        Ok(PlannedExperiment {
            spec,
            scene,
            sets,
            particles,
            threads,
            windows,
        })
    }

    fn states_key(&self) -> StatesKey {
        (
            self.spec.scene.clone(),
            self.sets.clone(),
            self.windows.clone(),
        )
    }

    /// The folder of the run that holds the states of this experiment's scene.
    pub fn states_folder(&self, run: &Path) -> PathBuf {
        let name = |text: &str| -> String {
            text.chars()
                .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
                .collect()
        };
        let parts: Vec<String> = std::iter::once(&self.scene.name)
            .chain(&self.sets)
            .map(|part| name(part))
            .collect();
        run.join("states").join(parts.join("_"))
    }

    fn rounds(
        &self,
        index: usize,
        mode: Mode,
        calibration: Calibration,
        must_provide_states: bool,
        usable_cores: usize,
    ) -> Vec<PlannedRound> {
        let measurement = self.spec.measurement(mode);
        let mut must_provide_states = must_provide_states && !self.windows.is_empty();
        let mut rounds = Vec::new();
        let whole = Window {
            start_step: 0,
            warmup_steps: 0,
            steps: self.scene.steps(),
        };
        let trial = |threads: usize, variants: Vec<Variant>, windows: Vec<Window>, seed: u64| {
            PlannedTrial {
                threads,
                estimate_s: calibration.estimate_s(
                    self.particles,
                    threads,
                    variants.len(),
                    &windows,
                ),
                variants,
                windows,
                seed,
                saves_states: false,
            }
        };
        if let Some(spec) = &measurement.whole {
            for round in 0..spec.rounds {
                let mut random = self.random(Stage::Whole, round);
                let mut trials = Vec::new();
                for variant in self.spec.variants() {
                    if spec
                        .distance_test
                        .as_ref()
                        .is_none_or(|tests| tests.contains(&variant.distance_test))
                    {
                        for &threads in &self.threads {
                            trials.push(trial(
                                threads,
                                vec![variant.clone()],
                                vec![whole],
                                random.u64(..),
                            ));
                        }
                    }
                }
                random.shuffle(&mut trials);
                if must_provide_states && let Some(first) = trials.first_mut() {
                    first.saves_states = true;
                    must_provide_states = false;
                }
                rounds.push(PlannedRound {
                    experiment: index,
                    stage: Stage::Whole,
                    round,
                    trials,
                });
            }
        }
        if must_provide_states {
            let mut variant = self.spec.variants()[0].clone();
            variant.preset = Preset::PAPER_AOS_RELOCATION.name().to_string();
            variant.distance_test = "squared".to_string();
            variant.storage = "csr".to_string();
            let mut trials = vec![trial(usable_cores, vec![variant], vec![whole], 0)];
            trials[0].saves_states = true;
            rounds.insert(
                0,
                PlannedRound {
                    experiment: index,
                    stage: Stage::States,
                    round: 0,
                    trials,
                },
            );
        }
        if let Some(spec) = &measurement.paired {
            for round in 0..spec.rounds {
                let mut random = self.random(Stage::Paired, round);
                let mut trials: Vec<PlannedTrial> = self
                    .threads
                    .iter()
                    .map(|&threads| {
                        trial(
                            threads,
                            self.spec.variants(),
                            self.windows.clone(),
                            random.u64(..),
                        )
                    })
                    .collect();
                random.shuffle(&mut trials);
                rounds.push(PlannedRound {
                    experiment: index,
                    stage: Stage::Paired,
                    round,
                    trials,
                });
            }
        }
        rounds
    }

    /// The random order of one round: the same whenever and wherever it is planned.
    fn random(&self, stage: Stage, round: usize) -> fastrand::Rng {
        fastrand::Rng::with_seed(self.spec.seed ^ ((stage as u64) << 32) ^ round as u64)
    }

    /// Digests of this scene's states that are known before any trial.
    pub fn known_digests(&self) -> Vec<StateDigest> {
        let embedded: KnownDigests = toml::from_str(include_str!("../../experiments/digests.toml"))
            .expect("the embedded digests are valid");
        let same_scene = |known: &KnownDigest| {
            self.spec.scene == known.scene
                && self.scene.particle_distance_m == known.particle_distance_m
                && self.spec.fixed.cg_tolerance == known.cg_tolerance
                && self
                    .sets
                    .iter()
                    .all(|set| set.starts_with("particle_distance_m="))
        };
        embedded
            .state
            .into_iter()
            .filter(same_scene)
            .map(|known| StateDigest {
                step: known.step,
                digest: known.digest,
            })
            .collect()
    }
}

#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct KnownDigests {
    state: Vec<KnownDigest>,
}

#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct KnownDigest {
    scene: String,
    particle_distance_m: f64,
    cg_tolerance: f64,
    step: usize,
    digest: String,
}

/// Windows spread evenly over the run, one in the middle of each equal part of it.
fn windows(paired: &Paired, steps: usize) -> Vec<Window> {
    let length = paired.warmup_steps + paired.steps;
    let part = steps as f64 / paired.windows as f64;
    (0..paired.windows)
        .map(|k| {
            let middle = (k as f64 + 0.5) * part;
            let last_start = steps.saturating_sub(length);
            let start_step = ((middle - 0.5 * length as f64).max(0.0) as usize).min(last_start);
            Window {
                start_step,
                warmup_steps: paired.warmup_steps,
                steps: paired.steps,
            }
        })
        .collect()
}

/// The CPUs to pin to: `off`, `close` or `spread`.
pub fn pin_order(pin: &str) -> Result<Vec<usize>> {
    let topology = Topology::read(Path::new("/"), &allowed_cpus());
    match pin {
        "off" => Ok(Vec::new()),
        "close" => Ok(topology.pin_order_close()),
        "spread" => Ok(topology.pin_order_spread()),
        _ => Err(InputError::new(
            "command line",
            "pin",
            pin,
            "allowed are `off`, `close` or `spread`",
        ))
        .context("pinning"),
    }
}

/// Cells that a run will not measure because the machine has too few cores: threads by experiment.
pub fn not_applicable(plan: &Plan) -> BTreeMap<String, Vec<usize>> {
    plan.experiments
        .iter()
        .map(|e| {
            let missing = e
                .spec
                .factors
                .threads
                .iter()
                .filter(|t| !e.threads.contains(t));
            (e.spec.id.clone(), missing.copied().collect())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_lie_in_the_middle_of_equal_parts() {
        let paired = Paired {
            rounds: 1,
            windows: 8,
            warmup_steps: 1,
            steps: 6,
        };
        let windows = windows(&paired, 667);
        assert_eq!(windows[0].start_step, 38);
        assert_eq!(windows[7].start_step, 621);
        assert!(windows.iter().all(|w| w.end_step() <= 667));
        let squeezed = super::windows(
            &Paired {
                windows: 3,
                steps: 9,
                ..paired
            },
            4,
        );
        assert!(squeezed.iter().all(|w| w.start_step == 0));
    }

    #[test]
    fn a_plan_is_the_same_every_time() {
        let calibration = Calibration {
            s_per_particle_step: 1e-6,
        };
        let plan = || {
            let table2 = crate::experiment::library::load("table2").unwrap();
            let figure4 = crate::experiment::library::load("figure4").unwrap();
            Plan::new(vec![table2, figure4], Mode::Quick, calibration).unwrap()
        };
        let (one, two) = (plan(), plan());
        assert_eq!(format!("{:?}", one.rounds), format!("{:?}", two.rounds));
        let savers = one
            .rounds
            .iter()
            .flat_map(|r| &r.trials)
            .filter(|t| t.saves_states)
            .count();
        assert_eq!(
            savers, 1,
            "one whole run leaves the states that both experiments start from"
        );
    }
}
