//! The pressure's matrix as the lists are: of each cluster the columns, and for each column the lanes that have a value.
//!
//! A product broadcasts one number of the vector for a column's values, deals these out to their lanes in a register and gathers
//! nothing; `x` is zero in rows without an unknown, so that columns need no mask. What resting walls are to one another is worked
//! out once. Values are kept as `c_ij = -A_ij`, in `f32` by default; the diagonal is the sum of the kept values, so that a row's
//! sum stays exact.

use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

use super::assembly::{Assemble, AssembleResting, Start};
use super::density::Numbers;
use super::entries::{End, Entries, Kept, Place, Run, Store};
use super::rows::RowSpace;
use crate::base::parallel::{Rows, Spares, Team};
use crate::base::simd::{Kernel, LANES, Simd, dispatch};
use crate::engine::kernel;
use crate::engine::pressure::preconditioner::two_level::lanes::{LaneBoxes, LaneGather, RowBoxes};
use crate::engine::pressure::system_matrix::{BLOCK, SystemMatrix};
use crate::engine::search::NONE;
use crate::engine::search::clusters::Clusters;

/// Clusters whose entries lie together: a block of rows.
const TOGETHER: usize = BLOCK / LANES;

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
pub(super) struct Block {
    /// Where its entries begin among those of all blocks, and where each cluster's end.
    place: Place,
    ends: Vec<End>,
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
    /// All others, by block, and their entries.
    moving: Vec<Block>,
    store: Store<V>,
    /// Where entries are worked out; lent to the workers.
    spare: Spares<Entries<V>>,
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
            store: Store::default(),
            spare: Spares::default(),
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
        self.diagonal.resize(rows.clusters(), [1.0; LANES]);
        self.moving.resize_with(rows.clusters().div_ceil(TOGETHER), Block::default);
        while let Err(wanted) = self.assemble_into_store(clusters, rows, compressibility, team) {
            self.store.make_room(wanted);
        }
    }

    /// The same as far as there is room for entries; tells how much is wanted where there is less.
    fn assemble_into_store(
        &mut self,
        clusters: &Clusters,
        rows: &RowSpace,
        compressibility: f64,
        team: Team<'_>,
    ) -> Result<(), Place> {
        let ClusterMatrix {
            kernel,
            coefficient,
            resting,
            resting_diagonal,
            moving,
            store,
            spare,
            diagonal,
            unknown,
            ..
        } = self;
        let (shares, full) = (store.shares(), AtomicBool::new(false));
        let (walls, first_slot) = (rows.walls().len(), rows.first_slot());
        let columns = (Rows::new(moving), Rows::of_width(diagonal, TOGETHER));
        team.fill(columns, |blocks, (moving, diagonal)| {
            let mut entries = spare.borrow();
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
                    entries: &mut entries,
                    moving,
                    diagonal,
                });
                moving.ends.clear();
                moving.ends.extend_from_slice(entries.ends());
                match shares.take_up(&entries) {
                    Some(place) => moving.place = place,
                    None => full.store(true, Relaxed),
                }
            }
            spare.give_back(entries);
        });
        if full.into_inner() { Err(shares.wanted()) } else { Ok(()) }
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
        let moving = &self.moving[block];
        let resting = match moving.resting_ends.get(k) {
            Some(&end) => self.resting[block].entries.up_to(k, end),
            None => Run::NONE,
        };
        [resting, self.store.run(moving.place, End::start_of(&moving.ends, k), moving.ends[k])]
    }

    /// Values beside the diagonal that a product goes through.
    pub fn stored(&self) -> usize {
        let with_unknowns = (0..self.unknown.len()).filter(|&cluster| self.unknown[cluster] != 0);
        let of_cluster = |cluster: usize| {
            let (block, k) = (cluster / TOGETHER, cluster % TOGETHER);
            let moving = &self.moving[block];
            let resting = |&end: &End| end.values_after(End::start_of(self.resting[block].entries.ends(), k));
            moving.resting_ends.get(k).map_or(0, resting)
                + moving.ends[k].values_after(End::start_of(&moving.ends, k))
        };
        with_unknowns.map(of_cluster).sum()
    }

    pub fn bytes(&self) -> usize {
        let resting = |r: &Resting<V>| {
            r.entries.bytes() + r.always.capacity() * size_of::<End>() + r.touching.capacity()
        };
        let moving = |b: &Block| {
            b.touching.capacity() + (b.ends.capacity() + b.resting_ends.capacity()) * size_of::<End>()
        };
        self.resting.iter().map(resting).sum::<usize>()
            + self.moving.iter().map(moving).sum::<usize>()
            + self.store.bytes()
            + self.spare.bytes(Entries::bytes)
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
