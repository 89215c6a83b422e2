//! The loop of the paper's Figure 3 in C and in Rust: the same sums to the last bit, and times that are believed only then.

#![cfg(feature = "driver")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use repro::base::parallel::Workers;
use repro::engine::parameters::Domain;
use repro::engine::phase::NoProbe;
use repro::engine::preset::{Preset, Test};
use repro::engine::simulation::{self, Start};
use repro::experiment::twin::loops::{self, Geometry};
use repro::experiment::twin::outcome::{Asked, TwinAnswer};
use repro::experiment::twin::toolchain::{Compiled, TargetCpu, compile};
use repro::scene::{library, snapshot};

const EXPERIMENT: &str = r#"
schema = 2
id = "small-twin"
title = "Small twin"
question = "Do both languages compute the same?"
analysis = "Compare digests."
scene = "dam-break"
seed = 1
pin = "off"
[twin]
after_step = 3
threads = [1, 1024]
distance_test = ["sqrt", "squared"]
compilers = ["gcc", "clang-999"]
target_cpu = ["portable", "native"]
[mode.quick]
scene = { particle_distance_m = 0.075, end_time_s = 0.03 }
twin = { rounds = 2, passes = 3 }
[mode.default]
twin = { rounds = 1, passes = 1 }
[mode.full]
twin = { rounds = 1, passes = 1 }
"#;

/// The twin compiled here, or nothing and a word about it on a machine that cannot.
fn twin(folder: &Path, target: TargetCpu) -> Option<Compiled> {
    match compile(folder, "gcc", target).unwrap() {
        Ok(compiled) => Some(compiled),
        Err(reason) => {
            eprintln!("skipped: {reason}");
            None
        }
    }
}

/// The twin's answer about particles in a file.
fn run(compiled: &Compiled, particles: &Path, geometry: &Geometry, changes: &[(&str, &str)]) -> Output {
    let point = |[x, y, z]: [f64; 3]| format!("{x},{y},{z}");
    let mut settings = vec![
        ("particles", particles.display().to_string()),
        ("low", point(geometry.domain.low)),
        ("high", point(geometry.domain.high)),
        ("bucket_side", geometry.bucket_side_m.to_string()),
        ("radius", geometry.radius_m.to_string()),
        ("distance_test", "sqrt".to_string()),
        ("threads", "2".to_string()),
        ("passes", "2".to_string()),
        ("seed", "9".to_string()),
    ];
    for (key, value) in changes {
        match settings.iter_mut().find(|(known, _)| known == key) {
            Some((_, old)) => *old = value.to_string(),
            None => settings.push((key, value.to_string())),
        }
    }
    let arguments = settings.iter().map(|(key, value)| format!("{key}={value}"));
    Command::new(&compiled.program).args(arguments).output().unwrap()
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A file of particles at these places.
fn write_particles(path: &Path, particles: &[(&str, [f64; 3])]) {
    let mut text = "id,kind,x_m,y_m,z_m,u_m_s,v_m_s,w_m_s,p_pa,n\n".to_string();
    for (id, (kind, [x, y, z])) in particles.iter().enumerate() {
        text += &format!("{id},{kind},{x},{y},{z},0,0,0,0,0\n");
    }
    fs::write(path, text).unwrap();
}

/// A mixed state of a coarse dam break, and its geometry.
fn mixed_state(path: &Path) -> Geometry {
    let scene = library::load("dam-break", &["particle_distance_m=0.075".to_string()]).unwrap();
    let initial = scene.particles("test").unwrap();
    let parameters = scene.parameters(&initial);
    let options = Preset::PAPER_LINKED_LIST.options();
    let workers = std::sync::Arc::new(Workers::new(2, options.schedule, &[]).unwrap());
    let start = Start { particles: &initial, steps_done: 0 };
    let mut simulation = simulation::build(&parameters, &options, start, workers).unwrap();
    for _ in 0..60 {
        simulation.step(&mut NoProbe).unwrap();
    }
    snapshot::write(path, simulation.particles()).unwrap();
    Geometry::of(&parameters)
}

#[test]
fn both_languages_give_the_same_sums_on_any_threads_and_target() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("particles.csv");
    let geometry = mixed_state(&file);
    let particles = snapshot::read(&file).unwrap();
    for target in [TargetCpu::Portable, TargetCpu::Native] {
        let Some(compiled) = twin(place.path(), target) else {
            return;
        };
        for (test, name) in [(Test::Sqrt, "sqrt"), (Test::Squared, "squared")] {
            for threads in [1, 2] {
                let schedule = Preset::PAPER_LINKED_LIST.options().schedule;
                let workers = Workers::new(threads, schedule, &[]).unwrap();
                let in_rust = loops::measure(&geometry, &particles, test, &workers, 2, 5).unwrap();
                let count = threads.to_string();
                let output =
                    run(&compiled, &file, &geometry, &[("distance_test", name), ("threads", &count)]);
                assert!(output.status.success(), "{}", errors(&output));
                let asked = Asked { particles: particles.len(), threads, passes: 2 };
                let in_c = TwinAnswer::parse(&output.stdout, asked).unwrap();
                assert_eq!(in_c.digest, in_rust.digest, "{name}, {threads} threads, {target:?}");
            }
        }
    }
}

/// A scene at rest does not move before its number density is summed, so the engine's own column is that of the start.
#[test]
fn the_rust_loop_is_the_engines() {
    let sets = ["particle_distance_m=0.075", "effects.gravity=false", "effects.viscosity=false"];
    let scene = library::load("dam-break", &sets.map(String::from)).unwrap();
    let particles = scene.particles("test").unwrap();
    let parameters = scene.parameters(&particles);
    let options = Preset::PAPER_AOS_RELOCATION.options();
    let workers = std::sync::Arc::new(Workers::new(1, options.schedule, &[]).unwrap());
    let start = Start { particles: &particles, steps_done: 0 };
    let mut simulation =
        simulation::build(&parameters, &options, start, std::sync::Arc::clone(&workers)).unwrap();
    simulation.step(&mut NoProbe).unwrap();
    let expected = loops::digest(&simulation.particles().number_density);
    let geometry = Geometry::of(&parameters);
    let answer = loops::measure(&geometry, &particles, Test::Sqrt, &workers, 1, 1).unwrap();
    assert_eq!(answer.digest, expected);
}

const GEOMETRY: Geometry =
    Geometry { domain: Domain::new([-1.0; 3], [3.0; 3]), bucket_side_m: 2.0, radius_m: 1.5 };

/// Distances 1, 1 and 2 within a radius of 1.5, worked out by hand; a ghost and one far outside take no part.
#[test]
fn the_program_in_c_sums_the_formula() {
    let place = tempfile::tempdir().unwrap();
    let Some(compiled) = twin(place.path(), TargetCpu::Portable) else {
        return;
    };
    let file = place.path().join("particles.csv");
    let at = |x| [x, 0.0, 0.0];
    let particles = [
        ("fluid", at(0.0)),
        ("wall", at(1.0)),
        ("ghost", at(1.5)),
        ("dummy_wall", at(2.0)),
        ("fluid", at(99.0)),
    ];
    write_particles(&file, &particles);
    for test in ["sqrt", "squared"] {
        let output = run(&compiled, &file, &GEOMETRY, &[("distance_test", test)]);
        let asked = Asked { particles: 5, threads: 2, passes: 2 };
        let answer = TwinAnswer::parse(&output.stdout, asked).unwrap();
        assert_eq!(answer.digest, loops::digest(&[0.5, 1.0, 0.0, 0.5, 0.0]), "{test}");
    }
}

#[test]
fn the_program_in_c_refuses_what_it_cannot_use() {
    let place = tempfile::tempdir().unwrap();
    let Some(compiled) = twin(place.path(), TargetCpu::Portable) else {
        return;
    };
    let file = place.path().join("particles.csv");
    write_particles(&file, &[("fluid", [0.0; 3]), ("fluid", [1.0, 0.0, 0.0])]);
    let missing = place.path().join("missing.csv").display().to_string();
    for (key, value, word) in [
        ("particles", missing.as_str(), "missing.csv"),
        ("low", "-1,0", "`low`"),
        ("high", "3,3,3,3", "`high`"),
        ("low", "nan,0,0", "finite"),
        ("high", "-9,3,3", "no grid"),
        ("bucket_side", "1e-9", "radius"),
        ("radius", "0", "above 0"),
        ("distance_test", "cube", "squared"),
        ("threads", "0", "1 to 1024"),
        ("passes", "many", "`passes`"),
        ("colour", "red", "10 settings"),
    ] {
        let output = run(&compiled, &file, &GEOMETRY, &[(key, value)]);
        let text = errors(&output);
        assert_eq!(output.status.code(), Some(2), "{key}={value}: {text}");
        assert!(text.starts_with("twin: ") && text.contains(word), "{key}={value}: {text}");
        assert!(output.stdout.is_empty());
    }
    let header = "id,kind,x_m,y_m,z_m,u_m_s";
    for text in [
        String::new(),
        format!("{header}\n"),
        "-1,fluid,0,0,0,0\n0,fluid,0,0,0,0\n".to_string(),
        format!("{header}\n1,fluid,0,0,0,0\n"),
        format!("{header}\n0,fluid,0,nan,0,0\n"),
        format!("{header}\n0,fluid,0,0,0,0\n1,{},0,0,0,0\n", "x".repeat(5000)),
    ] {
        fs::write(&file, &text).unwrap();
        assert_eq!(run(&compiled, &file, &GEOMETRY, &[]).status.code(), Some(2), "{text:?}");
    }
    write_particles(&file, &[("fluid", [0.0; 3]), ("fluid", [0.0; 3])]);
    let output = run(&compiled, &file, &GEOMETRY, &[]);
    assert_eq!(output.status.code(), Some(1));
    assert!(errors(&output).contains("not finite"), "{}", errors(&output));
}

/// A quick run of the experiment in a folder of its own, with these directories to look for compilers in.
fn experiment(place: &Path, path: Option<&str>) -> (PathBuf, Output) {
    let (file, folder) = (place.join("twin.toml"), place.join("run"));
    fs::write(&file, EXPERIMENT).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_repro"));
    command.arg("run").arg(&file).args(["--quick", "--output"]).arg(&folder);
    if let Some(path) = path {
        command.env("PATH", path);
    }
    (folder, command.output().unwrap())
}

/// The columns of `twin.csv` that these tests look at.
fn rows(folder: &Path) -> Vec<[String; 5]> {
    let mut reader = csv::Reader::from_path(folder.join("twin.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let wanted = ["compiler", "threads", "distance_test", "status", "digest"];
    let columns = wanted.map(|name| header.iter().position(|h| h == name).unwrap());
    reader.records().map(|row| columns.map(|c| row.as_ref().unwrap()[c].to_string())).collect()
}

#[test]
fn the_experiment_compares_both_languages() {
    let place = tempfile::tempdir().unwrap();
    if twin(place.path(), TargetCpu::Native).is_none() {
        return;
    }
    let (folder, output) = experiment(place.path(), None);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    let rows = rows(&folder);
    assert_eq!(rows.len(), 2 * 2 * 2 * 2 * (1 + 2 * 2), "rounds, layouts, tests, thread counts, programs");
    for [compiler, threads, test, status, digest] in &rows {
        let here = threads == "1" && compiler != "clang-999";
        assert_eq!(status, if here { "ok" } else { "not_applicable" }, "{compiler} {threads}");
        let rust = rows.iter().find(|row| row[0] == "rustc" && row[1] == "1" && row[2] == *test).unwrap();
        assert!(!here || *digest == rust[4], "{compiler} {test} computed something else");
    }
    let report = fs::read_to_string(folder.join("report.md")).unwrap();
    for words in ["list over relocated is", "there is no clang-999 here", "-ffp-contract=off", "needs 1024"] {
        assert!(report.contains(words), "{words}");
    }
    let record = fs::read_to_string(folder.join("rounds/small-twin-twin-000.json")).unwrap();
    assert!(!record.contains(place.path().to_str().unwrap()), "no path is recorded");
    assert!(!folder.join("states").exists(), "the programs went with the states");

    let doctored = record.replace("\"list_s\":", "\"list_s\":-");
    fs::write(folder.join("rounds/small-twin-twin-000.json"), doctored).unwrap();
    let report = Command::new(env!("CARGO_BIN_EXE_repro")).arg("report").arg(&folder).output().unwrap();
    assert_eq!(report.status.code(), Some(3));
    let text = errors(&report);
    assert!(text.contains("small-twin-twin-000.json") && text.contains("cannot be"), "{text}");
}

#[test]
fn without_a_compiler_only_rust_is_measured() {
    let place = tempfile::tempdir().unwrap();
    let empty = place.path().join("empty");
    fs::create_dir(&empty).unwrap();
    let (folder, output) = experiment(place.path(), empty.to_str());
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    for [compiler, threads, _, status, _] in rows(&folder) {
        let here = threads == "1" && compiler == "rustc";
        assert_eq!(status, if here { "ok" } else { "not_applicable" }, "{compiler} {threads}");
    }
    let report = fs::read_to_string(folder.join("report.md")).unwrap();
    assert!(report.contains("there is no gcc here") && report.contains("No program in C ran"));
}
