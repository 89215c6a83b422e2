//! The scenes of frames, moving walls, flow boundaries and bodies, each at toy size; and what wrong tables are told.

#[path = "common/mod.rs"]
mod common;

use common::{Run, run_scene};
use repro::engine::particles::{Kind, Particles};
use repro::scene::{Scene, library};

/// A scene with few particles, and the particles after some steps of it.
fn run(name: &str, sets: &[&str], steps: usize) -> (Scene, Particles) {
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    let scene = library::load(name, &sets).unwrap();
    let (simulation, report) = run_scene(&scene, &Run { steps, ..Run::default() });
    assert_eq!(report.ghosts, 0, "{name}: nobody leaves the domain");
    let particles = simulation.particles().clone();
    assert!(particles.position.iter().flatten().all(|x| x.is_finite()));
    (scene, particles)
}

fn fluid(particles: &Particles) -> impl Iterator<Item = usize> + '_ {
    (0..particles.len()).filter(|&i| particles.kind[i] == Kind::Fluid)
}

fn mean(particles: &Particles, axis: usize) -> f64 {
    let count = fluid(particles).count() as f64;
    fluid(particles).map(|i| particles.position[i][axis]).sum::<f64>() / count
}

#[test]
fn water_sways_against_the_tank() {
    let (_, particles) = run("sloshing-tank", &["particle_distance_m=0.08", "time_step_s=0.003"], 100);
    assert!((mean(&particles, 0) - 0.92).abs() > 0.002, "{}", mean(&particles, 0));
}

#[test]
fn water_climbs_the_wall_of_a_cup_that_turns() {
    let sets = ["particle_distance_m=0.05", "time_step_s=0.002", "effects.frame.spin_up_s=0"];
    let (_, particles) = run("rotating-cup", &sets, 150);
    let top = |from: f64, to: f64| {
        let within = |&i: &usize| (from..to).contains(&particles.position[i][0]);
        fluid(&particles).filter(within).map(|i| particles.position[i][1]).fold(0.0, f64::max)
    };
    assert!(top(0.0, 0.15) > top(0.4, 0.65) + 0.05, "{} {}", top(0.0, 0.15), top(0.4, 0.65));
}

#[test]
fn the_piston_is_where_its_motion_says_and_pushes() {
    let sets = ["particle_distance_m=0.06", "time_step_s=0.003"];
    let (scene, particles) = run("piston-wave", &sets, 120);
    let start = scene.particles("test").unwrap();
    let piston: Vec<usize> = (0..start.len()).filter(|&i| start[i].group == 1).collect();
    assert!(piston.len() > 20);
    let time_s = 120.0 * 0.003;
    let q: f64 = time_s / 1.26;
    let place = 0.03 * q * q * (3.0 - 2.0 * q) * (std::f64::consts::TAU * 0.7937 * time_s).sin();
    for &i in &piston {
        assert!((particles.position[i][0] - start[i].position[0] - place).abs() < 1e-12);
    }
    assert!(fluid(&particles).any(|i| particles.velocity[i][0] > 0.01));
}

#[test]
fn a_mould_fills_at_the_rate_of_its_opening() {
    let sets = ["particle_distance_m=0.02", "time_step_s=0.001"];
    let (_, particles) = run("filling-mould", &sets, 400);
    // Five particles a layer, and a layer each 0.04 s.
    let layers = fluid(&particles).count() / 5;
    assert!((9..=10).contains(&layers), "{layers}");
}

#[test]
fn a_box_that_floats_keeps_its_shape() {
    let sets = ["particle_distance_m=0.02", "time_step_s=0.001"];
    let (scene, particles) = run("floating-box", &sets, 150);
    let start = scene.particles("test").unwrap();
    let body: Vec<usize> = (0..start.len()).filter(|&i| start[i].kind == Kind::Body).collect();
    assert_eq!(body.len(), 100);
    let apart = |a: [f64; 3], b: [f64; 3]| (a[0] - b[0]).hypot(a[1] - b[1]);
    for &i in &body {
        let before = apart(start[i].position, start[body[0]].position);
        let after = apart(particles.position[i], particles.position[body[0]]);
        assert!((before - after).abs() < 1e-14);
    }
}

fn refused(name: &str, sets: &[&str], words: &[&str]) {
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    let text = library::load(name, &sets).unwrap_err().to_string();
    assert!(words.iter().all(|word| text.contains(word)), "{sets:?}: {text}");
}

#[test]
fn wrong_tables_are_refused_with_their_key() {
    refused("floating-box", &["effects.rigid_bodies=false"], &["geometry.region[5].fill", "rigid_bodies"]);
    refused("piston-wave", &["effects.wall_motion=false"], &["group[0].motion", "effects.wall_motion"]);
    refused("filling-mould", &["effects.flow_boundaries.reserve=39"], &["reserve", "40"]);
    refused("rotating-cup", &["effects.frame.spin_up_s=-1"], &["effects.frame.spin_up_s", "from 0 up"]);
    let table = ["effects.frame.acceleration_table=nowhere.csv"];
    refused("rotating-cup", &table, &["effects.frame.acceleration_table", "nowhere.csv", "time_s, x_m_s2"]);
}

#[test]
fn a_reserve_that_runs_out_names_its_key() {
    use repro::engine::phase::NoProbe;
    let sets = ["particle_distance_m=0.02", "time_step_s=0.001", "effects.flow_boundaries.reserve=24"];
    let scene = library::load("filling-mould", &sets.map(String::from)).unwrap();
    let (mut simulation, _) = run_scene(&scene, &Run { steps: 1, ..Run::default() });
    let error = (0..200).find_map(|_| simulation.step(&mut NoProbe).err()).unwrap().to_string();
    assert!(error.contains("effects.flow_boundaries.reserve"), "{error}");
}

#[test]
fn motions_and_accelerations_come_from_tables_beside_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("shake.csv"), "time_s,x_m_s2,y_m_s2,z_m_s2\n0,0,0,0\n1,2,0,0\n")
        .unwrap();
    let text = std::fs::read_to_string("experiments/scenes/sloshing-tank.toml").unwrap();
    let text = text.replace("[effects.frame]", "[effects.frame]\nacceleration_table = \"shake.csv\"");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let name = path.to_str().unwrap();
    let scene = library::load(name, &[]).unwrap();
    let frame = scene.parameters(&scene.particles("test").unwrap()).effects.frame.unwrap();
    assert_eq!(frame.table.unwrap().at(0.5), [1.0, 0.0, 0.0]);
    std::fs::write(folder.path().join("shake.csv"), "time_s,x_m_s2,y_m_s2,z_m_s2\n1,0,0,0\n1,2,0,0\n")
        .unwrap();
    refused(name, &[], &["effects.frame.acceleration_table", "ascend", "line 3"]);
}
