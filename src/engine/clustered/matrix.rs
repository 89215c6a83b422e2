//! The pressure's matrix as the lists are: of each cluster the columns, and for each column eight values, one a lane.
//!
//! A product broadcasts one number of the vector for eight values and gathers nothing; `x` is zero in rows without an
//! unknown, so that columns need no mask. What resting walls are to one another is worked out once. Values are kept as
//! `c_ij = -A_ij`, in `f32` by default; the diagonal is the sum of the kept values, so that a row's sum stays exact.

use std::fmt::Debug;

use super::assembly::{Assemble, AssembleResting, Start};
use super::density::Numbers;
use super::rows::RowSpace;
use crate::base::parallel::{Rows, Team};
use crate::base::simd::{Kernel, LANES, Simd, dispatch};
use crate::engine::kernel;
use crate::engine::pressure::preconditioner::two_level::lanes::{LaneBoxes, LaneGather, RowBoxes};
use crate::engine::pressure::system_matrix::{BLOCK, SystemMatrix};
use crate::engine::pressure::values::Value;
use crate::engine::search::NONE;
use crate::engine::search::clusters::Clusters;

/// Clusters whose entries lie together: a block of rows.
const TOGETHER: usize = BLOCK / LANES;

/// A precision that vectors can be kept in.
pub trait Kept: Value {
    fn keep<S: Simd>(s: S, value: S::F, to: &mut [Self; LANES]);
    fn load<S: Simd>(s: S, from: &[Self; LANES]) -> S::F;
}

impl Kept for f64 {
    #[inline(always)]
    fn keep<S: Simd>(s: S, value: S::F, to: &mut [f64; LANES]) {
        s.store(value, to);
    }

    #[inline(always)]
    fn load<S: Simd>(s: S, from: &[f64; LANES]) -> S::F {
        s.load(from)
    }
}

impl Kept for f32 {
    #[inline(always)]
    fn keep<S: Simd>(s: S, value: S::F, to: &mut [f32; LANES]) {
        s.store_narrow(value, to);
    }

    #[inline(always)]
    fn load<S: Simd>(s: S, from: &[f32; LANES]) -> S::F {
        s.load_narrow(from)
    }
}

/// The entries of some clusters.
#[derive(Debug, Default)]
pub(super) struct Entries<V> {
    pub columns: Vec<u32>,
    pub values: Vec<[V; LANES]>,
    pub ends: Vec<u32>,
}

impl<V: Kept> Entries<V> {
    pub fn clear(&mut self) {
        self.columns.clear();
        self.values.clear();
        self.ends.clear();
    }

    pub fn end(&mut self) {
        self.ends.push(self.columns.len() as u32);
    }

    /// The columns and values of the k-th cluster.
    #[inline(always)]
    pub fn of(&self, k: usize) -> (&[u32], &[[V; LANES]]) {
        self.up_to(k, self.ends[k])
    }

    /// Those of the k-th cluster that stand before `end`.
    #[inline(always)]
    fn up_to(&self, k: usize, end: u32) -> (&[u32], &[[V; LANES]]) {
        let start = if k == 0 { 0 } else { self.ends[k - 1] } as usize;
        let range = start..end as usize;
        (&self.columns[range.clone()], &self.values[range])
    }

    fn bytes(&self) -> usize {
        (self.columns.capacity() + self.ends.capacity()) * size_of::<u32>()
            + self.values.capacity() * size_of::<[V; LANES]>()
    }
}

/// What one block of rows of walls is to resting walls. Columns that have an unknown without any fluid stand first: a dry
/// wall's others have none, and its rows end before them.
#[derive(Debug, Default)]
pub(super) struct Resting<V> {
    pub entries: Entries<V>,
    /// Where the first columns of each cluster end.
    pub always: Vec<u32>,
    /// Of each cluster the lanes that lie within reach of its other columns.
    pub touching: Vec<u8>,
}

/// What is worked out of one block of rows.
#[derive(Debug, Default)]
pub(super) struct Block<V> {
    pub entries: Entries<V>,
    /// Of each cluster the lanes that lie within reach of the surface.
    pub touching: Vec<u8>,
    /// Of each cluster of walls where its columns among resting walls end.
    pub resting_ends: Vec<u32>,
}

#[derive(Debug)]
pub struct ClusterMatrix<V> {
    kernel: kernel::Kernel,
    /// `2D / (n0_L lambda rho)`.
    coefficient: f64,
    first_slot: usize,
    rows: usize,
    /// Of walls among walls, by block.
    resting: Vec<Resting<V>>,
    resting_diagonal: Vec<Numbers>,
    walls_sorted: usize,
    /// All others, by block.
    moving: Vec<Block<V>>,
    diagonal: Vec<Numbers>,
    /// Bit k: whether lane k has an unknown pressure; by cluster.
    pub unknown: Vec<u8>,
}

impl<V: Kept> ClusterMatrix<V> {
    pub fn new(kernel: kernel::Kernel, coefficient: f64) -> Self {
        ClusterMatrix {
            kernel,
            coefficient,
            first_slot: 0,
            rows: 0,
            resting: Vec::new(),
            resting_diagonal: Vec::new(),
            walls_sorted: 0,
            moving: Vec::new(),
            diagonal: Vec::new(),
            unknown: Vec::new(),
        }
    }

    /// Whether walls were sorted since they were taken up.
    pub fn has_old_walls(&self, clusters: &Clusters) -> bool {
        self.walls_sorted != clusters.walls_sorted
    }

    /// Takes up what walls are to one another; those that `unknown` says have an unknown even without fluid.
    pub fn take_up_walls(&mut self, clusters: &Clusters, rows: &RowSpace, unknown: &[u8], team: Team<'_>) {
        self.walls_sorted = clusters.walls_sorted;
        self.assemble_resting(clusters, rows, unknown, team);
    }

    /// Takes up the rows that `unknown` says; `compressibility` is `alpha / dt^2`.
    pub fn assemble(&mut self, clusters: &Clusters, rows: &RowSpace, compressibility: f64, team: Team<'_>) {
        (self.first_slot, self.rows) = (rows.first_slot(), rows.rows());
        let ClusterMatrix {
            kernel, coefficient, resting, resting_diagonal, moving, diagonal, unknown, ..
        } = self;
        diagonal.resize(rows.clusters(), [1.0; LANES]);
        moving.resize_with(rows.clusters().div_ceil(TOGETHER), Block::default);
        let (walls, first_slot) = (rows.walls().len(), rows.first_slot());
        let columns = (Rows::new(moving), Rows::of_width(diagonal, TOGETHER));
        team.fill(columns, |blocks, (moving, diagonal)| {
            let all = blocks.zip(moving).zip(diagonal.chunks_mut(TOGETHER));
            for ((block, moving), diagonal) in all {
                let rows = block * TOGETHER..block * TOGETHER + diagonal.len();
                let (kernel, coefficient) = (*kernel, *coefficient);
                let start = Start { resting: resting.get(block), resting_diagonal, walls, compressibility };
                dispatch(Assemble {
                    clusters,
                    kernel,
                    coefficient,
                    start,
                    unknown,
                    first_slot,
                    rows,
                    moving,
                    diagonal,
                });
            }
        });
    }

    fn assemble_resting(&mut self, clusters: &Clusters, rows: &RowSpace, always: &[u8], team: Team<'_>) {
        let others: Vec<u8> = always.iter().map(|bits| !bits).collect();
        let ClusterMatrix { kernel, coefficient, resting, resting_diagonal, .. } = self;
        let walls = rows.walls();
        resting.resize_with(walls.len().div_ceil(TOGETHER), Resting::default);
        resting_diagonal.clear();
        resting_diagonal.resize(walls.len(), [0.0; LANES]);
        let columns = (Rows::new(resting), Rows::of_width(resting_diagonal, TOGETHER));
        team.fill(columns, |blocks, (resting, diagonal)| {
            let all = blocks.zip(resting).zip(diagonal.chunks_mut(TOGETHER));
            for ((block, resting), diagonal) in all {
                let first = walls.start + block * TOGETHER;
                let pieces = first..first + diagonal.len();
                let (kernel, coefficient, first_slot) = (*kernel, *coefficient, rows.first_slot());
                dispatch(AssembleResting {
                    clusters,
                    kernel,
                    coefficient,
                    first_slot,
                    pieces,
                    columns: [always, &others],
                    resting,
                    diagonal,
                });
            }
        });
    }

    /// Doubles the diagonals of rows.
    pub fn anchor(&mut self, rows: &[u32]) {
        for &row in rows {
            self.diagonal[row as usize / LANES][row as usize % LANES] *= 2.0;
        }
    }

    /// The lanes of a cluster that are within reach of a particle of fluid on the surface.
    pub fn touching(&self, cluster: usize) -> u8 {
        self.moving[cluster / TOGETHER].touching[cluster % TOGETHER]
    }

    /// The diagonal of a row of walls without any fluid.
    pub fn resting_diagonal(&self, row: usize) -> f64 {
        self.resting_diagonal[row / LANES][row % LANES]
    }

    /// The lanes of a cluster of walls that are within reach of a wall on the surface without any fluid.
    pub fn resting_touching(&self, cluster: usize) -> u8 {
        self.resting[cluster / TOGETHER].touching[cluster % TOGETHER]
    }

    /// Shows what a row of walls has in columns of walls that have an unknown without any fluid: `c_ij`.
    pub fn for_each_resting(&self, row: usize, mut visit: impl FnMut(u32, f64)) {
        let (block, k) = (row / BLOCK, row / LANES % TOGETHER);
        let Resting { entries, always, .. } = &self.resting[block];
        let (columns, values) = entries.up_to(k, always[k]);
        for (&column, values) in columns.iter().zip(values) {
            let value = values[row % LANES].widened();
            if value != 0.0 {
                visit(column, value);
            }
        }
    }

    /// The columns and values of a cluster: those of resting walls, and the others.
    #[inline(always)]
    pub(super) fn entries(&self, cluster: usize) -> [(&[u32], &[[V; LANES]]); 2] {
        let (block, k) = (cluster / TOGETHER, cluster % TOGETHER);
        let Block { entries, resting_ends, .. } = &self.moving[block];
        let resting = match resting_ends.get(k) {
            Some(&end) => self.resting[block].entries.up_to(k, end),
            None => (&[][..], &[][..]),
        };
        [resting, entries.of(k)]
    }

    /// Values beside the diagonal that a product goes through, zeros among them.
    pub fn stored(&self) -> usize {
        let with_unknowns = (0..self.unknown.len()).filter(|&cluster| self.unknown[cluster] != 0);
        LANES
            * with_unknowns
                .flat_map(|cluster| self.entries(cluster))
                .map(|(columns, _)| columns.len())
                .sum::<usize>()
    }

    pub fn bytes(&self) -> usize {
        let resting = |r: &Resting<V>| {
            r.entries.bytes() + r.always.capacity() * size_of::<u32>() + r.touching.capacity()
        };
        let moving = |b: &Block<V>| {
            b.entries.bytes() + b.touching.capacity() + b.resting_ends.capacity() * size_of::<u32>()
        };
        self.resting.iter().map(resting).sum::<usize>()
            + self.moving.iter().map(moving).sum::<usize>()
            + (self.resting_diagonal.capacity() + self.diagonal.capacity()) * size_of::<Numbers>()
            + self.unknown.capacity()
    }
}

impl<V: Kept> SystemMatrix for ClusterMatrix<V> {
    fn rows(&self) -> usize {
        self.rows
    }

    fn diagonal(&self) -> &[f64] {
        self.diagonal.as_flattened()
    }

    fn multiply_rows(&self, first: usize, x: &[f64], y: &mut [f64]) {
        dispatch(Multiply { matrix: self, first: first / LANES, x, y });
    }

    const IN_LANES: bool = true;

    fn add_up_by_box(&self, boxes: RowBoxes<'_>, into: &mut LaneBoxes, team: Team<'_>) {
        into.take_up(self.rows, boxes, team, |cluster, gather| {
            dispatch(AddUp { matrix: self, cluster, boxes, gather });
        });
    }

    fn for_each_entry(&self, row: usize, mut visit: impl FnMut(u32, f64)) {
        for (columns, values) in self.entries(row / LANES) {
            for (&column, values) in columns.iter().zip(values) {
                let value = values[row % LANES].widened();
                if value != 0.0 {
                    visit(column, -value);
                }
            }
        }
    }
}

struct Multiply<'a, V> {
    matrix: &'a ClusterMatrix<V>,
    /// Cluster.
    first: usize,
    x: &'a [f64],
    y: &'a mut [f64],
}

impl<V: Kept> Kernel for Multiply<'_, V> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Multiply { matrix, first, x, y } = self;
        let (of_clusters, _) = x.as_chunks::<LANES>();
        let (y, _) = y.as_chunks_mut::<LANES>();
        for (cluster, y) in (first..).zip(y) {
            let unknown = matrix.unknown[cluster];
            if unknown == 0 {
                *y = [0.0; LANES];
                continue;
            }
            let diagonal = s.mul(s.load(&matrix.diagonal[cluster]), s.load(&of_clusters[cluster]));
            let mut strands = [diagonal, s.splat(0.0), s.splat(0.0), s.splat(0.0)];
            for (columns, values) in matrix.entries(cluster) {
                let ((columns4, columns_rest), (values4, values_rest)) =
                    (columns.as_chunks::<4>(), values.as_chunks::<4>());
                for (columns, values) in columns4.iter().zip(values4) {
                    for k in 0..4 {
                        let x = s.splat(x[columns[k] as usize]);
                        strands[k] = s.neg_mul_add(V::load(s, &values[k]), x, strands[k]);
                    }
                }
                for (k, (&column, values)) in columns_rest.iter().zip(values_rest).enumerate() {
                    let x = s.splat(x[column as usize]);
                    strands[k] = s.neg_mul_add(V::load(s, values), x, strands[k]);
                }
            }
            let [a, b, c, d] = strands;
            s.store(s.keep(s.mask(unknown), s.add(s.add(a, b), s.add(c, d))), y);
        }
    }
}

/// Adds the columns of one cluster up by box. Columns that follow one another mostly lie in one box: their sum stays in a
/// register until the box changes.
struct AddUp<'a, V> {
    matrix: &'a ClusterMatrix<V>,
    cluster: usize,
    boxes: RowBoxes<'a>,
    gather: &'a mut LaneGather,
}

impl<V: Kept> Kernel for AddUp<'_, V> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let AddUp { matrix, cluster, boxes, gather } = self;
        for (lane, &diagonal) in matrix.diagonal[cluster].iter().enumerate() {
            let row = cluster * LANES + lane;
            if boxes.of[row] != NONE {
                gather.sum_of(boxes.key[row], boxes.of[row])[lane] += diagonal;
            }
        }
        for (columns, values) in matrix.entries(cluster) {
            let (mut present, mut key, mut sum) = (NONE, 0, s.splat(0.0));
            for (&column, values) in columns.iter().zip(values) {
                let of = boxes.of[column as usize];
                if of != present {
                    if present != NONE {
                        let total = gather.sum_of(key, present);
                        s.store(s.sub(s.load(total), sum), total);
                    }
                    (present, key, sum) = (of, boxes.key[column as usize], s.splat(0.0));
                }
                sum = s.add(sum, V::load(s, values));
            }
            if present != NONE {
                let total = gather.sum_of(key, present);
                s.store(s.sub(s.load(total), sum), total);
            }
        }
    }
}
