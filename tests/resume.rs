//! A run that is killed goes on where it was, and ends as if nothing had happened.

#![cfg(feature = "driver")]

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

const TINY: &str = r#"
schema = 2
id = "tiny"
title = "Tiny"
question = "Does a killed run go on?"
analysis = "Compare cells, statuses and digests."
scene = "dam-break"
seed = 1
pin = "off"
[[factors]]
threads = [1, 2, 4096]
preset = ["paper-linked-list", "paper-aos-relocation"]
[[factors]]
name = "settings"
threads = ["all"]
preset = ["paper-aos-relocation"]
memory_order = ["as-aged", "shuffled"]
schedule = ["guided:16"]
scheme = ["as-it-is", "without-collision"]
[[scheme]]
id = "as-it-is"
title = "as it is"
[[scheme]]
id = "without-collision"
title = "without collision"
set = { effects.collision = false }
[[case]]
id = "dam-break"
title = "a short dam break"
scene = "dam-break"
set = { particle_distance_m = 0.075, end_time_s = 0.03 }
[mode.quick]
scene = { particle_distance_m = 0.075, end_time_s = 0.3 }
whole = { rounds = 1 }
paired = { rounds = 6, windows = 4, warmup_steps = 1, steps = 2 }
observed = { rounds = 2 }
[mode.default]
paired = { rounds = 1, windows = [2], warmup_steps = 0, steps = 1 }
observed = { rounds = 1 }
[mode.full]
paired = { rounds = 1, windows = 1, warmup_steps = 0, steps = 1 }
observed = { rounds = 1 }
"#;

fn start(experiment: &Path, folder: &Path) -> Child {
    Command::new(env!("CARGO_BIN_EXE_repro"))
        .arg("run")
        .arg(experiment)
        .args(["--quick", "--output"])
        .arg(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// What must not depend on interruptions: cell, round, phase, status and digest of every row of a timed cell, and every
/// number but the time of an observed run.
fn essence(folder: &Path) -> Vec<Vec<String>> {
    let mut essence =
        columns(folder, "samples.csv", ["cell_id", "round", "position", "phase", "status", "digest"]);
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

#[test]
fn a_killed_run_ends_like_an_uninterrupted_one() {
    let place = tempfile::tempdir().unwrap();
    let experiment = place.path().join("tiny.toml");
    fs::write(&experiment, TINY.replace("4096", "1024")).unwrap();
    let (whole, killed) = (place.path().join("whole"), place.path().join("killed"));
    let output = start(&experiment, &whole).wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));

    for milliseconds in [150, 700, 1500] {
        let mut child = start(&experiment, &killed);
        std::thread::sleep(Duration::from_millis(milliseconds));
        let _ = child.kill();
        let _ = child.wait();
    }
    let finished = start(&experiment, &killed).wait_with_output().unwrap();
    assert!(matches!(finished.status.code(), Some(0 | 2)), "{finished:?}");
    let again = start(&experiment, &killed).wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&again.stderr).into_owned();
    assert_eq!(again.status.code(), Some(2), "a finished run is not run again: {text}");
    assert!(text.contains("finished run") && text.contains("--fresh"), "{text}");

    let rows = essence(&whole);
    assert_eq!(rows, essence(&killed));
    assert!(rows.iter().any(|row| row[4] == "not_applicable"));
    assert!(rows.iter().all(|row| ["ok", "not_applicable", "completed"].contains(&row[4].as_str())));
    assert!(!killed.join("states").exists(), "states are removed when they are no longer needed");
    for file in ["report.html", "report.md", "machine.json", "summary.csv", "steps.csv", "fronts.csv"] {
        assert!(killed.join(file).is_file(), "{file} is missing");
    }
}

/// Fifty times killed at random moments, SIGKILL, each time started again: no row is lost, doubled or half-written.
#[test]
fn fifty_kills_lose_nothing() {
    let place = tempfile::tempdir().unwrap();
    let experiment = place.path().join("tiny.toml");
    let rounds = TINY
        .replace("4096", "1024")
        .replace("paired = { rounds = 6, windows = 4", "paired = { rounds = 24, windows = 4");
    fs::write(&experiment, rounds).unwrap();
    let (whole, killed) = (place.path().join("whole"), place.path().join("killed"));
    assert!(start(&experiment, &whole).wait().unwrap().success());
    let mut random = fastrand::Rng::with_seed(50);
    for _ in 0..50 {
        let mut child = start(&experiment, &killed);
        std::thread::sleep(Duration::from_millis(random.u64(20..1300)));
        let _ = child.kill();
        let _ = child.wait();
    }
    let finished = start(&experiment, &killed).wait_with_output().unwrap();
    assert!(matches!(finished.status.code(), Some(0 | 2)), "{finished:?}");
    assert_eq!(essence(&whole), essence(&killed));
}

#[test]
fn rendering_again_gives_the_same_bytes() {
    let place = tempfile::tempdir().unwrap();
    let experiment = place.path().join("tiny.toml");
    fs::write(&experiment, TINY.replace("4096", "1024")).unwrap();
    let folder = place.path().join("run");
    assert!(start(&experiment, &folder).wait().unwrap().success());
    let read = |name: &str| fs::read(folder.join(name)).unwrap();
    let names = ["samples.csv", "steps.csv", "summary.csv", "report.html", "report.md", "machine.csv"];
    let before = names.map(read);
    let status = Command::new(env!("CARGO_BIN_EXE_repro")).arg("report").arg(&folder).output().unwrap();
    assert!(status.status.success());
    for (name, before) in names.iter().zip(before) {
        assert_eq!(fs::read(folder.join(name)).unwrap(), before, "{name}");
    }
    let text = String::from_utf8(read("report.html")).unwrap();
    let home = std::env::var("HOME").unwrap_or_else(|_| "/home".to_string());
    assert!(!text.contains(&home) && !text.contains(place.path().to_str().unwrap()), "no path is recorded");
}

/// Ctrl-C ends the run with its own exit code; the same command finishes it.
#[cfg(unix)]
#[test]
fn an_interrupted_run_says_so_and_goes_on() {
    use rustix::process::{Pid, Signal, kill_process};
    let place = tempfile::tempdir().unwrap();
    let experiment = place.path().join("tiny.toml");
    fs::write(&experiment, TINY.replace("4096", "1024")).unwrap();
    let folder = place.path().join("run");
    let child = start(&experiment, &folder);
    std::thread::sleep(Duration::from_millis(900));
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{text}");
    assert!(text.contains("interrupted"), "{text}");
    let names = fs::read_dir(folder.join("rounds")).unwrap().flatten().map(|e| e.file_name());
    assert!(names.into_iter().all(|name| name.to_string_lossy().ends_with(".json")), "no half file");
    assert!(start(&experiment, &folder).wait().unwrap().success());
}
