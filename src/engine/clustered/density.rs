//! The number density on clusters, `n_i = sum_j w(r_ij, re_n)`, of fluid, bodies and walls.
//!
//! What walls and dummy walls add to walls is summed once, until walls move.

use std::ops::Range;

use super::rows::RowSpace;
use super::{PIECE, from_lanes, load, walk};
use crate::base::parallel::{Rows, Team};
use crate::base::simd::{Kernel, LANES, Simd, dispatch};
use crate::engine::kernel;
use crate::engine::search::clusters::{Clusters, Lists};

/// A number a lane.
pub type Numbers = [f64; LANES];

#[derive(Debug)]
pub struct ClusterDensity {
    kernel: kernel::Kernel,
    /// What resting walls add to walls, by cluster of walls.
    resting: Vec<Numbers>,
    walls_sorted: usize,
    /// By cluster of walls, fluid and bodies.
    pub n: Vec<Numbers>,
}

impl ClusterDensity {
    pub fn new(kernel: kernel::Kernel) -> Self {
        ClusterDensity { kernel, resting: Vec::new(), walls_sorted: 0, n: Vec::new() }
    }

    pub fn sum(&mut self, clusters: &Clusters, rows: &RowSpace, team: Team<'_>) {
        if self.walls_sorted != clusters.walls_sorted {
            self.walls_sorted = clusters.walls_sorted;
            let walls = rows.walls();
            self.resting.clear();
            self.resting.resize(walls.len(), [0.0; LANES]);
            fill(&mut self.resting, walls.start, team, |pieces, n| {
                dispatch(Sum { clusters, lists: &clusters.wall, pieces, kernel: self.kernel, n });
            });
        }
        self.n.resize(rows.clusters(), [0.0; LANES]);
        let (wall_n, mobile_n) = self.n.split_at_mut(rows.walls().len());
        wall_n.copy_from_slice(&self.resting);
        let kernel = self.kernel;
        fill(wall_n, rows.walls().start, team, |pieces, n| {
            dispatch(Sum { clusters, lists: &clusters.wall_mobile, pieces, kernel, n });
        });
        mobile_n.fill([0.0; LANES]);
        fill(mobile_n, rows.mobile().start, team, |pieces, n| {
            dispatch(Sum { clusters, lists: &clusters.mobile, pieces, kernel, n });
        });
    }

    /// Of each cluster of walls the lanes to which walls and dummy walls alone add up to `least`.
    pub fn resting_at_least(&self, least: f64) -> Vec<u8> {
        let lanes = |n: &Numbers| (0..LANES).fold(0, |bits, k| bits | u8::from(n[k] >= least) << k);
        self.resting.iter().map(lanes).collect()
    }

    /// What walls and dummy walls alone add up to, by cluster of walls.
    pub fn of_walls_alone(&self) -> &[Numbers] {
        &self.resting
    }

    pub fn bytes(&self) -> usize {
        (self.resting.capacity() + self.n.capacity()) * size_of::<Numbers>()
    }
}

/// Calls `sum` with pieces of clusters from `first` on, and their rows.
fn fill(n: &mut [Numbers], first: usize, team: Team<'_>, sum: impl Fn(Range<usize>, &mut [Numbers]) + Sync) {
    team.fill(Rows::of_width(n, PIECE), |pieces, n| {
        let start = first + pieces.start * PIECE;
        sum(start..start + n.len(), n);
    });
}

struct Sum<'a> {
    clusters: &'a Clusters,
    lists: &'a [Lists],
    pieces: Range<usize>,
    kernel: kernel::Kernel,
    n: &'a mut [Numbers],
}

impl Kernel for Sum<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Sum { clusters, lists, pieces, kernel, n } = self;
        let (re, re2, one) =
            (s.splat(kernel.radius_m), s.splat(kernel.radius_m * kernel.radius_m), s.splat(-1.0));
        let most = s.splat(1.0 / kernel.floor_m);
        let points = &clusters.slots.points[..];
        let small = clusters.small_reaches(kernel.radius_m);
        for (cluster, n) in pieces.zip(n) {
            let x = load(s, &clusters.slots.lanes[cluster]);
            let mut sum = s.load(n);
            for lists in lists {
                let near = lists.of(cluster);
                for (j, choice) in walk(near, near.reaching(small)) {
                    let r = from_lanes(s, &points[j], &x);
                    let r2 = s.dot(r, r);
                    let w = s.mul_add(re, s.min(s.reciprocal_sqrt(r2), most), one);
                    sum = s.add(sum, s.keep(s.both(s.mask(choice), s.below(r2, re2)), w));
                }
            }
            s.store(sum, n);
        }
    }
}
