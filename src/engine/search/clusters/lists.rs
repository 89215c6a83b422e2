//! For each cluster the slots that may lie within reach of any of its lanes.

use std::ops::Range;

use super::cells::{Cells, Grid};
use super::slots::{Section, Slots};
use crate::base::parallel::{Rows, Team};
use crate::base::simd::{Kernel, LANES, Simd, dispatch};

/// Clusters whose lists one piece of work makes.
pub const CHUNK: usize = 16;

/// The slots near one cluster, those within the smaller radius first.
#[derive(Debug, Clone, Copy)]
pub struct Near<'a> {
    slots: &'a [u32],
    near: usize,
    /// How many of the first stand in the cluster itself.
    own: usize,
}

impl<'a> Near<'a> {
    /// All of them.
    #[inline(always)]
    pub fn all(self) -> &'a [u32] {
        self.slots
    }

    /// Those that may lie within the smaller radius.
    #[inline(always)]
    pub fn within_small(self) -> &'a [u32] {
        &self.slots[..self.near]
    }

    /// How many of the first stand in the cluster itself: the k-th is lane k.
    #[inline(always)]
    pub fn own(self) -> usize {
        self.own
    }
}

/// The lists of one section's clusters over another section.
#[derive(Debug)]
pub struct Lists {
    of: Section,
    over: Section,
    first: usize,
    chunks: Vec<Chunk>,
}

#[derive(Debug, Default)]
struct Chunk {
    slots: Vec<u32>,
    far: Vec<u32>,
    /// Where each cluster's list ends, and where its near part does.
    ends: Vec<(u32, u32)>,
}

/// The runs of cells around each cluster of a section.
#[derive(Debug)]
pub struct Around {
    of: Section,
    chunks: Vec<Runs>,
}

#[derive(Debug, Default)]
struct Runs {
    runs: Vec<(u32, u32)>,
    ends: Vec<u32>,
}

impl Runs {
    #[inline(always)]
    fn of(&self, k: usize) -> &[(u32, u32)] {
        let start = if k == 0 { 0 } else { self.ends[k - 1] as usize };
        &self.runs[start..self.ends[k] as usize]
    }
}

impl Around {
    pub fn new(of: Section) -> Self {
        Around { of, chunks: Vec::new() }
    }

    /// Finds them anew for what lies within `reach_m` metres.
    pub fn find(&mut self, slots: &Slots, grid: &Grid, reach_m: f64, team: Team<'_>) {
        let (clusters, of) = (slots.clusters(self.of), self.of);
        self.chunks.resize_with(clusters.len().div_ceil(CHUNK), Runs::default);
        team.fill(Rows::new(&mut self.chunks), |range, chunks| {
            for (k, Runs { runs, ends }) in range.zip(chunks) {
                let first = clusters.start + k * CHUNK;
                runs.clear();
                ends.clear();
                for cluster in first..clusters.end.min(first + CHUNK) {
                    let (low, high) = slots.bounds(of, cluster);
                    grid.runs(low, high, reach_m, runs);
                    ends.push(runs.len() as u32);
                }
            }
        });
    }

    pub fn bytes(&self) -> usize {
        let bytes =
            |r: &Runs| r.runs.capacity() * size_of::<(u32, u32)>() + r.ends.capacity() * size_of::<u32>();
        self.chunks.iter().map(bytes).sum()
    }
}

/// The radii of a list, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    pub small_m: f64,
    pub large_m: f64,
}

impl Lists {
    pub fn new(of: Section, over: Section) -> Self {
        Lists { of, over, first: 0, chunks: Vec::new() }
    }

    /// Makes them anew; `cells` are those in which the section `over` is sorted, `around` the runs of them to look into.
    pub fn build(&mut self, slots: &Slots, cells: &Cells, around: &Around, reach: Reach, team: Team<'_>) {
        let clusters = slots.clusters(self.of);
        let (of, over) = (self.of, self.over);
        self.first = clusters.start;
        self.chunks.resize_with(clusters.len().div_ceil(CHUNK), Chunk::default);
        team.fill(Rows::new(&mut self.chunks), |range, chunks| {
            for (k, chunk) in range.zip(chunks) {
                let first = clusters.start + k * CHUNK;
                let clusters = first..clusters.end.min(first + CHUNK);
                dispatch(Build { chunk, clusters, of, over, slots, cells, around: &around.chunks[k], reach });
            }
        });
    }

    /// The list of a cluster.
    #[inline(always)]
    pub fn of(&self, cluster: usize) -> Near<'_> {
        let k = cluster - self.first;
        let chunk = &self.chunks[k / CHUNK];
        let (end, near_end) = chunk.ends[k % CHUNK];
        let start = if k.is_multiple_of(CHUNK) { 0 } else { chunk.ends[k % CHUNK - 1].0 } as usize;
        let slots = &chunk.slots[start..end as usize];
        let own = if self.of == self.over { slots.len().min(self.own_lanes(cluster, slots)) } else { 0 };
        Near { slots, near: near_end as usize - start, own }
    }

    /// The first slots of a list that are the cluster's own.
    #[inline(always)]
    fn own_lanes(&self, cluster: usize, slots: &[u32]) -> usize {
        slots.iter().take(LANES).take_while(|&&slot| slot as usize / LANES == cluster).count()
    }

    pub fn bytes(&self) -> usize {
        let bytes = |c: &Chunk| {
            (c.slots.capacity() + c.far.capacity()) * size_of::<u32>()
                + c.ends.capacity() * size_of::<(u32, u32)>()
        };
        self.chunks.iter().map(bytes).sum()
    }
}

struct Build<'a> {
    chunk: &'a mut Chunk,
    clusters: Range<usize>,
    of: Section,
    over: Section,
    slots: &'a Slots,
    cells: &'a Cells,
    around: &'a Runs,
    reach: Reach,
}

impl Kernel for Build<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Build {
            chunk: Chunk { slots: found, far, ends },
            clusters,
            of,
            over,
            slots,
            cells,
            around,
            reach,
        } = self;
        let (small, large) = (s.splat(reach.small_m * reach.small_m), s.splat(reach.large_m * reach.large_m));
        let offset = slots.of(over).start;
        found.clear();
        ends.clear();
        for (k, cluster) in clusters.enumerate() {
            let lanes = &slots.lanes[cluster];
            let x = [s.load(&lanes[0]), s.load(&lanes[1]), s.load(&lanes[2])];
            let first = cluster * LANES;
            let own = if of == over { first..first + slots.filled_lanes(of, cluster) } else { 0..0 };
            found.extend(own.clone().map(|slot| slot as u32));
            far.clear();
            let candidates: usize = around.of(k).iter().map(|&run| cells.in_run(run).len()).sum();
            let (mut near_len, mut far_len) = (found.len(), 0);
            // A place more than there are candidates: the cursor writes before it knows.
            found.resize(near_len + candidates + 1, 0);
            far.resize(candidates + 1, 0);
            for &run in around.of(k) {
                let range = cells.in_run(run);
                for slot in range.start + offset..range.end + offset {
                    let r2 = s.distance2(&slots.points[slot], &x);
                    let near = s.bits(s.below(r2, small)) != 0;
                    let within = s.bits(s.below(r2, large)) != 0;
                    let other = slot < own.start || slot >= own.end;
                    found[near_len] = slot as u32;
                    far[far_len] = slot as u32;
                    near_len += usize::from(near & other);
                    far_len += usize::from(within & !near & other);
                }
            }
            found.truncate(near_len);
            far.truncate(far_len);
            let near_end = found.len() as u32;
            found.extend_from_slice(far);
            ends.push((found.len() as u32, near_end));
        }
    }
}
