//! A small finished run, made by the command itself, and copies of it to doctor.
#![allow(dead_code)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use serde_json::Value;

/// Two timed cells in six rounds, and one observed run.
pub const EXPERIMENT: &str = r#"
schema = 2
id = "small"
title = "TITLE"
question = "QUESTION"
analysis = "ANALYSIS"
scene = "dam-break"
seed = 1
pin = "off"
[[factors]]
threads = [1]
preset = ["paper-linked-list", "paper-aos-relocation"]
[[case]]
id = "fall"
title = "CASE"
scene = "dam-break"
set = { particle_distance_m = 0.075, end_time_s = 0.009 }
pass = [{ quantity = "missing", at_most = 0.0 }]
[mode.quick]
scene = { particle_distance_m = 0.075, end_time_s = 0.03 }
paired = { rounds = 6, windows = [2], warmup_steps = 0, steps = 1 }
observed = { rounds = 1 }
[mode.default]
paired = { rounds = 1, windows = [2], warmup_steps = 0, steps = 1 }
observed = { rounds = 1 }
[mode.full]
paired = { rounds = 1, windows = [2], warmup_steps = 0, steps = 1 }
observed = { rounds = 1 }
"#;

pub fn repro(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_repro")).args(arguments).output().unwrap()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A finished run of an experiment's text in the folder `name` of `place`.
pub fn run(place: &Path, name: &str, experiment: &str) -> PathBuf {
    let (file, folder) = (place.join(format!("{name}.toml")), place.join(name));
    fs::write(&file, experiment).unwrap();
    let (file, output) = (file.to_str().unwrap(), folder.to_str().unwrap());
    let done = repro(&["run", file, "--quick", "--alias", name, "--output", output]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    folder
}

/// A copy, in the folder `name` of `place`, of a run that the tests of a file share: measuring it takes longer than a test.
pub fn copied(place: &Path, name: &str) -> PathBuf {
    static SHARED: LazyLock<PathBuf> = LazyLock::new(|| {
        let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join(env!("CARGO_CRATE_NAME"));
        let _ = fs::remove_dir_all(&place);
        fs::create_dir_all(&place).unwrap();
        run(&place, "shared", EXPERIMENT)
    });
    let folder = place.join(name);
    copy(&SHARED, &folder);
    fs::write(place.join(format!("{name}.toml")), EXPERIMENT).unwrap();
    folder
}

/// Copies a run folder's files.
pub fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().flatten() {
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// Changes a JSON file of a run folder.
pub fn edit(file: &Path, change: impl FnOnce(&mut Value)) {
    let mut value: Value = serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap();
    change(&mut value);
    fs::write(file, value.to_string()).unwrap();
}

/// Every file below a folder.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap().flatten() {
        match entry.file_type().unwrap().is_dir() {
            true => found.extend(files(&entry.path())),
            false => found.push(entry.path()),
        }
    }
    found.sort();
    found
}
