//! Both models of tension: the work of pulling a body apart, and the scenes that use them.

use std::sync::Arc;

use repro::base::parallel::Workers;
use repro::base::schedule::Schedule;
use repro::engine::parameters::{Domain, Parameters};
use repro::engine::particles::{InitialParticle, Kind};
use repro::engine::phase::NoProbe;
use repro::engine::preset::Preset;
use repro::engine::simulation::{self, Simulation, Start};
use repro::scene::Scene;
use repro::scene::validation::drop::{Drop, Model};

fn simulation(parameters: &Parameters, particles: &[InitialParticle]) -> Box<dyn Simulation> {
    let workers = Arc::new(Workers::new(1, Schedule::Static, &[]).unwrap());
    let start = Start { particles, steps_done: 0 };
    simulation::build(parameters, &Preset::PAPER_LINKED_LIST.options(), start, workers).unwrap()
}

/// Two slabs of the lattice without ends, a gap apart. The force on the upper one for each metre, from the velocities after
/// one step without pressure.
fn force(model: Model, gap: f64) -> f64 {
    const ACROSS: i32 = 10;
    let drop = Drop::new(model, 10, 0.0);
    let (l0, mut parameters) = (drop.particle_distance(), drop.parameters());
    let period = l0 * f64::from(ACROSS);
    parameters.domain =
        Domain { periodic: [true, false, false], ..Domain::new([0.0, -3.0, 0.0], [period, 3.0, 0.0]) };
    parameters.effects.pressure = None;
    parameters.effects.collision = None;
    parameters.time_step_s = 1e-6;
    let mut particles = Vec::new();
    for ix in 0..ACROSS {
        for iy in -9..9 {
            let raised = if iy < 0 { 0.0 } else { gap };
            let [x, y] = [ix, iy].map(|k| (f64::from(k) + 0.5) * l0);
            particles.push(InitialParticle::at_rest(Kind::Fluid, [x, y + raised, 0.0]));
        }
    }
    let mut simulation = simulation(&parameters, &particles);
    simulation.step(&mut NoProbe).unwrap();
    let upper = simulation.particles().velocity.iter().zip(&particles).filter(|(_, p)| p.position[1] > 0.0);
    let acceleration: f64 = upper.map(|(u, _)| u[1] / parameters.time_step_s).sum();
    -acceleration * l0 * l0 / period
}

/// Two surfaces come into being, each with `sigma` = 1, by Simpson's rule over gaps up to where nothing pulls any more.
#[test]
fn pulling_a_body_apart_takes_twice_the_tension() {
    for model in Model::ALL {
        let (steps, farthest) = (400, 0.41);
        let width = farthest / f64::from(steps);
        let work: f64 = (0..=steps)
            .map(|k| {
                let weight = if k == 0 || k == steps { 1.0 } else { f64::from(2 + 2 * (k % 2)) };
                weight * force(model, width * f64::from(k)) * width / 3.0
            })
            .sum();
        println!("{model:?}: work {work}");
        assert!((work - 2.0).abs() < 2e-3, "{model:?}: {work}");
    }
}

/// The scenes run at toy size, lose no particle and keep finite numbers.
#[test]
fn the_scenes_run_at_toy_size() {
    let scenes = [
        ("oscillating-drop", include_str!("../experiments/scenes/oscillating-drop.toml"), "0.0001", "1.5e-5"),
        ("drop-impact", include_str!("../experiments/scenes/drop-impact.toml"), "0.0005", "2e-5"),
    ];
    for (name, text, distance, step) in scenes {
        let sets = [format!("particle_distance_m={distance}"), format!("time_step_s={step}")];
        let scene = Scene::parse(text, name, &sets).unwrap();
        let particles = scene.particles(name).unwrap();
        let mut simulation = simulation(&scene.parameters(&particles), &particles);
        for _ in 0..200 {
            let report = simulation.step(&mut NoProbe).unwrap();
            assert_eq!(report.ghosts, 0, "{name}");
        }
        let speeds = simulation.particles().velocity.iter().flatten().map(|u| u.abs());
        let fastest = speeds.fold(0.0, f64::max);
        assert!(fastest > 1e-6 && fastest < 5.0, "{name}: {fastest}");
    }
}

/// Two tensions of one surface are refused, as are angles that are none.
#[test]
fn impossible_tensions_are_refused() {
    let text = include_str!("../experiments/scenes/oscillating-drop.toml");
    let refused = |sets: &[&str], words: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
        let error = Scene::parse(text, "test.toml", &sets).unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    };
    let potential = "effects.potential_tension.surface_tension_n_m=0.07";
    refused(&[potential], &["effects.potential_tension", "effects.surface_tension", "leave one"]);
    refused(&["effects.surface_tension.surface_tension_n_m=-1"], &["surface_tension_n_m", "from 0 up"]);
    refused(&["effects.surface_tension.radius=1"], &["effects.surface_tension.radius", "1.5 to 10"]);
    let angle = "effects.potential_tension.contact_angle_deg=190";
    let alone = ["effects.surface_tension=false", potential, angle];
    refused(&alone, &["effects.potential_tension.contact_angle_deg", "0 to 180"]);
}

/// A coefficient of zero is the same as no tension.
#[test]
fn no_tension_is_as_good_as_none_named() {
    for model in Model::ALL {
        let drop = Drop { surface_tension: 0.0, ..Drop::new(model, 6, 0.0) };
        let particles = drop.lattice(|x, y| x * x + y * y < 1.0, |x, y| [0.1 * x, -0.1 * y, 0.0]);
        let mut parameters = drop.parameters();
        let mut with_zero = simulation(&parameters, &particles);
        parameters.effects.potential_tension = None;
        parameters.effects.surface_tension = None;
        let mut without = simulation(&parameters, &particles);
        for _ in 0..5 {
            with_zero.step(&mut NoProbe).unwrap();
            without.step(&mut NoProbe).unwrap();
        }
        let pairs = with_zero.particles().velocity.iter().zip(&without.particles().velocity);
        let differs = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).any(|d| (a[d] - b[d]).abs() > 1e-14);
        assert!(!pairs.into_iter().any(differs), "{model:?}");
    }
}
