//! How the [matrix](super::matrix) is worked out: `c_ij = 2D / (n0_L lambda rho) w(r_ij, re_L)` of eight rows at once from their
//! lists.

use std::ops::Range;

use super::density::Numbers;
use super::entries::{Entries, Kept};
use super::matrix::{Block, Resting};
use super::{from_lanes, load, walk};
use crate::base::simd::{Kernel, LANES, Simd};
use crate::engine::kernel;
use crate::engine::search::clusters::{Clusters, Lists, with_pressure};

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
pub(super) struct Start<'a, V> {
    /// Of this block; `None` beyond the walls.
    pub resting: Option<&'a Resting<V>>,
    pub resting_diagonal: &'a [Numbers],
    /// Clusters of walls.
    pub walls: usize,
    pub compressibility: f64,
}

pub(super) struct Assemble<'a, V> {
    pub clusters: &'a Clusters,
    pub kernel: kernel::Kernel,
    pub coefficient: f64,
    pub start: Start<'a, V>,
    pub unknown: &'a [u8],
    pub first_slot: usize,
    /// Clusters, counted from that of row 0.
    pub rows: Range<usize>,
    pub entries: &'a mut Entries<V>,
    pub moving: &'a mut Block,
    pub diagonal: &'a mut [Numbers],
}

impl<V: Kept> Kernel for Assemble<'_, V> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Assemble {
            clusters,
            kernel,
            coefficient,
            start,
            unknown,
            first_slot,
            rows,
            entries,
            moving,
            diagonal,
        } = self;
        let coefficients = Coefficients::new(s, kernel, coefficient);
        let Block { touching, resting_ends, .. } = moving;
        let (of_walls, of_mobile) = (&clusters.wall_mobile[..], with_pressure(&clusters.mobile));
        entries.clear();
        touching.clear();
        resting_ends.clear();
        for (k, (row, diagonal)) in rows.zip(diagonal).enumerate() {
            let mut touch = 0;
            *diagonal = [1.0; LANES];
            if let (Some(resting), true) = (start.resting, row < start.walls) {
                let (always, end) = (resting.always[k], resting.entries.end_of(k));
                let wet = any_unknown(resting.entries.columns_between(always, end), unknown);
                resting_ends.push(if wet { end } else { always });
                touch = if wet { 0 } else { resting.touching[k] };
            }
            if unknown[row] != 0 {
                let cluster = row + first_slot / LANES;
                let sum = s.splat(start.compressibility);
                let (resting, lists) = match row < start.walls {
                    true => (s.load(&start.resting_diagonal[row]), of_walls),
                    false => (s.splat(0.0), of_mobile),
                };
                let rows = (cluster, first_slot);
                let wanted = (unknown, unknown[row]);
                let sum =
                    append_all(s, coefficients, clusters, lists, rows, wanted, entries, &mut touch, sum);
                let sum = s.add(sum, resting);
                s.store(s.select(s.mask(unknown[row]), sum, s.splat(1.0)), diagonal);
            }
            touching.push(touch);
            entries.end_cluster();
        }
    }
}

/// Appends the columns of several lists of a cluster, as [`append`] does; returns `sum` and that of all kept values.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "an inner loop of one kernel")]
fn append_all<S: Simd, V: Kept>(
    s: S,
    coefficients: Coefficients<S>,
    clusters: &Clusters,
    lists: &[Lists],
    (cluster, first_slot): (usize, usize),
    wanted: (&[u8], u8),
    entries: &mut Entries<V>,
    touch: &mut u8,
    mut sum: S::F,
) -> S::F {
    for lists in lists {
        let rows = (cluster, first_slot);
        let more = if lists.over().are_images() {
            append::<S, V, true>(s, coefficients, clusters, lists, rows, wanted, entries, touch)
        } else {
            append::<S, V, false>(s, coefficients, clusters, lists, rows, wanted, entries, touch)
        };
        sum = s.add(sum, more);
    }
    sum
}

/// Appends the values that some lanes have in those columns of a list that have unknowns; returns the sum over all columns, and
/// notes in `touch` which lanes are near a particle without. The column of an image is that of its particle, which a row may thus have
/// twice.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "an inner loop of one kernel")]
fn append<S: Simd, V: Kept, const IMAGES: bool>(
    s: S,
    coefficients: Coefficients<S>,
    clusters: &Clusters,
    lists: &Lists,
    (cluster, first_slot): (usize, usize),
    (unknown, of_lanes): (&[u8], u8),
    entries: &mut Entries<V>,
    touch: &mut u8,
) -> S::F {
    let near = lists.of(cluster);
    let x = load(s, &clusters.slots.lanes[cluster]);
    let points = &clusters.slots.points[..];
    let end = entries.end();
    let (columns, lanes, values) = entries.room_for(near.all.len());
    let (mut next, mut next_value) = (0, 0);
    let mut sum = s.splat(0.0);
    for (j, choice) in walk(near, near.all) {
        let (c, within) = coefficients.of(s, &points[j], &x, s.mask(choice));
        let (c, bits) = (V::kept(s, c), s.bits(within));
        sum = s.add(sum, c);
        let column = if IMAGES { clusters.slots.home(j) } else { j } - first_slot;
        let counts = unknown[column / LANES] >> (column % LANES) & 1 == 1;
        *touch |= if counts { 0 } else { bits };
        let wanted = if counts { bits & of_lanes } else { 0 };
        columns[next] = column as u32;
        lanes[next] = wanted;
        let room = values[next_value..].first_chunk_mut().expect("there is room for eight values a column");
        V::pack(s, c, wanted, room);
        // A column that only lanes without an unknown are near stays, so that who has one does not change the order of sums.
        next += usize::from(counts && bits != 0);
        next_value += wanted.count_ones() as usize;
    }
    entries.keep(end, next, next_value);
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

pub(super) struct AssembleResting<'a, V> {
    pub clusters: &'a Clusters,
    pub kernel: kernel::Kernel,
    pub coefficient: f64,
    pub first_slot: usize,
    pub pieces: Range<usize>,
    /// Those that come first and the others: of clusters of walls, a bit a lane.
    pub columns: [&'a [u8]; 2],
    pub resting: &'a mut Resting<V>,
    pub diagonal: &'a mut [Numbers],
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
            let (lists, rows, mut touch) = (with_pressure(&clusters.wall), (cluster, first_slot), 0);
            let (none, always, others) = (s.splat(0.0), (always, 0xFF), (others, 0xFF));
            let sum = append_all(s, coefficients, clusters, lists, rows, always, entries, &mut touch, none);
            always_end.push(entries.end());
            touching.push(touch);
            append_all(s, coefficients, clusters, lists, rows, others, entries, &mut 0, none);
            s.store(sum, diagonal);
            entries.end_cluster();
        }
    }
}
