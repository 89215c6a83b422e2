//! A scene that is a file of whoever runs it, with the STL files that it names, is in the archive of the run, and the archive's
//! experiment finds it there.

#![cfg(feature = "driver")]

#[path = "common/small_run.rs"]
mod small_run;

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use zip::ZipArchive;

use small_run::{repro, run, text};

const EXPERIMENT: &str = r#"
schema = 2
id = "mine"
title = "TITLE"
question = "QUESTION"
analysis = "ANALYSIS"
scene = "SCENE"
seed = 1
pin = "off"
[[case]]
id = "fall"
title = "CASE"
scene = "SCENE"
[mode.quick]
observed = { rounds = 1 }
[mode.default]
observed = { rounds = 1 }
[mode.full]
observed = { rounds = 1 }
"#;

const SCENE: &str = r#"
# A cube of water above a cube of wall.
schema = 1
name = "two-cubes"
description = "A cube of water falls onto a cube of wall."
particle_distance_m = 0.1
time_step_s = 0.002
end_time_s = 0.01
fluid = { density_kg_m3 = 1000.0 }
radii = { number_density = 2.1, gradient = 2.1, laplacian = 3.1 }
domain = { margin_m = 0.5, headroom_m = 0.0 }
effects.gravity = { acceleration_m_s2 = [0.0, -9.8, 0.0] }
geometry.lattice = { extent_m = [1.0, 1.0, 1.0], layers = 0 }
[[geometry.region]]
fill = "wall"
stl = { file = "../meshes/cube.stl", scale = 0.4, translate_m = [0.21, 0.01, 0.21] }
[[geometry.region]]
fill = "fluid"
stl = { file = "cube.stl", scale = 0.4, translate_m = [0.21, 0.51, 0.21] }
"#;

/// A cube from 0 to 1, as text.
fn cube() -> String {
    let corner = |k: usize| [k & 1, k >> 1 & 1, k >> 2 & 1].map(|x| x.to_string()).join(" ");
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let facets = triangles.map(|corners| {
        let vertices = corners.map(|k| format!("vertex {}\n", corner(k))).concat();
        format!("facet normal 0 0 0\nouter loop\n{vertices}endloop\nendfacet\n")
    });
    format!("solid cube\n{}endsolid cube\n", facets.collect::<String>())
}

/// The particles and the last state of a run's only trial.
fn outcome(run: &Path) -> (Value, Value) {
    let round = fs::read_to_string(run.join("rounds/mine-observed-000.json")).unwrap();
    let round: Value = serde_json::from_str(&round).unwrap();
    let seen = &round["trials"][0]["observation"];
    (seen["particles"].clone(), seen["digest"].clone())
}

fn unpacked(zip: &Path, folder: &Path) {
    ZipArchive::new(File::open(zip).unwrap()).unwrap().extract(folder).unwrap();
}

#[test]
fn an_archive_has_the_scene_and_its_solids_and_runs_again_from_them() {
    let place = tempfile::tempdir().unwrap();
    let here = |name: &str| -> PathBuf { place.path().join(name) };
    for (name, content) in
        [("meshes/cube.stl", cube()), ("mine/cube.stl", cube()), ("mine/tank.toml", SCENE.to_string())]
    {
        fs::create_dir_all(here(name).parent().unwrap()).unwrap();
        fs::write(here(name), content).unwrap();
    }
    let scene = here("mine/tank.toml");
    let folder = run(place.path(), "first", &EXPERIMENT.replace("SCENE", scene.to_str().unwrap()));
    let first = outcome(&folder);
    assert!(first.0.as_u64().unwrap() >= 2 * 27, "{first:?}");
    let archived = repro(&["archive", folder.to_str().unwrap()]);
    assert!(archived.status.success(), "{}", text(&archived.stderr));

    let elsewhere = here("elsewhere");
    unpacked(&here("first.zip"), &elsewhere);
    for gone in ["meshes", "mine", "first"] {
        fs::remove_dir_all(here(gone)).unwrap();
    }
    let read_me = fs::read_to_string(elsewhere.join("README.md")).unwrap();
    assert!(!read_me.contains("not here"), "every scene is: {read_me}");
    let again = Command::new(env!("CARGO_BIN_EXE_repro"))
        .args(["run", "experiments/mine.toml", "--quick", "--output", "again"])
        .current_dir(&elsewhere)
        .output()
        .unwrap();
    assert!(again.status.success(), "{}", text(&again.stderr));
    assert_eq!(outcome(&elsewhere.join("again")), first);
}
