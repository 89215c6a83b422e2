//! The pressure's matrix as the lists are: of each cluster the columns, and for each column eight values, one a lane.
//!
//! A product broadcasts one number of the vector for eight values and gathers nothing; `x` is zero in rows without an
//! unknown, so that columns need no mask. What resting walls are to one another is worked out once. Values are kept as
//! `c_ij = -A_ij`, in `f32` by default; the diagonal is the sum of the kept values, so that a row's sum stays exact.

use std::fmt::Debug;
use std::ops::Range;

use super::density::Numbers;
use super::rows::RowSpace;
use super::{from_lanes, load, walk};
use crate::base::parallel::{Rows, Team};
use crate::base::simd::{Kernel, LANES, Simd, dispatch};
use crate::engine::kernel;
use crate::engine::pressure::preconditioner::two_level::lanes::{LaneBoxes, LaneGather, RowBoxes};
use crate::engine::pressure::system_matrix::{BLOCK, SystemMatrix};
use crate::engine::pressure::values::Value;
use crate::engine::search::NONE;
use crate::engine::search::clusters::{Clusters, Lists, make_room};

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
    columns: Vec<u32>,
    values: Vec<[V; LANES]>,
    ends: Vec<u32>,
}

impl<V: Kept> Entries<V> {
    fn clear(&mut self) {
        self.columns.clear();
        self.values.clear();
        self.ends.clear();
    }

    fn end(&mut self) {
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
struct Resting<V> {
    entries: Entries<V>,
    /// Where the first columns of each cluster end.
    always: Vec<u32>,
    /// Of each cluster the lanes that lie within reach of its other columns.
    touching: Vec<u8>,
}

/// What is worked out of one block of rows.
#[derive(Debug, Default)]
struct Block<V> {
    entries: Entries<V>,
    /// Of each cluster the lanes that lie within reach of the surface.
    touching: Vec<u8>,
    /// Of each cluster of walls where its columns among resting walls end.
    resting_ends: Vec<u32>,
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

/// `c_ij` of all lanes, and where it is not zero.
#[derive(Clone, Copy)]
struct Coefficients<S: Simd> {
    re: S::F,
    re2: S::F,
    most: S::F,
    coefficient: S::F,
}

impl<S: Simd> Coefficients<S> {
    #[inline(always)]
    fn new(s: S, kernel: kernel::Kernel, coefficient: f64) -> Self {
        Coefficients {
            re: s.splat(kernel.radius_m),
            re2: s.splat(kernel.radius_m * kernel.radius_m),
            most: s.splat(1.0 / kernel.floor_m),
            coefficient: s.splat(coefficient),
        }
    }

    #[inline(always)]
    fn of(self, s: S, point: &[f64; 4], x: &[S::F; 3], choice: S::M) -> (S::F, S::M) {
        let r = from_lanes(s, point, x);
        let r2 = s.dot(r, r);
        let w = s.mul_add(self.re, s.min(s.reciprocal_sqrt(r2), self.most), s.splat(-1.0));
        let within = s.both(choice, s.below(r2, self.re2));
        (s.keep(within, s.mul(self.coefficient, w)), within)
    }
}

/// What the diagonal starts from.
#[derive(Clone, Copy)]
struct Start<'a, V> {
    /// Of this block; `None` beyond the walls.
    resting: Option<&'a Resting<V>>,
    resting_diagonal: &'a [Numbers],
    /// Clusters of walls.
    walls: usize,
    compressibility: f64,
}

struct Assemble<'a, V> {
    clusters: &'a Clusters,
    kernel: kernel::Kernel,
    coefficient: f64,
    start: Start<'a, V>,
    unknown: &'a [u8],
    first_slot: usize,
    /// Clusters, counted from that of row 0.
    rows: Range<usize>,
    moving: &'a mut Block<V>,
    diagonal: &'a mut [Numbers],
}

impl<V: Kept> Kernel for Assemble<'_, V> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Assemble { clusters, kernel, coefficient, start, unknown, first_slot, rows, moving, diagonal } =
            self;
        let coefficients = Coefficients::new(s, kernel, coefficient);
        let Block { entries, touching, resting_ends } = moving;
        let of_walls = [&clusters.wall_mobile];
        let of_mobile = [&clusters.mobile[1], &clusters.mobile[2]];
        entries.clear();
        touching.clear();
        resting_ends.clear();
        for (k, (row, diagonal)) in rows.zip(diagonal).enumerate() {
            let mut touch = 0;
            *diagonal = [1.0; LANES];
            if let (Some(resting), true) = (start.resting, row < start.walls) {
                let (always, end) = (resting.always[k], resting.entries.ends[k]);
                let others = &resting.entries.columns[always as usize..end as usize];
                let wet = any_unknown(others, unknown);
                resting_ends.push(if wet { end } else { always });
                touch = if wet { 0 } else { resting.touching[k] };
            }
            if unknown[row] != 0 {
                let cluster = row + first_slot / LANES;
                let mut sum = s.splat(start.compressibility);
                let (resting, lists) = match row < start.walls {
                    true => (s.load(&start.resting_diagonal[row]), &of_walls[..]),
                    false => (s.splat(0.0), &of_mobile[..]),
                };
                for lists in lists {
                    let more = append(
                        s,
                        coefficients,
                        clusters,
                        lists,
                        cluster,
                        first_slot,
                        unknown,
                        entries,
                        &mut touch,
                    );
                    sum = s.add(sum, more);
                }
                sum = s.add(sum, resting);
                s.store(s.select(s.mask(unknown[row]), sum, s.splat(1.0)), diagonal);
            }
            touching.push(touch);
            entries.end();
        }
    }
}

/// Appends the columns of a list that have unknowns; returns the sum of all kept values, and notes in `touch` which lanes are
/// near a particle without.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "an inner loop of one kernel")]
fn append<S: Simd, V: Kept>(
    s: S,
    coefficients: Coefficients<S>,
    clusters: &Clusters,
    lists: &Lists,
    cluster: usize,
    first_slot: usize,
    unknown: &[u8],
    entries: &mut Entries<V>,
    touch: &mut u8,
) -> S::F {
    let near = lists.of(cluster);
    let x = load(s, &clusters.slots.lanes[cluster]);
    let points = &clusters.slots.points[..];
    let mut next = entries.columns.len();
    let room = next + near.all.len();
    make_room(&mut entries.columns, room, 0);
    make_room(&mut entries.values, room, [V::default(); LANES]);
    let mut sum = s.splat(0.0);
    for (j, choice) in walk(near, near.all) {
        let (c, within) = coefficients.of(s, &points[j], &x, s.mask(choice));
        let kept = &mut entries.values[next];
        V::keep(s, c, kept);
        sum = s.add(sum, V::load(s, kept));
        let column = j - first_slot;
        entries.columns[next] = column as u32;
        let (lanes, counts) = (s.bits(within), unknown[column / LANES] >> (column % LANES) & 1);
        *touch |= if counts == 1 { 0 } else { lanes };
        next += usize::from(counts == 1 && lanes != 0);
    }
    entries.columns.truncate(next);
    entries.values.truncate(next);
    sum
}

/// Whether any of these columns has an unknown.
#[inline(always)]
fn any_unknown(columns: &[u32], unknown: &[u8]) -> bool {
    for &column in columns {
        if unknown[column as usize / LANES] >> (column as usize % LANES) & 1 == 1 {
            return true;
        }
    }
    false
}

struct AssembleResting<'a, V> {
    clusters: &'a Clusters,
    kernel: kernel::Kernel,
    coefficient: f64,
    first_slot: usize,
    pieces: Range<usize>,
    /// Those that come first and the others: of clusters of walls, a bit a lane.
    columns: [&'a [u8]; 2],
    resting: &'a mut Resting<V>,
    diagonal: &'a mut [Numbers],
}

impl<V: Kept> Kernel for AssembleResting<'_, V> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let AssembleResting {
            clusters,
            kernel,
            coefficient,
            first_slot,
            pieces,
            columns: [always, others],
            resting: Resting { entries, always: always_end, touching },
            diagonal,
        } = self;
        let coefficients = Coefficients::new(s, kernel, coefficient);
        entries.clear();
        always_end.clear();
        touching.clear();
        for (cluster, diagonal) in pieces.zip(diagonal) {
            let (lists, mut touch) = (&clusters.wall[1], 0);
            let sum =
                append(s, coefficients, clusters, lists, cluster, first_slot, always, entries, &mut touch);
            always_end.push(entries.columns.len() as u32);
            touching.push(touch);
            append(s, coefficients, clusters, lists, cluster, first_slot, others, entries, &mut 0);
            s.store(sum, diagonal);
            entries.end();
        }
    }
}
