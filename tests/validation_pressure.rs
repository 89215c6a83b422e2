//! The pressure solve of general scenes against known answers.

use repro::base::parallel::Workers;
use repro::base::schedule::Schedule;
use repro::engine::effects::shifting::{AtSurface, Shifting};
use repro::engine::parameters::{Effects, Parameters};
use repro::engine::particles::{InitialParticle, Kind};
use repro::engine::pressure::Pressure;
use repro::engine::pressure::any_matrix::AnyMatrix;
use repro::engine::pressure::conjugate_gradient::{CgParams, ConjugateGradient};
use repro::engine::pressure::enclosed::EnclosedParts;
use repro::engine::pressure::matrix::Storage;
use repro::engine::pressure::options::Gradient;
use repro::engine::pressure::poisson::Poisson;
use repro::engine::pressure::preconditioner::Places;
use repro::engine::pressure::values::MatrixValues;
use repro::scene::validation::{CASES, Fidelity, Outcome, general};

const L0: f64 = 0.02;

fn parameters() -> Parameters {
    let particle = InitialParticle::at_rest(Kind::Fluid, [0.0; 3]);
    general::parameters(L0, 1e-3, &[particle], 20.0, Effects::default())
}

/// Two chains of rows without a fixed value, laid out alternately, and one that is fixed at its ends: the first two are
/// singular. The source is that of a known solution, and on the singular chains it has a part that no solution has.
#[test]
fn constants_are_projected_out_of_singular_parts_and_of_no_others() {
    const ROWS: usize = 3000;
    let chain = |row: usize| row % 3;
    let known = |row: usize| ((row / 3) as f64 * 0.01).sin() + chain(row) as f64;
    let neighbors =
        |row: usize| [row.checked_sub(3), Some(row + 3).filter(|&next| next < ROWS)].into_iter().flatten();
    let diagonal = |row: usize| if chain(row) == 2 { 2.0 } else { neighbors(row).count() as f64 };
    let mut bits = Vec::new();
    for threads in [1, 2] {
        let workers = Workers::new(threads, Schedule::Static, &[]).unwrap();
        let mut poisson = Poisson::new(&Pressure::default(), &parameters(), Storage::Csr, MatrixValues::F64);
        let AnyMatrix::F64(matrix) = &mut poisson.matrix else { unreachable!("asked for f64") };
        matrix.assemble(ROWS, &workers, |row, entries| {
            neighbors(row).for_each(|other| entries.push(other as u32, -1.0));
            diagonal(row)
        });
        let product = |row: usize| {
            diagonal(row) * known(row) - neighbors(row).map(known).sum::<f64>()
                + if chain(row) == 2 { 0.0 } else { 0.5 + chain(row) as f64 }
        };
        poisson.source = (0..ROWS).map(product).collect();
        let enclosed: Vec<u32> = (0..ROWS as u32).filter(|&row| chain(row as usize) < 2).collect();
        let mut parts = EnclosedParts::default();
        parts.find(&enclosed, ROWS, &poisson.matrix);
        assert_eq!(parts.count(), 2);
        poisson.project(&mut parts, workers.shared_evenly(), 1.0);
        let mut solver = ConjugateGradient::new(CgParams { tolerance: 1e-12, ..CgParams::default() }, L0);
        solver.solve(&poisson.system(Places::default()), &mut parts, &workers).unwrap();
        let mean = |part: usize| {
            (0..ROWS).filter(|&row| chain(row) == part).map(known).sum::<f64>() / (ROWS / 3) as f64
        };
        let means = [mean(0), mean(1), 0.0];
        for (row, found) in solver.solution().iter().enumerate() {
            let expected = known(row) - means[chain(row)];
            assert!((found - expected).abs() < 1e-5, "row {row}: {found} instead of {expected}");
        }
        solver.make_minima_zero(&mut parts, &workers);
        let least = |part: usize| {
            let rows = solver.solution().iter().enumerate().filter(|(row, _)| chain(*row) == part);
            rows.map(|(_, p)| *p).fold(f64::INFINITY, f64::min)
        };
        assert_eq!([least(0), least(1)], [0.0, 0.0]);
        assert!((least(2) - known(ROWS - 1).min(known(2))).abs() < 5.0, "the regular chain stays as it is");
        bits.push(solver.solution().iter().map(|p| p.to_bits()).collect::<Vec<_>>());
    }
    assert_eq!(bits[0], bits[1], "the bits do not depend on the number of threads");
}

/// Runs a case and holds it to its gates.
fn hold(name: &str) {
    let full = std::env::var("REPRO_FULL_VALIDATION").is_ok_and(|value| value == "1");
    let fidelity = if full { Fidelity::Full } else { Fidelity::Coarse };
    let case = CASES.iter().find(|case| case.name == name).unwrap();
    let outcomes = (case.run)(fidelity).unwrap();
    for Outcome { effect, case, quantity, value, error, gate, .. } in &outcomes {
        println!("{effect}, {case}, {quantity}: {value:.5}, error {error:.5}, gate {gate}");
    }
    for outcome in &outcomes {
        assert!(outcome.passes(), "{outcome:?}");
    }
}

#[test]
fn still_water_keeps_still() {
    hold("still-water");
}

#[test]
fn a_full_box_has_the_hydrostatic_pressure_about_its_gauge() {
    hold("full-box");
}

#[test]
fn pools_side_by_side_know_nothing_of_each_other() {
    hold("pools-side-by-side");
}

#[test]
fn vortices_decay_at_the_exact_rate_from_a_lattice() {
    hold("taylor-green");
}

#[test]
fn vortices_decay_at_the_exact_rate_from_disorder() {
    hold("taylor-green-jittered");
}

#[test]
fn a_standing_wave_swings_with_the_period_of_linear_theory_and_keeps_its_energy() {
    hold("standing-wave");
}

/// A round drop whose particles fly towards one another, in no walls: velocities after some steps.
fn drop(effects: Effects, steps: usize) -> Vec<[f64; 3]> {
    let mut noise = general::Noise(7);
    let mut particles = Vec::new();
    for i in -6..=6i32 {
        for j in -6..=6i32 {
            if i * i + j * j <= 36 {
                let mut particle = InitialParticle::at_rest(Kind::Fluid, general::middle(L0, i, j));
                let x = particle.position;
                particle.velocity = [-x[0] + 0.1 * noise.draw(), x[1] + 0.1 * noise.draw(), 0.0];
                particle.group = u8::from(j > 0);
                particles.push(particle);
            }
        }
    }
    let mut parameters = general::parameters(L0, 1e-3, &particles, 20.0, effects);
    parameters.groups = vec!["lower".to_string(), "upper".to_string()];
    let mut simulation = general::build(&parameters, &particles, 2).unwrap();
    for _ in 0..steps {
        general::step(simulation.as_mut()).unwrap();
    }
    simulation.particles().velocity.clone()
}

fn with_pressure(change: impl FnOnce(&mut Pressure)) -> Effects {
    let mut pressure = general::water().pressure.unwrap();
    change(&mut pressure);
    Effects { pressure: Some(pressure), ..Effects::default() }
}

fn largest_difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let components = a.iter().flatten().zip(b.iter().flatten());
    components.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn the_conservative_gradient_keeps_momentum() {
    let momentum = |velocity: &[[f64; 3]]| [0, 1].map(|d| velocity.iter().map(|u| u[d]).sum::<f64>());
    let run = |steps| momentum(&drop(with_pressure(|p| p.gradient = Gradient::Conservative), steps));
    let (before, after) = (run(0), run(20));
    for d in 0..2 {
        assert!((after[d] - before[d]).abs() < 1e-12, "{before:?} {after:?}");
    }
    let usual = momentum(&drop(with_pressure(|p| p.gradient = Gradient::Minimum), 20));
    assert!((0..2).any(|d| (usual[d] - before[d]).abs() > 1e-6), "the drop is no test: {usual:?}");
}

#[test]
fn groups_of_one_density_are_one_fluid_and_others_are_not() {
    let with = |density| drop(with_pressure(|p| p.density_by_group_kg_m3 = density), 10);
    let uniform = with(None);
    assert!(largest_difference(&uniform, &with(Some(vec![1000.0, 1000.0]))) < 1e-12);
    assert!(largest_difference(&uniform, &with(Some(vec![1000.0, 500.0]))) > 1e-3);
}

#[test]
fn shifting_of_strength_zero_is_none() {
    let effects = with_pressure(|_| ());
    let shifted = |strength| Effects {
        shifting: Some(Shifting { strength, limit: 0.1, at_surface: AtSurface::Tangential }),
        ..effects.clone()
    };
    let plain = drop(effects.clone(), 10);
    assert!(largest_difference(&plain, &drop(shifted(0.0), 10)) < 1e-14);
    assert!(largest_difference(&plain, &drop(shifted(5.0), 10)) > 1e-6);
}

#[test]
fn the_floor_carries_layers_of_different_density() {
    hold("two-layers");
}
