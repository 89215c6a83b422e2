//! From a planned trial of the twin to the request for its process, or to the reason why there is none.

use std::path::Path;

use anyhow::Result;

use crate::experiment::plan::{Plan, PlannedExperiment};
use crate::experiment::twin::outcome::{Language, TwinOutcome};
use crate::experiment::twin::plan::TwinWork;
use crate::experiment::twin::toolchain::Toolchain;
use crate::experiment::twin::trial::TwinRequest;
use crate::scene::snapshot;

/// What is known of a trial before it runs, and what to ask of its process; a reason where the cell is not applicable here.
pub fn prepare(
    plan: &Plan,
    experiment: &PlannedExperiment,
    work: &TwinWork,
    threads: usize,
    run_folder: &Path,
    toolchain: &Toolchain,
) -> Result<(TwinOutcome, Result<TwinRequest, String>)> {
    let cell = work.cell.clone();
    let mut outcome = TwinOutcome { cell, build: None, answer: None };
    let there = plan.usable.threads;
    if threads > there {
        return Ok((outcome, Err(format!("needs {threads} hardware threads, {there} may be used here"))));
    }
    let mut program = None;
    if work.cell.language == Language::C {
        let folder = run_folder.join("states").join("twin");
        match toolchain.compiled(&folder, &work.cell.compiler, &work.cell.target_cpu)? {
            Ok(compiled) => {
                program = Some(compiled.program);
                outcome.build = Some(compiled.build);
            }
            Err(reason) => return Ok((outcome, Err(reason))),
        }
    }
    let (spec, group) = (&experiment.spec, &experiment.groups[work.group]);
    let start_step = group.windows.iter().map(|window| window.start_step).max().unwrap_or(0);
    let request = TwinRequest {
        scene: spec.scene.clone(),
        sets: group.sets.clone(),
        state: plan.states[group.states].folder(run_folder).join(snapshot::file_name(start_step)),
        particles: group.particles,
        program,
        distance_test: work.cell.distance_test.clone(),
        threads,
        pin: spec.pin.clone(),
        passes: work.passes,
        seed: work.seed,
    };
    Ok((outcome, Ok(request)))
}
