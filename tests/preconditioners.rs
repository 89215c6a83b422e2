//! Each preconditioner gives the pressures of plain conjugate gradients in a known number of iterations, from real flows.

mod common;

use std::sync::Arc;

use common::{Run, dam_break, run_scene};
use repro::base::parallel::Workers;
use repro::engine::parameters::Parameters;
use repro::engine::particles::{InitialParticle, Particles};
use repro::engine::phase::NoProbe;
use repro::engine::preset::{Options, Preset};
use repro::engine::pressure::PressureReport;
use repro::engine::pressure::conjugate_gradient::CgMode;
use repro::engine::pressure::preconditioner::Preconditioning;
use repro::engine::pressure::values::MatrixValues;
use repro::engine::simulation::{self, Start};
use repro::scene::validation::{general, taylor_green};
use repro::scene::{Scene, library};

/// A state of a flow, from which the next step is computed in several ways.
struct Flow {
    parameters: Parameters,
    particles: Vec<InitialParticle>,
    steps: usize,
}

impl Flow {
    fn after(scene: &Scene, steps: usize) -> Flow {
        let (simulation, _) =
            run_scene(scene, &Run { steps, threads: 2, preset: "general", ..Run::default() });
        let initial = scene.particles("test").unwrap();
        let particles = taken_over(simulation.particles(), &initial);
        Flow { parameters: scene.parameters(&initial), particles, steps }
    }

    fn of(parameters: Parameters, initial: &[InitialParticle], steps: usize) -> Flow {
        let mut simulation = general::build(&parameters, initial, 2).unwrap();
        (0..steps).for_each(|_| {
            general::step(simulation.as_mut()).unwrap();
        });
        Flow { particles: taken_over(simulation.particles(), initial), parameters, steps }
    }

    /// The next step's pressures, and what its solve took.
    fn step(&self, threads: usize, change: impl FnOnce(&mut Options)) -> (Vec<f64>, PressureReport) {
        let mut options = Preset::GENERAL.options();
        change(&mut options);
        let workers = Arc::new(Workers::new(threads, options.schedule, &[]).unwrap());
        let start = Start { particles: &self.particles, steps_done: self.steps };
        let mut simulation = simulation::build(&self.parameters, &options, start, workers).unwrap();
        let report = simulation.step(&mut NoProbe).unwrap();
        (simulation.particles().pressure.clone(), report.pressure.unwrap())
    }

    /// Holds every preconditioner to the answer of plain conjugate gradients, and the number of iterations to `most`, in the
    /// order of [`Preconditioning::ALL`].
    fn all_agree(&self, what: &str, most: [usize; 5]) {
        let (exact, _) = self.step(1, |options| options.cg.tolerance = 1e-12);
        for (name, most) in Preconditioning::ALL.into_iter().zip(most) {
            let (found, solve) = self.step(2, |options| options.cg.preconditioner = name);
            let error = difference(&found, &exact);
            println!(
                "{what}, {name}: {} rows, {} iterations, {error:e}",
                solve.unknowns, solve.cg.iterations
            );
            assert!(
                solve.unknowns > 0 && solve.cg.iterations <= most,
                "{what}, {name}: {}",
                solve.cg.iterations
            );
            assert!(error < 1e-6, "{what}, {name}: {error:e}");
            let tight = |options: &mut Options| {
                options.cg.preconditioner = name;
                options.cg.tolerance = 1e-12;
            };
            let error = difference(&self.step(2, tight).0, &exact);
            assert!(error < 1e-9, "{what}, {name}: {error:e} at a tight tolerance");
        }
    }
}

fn taken_over(particles: &Particles, initial: &[InitialParticle]) -> Vec<InitialParticle> {
    let one = |(i, initial): (usize, &InitialParticle)| InitialParticle {
        kind: particles.kind[i],
        position: particles.position[i],
        velocity: particles.velocity[i],
        pressure: particles.pressure[i],
        ..*initial
    };
    initial.iter().enumerate().map(one).collect()
}

/// The largest difference over the largest value.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let largest = b.iter().fold(0.0, |largest: f64, p| largest.max(p.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn a_column_that_has_begun_to_fall() {
    Flow::after(&dam_break(0.0375), 60).all_agree("dam break, 0.0375 m, step 60", [40, 36, 18, 14, 18]);
}

/// Spray, and particles that have flown off.
#[test]
fn a_wave_that_has_hit_the_far_wall() {
    Flow::after(&dam_break(0.0375), 300).all_agree("dam break, 0.0375 m, step 300", [60, 60, 30, 25, 20]);
}

#[test]
fn two_levels_hardly_need_more_iterations_for_more_particles() {
    let flow = Flow::after(&dam_break(0.01875), 60);
    flow.all_agree("dam break, 0.01875 m, step 60", [64, 60, 30, 26, 20]);
}

/// Closed, so that pressures are determined up to a constant, and in a plane.
#[test]
fn a_closed_cavity() {
    let scene = library::load("heated-cavity", &[]).unwrap();
    Flow::after(&scene, 20).all_agree("heated cavity", [200, 200, 90, 70, 30]);
}

/// Periodic along both axes: neighbours lie at the other end of the domain.
#[test]
fn vortices_without_walls() {
    let (parameters, particles) =
        (taylor_green::parameters(40, 1e-3, general::closed(0.1)), taylor_green::particles(40, 0.1));
    Flow::of(parameters, &particles, 10).all_agree("periodic vortices", [200, 200, 90, 70, 30]);
}

#[test]
fn water_in_a_swaying_tank() {
    let scene = library::load("sloshing-tank", &[]).unwrap();
    Flow::after(&scene, 20).all_agree("sloshing tank", [400, 400, 160, 120, 30]);
}

/// Two open pools and a full box that nothing joins, the box's pressures up to a constant.
#[test]
fn pools_that_nothing_joins() {
    let (n, l0) = (20, 0.02);
    let open = general::Tank { width: n, height: n + 4, lid: false };
    let mut particles = Vec::new();
    for (which, tank, depth) in
        [(0, open, n), (1, open, 10), (2, general::Tank { height: n, lid: true, ..open }, n)]
    {
        let mut filled = tank.fill(l0, |_, j| j < depth);
        filled.iter_mut().for_each(|particle| particle.position[0] += f64::from(which * (n + 12)) * l0);
        particles.extend(filled);
    }
    let parameters = general::parameters(l0, 1e-3, &particles, 20.0, general::water());
    let flow = Flow::of(parameters, &particles, 20);
    assert_eq!(flow.step(1, |_| ()).1.enclosed_parts, 1);
    flow.all_agree("pools", [200, 200, 90, 70, 30]);
}

#[test]
fn no_bit_depends_on_who_computes() {
    let flow = Flow::after(&dam_break(0.0375), 100);
    for name in Preconditioning::ALL {
        for values in [MatrixValues::F64, MatrixValues::F32] {
            let set = |options: &mut Options| {
                options.cg.preconditioner = name;
                options.matrix_values = values;
            };
            let expected = bits(&flow.step(1, set).0);
            for threads in [2, 3] {
                assert_eq!(bits(&flow.step(threads, set).0), expected, "{name}, {values}, {threads} threads");
            }
            let serial = |options: &mut Options| {
                set(options);
                options.cg.mode = CgMode::Serial;
            };
            assert_eq!(bits(&flow.step(2, serial).0), expected, "{name}, {values}, serial");
        }
    }
}

/// What single precision changes in the answer: below what the usual tolerance leaves undetermined.
#[test]
fn values_in_f32_change_pressures_by_less_than_the_tolerance_does() {
    for (l0, step) in [(0.0375, 60), (0.0375, 300), (0.01875, 60)] {
        let flow = Flow::after(&dam_break(l0), step);
        let tight = |options: &mut Options| options.cg.tolerance = 1e-12;
        let (exact, _) = flow.step(2, tight);
        let (found, solve) = flow.step(2, |options| {
            tight(options);
            options.matrix_values = MatrixValues::F32;
        });
        let error = difference(&found, &exact);
        println!("f32, {l0} m, step {step}: {error:e}, residual {:e}", solve.cg.residual);
        assert!(error < 2e-8 && solve.cg.residual < 1e-11, "{error:e}");
    }
}
