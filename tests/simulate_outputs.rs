//! What `repro simulate` writes beside CSV, what it refuses before it begins, and what an interruption leaves.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const SHORT: [&str; 8] = [
    "simulate",
    "dam-break",
    "--set",
    "particle_distance_m=0.075",
    "--set",
    "time_step_s=0.005",
    "--threads",
    "1",
];

fn simulate(extra: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_repro")).args(SHORT).args(extra).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap().flatten();
    let mut names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn refused(extra: &[&str], words: &[&str]) {
    let output = simulate(extra);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{extra:?}: {text}");
    for word in words {
        assert!(text.contains(word), "{extra:?} does not say `{word}`: {text}");
    }
}

#[test]
fn a_series_begins_at_the_start_and_ends_with_the_last_step() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("out");
    let path = folder.to_str().unwrap();
    let every = ["--steps", "5", "--every-s", "0.01", "--format", "csv,vtu", "--frames", "--quiet"];
    let output = simulate(&[&every[..], &["--output", path]].concat());
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
    let expected = [
        "frame-000000.png",
        "frame-000002.png",
        "frame-000004.png",
        "frame-000005.png",
        "particles-000000.vtu",
        "particles-000002.csv",
        "particles-000002.vtu",
        "particles-000004.csv",
        "particles-000004.vtu",
        "particles-000005.csv",
        "particles-000005.vtu",
        "particles.pvd",
    ];
    assert_eq!(names(&folder), expected);
    let list = fs::read_to_string(folder.join("particles.pvd")).unwrap();
    assert_eq!(list.matches("<DataSet").count(), 4, "{list}");
    assert!(list.contains("timestep=\"0.01\" part=\"0\" file=\"particles-000002.vtu\""), "{list}");
    // The next simulation replaces all of it.
    let output = simulate(&["--steps", "1", "--format", "none", "--frames", "--output", path, "--quiet"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(names(&folder), ["frame-000001.png"]);
}

#[test]
fn what_cannot_be_written_is_refused_and_leaves_a_former_simulation_alone() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("out");
    let path = folder.to_str().unwrap();
    assert!(simulate(&["--steps", "1", "--output", path]).status.success());
    let with = |extra: &[&'static str]| [&["--steps", "1", "--output", path], extra].concat();
    refused(&with(&["--frames", "--color", "temperature"]), &["--color", "temperature", "speed, pressure"]);
    refused(&with(&["--frames", "--color-range", "2:1"]), &["--color-range", "2:1", "LOW:HIGH"]);
    refused(&with(&["--every-s", "0"]), &["--every-s", "above 0"]);
    refused(&with(&["--every", "0"]), &["--every", "1 up"]);
    refused(&with(&["--format", "none,vtu"]), &["--format", "none"]);
    refused(&with(&["--format", "xml"]), &["xml", "vtu"]);
    refused(&["--steps", "1", "--frames"], &["--output"]);
    refused(&with(&["--every", "1", "--every-s", "1"]), &["--every"]);
    assert_eq!(names(&folder), ["particles-000001.csv"]);
}

const PROBES: &str = r#"
[[probe]]
name = "budget"
every_steps = 2
measure = "energy"
[[probe]]
name = "surface"
every_steps = 4
measure.gauge = { x_m = 0.1, z_m = 0.15 }
"#;

fn scene(folder: &Path, probes: &str) -> String {
    let dam = include_str!("../experiments/scenes/dam-break.toml");
    let path = folder.join("probed.toml");
    fs::write(&path, format!("{dam}{probes}")).unwrap();
    path.to_str().unwrap().to_string()
}

#[test]
fn probes_become_rows() {
    let place = tempfile::tempdir().unwrap();
    let (scene, out) = (scene(place.path(), PROBES), place.path().join("out"));
    let output = Command::new(env!("CARGO_BIN_EXE_repro"))
        .args(["simulate", &scene, "--set", "particle_distance_m=0.075", "--steps", "5", "--format", "none"])
        .arg("--output")
        .arg(&out)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(names(&out), ["probes.csv"]);
    let rows = fs::read_to_string(out.join("probes.csv")).unwrap();
    let lines: Vec<&str> = rows.lines().collect();
    assert_eq!(lines[0], "step,time_s,budget_kinetic_j,budget_potential_j,surface_height_m");
    assert_eq!(lines.len(), 1 + 3, "the start and every second step: {rows}");
    assert!(lines[1].starts_with("0,0,0,") && lines[2].starts_with("2,0.006,") && lines[2].ends_with(','));
    let height: f64 = lines[1].rsplit(',').next().unwrap().parse().unwrap();
    assert!((height - 0.4875).abs() < 0.01, "six layers of 0.075 m and half a layer: {height}");
}

#[test]
fn a_probe_outside_the_domain_is_refused_before_anything_is_replaced() {
    let place = tempfile::tempdir().unwrap();
    let far = "[[probe]]\nname = \"far\"\nmeasure.gauge = { x_m = 7.0, z_m = 0.0 }\n";
    let scene = scene(place.path(), far);
    let out = place.path().join("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("probes.csv"), "former").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_repro"))
        .args(["simulate", &scene, "--set", "particle_distance_m=0.075", "--steps", "1", "--output"])
        .arg(&out)
        .output()
        .unwrap();
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{text}");
    for word in ["probed.toml", "probe[0].measure.gauge", "7.0", "domain.margin_m"] {
        assert!(text.contains(word), "{text}");
    }
    assert_eq!(fs::read_to_string(out.join("probes.csv")).unwrap(), "former");
}

/// A simulation that is interrupted keeps whole files, whole rows and a valid list.
#[cfg(unix)]
#[test]
fn an_interruption_leaves_whole_files() {
    let place = tempfile::tempdir().unwrap();
    let (scene, out) = (scene(place.path(), PROBES), place.path().join("out"));
    let mut child = Command::new(env!("CARGO_BIN_EXE_repro"))
        .args(["simulate", &scene, "--set", "particle_distance_m=0.0375", "--threads", "1", "--every", "1"])
        .args(["--set", "end_time_s=200", "--format", "vtu", "--quiet", "--output"])
        .arg(&out)
        .spawn()
        .unwrap();
    while !out.join("particles-000003.vtu").exists() {
        assert_eq!(child.try_wait().unwrap(), None, "it ended by itself");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let list = fs::read_to_string(out.join("particles.pvd")).unwrap();
    let listed: Vec<&str> = list.split("file=\"").skip(1).map(|e| e.split('"').next().unwrap()).collect();
    let there: Vec<String> = names(&out).into_iter().filter(|name| name.ends_with(".vtu")).collect();
    assert_eq!(listed, there, "the list names what is there");
    assert!(names(&out).iter().all(|name| !name.ends_with(".part")), "{:?}", names(&out));
    let rows = fs::read_to_string(out.join("probes.csv")).unwrap();
    assert!(rows.ends_with('\n') && rows.lines().all(|line| line.matches(',').count() == 4), "{rows}");
}
