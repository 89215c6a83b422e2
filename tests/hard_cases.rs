//! The scenes that are easy to get wrong: free fall, particles alone, on one another or leaving; effects that do nothing.

mod common;

use std::sync::Arc;

use common::{Run, run_scene};
use repro::base::parallel::Workers;
use repro::base::vec3::{Vec3, add_scaled, is_finite, sub};
use repro::engine::diagnostics::{FlowState, LeakWatch, digest};
use repro::engine::error::SimulationError;
use repro::engine::particles::{InitialParticle, Kind, Particles};
use repro::engine::phase::{NoProbe, Phase, Probe};
use repro::engine::preset::{Options, Preset, Test};
use repro::engine::pressure::matrix::Storage;
use repro::engine::simulation::{self, Simulation, Start};
use repro::scene::{Scene, library};

const G: f64 = 9.8;
const DENSITY: f64 = 1000.0;
const ALL_THREE: [Kind; 3] = [Kind::Fluid, Kind::Wall, Kind::DummyWall];

fn scene(name: &str, sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    library::load(name, &sets).unwrap()
}

/// A simulation of the scene on two threads, before its first step.
fn start(scene: &Scene) -> (Vec<InitialParticle>, Box<dyn Simulation>) {
    let particles = scene.particles("test").unwrap();
    let mut options = Preset::PAPER_AOS_RELOCATION.options();
    quick(&mut options);
    let workers = Arc::new(Workers::new(2, options.schedule, &[]).unwrap());
    let first = Start { particles: &particles, steps_done: 0 };
    let simulation = simulation::build(&scene.parameters(&particles), &options, first, workers).unwrap();
    (particles, simulation)
}

fn quick(options: &mut Options) {
    options.distance_test = Test::Squared;
    options.storage = Storage::Csr;
}

/// Where a particle is after `n` steps of free fall: the symplectic Euler method's parabola.
fn parabola(start: &InitialParticle, time_step_s: f64, n: usize) -> Vec3 {
    let n = n as f64;
    let thrown = add_scaled(start.position, n * time_step_s, start.velocity);
    add_scaled(thrown, time_step_s * time_step_s * n * (n + 1.0) / 2.0, [0.0, -G, 0.0])
}

fn largest_component(v: Vec3) -> f64 {
    v.into_iter().fold(0.0, |largest, c| largest.max(c.abs()))
}

#[test]
fn every_scene_has_a_first_step_or_says_why_not() {
    for name in library::names() {
        let sets: &[&str] = if name == "dam-break" { &["particle_distance_m=0.075"] } else { &[] };
        let (_, mut simulation) = start(&scene(name, sets));
        let broken = simulation.step(&mut NoProbe).is_err();
        assert_eq!(broken, name == "coincident-pair", "{name}");
    }
}

#[test]
fn still_water_has_the_same_depth_at_every_particle_distance() {
    for (l0, [across, deep, high]) in
        [(0.02, [5, 10, 13]), (0.0125, [8, 16, 20]), (0.01, [10, 20, 26]), (0.005, [20, 40, 52])]
    {
        let particles =
            scene("still-water", &[&format!("particle_distance_m={l0}")]).particles("test").unwrap();
        let found = ALL_THREE.map(|kind| particles.iter().filter(|p| p.kind == kind).count());
        let tub = |layers: usize| (across + 2 * layers) * (across + 2 * layers) * (high + layers);
        assert_eq!(found, [across * across * deep, tub(2) - tub(0), tub(4) - tub(2)], "l0 = {l0}");
        let heights = |kind: Kind| particles.iter().filter(move |p| p.kind == kind).map(|p| p.position[1]);
        assert_eq!(heights(Kind::Fluid).reduce(f64::min), Some(l0), "a layer above the wall's first at 0");
        assert!((heights(Kind::Fluid).fold(0.0, f64::max) - 0.2).abs() < 1e-12);
        assert!(heights(Kind::Wall).any(|y| y == 0.0));
    }
}

#[test]
fn still_water_carries_its_weight_on_the_floor() {
    let scene = scene("still-water", &["particle_distance_m=0.02", "time_step_s=0.003"]);
    let (_, mut simulation) = start(&scene);
    let (mut sum, mut count) = (0.0, 0.0);
    for step in 1..=150 {
        let report = simulation.step(&mut NoProbe).unwrap();
        assert_eq!(report.ghosts, 0);
        let Particles { kind, position, pressure, .. } = simulation.particles();
        let under_water = |x: &Vec3| x[1] == 0.0 && [x[0], x[2]].iter().all(|c| *c > 0.0 && *c < 0.11);
        let floor =
            (0..kind.len()).filter(|&i| step > 50 && kind[i] == Kind::Wall && under_water(&position[i]));
        for i in floor {
            (sum, count) = (sum + pressure[i], count + 1.0);
        }
    }
    // The floor's particles lie a particle distance below the lowest fluid.
    let (mean, expected) = (sum / count, DENSITY * G * 0.2);
    assert!((mean / expected - 1.0).abs() < 0.1, "{mean} Pa instead of about {expected} Pa");
}

#[test]
fn a_falling_block_stays_a_block_without_pressure() {
    let scene = scene("falling-block", &[]);
    let (initial, mut simulation) = start(&scene);
    let mut largest_pressure = 0.0f64;
    for _ in 0..scene.steps() {
        simulation.step(&mut NoProbe).unwrap();
        largest_pressure = largest_pressure.max(FlowState::of(simulation.particles()).max_pressure_pa);
    }
    let (height_m, l0) = (0.2, scene.particle_distance_m);
    let fallen = initial[0].position[1] - simulation.particles().position[0][1];
    assert!(fallen > 5.0 * height_m, "{fallen} m");
    assert!(largest_pressure < 1e-3 * DENSITY * G * height_m, "{largest_pressure} Pa");
    for (start, &x) in initial.iter().zip(&simulation.particles().position) {
        let off = largest_component(sub(x, parabola(start, scene.time_step_s, scene.steps())));
        assert!(off < 0.05 * l0, "{off} m off the parabola at {x:?}");
    }
    assert_eq!(simulation.particles().count(Kind::Fluid), initial.len());
}

#[test]
fn a_lone_particle_flies_on_the_discrete_parabola() {
    let scene = scene("lone-particle", &[]);
    let (initial, mut simulation) = start(&scene);
    for step in 1..=scene.steps() {
        let report = simulation.step(&mut NoProbe).unwrap();
        assert_eq!((report.ghosts, report.pressure.unwrap().unknowns), (0, 0));
        let x = simulation.particles().position[0];
        let off = largest_component(sub(x, parabola(&initial[0], scene.time_step_s, step)));
        assert!(off < 1e-12, "{off} m off in step {step}");
    }
}

#[test]
fn a_coincident_pair_ends_the_run_in_its_first_step() {
    let scene = scene("coincident-pair", &[]);
    let (initial, mut simulation) = start(&scene);
    let pair = (initial.len() - 2, initial.len() - 1);
    let error = simulation.step(&mut NoProbe).unwrap_err();
    let SimulationError::Coincident { step: 1, particle, other, .. } = error else {
        panic!("{error}");
    };
    assert_eq!((particle, other), pair);
}

#[test]
fn a_leaver_is_counted_once_and_disturbs_nobody() {
    let scene = scene("leaver", &[]);
    let (initial, mut simulation) = start(&scene);
    let leaver = initial.len() - 1;
    let mut ghosts = Vec::new();
    for _ in 0..scene.steps() {
        ghosts.push(simulation.step(&mut NoProbe).unwrap().ghosts);
        let alive = simulation.particles().count(Kind::Fluid);
        assert_eq!(alive + ghosts[ghosts.len() - 1], initial.len());
    }
    assert!(ghosts.is_sorted() && ghosts[0] == 0 && ghosts[ghosts.len() - 1] == 1, "{ghosts:?}");
    let particles = simulation.particles();
    assert_eq!((particles.kind[leaver], particles.velocity[leaver]), (Kind::Ghost, [0.0; 3]));
    for (i, start) in initial[..leaver].iter().enumerate() {
        let off = sub(particles.position[i], parabola(start, scene.time_step_s, scene.steps()));
        assert!(largest_component(off) < 1e-12, "particle {i} felt the leaver");
        assert!(is_finite(particles.velocity[i]) && particles.pressure[i].is_finite());
    }
}

/// Fewer unknowns than a block of the solver holds, dealt to more threads than there are blocks.
#[test]
fn a_drop_may_be_smaller_than_a_share_of_the_solver() {
    let scene = scene("leaver", &[]);
    let run = |threads| {
        let run = Run { steps: 3, threads, change: quick, ..Run::default() };
        let (simulation, report) = run_scene(&scene, &run);
        (report.pressure.unwrap().unknowns, digest(simulation.particles()))
    };
    let alone = run(1);
    assert!(alone.0 > 0 && alone.0 < 256, "{}", alone.0);
    assert_eq!(run(3), alone);
}

/// The dam break with twice the paper's time step at twice its particle distance, where the textbook's walls leak.
#[test]
fn walls_with_contact_hold_the_dam_break() {
    let scene = scene(
        "dam-break",
        &[
            "particle_distance_m=0.0375",
            "time_step_s=0.006",
            "effects.wall_contact.height=0.7",
            "effects.wall_contact.reach=0.75",
            "effects.pressure.kernel_floor=0.5",
        ],
    );
    let (initial, mut simulation) = start(&scene);
    let mut watch = LeakWatch::new(&initial, scene.particle_distance_m);
    for _ in 0..scene.steps() {
        simulation.step(&mut NoProbe).unwrap();
        watch.look(simulation.particles());
    }
    assert_eq!(watch.count(), 0);
}

/// Notes which phases there were.
#[derive(Default)]
struct Phases(Vec<Phase>);

impl Probe for Phases {
    fn begin(&mut self, phase: Phase) {
        if !self.0.contains(&phase) {
            self.0.push(phase);
        }
    }

    fn end(&mut self, _: Phase) {}
}

/// The dam break with some changes after fifty steps, and its phases.
fn changed_dam_break(sets: &[&str]) -> (Box<dyn Simulation>, Vec<Phase>) {
    let mut all = vec!["particle_distance_m=0.0375"];
    all.extend(sets);
    let (_, mut simulation) = start(&scene("dam-break", &all));
    let mut phases = Phases::default();
    for _ in 0..50 {
        simulation.step(&mut phases).unwrap();
    }
    (simulation, phases.0)
}

fn assert_same_flow(a: &Particles, b: &Particles) {
    assert_eq!(a.kind, b.kind);
    let columns = |p: &Particles| -> Vec<f64> {
        p.position.iter().chain(&p.velocity).flatten().chain(&p.pressure).copied().collect()
    };
    for (a, b) in columns(a).into_iter().zip(columns(b)) {
        assert!((a - b).abs() <= 1e-14 * a.abs().max(b.abs()), "{a} and {b}");
    }
}

/// What a scene does not name costs nothing and does what a coefficient of zero does.
#[test]
fn no_viscosity_is_zero_viscosity_without_its_phase() {
    let (without, phases) = changed_dam_break(&["effects.viscosity=false"]);
    let (zero, phases_of_zero) = changed_dam_break(&["effects.viscosity.kinematic_viscosity_m2_s=0"]);
    assert_same_flow(without.particles(), zero.particles());
    assert!(!phases.contains(&Phase::Viscosity) && phases_of_zero.contains(&Phase::Viscosity));
    assert_eq!(phases.len() + 1, phases_of_zero.len());
    assert!(without.bytes() <= zero.bytes(), "{} and {}", without.bytes(), zero.bytes());
}

#[test]
fn no_wall_contact_is_contact_with_nobody_without_its_phase_and_columns() {
    let (without, phases) = changed_dam_break(&[]);
    let nowhere = ["effects.wall_contact.height=1e-9", "effects.wall_contact.reach=1e-9"];
    let (nobody, phases_of_nobody) = changed_dam_break(&nowhere);
    assert_same_flow(without.particles(), nobody.particles());
    assert!(!phases.contains(&Phase::WallContact) && phases_of_nobody.contains(&Phase::WallContact));
    assert_eq!(phases.len() + 1, phases_of_nobody.len());
    let columns = 2 * size_of::<Vec3>() * without.particles().len();
    assert_eq!(without.bytes() + columns, nobody.bytes());
}

#[test]
fn no_collision_is_collision_of_nobody_without_its_phase_and_column() {
    let (without, phases) = changed_dam_break(&["effects.collision=false"]);
    let (nobody, phases_of_nobody) = changed_dam_break(&["effects.collision.distance=1e-9"]);
    assert_same_flow(without.particles(), nobody.particles());
    assert!(!phases.contains(&Phase::Collision) && phases_of_nobody.contains(&Phase::Collision));
    assert_eq!(phases.len() + 1, phases_of_nobody.len());
    let column = size_of::<Vec3>() * without.particles().len();
    assert_eq!(without.bytes() + column, nobody.bytes());
}
