//! The matrix against one of all pairs.

use super::matrix::ClusterMatrix;
use super::rows::RowSpace;
use crate::base::parallel::Workers;
use crate::base::simd::LANES;
use crate::base::vec3::{Vec3, dot, sub};
use crate::engine::kernel::Kernel;
use crate::engine::parameters::Domain;
use crate::engine::particles::Kind;
use crate::engine::pressure::system_matrix::{BLOCK, SystemMatrix};
use crate::engine::search::clusters::Clusters;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::{CandidateSearch, Lengths, NONE, Now};

const L0: f64 = 0.05;
const RADIUS_M: f64 = 3.1 * L0;
const LENGTHS: Lengths = Lengths { particle_distance_m: L0, small_m: 2.1 * L0, large_m: RADIUS_M };
const COEFFICIENT: f64 = 0.7;
const COMPRESSIBILITY: f64 = 0.01;

/// A third each of fluid, walls and dummy walls, the kinds side by side.
fn crowd() -> (Vec<Kind>, Vec<Vec3>) {
    let mut random = fastrand::Rng::with_seed(4);
    let positions: Vec<Vec3> = (0..900).map(|_| [0.9, 0.4, 0.4].map(|side| side * random.f64())).collect();
    let kind = |x: &Vec3| [Kind::Fluid, Kind::Wall, Kind::DummyWall][(x[0] / 0.3) as usize];
    (positions.iter().map(kind).collect(), positions)
}

#[test]
fn entries_diagonal_product_and_their_number_are_those_of_all_pairs() {
    let (kind, position) = crowd();
    let domain = Domain::new([0.0; 3], [0.9, 0.4, 0.4]);
    let grid = Grid::new(domain, LENGTHS.large_m, 1).unwrap();
    let mut clusters = Clusters::new(&grid, LENGTHS, kind.len());
    let buckets = Buckets { grid, of_particle: Vec::new() };
    let workers = Workers::new(2, "dynamic:1".parse().unwrap(), &[]).unwrap();
    let now = Now { kind: &kind, position: &position, radius_m: LENGTHS.large_m, walls_moved: false };
    clusters.build(&buckets, now, &workers);

    let rows = RowSpace::of(&clusters);
    let particle = |row: usize| clusters.slots.particle[rows.first_slot() + row];
    // Every fifth particle is on the surface; of those that are not, walls have an unknown even without fluid.
    let is_unknown = |row: usize| particle(row) != NONE && !particle(row).is_multiple_of(5);
    let unknown: Vec<u8> = (0..rows.clusters())
        .map(|c| (0..LANES).fold(0, |bits, k| bits | u8::from(is_unknown(c * LANES + k)) << k))
        .collect();
    let kernel = Kernel { radius_m: RADIUS_M, floor_m: 1e-3 * L0 };
    let mut matrix = ClusterMatrix::<f64>::new(kernel, COEFFICIENT);
    let team = workers.scheduled_over(BLOCK);
    matrix.take_up_walls(&clusters, &rows, &unknown[..rows.walls().len()], team);
    matrix.unknown = unknown;
    matrix.assemble(&clusters, &rows, COMPRESSIBILITY, team);

    let weight = |row: usize, column: usize| {
        let r = sub(position[particle(row) as usize], position[particle(column) as usize]);
        let r = dot(r, r).sqrt();
        if row != column && r < RADIUS_M { COEFFICIENT * (RADIUS_M / r - 1.0) } else { 0.0 }
    };
    let filled: Vec<usize> = (0..rows.rows()).filter(|&row| particle(row) != NONE).collect();
    let x: Vec<f64> =
        (0..rows.rows()).map(|row| if is_unknown(row) { 1.0 + (row % 7) as f64 } else { 0.0 }).collect();
    let mut product = vec![f64::NAN; rows.rows()];
    matrix.multiply(&x, &mut product, workers.dealt_out());
    let close = |found: f64, expected: f64| (found - expected).abs() <= 1e-12 * expected.abs().max(1.0);
    let mut entries = 0;
    for row in 0..rows.rows() {
        if !is_unknown(row) {
            assert_eq!(product[row], 0.0, "row {row} has no unknown");
            continue;
        }
        let neighbors: Vec<usize> = filled.iter().copied().filter(|&j| weight(row, j) > 0.0).collect();
        let expected = COMPRESSIBILITY + neighbors.iter().map(|&j| weight(row, j)).sum::<f64>();
        assert!(close(matrix.diagonal()[row], expected), "diagonal of row {row}");
        let mut columns = Vec::new();
        matrix.for_each_entry(row, |column, value| {
            assert!(close(value, -weight(row, column as usize)), "row {row}, column {column}");
            columns.push(column as usize);
        });
        columns.sort_unstable();
        let with_unknown: Vec<usize> = neighbors.into_iter().filter(|&j| is_unknown(j)).collect();
        assert_eq!(columns, with_unknown, "row {row}");
        let others: f64 = with_unknown.iter().map(|&j| weight(row, j) * x[j]).sum();
        assert!(close(product[row], expected * x[row] - others), "product of row {row}");
        entries += with_unknown.len();
    }
    assert!(entries > 1000);
    // Resting walls are worked out for all lanes, those on the surface among them.
    let of_the_surface = |row: &usize| !is_unknown(*row) && *row < rows.walls().len() * LANES;
    let spare = filled.iter().filter(|row| of_the_surface(row)).map(|&row| {
        let mut count = 0;
        matrix.for_each_resting(row, |_, _| count += 1);
        count
    });
    assert_eq!(matrix.stored(), entries + spare.sum::<usize>());
}
