//! The preset `fast` computes the paper's flow: not bit for bit once the water has hit the wall, when a rounding decides where a drop
//! flies, but within what five starts differ by whose particles are moved by a hundredth of their distance.
//!
//! `REPRO_FLOW_DISTANCE_M=0.01875 cargo test --release --test flow_statistics -- --nocapture` does so with the paper's particles.

use std::sync::Arc;

use repro::base::parallel::Workers;
use repro::engine::diagnostics::FlowState;
use repro::engine::particles::{Kind, Particles};
use repro::engine::phase::NoProbe;
use repro::engine::preset::{Options, Preset, Test};
use repro::engine::simulation::{self, Start};
use repro::scene::library;

const STARTS: u64 = 5;
/// Seconds between looks.
const EVERY_S: f64 = 0.06;

/// What is told of a flow: means over its looks after the first second, and the front on its way.
const NAMES: [&str; 6] = [
    "front (p99) at 0.3 s, m",
    "front (p99), m",
    "centre of mass, x, m",
    "centre of mass, y, m",
    "kinetic energy but of the fastest 1 %, J/kg",
    "particles on the surface",
];

fn centre(particles: &Particles, axis: usize) -> f64 {
    let fluid = (0..particles.position.len()).filter(|&i| particles.kind[i] == Kind::Fluid);
    let (sum, count) = fluid.fold((0.0, 0.0), |(sum, n), i| (sum + particles.position[i][axis], n + 1.0));
    sum / count
}

/// Kinetic energy of all fluid but its fastest hundredth, a particle of it. At the paper's time step a few particles are flung away at up to hundreds of
/// metres a second, with either preset: one of them has more energy than all the others together.
fn kinetic(particles: &Particles) -> f64 {
    let fluid = (0..particles.position.len()).filter(|&i| particles.kind[i] == Kind::Fluid);
    let mut energies: Vec<f64> =
        fluid.map(|i| particles.velocity[i].iter().map(|v| v * v).sum::<f64>() / 2.0).collect();
    energies.sort_by(f64::total_cmp);
    energies.truncate(energies.len() * 99 / 100);
    energies.iter().sum::<f64>() / energies.len() as f64
}

/// The statistics of one flow up to 2 s.
fn flow(distance_m: f64, options: &Options, seed: u64) -> [f64; NAMES.len()] {
    let time_step_s = 0.003 * distance_m / 0.01875;
    let sets = [
        format!("particle_distance_m={distance_m}"),
        format!("time_step_s={time_step_s}"),
        "geometry.jitter.amplitude=0.01".to_string(),
        format!("geometry.jitter.seed={seed}"),
    ];
    let scene = library::load("dam-break", &sets).unwrap();
    let particles = scene.particles("test").unwrap();
    let workers = Arc::new(Workers::new(2, options.schedule, &[]).unwrap());
    let start = Start { particles: &particles, steps_done: 0 };
    let mut simulation = simulation::build(&scene.parameters(&particles), options, start, workers).unwrap();
    let (mut found, mut looks) = ([0.0; NAMES.len()], 0.0);
    let (every, steps) = ((EVERY_S / time_step_s).round() as usize, (2.0 / time_step_s).round() as usize);
    for step in 1..=steps {
        let report = simulation.step(&mut NoProbe).unwrap();
        let now = simulation.particles();
        if step == 5 * every {
            found[0] = FlowState::of(now).front_p99_m;
        }
        if step % every == 0 && 2 * step > steps {
            looks += 1.0;
            let flow = FlowState::of(now);
            let kinetic = kinetic(now);
            let surface = report.pressure.unwrap().surface as f64;
            let values = [flow.front_p99_m, centre(now, 0), centre(now, 1), kinetic, surface];
            found[1..].iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
    }
    found[1..].iter_mut().for_each(|sum| *sum /= looks);
    found
}

fn mean_and_range(values: &[f64]) -> (f64, f64) {
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
    (values.iter().sum::<f64>() / values.len() as f64, largest - smallest)
}

#[test]
fn fast_flows_as_the_paper_does() {
    let distance_m = std::env::var("REPRO_FLOW_DISTANCE_M").map_or(0.0375, |text| text.parse().unwrap());
    let paper = Options { distance_test: Test::Squared, ..Preset::PAPER_AOS_RELOCATION.options() };
    let flows = [paper, Preset::FAST.options()]
        .map(|options| (1..=STARTS).map(|seed| flow(distance_m, &options, seed)).collect::<Vec<_>>());
    for (k, name) in NAMES.iter().enumerate() {
        let of = |flows: &[[f64; NAMES.len()]]| {
            mean_and_range(&flows.iter().map(|flow| flow[k]).collect::<Vec<_>>())
        };
        let ((paper, paper_range), (fast, fast_range)) = (of(&flows[0]), of(&flows[1]));
        println!(
            "{name:44} paper {paper:.5} (range {paper_range:.5}), fast {fast:.5} (range {fast_range:.5})"
        );
        let spread = paper_range.max(fast_range);
        assert!((paper - fast).abs() <= spread, "{name}: {paper} and {fast}, starts differ by {spread}");
    }
}
