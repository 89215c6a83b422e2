//! Preconditioners on matrices with known answers, and on those that they must refuse.

use repro::base::parallel::{Team, Workers};
use repro::base::schedule::Schedule;
use repro::base::vec3::Vec3;
use repro::engine::pressure::conjugate_gradient::{CgError, CgInfo, CgParams, ConjugateGradient};
use repro::engine::pressure::enclosed::EnclosedParts;
use repro::engine::pressure::matrix::{SparseMatrix, Storage};
use repro::engine::pressure::preconditioner::{AnyPreconditioner, Places, Preconditioner, Preconditioning};
use repro::engine::pressure::system_matrix::{System, SystemMatrix};
use repro::engine::search::NONE;

/// Points along each axis of a grid of unknowns.
const N: usize = 14;
const ROWS: usize = N * N * N;
/// Rows at the end that count for nothing.
const GHOSTS: usize = 3;

fn workers(threads: usize) -> Workers {
    Workers::new(threads, Schedule::Static, &[]).unwrap()
}

fn at(row: usize) -> [usize; 3] {
    [row % N, row / N % N, row / N / N]
}

/// The neighbours of a point on the grid.
fn neighbors(row: usize) -> impl Iterator<Item = usize> {
    [1, N, N * N].into_iter().enumerate().flat_map(move |(axis, stride)| {
        let before = (at(row)[axis] > 0).then(|| row - stride);
        before.into_iter().chain((at(row)[axis] + 1 < N).then(|| row + stride))
    })
}

/// The equation of a Laplacian with the value zero above the grid and no flux elsewhere, with rows that count for nothing at
/// the end.
fn laplacian() -> SparseMatrix {
    let mut matrix = SparseMatrix::new(Storage::Csr, 6);
    matrix.assemble(ROWS + GHOSTS, &workers(2), |row, entries| {
        if row >= ROWS {
            return 1.0;
        }
        neighbors(row).for_each(|other| entries.push(other as u32, -1.0));
        neighbors(row).count() as f64 + f64::from(u8::from(at(row)[1] == N - 1))
    });
    matrix
}

/// A particle a grid point, one of them as far away as numbers go.
fn positions() -> Vec<Vec3> {
    let mut positions: Vec<Vec3> = (0..ROWS).map(|row| at(row).map(|k| k as f64)).collect();
    positions[ROWS / 2] = [1e300, -1e300, 1e9];
    positions
}

fn particle_of() -> Vec<u32> {
    (0..ROWS as u32).chain([NONE; GHOSTS]).collect()
}

fn known(row: usize) -> f64 {
    if row < ROWS { (row as f64 * 0.01).sin() + at(row)[1] as f64 } else { 0.0 }
}

fn solve<M: SystemMatrix>(
    matrix: &M,
    source: &[f64],
    params: CgParams,
    parts: &mut EnclosedParts,
    threads: usize,
) -> Result<(Vec<f64>, CgInfo), CgError> {
    let (particle_of, position) = (particle_of(), positions());
    let places = Places { particle_of: &particle_of, position: &position };
    let mut solver = ConjugateGradient::new(params, 1.0);
    let system = System { matrix, source, quiet: false, places };
    let info = solver.solve(&system, parts, &workers(threads))?;
    Ok((solver.solution().to_vec(), info))
}

fn with(preconditioner: Preconditioning) -> CgParams {
    CgParams { preconditioner, tolerance: 1e-11, ..CgParams::default() }
}

fn product<M: SystemMatrix>(matrix: &M, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    matrix.multiply(x, &mut y, Team::SERIAL);
    y
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[test]
fn each_finds_a_known_solution() {
    let matrix = laplacian();
    let expected: Vec<f64> = (0..ROWS + GHOSTS).map(known).collect();
    let source = product(&matrix, &expected);
    for name in Preconditioning::ALL {
        let (found, info) = solve(&matrix, &source, with(name), &mut EnclosedParts::default(), 2).unwrap();
        let error = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{name}: {} iterations, {error:e}", info.iterations);
        assert!(error < 1e-8, "{name}: {error:e}");
        assert!(found[ROWS..].iter().all(|&p| p == 0.0), "rows that count for nothing stay zero");
    }
}

/// Nothing is fixed anywhere: constants are projected out, and the source has a part that no solution has.
#[test]
fn each_solves_a_system_without_a_fixed_value() {
    let mut matrix = laplacian();
    for row in 0..ROWS {
        matrix.diagonal[row] = neighbors(row).count() as f64;
    }
    let mean = (0..ROWS).map(known).sum::<f64>() / ROWS as f64;
    let expected: Vec<f64> = (0..ROWS).map(|row| known(row) - mean).chain([0.0; GHOSTS]).collect();
    let enclosed: Vec<u32> = (0..ROWS as u32).collect();
    for name in Preconditioning::ALL {
        let mut parts = EnclosedParts::default();
        parts.find(&enclosed, ROWS + GHOSTS, &matrix);
        assert_eq!(parts.count(), 1);
        let mut source = product(&matrix, &expected);
        source[..ROWS].iter_mut().for_each(|b| *b += 0.5);
        parts.subtract_means(&mut source, Team::SERIAL);
        let (found, info) = solve(&matrix, &source, with(name), &mut parts, 2).unwrap();
        let error = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("{name}: {} iterations, {error:e}", info.iterations);
        assert!(error < 1e-7, "{name}: {error:e}");
    }
}

/// `x . M^-1 y = y . M^-1 x` and `x . M^-1 x > 0`; two levels are symmetric only where boxes sum to zero.
#[test]
fn symmetric_ones_are_symmetric_and_all_are_positive() {
    let matrix = laplacian();
    let (particle_of, position, workers) = (particle_of(), positions(), workers(2));
    let places = Places { particle_of: &particle_of, position: &position };
    let mut random = fastrand::Rng::with_seed(7);
    let mut vector = || (0..ROWS + GHOSTS).map(|_| random.f64() - 0.5).collect::<Vec<f64>>();
    let (x, y) = (vector(), vector());
    for name in Preconditioning::ALL {
        let mut preconditioner = AnyPreconditioner::new(name, 1.0);
        preconditioner.set_up(&matrix, places, workers.shared_evenly(), &workers).unwrap();
        let mut inverse = |x: &[f64]| {
            let mut z = vec![0.0; x.len()];
            preconditioner.apply(&matrix, x, &mut z, workers.shared_evenly());
            z
        };
        let (of_x, of_y) = (inverse(&x), inverse(&y));
        assert!(dot(&x, &of_x) > 0.0 && dot(&y, &of_y) > 0.0, "{name}");
        if name != Preconditioning::TwoLevel {
            let [a, b] = [dot(&x, &of_y), dot(&y, &of_x)];
            assert!((a - b).abs() < 1e-12 * dot(&x, &of_x), "{name}: {a} and {b}");
        }
    }
}

/// One particle far off costs one box, not all boxes on the way to it.
#[test]
fn memory_does_not_span_the_space() {
    let matrix = laplacian();
    let (particle_of, position, workers) = (particle_of(), positions(), workers(1));
    let places = Places { particle_of: &particle_of, position: &position };
    let mut preconditioner = AnyPreconditioner::new(Preconditioning::TwoLevel, 1.0);
    preconditioner.set_up(&matrix, places, Team::SERIAL, &workers).unwrap();
    assert!(preconditioner.bytes() < 2000 * ROWS, "{} bytes", preconditioner.bytes());
}

#[test]
fn breakdowns_are_named_with_iteration_and_residual() {
    let source: Vec<f64> = (0..ROWS + GHOSTS).map(|row| if row < ROWS { 1.0 } else { 0.0 }).collect();
    let attempt = |diagonal: f64, params: CgParams| {
        let mut matrix = laplacian();
        matrix.diagonal[100] = diagonal;
        solve(&matrix, &source, params, &mut EnclosedParts::default(), 2).map(|_| ())
    };
    let ic0 = attempt(-3.0, with(Preconditioning::IncompleteCholesky)).unwrap_err();
    assert!(matches!(ic0, CgError::Pivot { row: 100, pivot } if pivot < 0.0), "{ic0}");
    assert!(ic0.to_string().contains("iteration 1") && ic0.to_string().contains("row 100"), "{ic0}");
    let plain = attempt(-3e4, with(Preconditioning::None)).unwrap_err();
    assert!(matches!(plain, CgError::NotPositiveDefinite { iteration: 1, residual: 1.0, .. }), "{plain}");
    for name in Preconditioning::ALL {
        let text = attempt(f64::NAN, with(name)).unwrap_err().to_string();
        assert!(text.contains("residual") && text.contains("iteration"), "{name}: {text}");
        let hasty = CgParams { max_iterations: 2, ..with(name) };
        let error = attempt(6.0, hasty).unwrap_err();
        assert!(matches!(error, CgError::NotConverged { iterations: 2, .. }), "{name}: {error}");
    }
}
