//! The same bits, whoever searches, however many threads, however loops are dealt.

mod common;

use std::sync::Arc;

use common::{Change, Run, dam_break, run_dam_break, run_scene};
use repro::base::parallel::Workers;
use repro::engine::diagnostics::digest;
use repro::engine::particles::InitialParticle;
use repro::engine::phase::NoProbe;
use repro::engine::preset::{Options, Preset, Search, Test};
use repro::engine::pressure::conjugate_gradient::CgMode;
use repro::engine::pressure::matrix::Storage;
use repro::engine::simulation::{self, Start};
use repro::scene::library;

const L0: f64 = 0.0375;
/// After the impact on the far wall: spray, mixed order in memory.
const LATE_STEP: usize = 240;
const STEPS: usize = 12;

const WALLS_THAT_HOLD: [&str; 3] = [
    "effects.wall_contact.height=0.7",
    "effects.wall_contact.reach=0.75",
    "effects.pressure.kernel_floor=0.5",
];

fn plain(_: &mut Options) {}

fn squared_csr(options: &mut Options) {
    options.distance_test = Test::Squared;
    options.storage = Storage::Csr;
}

fn serial_cg(options: &mut Options) {
    options.cg.mode = CgMode::Serial;
}

/// The state that a variant reaches from `state` after some steps.
fn end_state(
    state: &[InitialParticle],
    preset: &str,
    threads: usize,
    schedule: &str,
    change: Change,
) -> String {
    let scene = dam_break(L0);
    let parameters = scene.parameters(&scene.particles("test").unwrap());
    let mut options = preset.parse::<Preset>().unwrap().options();
    options.schedule = schedule.parse().unwrap();
    change(&mut options);
    let workers = Arc::new(Workers::new(threads, options.schedule, &[]).unwrap());
    let start = Start { particles: state, steps_done: LATE_STEP };
    let mut simulation = simulation::build(&parameters, &options, start, workers).unwrap();
    for _ in 0..STEPS {
        simulation.step(&mut NoProbe).unwrap();
    }
    digest(simulation.particles())
}

/// Every search with every thread count, and every schedule with chunks from 1 to 4096, at 8,176 particles.
#[test]
fn a_covering_set_of_searches_threads_and_schedules_gives_the_same_bits() {
    let (list, relocated) = ("paper-linked-list", "paper-aos-relocation");
    let run = Run { l0: L0, steps: LATE_STEP, threads: 2, change: squared_csr, ..Run::default() };
    let (simulation, _) = run_dam_break(&run);
    let particles = simulation.particles();
    let state: Vec<InitialParticle> = (0..particles.len())
        .map(|i| InitialParticle {
            velocity: particles.velocity[i],
            pressure: particles.pressure[i],
            ..InitialParticle::at_rest(particles.kind[i], particles.position[i])
        })
        .collect();
    let expected = end_state(&state, list, 1, "dynamic:64", plain);
    let runs: [(&str, usize, &str, Change); 18] = [
        (list, 2, "dynamic:64", plain),
        (list, 3, "dynamic:64", serial_cg),
        (relocated, 1, "dynamic:64", plain),
        (relocated, 2, "dynamic:64", squared_csr),
        (relocated, 3, "dynamic:64", plain),
        (list, 3, "static", squared_csr),
        (relocated, 2, "static", plain),
        (list, 2, "dynamic:1", squared_csr),
        (relocated, 3, "dynamic:1", plain),
        (list, 3, "dynamic:4096", plain),
        (relocated, 2, "dynamic:4096", serial_cg),
        (list, 2, "guided:1", plain),
        (relocated, 3, "guided:16", squared_csr),
        (list, 3, "guided:4096", plain),
        (relocated, 2, "rayon:1", plain),
        (list, 3, "rayon:64", squared_csr),
        (relocated, 3, "rayon:4096", plain),
        (list, 1, "rayon:7", serial_cg),
    ];
    for (preset, threads, schedule, change) in runs {
        let found = end_state(&state, preset, threads, schedule, change);
        assert_eq!(found, expected, "{preset}, {threads} threads, {schedule}");
    }
    for preset in layouts() {
        let runs: [(usize, &str, Change); 5] = [
            (1, "dynamic:64", plain),
            (2, "static", squared_csr),
            (3, "dynamic:1", plain),
            (3, "guided:16", serial_cg),
            (2, "rayon:7", plain),
        ];
        for (threads, schedule, change) in runs {
            let found = end_state(&state, preset.name(), threads, schedule, change);
            assert_eq!(found, expected, "{preset}, {threads} threads, {schedule}");
        }
    }
}

/// The searches beyond the paper's two that sum in their order.
/// The searches that keep the order of sums.
fn layouts() -> impl Iterator<Item = Preset> {
    let own_order =
        |preset: &Preset| [Search::BruteForce, Search::Clusters].contains(&preset.options().search);
    Preset::all().filter(move |preset| !Preset::PAPER.contains(preset) && !own_order(preset))
}

/// The optional parts of the scheme, through the impact on the far wall.
#[test]
fn wall_contact_and_a_kernel_floor_keep_to_the_same_bits() {
    let sets = ["particle_distance_m=0.075"].iter().chain(&WALLS_THAT_HOLD).map(|set| set.to_string());
    let scene = library::load("dam-break", &sets.collect::<Vec<_>>()).unwrap();
    let run = |preset, threads, schedule, change| {
        let run = Run { steps: 130, preset, threads, schedule, change, ..Run::default() };
        digest(run_scene(&scene, &run).0.particles())
    };
    let expected = run("paper-linked-list", 1, "dynamic:64", plain);
    let runs: [(&str, usize, &str, Change); 3] = [
        ("paper-aos-relocation", 2, "dynamic:64", squared_csr),
        ("paper-linked-list", 3, "guided:16", squared_csr),
        ("paper-aos-relocation", 3, "rayon:7", plain),
    ];
    for (preset, threads, schedule, change) in runs {
        let found = run(preset, threads, schedule, change);
        assert_eq!(found, expected, "{preset}, {threads} threads, {schedule}");
    }
}

/// The whole run at 0.0375 m against the digest that is known for it.
#[test]
fn a_whole_run_ends_in_the_known_state() {
    let run = Run { l0: L0, steps: 667, threads: 2, change: squared_csr, ..Run::default() };
    let (simulation, _) = run_dam_break(&run);
    let known: toml::Table = include_str!("../experiments/digests.toml").parse().unwrap();
    let states = known["state"].as_array().unwrap();
    let entry = states.iter().find(|state| state["particle_distance_m"].as_float() == Some(L0)).unwrap();
    assert_eq!(entry["digest"].as_str().unwrap(), digest(simulation.particles()));
}
