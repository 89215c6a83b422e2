//! One trial of the twin: what a child process does.

use std::path::PathBuf;
use std::process::Command;

use anyhow::Result;
use serde::{Deserialize, Serialize};

use crate::base::input::InputError;
use crate::base::parallel::Workers;
use crate::engine::preset::{Preset, Test};
use crate::experiment::pinning::pin_order;
use crate::experiment::twin::loops::{self, Geometry};
use crate::experiment::twin::outcome::Asked;
use crate::scene::{library, snapshot};

/// Which loop to run on which particles.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TwinRequest {
    pub scene: String,
    pub sets: Vec<String>,
    /// The file of the state's particles.
    pub state: PathBuf,
    /// How many it holds.
    pub particles: usize,
    /// The program in C; the loop in Rust without it.
    pub program: Option<PathBuf>,
    pub distance_test: String,
    pub threads: usize,
    pub pin: String,
    pub passes: usize,
    /// From 1 to the largest 32-bit integer.
    pub seed: u32,
}

impl TwinRequest {
    /// What the answer must agree with.
    pub fn asked(&self) -> Asked {
        Asked { particles: self.particles, threads: self.threads, passes: self.passes }
    }
}

/// Measures and gives the answer in JSON.
pub fn run(request: &TwinRequest) -> Result<Vec<u8>> {
    let wrong = |error: String| InputError::new("trial", "distance_test", &request.distance_test, error);
    let test: Test = request.distance_test.parse().map_err(wrong)?;
    let scene = library::load(&request.scene, &request.sets)?;
    let geometry = Geometry::of(&scene.parameters(&scene.particles(&request.scene)?));
    let cpus = pin_order(&request.pin)?;
    if let Some(program) = &request.program {
        let mut command = Command::new(program);
        command.args(arguments(request, &geometry)).envs(environment(&cpus));
        command.env_remove("GOMP_CPU_AFFINITY").env_remove("OMP_THREAD_LIMIT");
        return hand_over(command);
    }
    let particles = snapshot::read(&request.state)?;
    let workers = Workers::new(request.threads, Preset::PAPER_LINKED_LIST.options().schedule, &cpus)?;
    let seed = u64::from(request.seed);
    let answer = loops::measure(&geometry, &particles, test, &workers, request.passes, seed)?;
    Ok(serde_json::to_vec(&answer)?)
}

/// The command line of the C program. Numbers read back to the same bits.
fn arguments(request: &TwinRequest, geometry: &Geometry) -> Vec<String> {
    let point = |[x, y, z]: [f64; 3]| format!("{x},{y},{z}");
    vec![
        format!("particles={}", request.state.display()),
        format!("low={}", point(geometry.domain.low)),
        format!("high={}", point(geometry.domain.high)),
        format!("bucket_side={}", geometry.bucket_side_m),
        format!("radius={}", geometry.radius_m),
        format!("distance_test={}", request.distance_test),
        format!("threads={}", request.threads),
        format!("passes={}", request.passes),
        format!("seed={}", request.seed),
    ]
}

/// What OpenMP is told: threads stay on the CPUs that the Rust loop's stay on, and wait as those do, without spinning.
fn environment(cpus: &[usize]) -> Vec<(&'static str, String)> {
    let mut settings = vec![("OMP_DYNAMIC", "false".to_string()), ("OMP_WAIT_POLICY", "passive".to_string())];
    if cpus.is_empty() {
        settings.push(("OMP_PROC_BIND", "false".to_string()));
    } else {
        let places: Vec<String> = cpus.iter().map(|cpu| format!("{{{cpu}}}")).collect();
        settings.push(("OMP_PLACES", places.join(",")));
        settings.push(("OMP_PROC_BIND", "close".to_string()));
    }
    settings
}

/// Becomes the C program: its answer is this process's, and who stops the one stops the other.
#[cfg(unix)]
fn hand_over(mut command: Command) -> Result<Vec<u8>> {
    use anyhow::Context;
    use std::os::unix::process::CommandExt;
    Err(command.exec()).context("cannot start the twin in C")
}

/// Runs the C program and passes on its answer.
#[cfg(not(unix))]
fn hand_over(mut command: Command) -> Result<Vec<u8>> {
    use anyhow::{Context, ensure};
    let output = command.output().context("cannot start the twin in C")?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr).trim());
    Ok(output.stdout)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_of_both_languages_stay_on_the_same_cpus() {
        let settings = environment(&[2, 0]);
        assert!(settings.contains(&("OMP_PLACES", "{2},{0}".to_string())));
        assert!(settings.contains(&("OMP_PROC_BIND", "close".to_string())));
        assert!(environment(&[]).contains(&("OMP_PROC_BIND", "false".to_string())));
    }
}
