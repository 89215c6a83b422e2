//! A small run for tests of clusters, and what must not depend on where its rounds ran.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const TINY: &str = r#"
schema = 2
id = "tiny"
title = "Tiny"
question = "Does a run that is spread over nodes end like one that is not?"
analysis = "Compare cells, statuses and digests."
scene = "dam-break"
seed = 3
pin = "off"
[[factors]]
threads = [1, 2, 1024]
preset = ["paper-linked-list", "paper-aos-relocation"]
[[case]]
id = "dam-break"
title = "a short dam break"
scene = "dam-break"
set = { particle_distance_m = 0.075, end_time_s = 0.03 }
[mode.quick]
scene = { particle_distance_m = 0.075, end_time_s = 0.15 }
whole = { rounds = 2 }
paired = { rounds = 2, windows = 4, warmup_steps = 1, steps = 2 }
observed = { rounds = 1 }
[mode.default]
paired = { rounds = 1, windows = [2], warmup_steps = 0, steps = 1 }
observed = { rounds = 1 }
[mode.full]
paired = { rounds = 1, windows = 1, warmup_steps = 0, steps = 1 }
observed = { rounds = 1 }
"#;

/// The blocks of the small run in quick mode, by number.
pub const BLOCKS: [&str; 5] = ["whole-000", "whole-001", "paired-000", "paired-001", "observed-000"];

/// Writes the small experiment to a file of that name.
pub fn tiny(folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, TINY).unwrap();
    path
}

pub fn repro() -> Command {
    Command::new(env!("CARGO_BIN_EXE_repro"))
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A plain run of the small experiment on this machine.
pub fn plain_run(experiment: &Path, folder: &Path) {
    let output =
        repro().arg("run").arg(experiment).args(["--quick", "--output"]).arg(folder).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

/// `repro collect` on a run folder.
pub fn collect(folder: &Path) -> Output {
    repro().arg("collect").arg(folder).output().unwrap()
}

/// What must not depend on where and when a round ran: cell, round, position, phase, status and digest of timed cells,
/// and every number but the time of observed runs.
pub fn essence(folder: &Path) -> Vec<Vec<String>> {
    let timed = ["cell_id", "round", "position", "phase", "status", "digest"];
    let mut essence = columns(folder, "samples.csv", timed);
    let observed = ["observed_run", "round", "quantity", "value", "ended", "digest"];
    let observations = columns(folder, "observations.csv", observed);
    essence.extend(observations.into_iter().filter(|row| row[2] != "stepping_time"));
    essence
}

fn columns(folder: &Path, file: &str, wanted: [&str; 6]) -> Vec<Vec<String>> {
    let mut reader = csv::Reader::from_path(folder.join(file)).unwrap();
    let header = reader.headers().unwrap().clone();
    let columns = wanted.map(|name| header.iter().position(|h| h == name).unwrap());
    reader.records().map(|row| columns.map(|c| row.as_ref().unwrap()[c].to_string()).to_vec()).collect()
}
