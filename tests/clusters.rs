//! The preset `fast`: clusters, their list as the matrix, two levels.

#[path = "common/toy.rs"]
#[allow(dead_code)]
mod toy;

use std::sync::Arc;

use repro::base::parallel::Workers;
use repro::engine::columns::SavedState;
use repro::engine::particles::{InitialParticle, Kind};
use repro::engine::phase::NoProbe;
use repro::engine::preset::{DryWalls, Options, Preset};
use repro::engine::pressure::preconditioner::Preconditioning;
use repro::engine::pressure::values::MatrixValues;
use repro::engine::simulation::{self, Simulation, Start};
use repro::scene::{Scene, library};
use toy::TOYS;

/// Farthest that a particle of the dam break may be from where the paper's preset has it after 20 steps, metres, with the
/// same equations: some tens of roundings.
const SAME_EQUATIONS_M: f64 = 1e-13;
/// The same with rounded matrix values and another solver, both of whose answers are right to 1e-8.
const SAME_TOLERANCE_M: f64 = 1e-9;

fn dam_break(l0: f64) -> Scene {
    library::load("dam-break", &[format!("particle_distance_m={l0}")]).unwrap()
}

fn simulation(scene: &Scene, options: &Options, threads: usize) -> Box<dyn Simulation> {
    let particles = scene.particles("test").unwrap();
    let workers = Arc::new(Workers::new(threads, options.schedule, &[]).unwrap());
    let start = Start { particles: &particles, steps_done: 0 };
    simulation::build(&scene.parameters(&particles), options, start, workers).unwrap()
}

fn after(scene: &Scene, options: &Options, threads: usize, steps: usize) -> Box<dyn Simulation> {
    let mut simulation = simulation(scene, options, threads);
    for _ in 0..steps {
        simulation.step(&mut NoProbe).unwrap();
    }
    simulation
}

/// Of all particles and coordinates.
fn farthest(a: &dyn Simulation, b: &dyn Simulation) -> f64 {
    let pairs = a.particles().position.iter().zip(&b.particles().position);
    pairs.flat_map(|(a, b)| [0, 1, 2].map(|d| (a[d] - b[d]).abs())).fold(0.0, f64::max)
}

fn state(simulation: &mut dyn Simulation) -> SavedState {
    let mut state = SavedState::default();
    state.keep(|visitor| simulation.visit(visitor));
    state
}

fn fast() -> Options {
    Preset::FAST.options()
}

#[test]
fn twenty_steps_are_those_of_the_papers_preset() {
    for l0 in [0.0375, 0.025] {
        let scene = dam_break(l0);
        let paper = after(&scene, &Preset::PAPER_LINKED_LIST.options(), 2, 20);
        let mut same = Options { matrix_values: MatrixValues::F64, dry_walls: DryWalls::Solved, ..fast() };
        same.cg.preconditioner = Preconditioning::None;
        let found = [same, fast()].map(|options| farthest(&*after(&scene, &options, 2, 20), &*paper));
        println!("l0 = {l0} m: {:e} m with the same equations, {:e} m as it is", found[0], found[1]);
        assert!(found[0] <= SAME_EQUATIONS_M && found[1] <= SAME_TOLERANCE_M, "{found:?}");
    }
}

/// Walls that no fluid comes near change what the solver's tolerance leaves open anyway, and no more.
#[test]
fn dry_walls_may_as_well_be_known() {
    for (l0, steps) in [(0.025, 1), (0.0375, 20)] {
        let scene = dam_break(l0);
        let after = |dry_walls, tolerance| {
            let mut options = Options { matrix_values: MatrixValues::F64, dry_walls, ..fast() };
            options.cg.tolerance = tolerance;
            let mut simulation = simulation(&scene, &options, 2);
            let mut unknowns = 0;
            for _ in 0..steps {
                unknowns = simulation.step(&mut NoProbe).unwrap().pressure.unwrap().unknowns;
            }
            (simulation, unknowns)
        };
        let (solved, all) = after(DryWalls::Solved, 1e-12);
        let (known, fewer) = after(DryWalls::Known, 1e-12);
        let (loosely, _) = after(DryWalls::Solved, 1e-8);
        let (apart, open) = (farthest(&*known, &*solved), farthest(&*loosely, &*solved));
        println!(
            "l0 = {l0} m: {fewer} unknowns instead of {all}, {apart:e} m; the tolerance leaves {open:e} m open"
        );
        assert!(
            10 * fewer < 9 * all && apart > 0.0 && apart <= 2.0 * open,
            "{fewer} of {all}, {apart:e}, {open:e}"
        );
    }
}

/// A particle high above a dry tank leaves no row to solve for.
#[test]
fn a_tank_that_no_fluid_is_near_needs_no_solve() {
    let scene = dam_break(0.0375);
    let mut particles = scene.particles("test").unwrap();
    let highest = particles.iter().map(|p| p.position[1]).fold(0.0, f64::max);
    particles.retain(|p| p.kind != Kind::Fluid);
    // Parameters are those of a domain that reaches up to where the particle is.
    let mut parameters = scene.parameters(&particles);
    parameters.domain.high[1] += 2.0;
    let last = particles.len();
    particles.push(InitialParticle {
        kind: Kind::Fluid,
        position: [0.5, highest + 1.0, 0.1],
        ..particles[0]
    });
    let ends = [Preset::FAST, Preset::FAST_ALL_WALLS].map(|preset| {
        let options = preset.options();
        let workers = Arc::new(Workers::new(1, options.schedule, &[]).unwrap());
        let start = Start { particles: &particles, steps_done: 0 };
        let mut simulation = simulation::build(&parameters, &options, start, workers).unwrap();
        let report = simulation.step(&mut NoProbe).unwrap();
        (simulation.particles().position[last], report.pressure.unwrap().unknowns)
    });
    assert_eq!(ends[0], (ends[1].0, 0));
    assert!(ends[1].1 > 0, "the tank has unknowns of its own");
}

#[test]
fn the_bits_do_not_depend_on_threads_or_schedules() {
    let scene = dam_break(0.0375);
    let expected = state(&mut *after(&scene, &fast(), 1, 30));
    for (threads, schedule) in [(2, "static"), (3, "dynamic:1"), (2, "guided:4"), (3, "rayon:8")] {
        let options = Options { schedule: schedule.parse().unwrap(), ..fast() };
        assert!(state(&mut *after(&scene, &options, threads, 30)) == expected, "{threads} {schedule}");
    }
}

/// The order of sums depends on when lists were made: that is a part of the state.
#[test]
fn a_state_that_is_put_back_goes_on_to_the_same_bits() {
    let scene = dam_break(0.0375);
    for stop in [1, 7, 23] {
        let mut whole = after(&scene, &fast(), 2, stop);
        let kept = state(&mut *whole);
        let mut resumed = simulation(&scene, &fast(), 1);
        kept.restore(|visitor| resumed.visit(visitor));
        for _ in 0..6 {
            whole.step(&mut NoProbe).unwrap();
            resumed.step(&mut NoProbe).unwrap();
        }
        assert!(state(&mut *whole) == state(&mut *resumed), "stopped after step {stop}");
    }
}

/// Scenes that repeat themselves along x as well as not.
const ENDLESS: [&str; 5] = ["dam-break", "still-water", "oscillating-drop", "heated-cavity", "mud-flow"];

/// Whatever a scene calls for beyond the textbook runs from the same lists. Solved to 1e-12 on both sides, since a tolerance
/// leaves more than another order of sums does.
#[test]
fn every_scene_runs_and_agrees() {
    let closely = |mut options: Options| {
        options.cg.tolerance = 1e-12;
        Options { matrix_values: MatrixValues::F64, ..options }
    };
    let cavity = *TOYS.iter().find(|toy| toy.0 == "heated-cavity").unwrap();
    let with_resting_walls = (cavity, &["effects.viscosity.walls=resting"][..]);
    let endless = TOYS.iter().filter(|toy| ENDLESS.contains(&toy.0));
    let endless = endless.map(|&toy| (toy, &["domain.periodic=[\"x\"]"][..]));
    let all = TOYS.iter().map(|&toy| (toy, &[][..])).chain([with_resting_walls]).chain(endless);
    for (toy, sets) in all {
        let scene = toy::load(toy, sets);
        let particles = scene.particles("test").unwrap();
        let l0 = scene.parameters(&particles).particle_distance_m;
        let general = after(&scene, &closely(Preset::GENERAL.options()), 2, 5);
        let apart = farthest(&*after(&scene, &closely(fast()), 2, 5), &*general) / l0;
        println!("{:20} {apart:e} particle distances after 5 steps {sets:?}", toy.0);
        // Mirrored walls choose among equally near wall particles the one that comes first, which is another one here.
        let mirrored = toy.0 == "heated-cavity" && sets.is_empty()
            || toy.1.iter().any(|set| set.ends_with("walls=mirrored"));
        assert!(apart <= if mirrored { 1e-4 } else { 1e-12 }, "{}: {apart:e}", toy.0);
    }
}

/// Heat that shares the walk of viscosity stands in the same vectors as velocities.
#[test]
fn what_diffuses_beside_viscosity_is_what_it_is_in_any_search() {
    let sets =
        ["effects.heat.thermal_diffusivity_m2_s=1e-3", "effects.heat.initial_k=293.0"].map(String::from);
    let scene =
        library::load("dam-break", &[&sets[..], &["particle_distance_m=0.0375".to_string()]].concat())
            .unwrap();
    let mut particles = scene.particles("test").unwrap();
    for particle in &mut particles {
        particle.temperature = 290.0 + 10.0 * particle.position[1] + particle.position[0];
    }
    let parameters = scene.parameters(&particles);
    let after = |preset: Preset| {
        let options = Options { matrix_values: MatrixValues::F64, ..preset.options() };
        let workers = Arc::new(Workers::new(2, options.schedule, &[]).unwrap());
        let start = Start { particles: &particles, steps_done: 0 };
        let mut simulation = simulation::build(&parameters, &options, start, workers).unwrap();
        for _ in 0..5 {
            simulation.step(&mut NoProbe).unwrap();
        }
        simulation
    };
    let (general, fast) = (after(Preset::GENERAL), after(Preset::FAST));
    let pairs = general.particles().temperature.iter().zip(&fast.particles().temperature);
    let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let changed =
        general.particles().temperature.iter().zip(&particles).map(|(a, p)| (a - p.temperature).abs());
    let changed = changed.fold(0.0, f64::max);
    println!("{apart:e} K apart after temperatures changed by up to {changed:e} K");
    assert!(changed > 1e-3 && apart <= 1e-9 * changed.max(1.0), "{apart:e} of {changed:e}");
}
