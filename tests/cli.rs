//! The command as a user meets it: what it prints, what it refuses, and with which exit code.

#![cfg(feature = "driver")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn repro(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_repro")).args(arguments).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The command ends with exit code 2 and says all of `words`.
fn refused(arguments: &[&str], words: &[&str]) {
    let output = repro(arguments);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    for word in words {
        assert!(text.contains(word), "{arguments:?} does not say `{word}`: {text}");
    }
}

#[test]
fn impossible_scenes_are_refused_by_file_key_value_and_what_is_allowed() {
    let set = |set: &str, words: &[&str]| {
        let mut all = vec!["scenes/dam-break.toml"];
        all.extend(words);
        refused(&["simulate", "dam-break", "--steps", "1", "--set", set], &all);
    };
    set("particle_distance_m=0", &["particle_distance_m", "is 0", "above 0"]);
    set("particle_distance_m=-0.1", &["particle_distance_m", "-0.1", "above 0"]);
    set("particle_distance_m=nan", &["particle_distance_m", "NaN", "finite"]);
    set("time_step_s=inf", &["time_step_s", "inf", "finite"]);
    set("end_time_s=1e12", &["end_time_s", "steps"]);
    set("radii.laplacian=50", &["radii.laplacian", "50", "up to 10"]);
    set("effects.collision.restitution=2", &["effects.collision.restitution", "0 to 1"]);
    set("particle_distance=0.1", &["unknown field", "particle_distance", "particle_distance_m"]);
    set("time_step_s=fast", &["time_step_s", "fast"]);
    set("effects.magnetism.strength=1", &["unknown field", "magnetism", "viscosity"]);
    set("schema=7", &["schema", "7", "schema 1"]);
    set("nonsense", &["--set", "nonsense", "dotted.key=value"]);
}

#[test]
fn a_scene_that_does_not_fit_into_memory_is_refused() {
    let output = repro(&["simulate", "dam-break", "--set", "particle_distance_m=0.0002"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("particle_distance_m"), "{}", stderr(&output));
}

#[test]
fn impossible_options_are_refused() {
    let simulate = |extra: &[&str], words: &[&str]| {
        let mut arguments = vec!["simulate", "dam-break", "--steps", "1"];
        arguments.extend(extra);
        refused(&arguments, words);
    };
    simulate(&["--schedule", "dynamic:0"], &["dynamic:0", "dynamic:<chunk>"]);
    simulate(&["--schedule", "fair"], &["fair", "static"]);
    simulate(&["--threads", "0"], &["--threads", "1 to 1024"]);
    simulate(&["--threads", "1025"], &["--threads", "1025", "1 to 1024"]);
    simulate(&["--preset", "magic"], &["magic", "paper-linked-list"]);
    simulate(&["--storage", "dense"], &["dense", "csr"]);
    simulate(&["--preconditioner", "magic"], &["magic", "two-level"]);
    simulate(&["--matrix-values", "f16"], &["f16", "`f64` or `f32`"]);
    simulate(&["--distance-test", "cube"], &["cube", "squared"]);
    simulate(&["--cg-tolerance", "0"], &["cg_tolerance", "1e-13"]);
    simulate(&["--timings", "/no/such/folder/t.csv"], &["--timings", "folder that exists"]);
    refused(&["simulate", "no-such-scene"], &["no-such-scene", "dam-break"]);
    refused(&["run", "no-such-experiment"], &["no-such-experiment", "table2"]);
    refused(&["report"], &["<RUN>"]);
}

#[test]
fn output_folders_that_are_not_ours_are_left_alone() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("file");
    fs::write(&file, "mine").unwrap();
    let foreign = place.path().join("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("thesis.tex"), "mine").unwrap();
    for (path, words) in [(&file, "is a file"), (&foreign, "hold")] {
        let path = path.to_str().unwrap();
        refused(&["run", "table2", "--quick", "--output", path], &["--output", path, words, "--fresh"]);
        refused(&["run", "table2", "--quick", "--fresh", "--output", path], &["--output", words]);
        refused(&["simulate", "dam-break", "--steps", "1", "--output", path], &["--output", words]);
    }
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
    assert_eq!(fs::read_dir(&foreign).unwrap().count(), 1);
}

#[test]
fn simulate_writes_particles_and_timings() {
    let place = tempfile::tempdir().unwrap();
    let (folder, timings) = (place.path().join("out"), place.path().join("t.csv"));
    let arguments =
        ["simulate", "dam-break", "--set", "particle_distance_m=0.075", "--steps", "4", "--every", "2"];
    let output = Command::new(env!("CARGO_BIN_EXE_repro"))
        .args(arguments)
        .args(["--preset", "paper-linked-list", "--threads", "2", "--schedule", "guided:8"])
        .args(["--format", "csv", "--output"])
        .arg(&folder)
        .arg("--timings")
        .arg(&timings)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    let digest = text.lines().find_map(|line| line.strip_prefix("digest ")).unwrap();
    assert!(digest.len() == 32 && digest.chars().all(|c| c.is_ascii_hexdigit()));
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
    let last = fs::read_to_string(folder.join("particles-000004.csv")).unwrap();
    assert!(last.starts_with("id,kind,x_m,y_m,z_m,u_m_s,v_m_s,w_m_s,p_pa,n\n0,"));
    assert_eq!(last.lines().count(), 1 + 2680);
    let timings = fs::read_to_string(timings).unwrap();
    assert!(timings.starts_with("phase,calls,time_s\ngravity,4,") && timings.contains("\ntotal,4,"));
    assert!(!timings.contains("relocation"), "the linked list has no relocation phase");
}

/// Floats in a particle file read back to the same bits.
#[test]
fn particle_files_round_trip() {
    use repro::scene::snapshot;
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("out");
    let output = repro(&[
        "simulate",
        "dam-break",
        "--set",
        "particle_distance_m=0.075",
        "--steps",
        "10",
        "--output",
        path.to_str().unwrap(),
    ]);
    assert!(output.status.success());
    let file = path.join("particles-000010.csv");
    let particles = snapshot::read(&file).unwrap();
    for (particle, line) in particles.iter().zip(fs::read_to_string(&file).unwrap().lines().skip(1)) {
        let x: f64 = line.split(',').nth(2).unwrap().parse().unwrap();
        assert_eq!(x.to_bits(), particle.position[0].to_bits());
    }
    fs::write(&file, "id,kind,x_m,y_m,z_m,u_m_s,v_m_s,w_m_s,p_pa,n\n0,lava,0,0,0,0,0,0,0,0\n").unwrap();
    let error = format!("{:#}", snapshot::read(&file).unwrap_err());
    assert!(error.contains("line 2") && error.contains("lava"), "{error}");
}

#[test]
fn a_broken_simulation_ends_with_its_own_exit_code() {
    let output = repro(&["simulate", "coincident-pair"]);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{text}");
    assert!(text.contains("step ") && text.contains("phase "), "{text}");
}

#[test]
fn help_and_lists_name_everything() {
    let text = String::from_utf8(repro(&["list"]).stdout).unwrap();
    for word in ["table2", "figure4", "dam-break", "paper-linked-list", "paper-aos-relocation"] {
        assert!(text.contains(word), "{text}");
    }
    let help = String::from_utf8(repro(&["--help"]).stdout).unwrap();
    assert!(help.contains("Exit codes") && help.contains("130"));
    assert_eq!(repro(&["frobnicate"]).status.code(), Some(2));
}

#[test]
fn a_run_folder_of_another_schema_is_refused() {
    let place = tempfile::tempdir().unwrap();
    assert_eq!(repro(&["report", place.path().to_str().unwrap()]).status.code(), Some(3));
    let empty = Path::new("run.json");
    fs::write(place.path().join(empty), "{\"schema_version\": 99}").unwrap();
    let output = repro(&["report", place.path().to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("run.json"), "{}", stderr(&output));
}
