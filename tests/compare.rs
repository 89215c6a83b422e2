//! Runs from several machines side by side: what is compared, and what is refused.

#![cfg(feature = "driver")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const EXPERIMENT: &str = r#"
schema = 2
id = "small"
title = "Small"
question = "Can two runs be compared?"
analysis = "Look at the table."
scene = "dam-break"
seed = 1
pin = "off"
[[factors]]
threads = [1]
preset = ["paper-linked-list", "paper-aos-relocation"]
[mode.quick]
scene = { particle_distance_m = 0.075, end_time_s = 0.03 }
paired = { rounds = 6, windows = [2], warmup_steps = 0, steps = 1 }
[mode.default]
paired = { rounds = 1, windows = [2], warmup_steps = 0, steps = 1 }
[mode.full]
paired = { rounds = 1, windows = [2], warmup_steps = 0, steps = 1 }
"#;

fn repro(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_repro")).args(arguments).output().unwrap()
}

/// A finished run of the experiment, with changes to its text, on a machine of that name.
fn run(place: &Path, alias: &str, changes: [&str; 2]) -> PathBuf {
    let [from, to] = changes;
    let (file, folder) = (place.join(format!("{alias}.toml")), place.join(alias));
    fs::write(&file, EXPERIMENT.replace(from, to)).unwrap();
    let (file, output) = (file.to_str().unwrap(), folder.to_str().unwrap());
    let done = repro(&["run", file, "--quick", "--alias", alias, "--output", output]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    folder
}

fn compare(runs: &[&Path], more: &[&str]) -> (Option<i32>, String, String) {
    let runs: Vec<&str> = runs.iter().map(|run| run.to_str().unwrap()).collect();
    let output = repro(&[&["compare"], &runs[..], more].concat());
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn equal_work_is_compared_and_other_work_is_not() {
    let place = tempfile::tempdir().unwrap();
    let none = ["", ""];
    let (one, two) = (run(place.path(), "one", none), run(place.path(), "two", none));
    let out = place.path().join("out");
    let (code, text, complaint) = compare(&[&one, &two], &["--output", out.to_str().unwrap()]);
    // Whether one run was slower is the machine's doing, and no complaint about the work.
    let of_work: Vec<&str> = complaint.lines().filter(|line| !line.starts_with("repro: slower: ")).collect();
    assert_eq!((code, of_work), (Some(0), vec![]), "{text}");
    assert!(text.contains("List over relocation") && text.contains("| one | two |"), "{text}");
    assert!(!text.contains("Not comparable"), "{text}");
    let rows = fs::read_to_string(out.join("compare.csv")).unwrap();
    assert_eq!(rows.lines().count(), 1 + 2 * 2, "a row a cell and run: {rows}");
    assert!(out.join("compare.png").is_file() && out.join("compare.md").is_file());

    let finer = run(place.path(), "finer", ["0.075", "0.06"]);
    let (code, text, _) = compare(&[&one, &finer], &[]);
    assert_eq!(code, Some(6), "{text}");
    assert!(text.contains("another number of particles"), "{text}");
    let later = run(place.path(), "later", ["[2]", "[3]"]);
    let (code, text, _) = compare(&[&one, &later], &[]);
    assert_eq!(code, Some(6), "{text}");
    assert!(text.contains("other steps"), "{text}");
}

#[test]
fn doctored_runs_are_named_or_refused() {
    let place = tempfile::tempdir().unwrap();
    let one = run(place.path(), "one", ["", ""]);
    let change = |folder: &Path, file: &str, from: &str, to: &str| {
        let text = fs::read_to_string(folder.join(file)).unwrap();
        assert!(text.contains(from), "{file} has no {from}");
        fs::write(folder.join(file), text.replace(from, to)).unwrap();
    };

    let odd = run(place.path(), "odd", ["", ""]);
    for round in 0..6 {
        let file = format!("rounds/small-paired-{round:03}.json");
        let text = fs::read_to_string(odd.join(&file)).unwrap();
        let (_, rest) = text.split_once("\"digest\":\"").unwrap();
        let digest = rest[..32].to_string();
        change(&odd, &file, &digest, &"0".repeat(32));
    }
    let (code, text, complaint) = compare(&[&one, &odd], &[]);
    assert_eq!(code, Some(6), "{text}");
    assert!(complaint.contains("odd ends in 0000") && text.contains("other states"), "{complaint}{text}");

    let old = run(place.path(), "old", ["", ""]);
    change(&old, "run.json", "\"schema_version\": 2", "\"schema_version\": 1");
    let (code, _, complaint) = compare(&[&one, &old], &[]);
    assert_eq!(code, Some(3), "{complaint}");
    assert!(complaint.contains("schema_version is 1"), "{complaint}");

    let bare = place.path().join("bare");
    fs::create_dir(&bare).unwrap();
    let (code, _, complaint) = compare(&[&one, &bare], &[]);
    assert_eq!(code, Some(2), "{complaint}");
    assert!(complaint.contains("run.json"), "{complaint}");
    assert_eq!(compare(&[&one], &[]).0, Some(2), "one run is nothing to compare");
}
