//! Rounds are added until intervals are narrow enough, and not beyond.

#![cfg(feature = "driver")]

use std::fs;
use std::path::Path;
use std::process::Command;

const EXPERIMENT: &str = r#"
schema = 2
id = "adaptive"
title = "Adaptive"
question = "How many rounds?"
analysis = "Count them."
scene = "dam-break"
seed = 1
pin = "off"
[[factors]]
threads = [1]
preset = ["paper-linked-list", "paper-aos-relocation"]
[mode.quick]
scene = { particle_distance_m = 0.075, end_time_s = 0.03 }
paired = { rounds = %, windows = [0], warmup_steps = 0, steps = 1, control = true }
[mode.default]
paired = { rounds = 1, windows = [0], warmup_steps = 0, steps = 1 }
[mode.full]
paired = { rounds = 1, windows = [0], warmup_steps = 0, steps = 1 }
"#;

fn repro(arguments: &[&str]) -> (i32, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_repro")).args(arguments).output().unwrap();
    let text = [output.stdout, output.stderr].concat();
    (output.status.code().unwrap(), String::from_utf8_lossy(&text).into_owned())
}

/// Runs the experiment with these rounds and counts what is recorded.
fn recorded(place: &Path, rounds: &str) -> usize {
    let file = place.join("adaptive.toml");
    fs::write(&file, EXPERIMENT.replace('%', rounds)).unwrap();
    let folder = place.join("run");
    let (file, folder_text) = (file.to_str().unwrap(), folder.to_str().unwrap());
    let (code, text) = repro(&["run", file, "--quick", "--fresh", "--output", folder_text]);
    assert_eq!(code, 0, "{text}");
    assert_eq!(repro(&["status", folder_text]).0, 0, "a stage that has measured enough is complete");
    assert!(fs::read_to_string(folder.join("report.md")).unwrap().contains("Noise floor"));
    let names = fs::read_dir(folder.join("rounds")).unwrap().flatten().map(|entry| entry.file_name());
    names.filter(|name| name.to_string_lossy().contains("paired")).count()
}

/// Any width will do: confirmed at the second look, after thirteen rounds, or later where rounds depend on one another.
/// None will: the maximum. No time left: the minimum.
#[test]
fn rounds_end_at_the_second_narrow_look_at_the_most_or_with_the_budget() {
    let place = tempfile::tempdir().unwrap();
    let rounds = recorded(place.path(), "{ min = 6, max = 30, target_interval = 1e6 }");
    assert!([13, 19, 27, 30].contains(&rounds), "{rounds}");
    assert_eq!(recorded(place.path(), "{ min = 6, max = 11, target_interval = 1e-9 }"), 11);
    assert_eq!(recorded(place.path(), "{ min = 6, max = 12, target_interval = 1e-9, budget_s = 1e-6 }"), 6);
}

#[test]
fn rounds_that_cannot_be_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("adaptive.toml");
    for (rounds, words) in [
        ("{ min = 3, max = 12, target_interval = 0.1 }", "mode.quick.paired.rounds.min"),
        ("{ min = 9, max = 8, target_interval = 0.1 }", "allowed are 6"),
        ("{ min = 6, max = 12, target_interval = 0.0 }", "target_interval"),
        ("{ min = 6, max = 12 }", "target_interval"),
        ("0", "1 to 10000"),
    ] {
        fs::write(&file, EXPERIMENT.replace('%', rounds)).unwrap();
        let (code, text) = repro(&["plan", file.to_str().unwrap(), "--quick"]);
        assert!(code == 2 && text.contains(words), "{rounds}: {text}");
    }
}

/// More rounds than the rule needs, as a cancelled array of a cluster leaves them, make a run no less complete.
#[test]
fn rounds_beyond_the_needed_ones_do_no_harm() {
    let place = tempfile::tempdir().unwrap();
    let needed = recorded(place.path(), "{ min = 6, max = 30, target_interval = 1e6 }");
    let folder = place.path().join("run");
    for round in needed..needed + 2 {
        let name = |round: usize| folder.join(format!("rounds/adaptive-paired-{round:03}.json"));
        let last = needed - 1;
        let text = fs::read_to_string(name(last)).unwrap();
        let text = text.replace(&format!("\"round\":{last}"), &format!("\"round\":{round}"));
        fs::write(name(round), text).unwrap();
    }
    let folder = folder.to_str().unwrap();
    for verb in ["status", "report"] {
        let (code, text) = repro(&[verb, folder]);
        assert_eq!(code, 0, "{verb}: {text}");
    }
}
