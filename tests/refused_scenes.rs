//! What is wrong with a scene is said before anything is written: no folder, no file, and the command ends with 2.

#![cfg(feature = "driver")]

use std::fs;
use std::path::Path;
use std::process::Command;

/// A tank of water at toy size, to which tests add what is wrong.
const SCENE: &str = r#"
schema = 1
name = "tank"
description = "A small tank."
dimensions = 2
particle_distance_m = 0.1
time_step_s = 0.002
end_time_s = 0.01
fluid = { density_kg_m3 = 1000.0 }
radii = { number_density = 2.1, gradient = 2.1, laplacian = 3.1 }
domain = { margin_m = 0.5, headroom_m = 0.0 }
effects.gravity = { acceleration_m_s2 = [0.0, -9.8, 0.0] }
effects.viscosity = { kinematic_viscosity_m2_s = 1e-6 }
effects.pressure = { surface_threshold = 0.97, source_relaxation = 0.2, compressibility_1_pa = 0.45e-9 }
geometry.lattice = { extent_m = [1.0, 1.0, 0.0], layers = 4 }
[[geometry.region]]
fill = "wall"
from_m = [0, 0, 0]
to_m = [1, 1, 0]
layers_below = [2, 2, 0]
layers_above = [2, 0, 0]
[[geometry.region]]
fill = "fluid"
from_m = [0, 0, 0]
to_m = [1, 0.5, 0]
"#;

/// Runs the scene in `file` with `more` arguments: it must be refused with all `words`, and leave the folder as it was.
#[track_caller]
fn refused(folder: &Path, scene: &str, more: &[&str], words: &[&str]) {
    let (file, out) = (folder.join("tank.toml"), folder.join("out"));
    fs::write(&file, scene).unwrap();
    let before = names(folder);
    let arguments = ["simulate", file.to_str().unwrap(), "--threads", "1", "--output", out.to_str().unwrap()];
    let output = Command::new(env!("CARGO_BIN_EXE_repro")).args(arguments).args(more).output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{text}");
    for word in words {
        assert!(text.contains(word), "`{word}` is not in: {text}");
    }
    assert_eq!(names(folder), before, "{words:?}: something was written");
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap().flatten();
    let mut names: Vec<String> = entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn simulate(scene: &Path, more: &[&str]) {
    let arguments = ["simulate", scene.to_str().unwrap(), "--threads", "1", "--quiet"];
    let output = Command::new(env!("CARGO_BIN_EXE_repro")).args(arguments).args(more).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn wrong_scenes_leave_nothing_behind() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let added = |more: &str| format!("{SCENE}\n{more}");
    let changed = |from: &str, to: &str| {
        assert!(SCENE.contains(from), "{from}");
        SCENE.replace(from, to)
    };
    let file = "tank.toml";
    // Regions that another covers, that hold nothing, and that lie outside.
    let over = added("[[geometry.region]]\nfill = \"wall\"\nfrom_m = [0, 0, 0]\nto_m = [1, 0.5, 0]\n");
    refused(folder, &over, &[], &[file, "geometry.region[1]", "later regions cover", "put it after"]);
    let ball = |center: &str, radius: &str| {
        added(&format!(
            "[[geometry.region]]\nfill = \"wall\"\nsphere = {{ center_m = {center}, radius_m = {radius} }}\n"
        ))
    };
    refused(folder, &ball("[0.55, 0.85, 0]", "0.01"), &[], &[file, "geometry.region[2]", "no lattice point"]);
    refused(folder, &ball("[9, 9, 0]", "0.2"), &[], &[file, "geometry.region[2]", "outside the lattice"]);
    // Particles where there is no place for them.
    let single = |position: &str| {
        added(&format!("[[geometry.particle]]\nkind = \"fluid\"\nposition_m = {position}\n"))
    };
    refused(folder, &single("[0.5, 0.7, 0.3]"), &[], &[file, "geometry.particle[0].position_m", "must be 0"]);
    let ring = single("[1.5, 0.7, 0]").replace("headroom_m = 0.0", "headroom_m = 0.0, periodic = [\"x\"]");
    refused(folder, &ring, &[], &[file, "geometry.particle[0].position_m", "periodic axis x", "up to"]);
    // Effects that contradict each other, or lack another one.
    let both = changed(
        "[[geometry.region]]\nfill = \"wall\"",
        "[effects.implicit_viscosity]\nkinematic_viscosity_m2_s = 1e-6\n[[geometry.region]]\nfill = \"wall\"",
    );
    let words = [file, "effects.viscosity", "effects.implicit_viscosity", "leave one of them out"];
    refused(folder, &both, &[], &words);
    let alone = changed("effects.viscosity = {", "effects.turbulence = { smagorinsky_constant = 0.1 } #");
    refused(
        folder,
        &alone,
        &[],
        &[file, "effects.turbulence", "named alone", "effects.viscosity", "as well"],
    );
    let unmoved = changed("effects.viscosity = {", "effects.wall_motion = {} #");
    refused(
        folder,
        &unmoved,
        &[],
        &[file, "effects.wall_motion", "where no group moves", "leave this one out"],
    );
    // Units.
    let heavy = changed("1000.0", "1e9");
    refused(folder, &heavy, &[], &[file, "fluid.density_kg_m3", "1000000000", "kg/m3"]);
    // Probes.
    let probe = |measure: &str| added(&format!("[[probe]]\nname = \"p\"\nmeasure.{measure}\n"));
    let outside = probe("point_pressure = { at_m = [7.0, 0.2, 0.0] }");
    let words = [file, "probe[0].measure.point_pressure.at_m", "7.0", "domain", "move the probe"];
    refused(folder, &outside, &[], &words);
    refused(folder, &probe("gauge = { x_m = -3, z_m = 0 }"), &[], &[file, "probe[0].measure.gauge", "-3.0"]);
    let nobody = probe("group_force = { group = \"lid\" }");
    refused(folder, &nobody, &[], &[file, "probe[0].measure.group_force.group", "`lid`", "groups"]);
}

#[test]
fn a_surface_that_leaks_leaves_nothing_behind() {
    let place = tempfile::tempdir().unwrap();
    let text = "solid open\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
                endfacet\nendsolid open\n";
    fs::write(place.path().join("open.stl"), text).unwrap();
    let scene = format!("{SCENE}\n[[geometry.region]]\nfill = \"wall\"\nstl = {{ file = \"open.stl\" }}\n");
    let words = ["tank.toml", "geometry.region[2].stl.file", "open.stl", "every edge"];
    refused(place.path(), &scene, &[], &words);
}

#[test]
fn checkpoints_that_do_not_fit_leave_nothing_behind() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let (scene, first) = (folder.join("tank.toml"), folder.join("first"));
    fs::write(&scene, SCENE).unwrap();
    simulate(&scene, &["--steps", "3", "--checkpoint-every", "1", "--output", first.to_str().unwrap()]);
    let good = fs::read(first.join("state.checkpoint")).unwrap();
    let bad = folder.join("bad.checkpoint");
    let restart = ["--restart", bad.to_str().unwrap()];
    let again = "--checkpoint-every";
    fs::write(&bad, &good[..good.len() / 2]).unwrap();
    refused(folder, SCENE, &restart, &["bad.checkpoint", "cut off or changed", again]);
    fs::write(&bad, "id,kind,x_m\n0,fluid,1\n").unwrap();
    refused(folder, SCENE, &restart, &["bad.checkpoint", "no checkpoint", again]);
    fs::write(&bad, &good).unwrap();
    let other = SCENE.replace("to_m = [1, 0.5, 0]", "to_m = [1, 0.5, 0]\nvelocity_m_s = [0.1, 0, 0]");
    let other = other.replace("1e-6", "2e-6");
    refused(folder, &other, &restart, &["bad.checkpoint", "of another scene", "--set"]);
}
