//! Every documented exit code, reached.

#![cfg(feature = "driver")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// An experiment of a fraction of a second; `%` stands for what a test adds before the factors.
const SMALL: &str = r#"
schema = 2
id = "small"
title = "Small"
question = "Which exit code?"
analysis = "None."
scene = "dam-break"
seed = 1
pin = "off"
%
[[factors]]
threads = [1]
preset = ["paper-linked-list", "paper-aos-relocation"]
[mode.quick]
scene = { particle_distance_m = 0.075, end_time_s = 0.03 }
paired = { rounds = 6, windows = [0], warmup_steps = 0, steps = 2 }
[mode.default]
paired = { rounds = 1, windows = [0], warmup_steps = 0, steps = 1 }
[mode.full]
paired = { rounds = 1, windows = [0], warmup_steps = 0, steps = 1 }
"#;

fn repro(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_repro")).args(arguments).output().unwrap()
}

fn ends_with(code: i32, arguments: &[&str]) -> String {
    let output = repro(arguments);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {text}");
    text
}

fn write(place: &Path, name: &str, added: &str) -> String {
    let path = place.join(name);
    fs::write(&path, SMALL.replace('%', added)).unwrap();
    path.to_str().unwrap().to_string()
}

/// Runs the experiment file in a folder of that name below `place`.
fn run(place: &Path, folder: &str, experiment: &str, more: &[&str]) -> (PathBuf, Output) {
    let folder = place.join(folder);
    let mut arguments = vec!["run", experiment, "--quick", "--output", folder.to_str().unwrap()];
    arguments.extend(more);
    let output = repro(&arguments);
    (folder, output)
}

/// A copy of what the recorded run holds of Table 2's paired trials, with the times of relocation multiplied.
fn doctored_reference(place: &Path, factor: f64) -> PathBuf {
    let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("results/reference");
    let copy = place.join(format!("times-{factor}"));
    fs::create_dir_all(copy.join("rounds")).unwrap();
    fs::copy(reference.join("machine.json"), copy.join("machine.json")).unwrap();
    let mut info: serde_json::Value =
        serde_json::from_slice(&fs::read(reference.join("run.json")).unwrap()).unwrap();
    info["finished_utc"] = serde_json::Value::Null;
    fs::write(copy.join("run.json"), serde_json::to_vec(&info).unwrap()).unwrap();
    for entry in fs::read_dir(reference.join("rounds")).unwrap().flatten() {
        let name = entry.file_name().into_string().unwrap();
        if !name.starts_with("table2-paired") {
            continue;
        }
        let mut round: serde_json::Value = serde_json::from_slice(&fs::read(entry.path()).unwrap()).unwrap();
        for trial in round["trials"].as_array_mut().unwrap() {
            let presets = trial["variants"].as_array().unwrap().clone();
            for (variant, windows) in presets.iter().zip(trial["outcome"]["samples"].as_array_mut().unwrap())
            {
                if variant["preset"] != "paper-aos-relocation" {
                    continue;
                }
                let steps = windows.as_array_mut().unwrap().iter_mut();
                for step in steps.flat_map(|window| window["steps"].as_array_mut().unwrap()) {
                    step["total_s"] = (factor * step["total_s"].as_f64().unwrap()).into();
                }
            }
        }
        fs::write(copy.join("rounds").join(name), serde_json::to_vec(&round).unwrap()).unwrap();
    }
    copy
}

#[test]
fn done_is_0_and_bad_usage_2() {
    let place = tempfile::tempdir().unwrap();
    let experiment = write(place.path(), "small.toml", "");
    let (folder, output) = run(place.path(), "run", &experiment, &[]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    ends_with(0, &["status", folder.to_str().unwrap()]);
    ends_with(2, &["run", "no-such-experiment"]);
    ends_with(2, &["run", &experiment, "--filter", "colour=red"]);
}

#[test]
fn a_failing_claim_is_1_where_asked_for() {
    let place = tempfile::tempdir().unwrap();
    let slow = doctored_reference(place.path(), 3.0);
    let slow = slow.to_str().unwrap();
    ends_with(0, &["report", slow]);
    ends_with(1, &["report", slow, "--strict"]);
}

#[test]
fn a_regression_is_1_where_asked_for() {
    let place = tempfile::tempdir().unwrap();
    let (before, after) = (doctored_reference(place.path(), 1.0), doctored_reference(place.path(), 1.5));
    let (before, after) = (before.to_str().unwrap(), after.to_str().unwrap());
    assert!(ends_with(0, &["compare", before, after]).contains("slower: table2/paired/paper-aos-relocation"));
    ends_with(1, &["compare", before, after, "--strict"]);
    ends_with(0, &["compare", after, before, "--strict"]);
    ends_with(0, &["compare", before, before, "--strict"]);
}

/// A trial that failed is a row with its reason; its round is run again when that is asked for.
#[test]
fn failed_trials_are_3_and_are_retried() {
    let place = tempfile::tempdir().unwrap();
    let experiment = write(place.path(), "small.toml", "");
    let (folder, output) = run(place.path(), "run", &experiment, &[]);
    assert!(output.status.success());
    let round = folder.join("rounds/small-paired-002.json");
    let good = fs::read_to_string(&round).unwrap();
    let mut record: serde_json::Value = serde_json::from_str(&good).unwrap();
    record["trials"][0]["status"] = "failed".into();
    record["trials"][0]["reason"] = "made to fail".into();
    record["trials"][0]["outcome"] = serde_json::Value::Null;
    fs::write(&round, serde_json::to_vec(&record).unwrap()).unwrap();
    let path = folder.to_str().unwrap();
    ends_with(3, &["status", path]);
    ends_with(0, &["report", path]);
    let samples = fs::read_to_string(folder.join("samples.csv")).unwrap();
    assert_eq!(samples.lines().filter(|line| line.contains(",failed,made to fail,")).count(), 2);
    let (_, output) = run(place.path(), "run", &experiment, &["--retry-failed"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(!fs::read_to_string(&round).unwrap().contains("made to fail"));
    ends_with(0, &["status", path]);
}

/// A gate that lets no pressure pass, on a machine that is kept busy.
#[cfg(target_os = "linux")]
#[test]
fn a_machine_that_is_too_busy_is_4() {
    let place = tempfile::tempdir().unwrap();
    let gate = "[gate]\ncpu_pressure_max = 0\non_violation = \"refuse\"";
    let experiment = write(place.path(), "small.toml", gate);
    let pressure = || {
        let text = fs::read_to_string("/proc/pressure/cpu").unwrap_or_default();
        text.split("avg10=").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok())
    };
    if pressure().is_none() {
        eprintln!("skipped: the kernel does not tell the pressure on its processors");
        return;
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let stop = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        for _ in 0..3 * cores {
            scope.spawn(|| {
                while !stop.load(std::sync::atomic::Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        while pressure().is_none_or(|found| found < 1.0) {
            std::thread::sleep(std::time::Duration::from_millis(200));
        }
        let (folder, output) = run(place.path(), "run", &experiment, &[]);
        stop.store(true, std::sync::atomic::Ordering::Relaxed);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(4), "{text}");
        assert!(text.contains("refused") && text.contains('%'), "{text}");
        let rounds = fs::read_dir(folder.join("rounds")).unwrap().flatten();
        let measured = rounds.filter(|entry| entry.file_name().to_string_lossy().contains("paired"));
        assert_eq!(measured.count(), 0);
    });
}

#[test]
fn nothing_measured_is_5() {
    let place = tempfile::tempdir().unwrap();
    let experiment = write(place.path(), "small.toml", "");
    let (_, output) = run(place.path(), "run", &experiment, &["--filter", "threads=7"]);
    assert_eq!(output.status.code(), Some(5), "{}", String::from_utf8_lossy(&output.stderr));
    let samples = fs::read_to_string(place.path().join("run/samples.csv")).unwrap();
    let skipped = samples.lines().filter(|line| line.contains(",skipped,left out by the filter threads=7,"));
    assert_eq!(skipped.count(), 2);
}

#[test]
fn incomparable_runs_are_6() {
    let place = tempfile::tempdir().unwrap();
    let experiment = write(place.path(), "small.toml", "");
    let (folder, output) = run(place.path(), "run", &experiment, &[]);
    assert!(output.status.success());
    let other = doctored_reference(place.path(), 1.0);
    ends_with(6, &["compare", folder.to_str().unwrap(), other.to_str().unwrap()]);
}

#[test]
fn excluded_cells_are_rows_with_the_reason() {
    let place = tempfile::tempdir().unwrap();
    let exclude =
        "[[exclude]]\nwhere = { preset = [\"paper-linked-list\"], threads = [1] }\nreason = \"known\"";
    let experiment = write(place.path(), "small.toml", exclude);
    let (folder, output) = run(place.path(), "run", &experiment, &[]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let samples = fs::read_to_string(folder.join("samples.csv")).unwrap();
    assert_eq!(samples.lines().filter(|line| line.contains(",not_applicable,known,")).count(), 1);
    let measured =
        samples.lines().filter(|line| line.contains("/paper-linked-list/") && line.contains(",ok,"));
    assert_eq!(measured.count(), 0);
}

/// A file system without room for a record: the exit code says incomplete, nothing half-written is left, and with room the
/// same command finishes the run.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_3_and_the_run_goes_on() {
    let place = tempfile::tempdir().unwrap();
    let experiment = write(place.path(), "small.toml", "");
    let folder = place.path().join("run");
    // Files of at most two kibibytes: the run's description fits, a record does not.
    let script = format!(
        "trap '' XFSZ; ulimit -f 4; exec '{}' run '{experiment}' --quick --output '{}'",
        env!("CARGO_BIN_EXE_repro"),
        folder.display()
    );
    let output = Command::new("bash").args(["-c", &script]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{text}");
    assert!(text.contains("cannot write"), "{text}");
    let leftovers = fs::read_dir(folder.join("rounds")).unwrap().count();
    assert_eq!(leftovers, 0);
    let (_, output) = run(place.path(), "run", &experiment, &[]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_second_process_on_a_run_is_refused() {
    let place = tempfile::tempdir().unwrap();
    let experiment = write(place.path(), "small.toml", "");
    let folder = place.path().join("run");
    fs::create_dir_all(&folder).unwrap();
    let lock = fs::File::create(folder.join(".lock")).unwrap();
    lock.lock().unwrap();
    let (_, output) = run(place.path(), "run", &experiment, &[]);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(text.contains("another process"), "{text}");
    drop(lock);
    let (_, output) = run(place.path(), "run", &experiment, &[]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A folder that can no longer be written ends the run with 3; nothing is made up, and the run goes on when it can be again.
#[cfg(unix)]
#[test]
fn a_folder_that_is_lost_on_the_way_is_3() {
    let place = tempfile::tempdir().unwrap();
    let experiment = place.path().join("small.toml");
    fs::write(&experiment, SMALL.replace('%', "").replace("rounds = 6", "rounds = 40")).unwrap();
    let experiment = experiment.to_str().unwrap();
    let folder = place.path().join("run");
    let mut child = Command::new(env!("CARGO_BIN_EXE_repro"))
        .args(["run", experiment, "--quick", "--output", folder.to_str().unwrap()])
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let rounds = folder.join("rounds");
    while !rounds.join("small-paired-001.json").exists() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let aside = place.path().join("aside");
    fs::rename(&rounds, &aside).unwrap();
    fs::write(&rounds, "not a folder").unwrap();
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(3));
    fs::remove_file(&rounds).unwrap();
    fs::rename(&aside, &rounds).unwrap();
    let (_, output) = run(place.path(), "run", experiment, &[]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let paired = fs::read_dir(&rounds).unwrap().flatten();
    let paired = paired.filter(|entry| entry.file_name().to_string_lossy().contains("paired"));
    assert_eq!(paired.count(), 40);
}

/// Times of day are labels: a clock that jumps between two rounds changes no number.
#[test]
fn a_clock_that_jumps_changes_nothing() {
    let place = tempfile::tempdir().unwrap();
    let experiment = write(place.path(), "small.toml", "");
    let (folder, output) = run(place.path(), "run", &experiment, &[]);
    assert!(output.status.success());
    let summary = || fs::read_to_string(folder.join("summary.csv")).unwrap();
    let before = summary();
    let round = folder.join("rounds/small-paired-003.json");
    let mut record: serde_json::Value = serde_json::from_slice(&fs::read(&round).unwrap()).unwrap();
    record["trials"][0]["started_utc"] = "1970-01-01T00:00:00Z".into();
    fs::write(&round, serde_json::to_vec(&record).unwrap()).unwrap();
    ends_with(0, &["report", folder.to_str().unwrap()]);
    assert_eq!(summary(), before);
}
