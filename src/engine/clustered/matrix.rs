//! The pressure's matrix as the lists are: of each cluster the columns, and for each column the lanes that have a value.
//!
//! A product broadcasts one number of the vector for a column's values and gathers nothing; `x` is zero in rows without an
//! unknown, so that columns need no mask. Half the lanes have no value: only those that have are kept, behind a bit a lane,
//! and dealt out to them in a register (the format SPC5 of Bramas & Kus, PeerJ Computer Science 4:e151, 2018). What resting walls are to one another is worked out once. Values are kept as
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
use crate::engine::search::clusters::{Clusters, make_room};

/// Clusters whose entries lie together: a block of rows.
const TOGETHER: usize = BLOCK / LANES;

/// A precision that values can be kept in.
pub trait Kept: Value {
    /// What is left of values that are kept.
    fn kept<S: Simd>(s: S, values: S::F) -> S::F;
    /// Keeps those of some lanes, one behind the other; what stands behind them is written over.
    fn pack<S: Simd>(s: S, values: S::F, lanes: u8, to: &mut [Self; LANES]);
    /// Those of some lanes, zero in the others.
    fn unpack<S: Simd>(s: S, from: &[Self; LANES], lanes: u8) -> S::F;
}

impl Kept for f64 {
    #[inline(always)]
    fn kept<S: Simd>(_: S, values: S::F) -> S::F {
        values
    }

    #[inline(always)]
    fn pack<S: Simd>(s: S, values: S::F, lanes: u8, to: &mut [f64; LANES]) {
        s.pack(values, lanes, to);
    }

    #[inline(always)]
    fn unpack<S: Simd>(s: S, from: &[f64; LANES], lanes: u8) -> S::F {
        s.expand(from, lanes)
    }
}

impl Kept for f32 {
    #[inline(always)]
    fn kept<S: Simd>(s: S, values: S::F) -> S::F {
        s.narrowed(values)
    }

    #[inline(always)]
    fn pack<S: Simd>(s: S, values: S::F, lanes: u8, to: &mut [f32; LANES]) {
        s.pack_narrow(values, lanes, to);
    }

    #[inline(always)]
    fn unpack<S: Simd>(s: S, from: &[f32; LANES], lanes: u8) -> S::F {
        s.expand_narrow(from, lanes)
    }
}

/// The entries of some clusters.
#[derive(Debug, Default)]
pub(super) struct Entries<V> {
    columns: Vec<u32>,
    /// Of each column the lanes that have a value.
    lanes: Vec<u8>,
    /// The values of all lanes of all columns, and room for eight more.
    values: Vec<V>,
    ends: Vec<End>,
}

/// How far something reaches.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct End {
    columns: u32,
    values: u32,
}

/// Columns that follow one another, and their values.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run<'a, V> {
    pub columns: &'a [u32],
    pub lanes: &'a [u8],
    /// Those of the first column come first; what follows those of the last is not the run's.
    values: &'a [V],
}

impl<'a, V: Kept> Run<'a, V> {
    const NONE: Run<'static, V> = Run { columns: &[], lanes: &[], values: &[] };

    /// Shows the columns in which a lane has a value.
    fn for_each_in(self, lane: usize, mut visit: impl FnMut(u32, f64)) {
        let mut next = 0;
        for (&column, &lanes) in self.columns.iter().zip(self.lanes) {
            if lanes >> lane & 1 == 1 {
                let before = lanes & !(0xFF << lane);
                visit(column, self.values[next + before.count_ones() as usize].widened());
            }
            next += lanes.count_ones() as usize;
        }
    }

    /// Eight numbers from one on, of which the first are a column's values.
    #[inline(always)]
    fn values_from(self, first: usize) -> &'a [V; LANES] {
        self.values[first..].first_chunk().expect("values have room for eight more behind them")
    }
}

impl<V: Kept> Entries<V> {
    pub fn clear(&mut self) {
        self.columns.clear();
        self.lanes.clear();
        self.values.clear();
        self.ends.clear();
    }

    /// Where what was appended last ends.
    pub fn end(&self) -> End {
        End { columns: self.columns.len() as u32, values: self.values.len().saturating_sub(LANES) as u32 }
    }

    /// Ends a cluster.
    pub fn end_cluster(&mut self) {
        self.ends.push(self.end());
    }

    /// Room for so many columns behind those that are there, their lanes and values.
    #[inline(always)]
    pub fn room_for(&mut self, columns: usize) -> (&mut [u32], &mut [u8], &mut [V]) {
        let End { columns: start, values: start_of_values } = self.end();
        let (start, start_of_values) = (start as usize, start_of_values as usize);
        make_room(&mut self.columns, start + columns, 0);
        make_room(&mut self.lanes, start + columns, 0);
        make_room(&mut self.values, start_of_values + (columns + 1) * LANES, V::default());
        (&mut self.columns[start..], &mut self.lanes[start..], &mut self.values[start_of_values..])
    }

    /// Keeps so many of the columns and values that were written where [`room_for`](Entries::room_for) made room after `end`.
    #[inline(always)]
    pub fn keep(&mut self, end: End, columns: usize, values: usize) {
        self.columns.truncate(end.columns as usize + columns);
        self.lanes.truncate(end.columns as usize + columns);
        self.values.truncate(end.values as usize + values + LANES);
    }

    /// Those of the k-th cluster.
    #[inline(always)]
    pub fn of(&self, k: usize) -> Run<'_, V> {
        self.up_to(k, self.ends[k])
    }

    /// How many values of the k-th cluster stand before `end`.
    fn values_up_to(&self, k: usize, end: End) -> usize {
        (end.values - self.start_of(k).values) as usize
    }

    #[inline(always)]
    fn start_of(&self, k: usize) -> End {
        if k == 0 { End::default() } else { self.ends[k - 1] }
    }

    /// Those of the k-th cluster that stand before `end`.
    #[inline(always)]
    pub fn up_to(&self, k: usize, end: End) -> Run<'_, V> {
        let start = self.start_of(k);
        let range = start.columns as usize..end.columns as usize;
        Run {
            columns: &self.columns[range.clone()],
            lanes: &self.lanes[range],
            values: &self.values[start.values as usize..],
        }
    }

    /// Where the k-th cluster ends.
    pub fn end_of(&self, k: usize) -> End {
        self.ends[k]
    }

    /// The columns from one place to another.
    pub fn columns_between(&self, from: End, to: End) -> &[u32] {
        &self.columns[from.columns as usize..to.columns as usize]
    }

    fn bytes(&self) -> usize {
        self.columns.capacity() * size_of::<u32>()
            + self.lanes.capacity()
            + self.values.capacity() * size_of::<V>()
            + self.ends.capacity() * size_of::<End>()
    }
}

/// What one block of rows of walls is to resting walls. Columns that have an unknown without any fluid stand first: a dry
/// wall's others have none, and its rows end before them.
#[derive(Debug, Default)]
pub(super) struct Resting<V> {
    pub entries: Entries<V>,
    /// Where the first columns of each cluster end.
    pub always: Vec<End>,
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
    pub resting_ends: Vec<End>,
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
    pub fn for_each_resting(&self, row: usize, visit: impl FnMut(u32, f64)) {
        let (block, k) = (row / BLOCK, row / LANES % TOGETHER);
        let Resting { entries, always, .. } = &self.resting[block];
        entries.up_to(k, always[k]).for_each_in(row % LANES, visit);
    }

    /// The columns and values of a cluster: those of resting walls, and the others.
    #[inline(always)]
    pub(super) fn entries(&self, cluster: usize) -> [Run<'_, V>; 2] {
        let (block, k) = (cluster / TOGETHER, cluster % TOGETHER);
        let Block { entries, resting_ends, .. } = &self.moving[block];
        let resting = match resting_ends.get(k) {
            Some(&end) => self.resting[block].entries.up_to(k, end),
            None => Run::NONE,
        };
        [resting, entries.of(k)]
    }

    /// Values beside the diagonal that a product goes through.
    pub fn stored(&self) -> usize {
        let with_unknowns = (0..self.unknown.len()).filter(|&cluster| self.unknown[cluster] != 0);
        let of_cluster = |cluster: usize| {
            let (block, k) = (cluster / TOGETHER, cluster % TOGETHER);
            let Block { entries, resting_ends, .. } = &self.moving[block];
            let resting = |&end| self.resting[block].entries.values_up_to(k, end);
            resting_ends.get(k).map_or(0, resting) + entries.values_up_to(k, entries.end_of(k))
        };
        with_unknowns.map(of_cluster).sum()
    }

    pub fn bytes(&self) -> usize {
        let resting = |r: &Resting<V>| {
            r.entries.bytes() + r.always.capacity() * size_of::<End>() + r.touching.capacity()
        };
        let moving = |b: &Block<V>| {
            b.entries.bytes() + b.touching.capacity() + b.resting_ends.capacity() * size_of::<End>()
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
        for run in self.entries(row / LANES) {
            run.for_each_in(row % LANES, |column, value| visit(column, -value));
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
            for run in matrix.entries(cluster) {
                let mut next = 0;
                let ((columns4, columns_rest), (lanes4, lanes_rest)) =
                    (run.columns.as_chunks::<4>(), run.lanes.as_chunks::<4>());
                for (columns, lanes) in columns4.iter().zip(lanes4) {
                    for k in 0..4 {
                        let values = V::unpack(s, run.values_from(next), lanes[k]);
                        strands[k] = s.neg_mul_add(values, s.splat(x[columns[k] as usize]), strands[k]);
                        next += lanes[k].count_ones() as usize;
                    }
                }
                for (k, (&column, &lanes)) in columns_rest.iter().zip(lanes_rest).enumerate() {
                    let values = V::unpack(s, run.values_from(next), lanes);
                    strands[k] = s.neg_mul_add(values, s.splat(x[column as usize]), strands[k]);
                    next += lanes.count_ones() as usize;
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
        for run in matrix.entries(cluster) {
            let (mut present, mut key, mut sum) = (NONE, 0, s.splat(0.0));
            let mut next = 0;
            for (&column, &lanes) in run.columns.iter().zip(run.lanes) {
                let of = boxes.of[column as usize];
                if of != present {
                    if present != NONE {
                        let total = gather.sum_of(key, present);
                        s.store(s.sub(s.load(total), sum), total);
                    }
                    (present, key, sum) = (of, boxes.key[column as usize], s.splat(0.0));
                }
                sum = s.add(sum, V::unpack(s, run.values_from(next), lanes));
                next += lanes.count_ones() as usize;
            }
            if present != NONE {
                let total = gather.sum_of(key, present);
                s.store(s.sub(s.load(total), sum), total);
            }
        }
    }
}
