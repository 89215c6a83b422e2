//! For each cluster the slots that may lie within reach of any of its lanes.

use std::ops::Range;

use super::cells::{Cells, Grid};
use super::make_room;
use super::slots::{Lanes, Section, Slots};
use crate::base::parallel::{Rows, Team};
use crate::base::simd::{Kernel, LANES, Simd, dispatch};

/// Clusters whose lists one piece of work makes.
pub const CHUNK: usize = 16;

/// The slots near one cluster, ascending but for those of the cluster itself, which come first.
#[derive(Debug, Clone, Copy)]
pub struct Near<'a> {
    /// Those that may lie within the smaller radius.
    pub small: &'a [u32],
    /// Those that may lie within the larger one.
    pub all: &'a [u32],
    /// How many of the first stand in the cluster itself: the k-th is lane k.
    pub own: usize,
}

impl<'a> Near<'a> {
    /// The small list where that is enough.
    #[inline(always)]
    pub fn reaching(self, small_is_enough: bool) -> &'a [u32] {
        if small_is_enough { self.small } else { self.all }
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
    small: Vec<u32>,
    all: Vec<u32>,
    /// The clusters that have slots in each list.
    clusters: Vec<u32>,
    /// Where those of each cluster end.
    ends: Vec<Ends>,
    /// Clusters of which some lanes, a bit each, are to be looked at.
    candidates: Vec<(u32, u8)>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Ends {
    small: u32,
    all: u32,
    clusters: u32,
}

impl Chunk {
    /// The ends before the k-th cluster's.
    #[inline(always)]
    fn start(&self, k: usize) -> Ends {
        if k == 0 { Ends::default() } else { self.ends[k - 1] }
    }
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

/// Lists seen from the other side: for each cluster of the section that lists are over, the clusters in whose lists it is.
#[derive(Debug, Default)]
pub struct Crossed {
    first: usize,
    /// Where those of each cluster begin, and the end of the last.
    start: Vec<u32>,
    clusters: Vec<u32>,
}

impl Crossed {
    pub fn find(&mut self, lists: &Lists, slots: &Slots) {
        let over = slots.clusters(lists.over);
        self.first = over.start;
        self.start.clear();
        self.start.resize(over.len() + 2, 0);
        for &listed in lists.chunks.iter().flat_map(|chunk| &chunk.clusters) {
            self.start[listed as usize - over.start + 2] += 1;
        }
        for k in 2..self.start.len() {
            self.start[k] += self.start[k - 1];
        }
        self.clusters.resize(self.start[over.len() + 1] as usize, 0);
        // The entry behind a cluster's walks from where it begins to where it ends.
        let mut cluster = lists.first as u32;
        for chunk in &lists.chunks {
            for k in 0..chunk.ends.len() {
                let range = chunk.start(k).clusters as usize..chunk.ends[k].clusters as usize;
                for &listed in &chunk.clusters[range] {
                    let next = &mut self.start[listed as usize - over.start + 1];
                    self.clusters[*next as usize] = cluster;
                    *next += 1;
                }
                cluster += 1;
            }
        }
    }

    #[inline(always)]
    fn of(&self, cluster: usize) -> &[u32] {
        let k = cluster - self.first;
        &self.clusters[self.start[k] as usize..self.start[k + 1] as usize]
    }

    pub fn bytes(&self) -> usize {
        (self.start.capacity() + self.clusters.capacity()) * size_of::<u32>()
    }
}

/// The radii of a list, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    pub small_m: f64,
    pub large_m: f64,
}

/// Where candidates for lists come from.
#[derive(Debug, Clone, Copy)]
pub enum Candidates<'a> {
    /// The cells in which a section is sorted, and which of them lie around each cluster.
    Around(&'a Cells, &'a Around),
    /// Lists of the other side.
    Crossed(&'a Crossed),
}

impl Lists {
    pub fn new(of: Section, over: Section) -> Self {
        Lists { of, over, first: 0, chunks: Vec::new() }
    }

    /// Makes them anew from candidates of the section that they are over.
    pub fn build(&mut self, slots: &Slots, candidates: Candidates<'_>, reach: Reach, team: Team<'_>) {
        let clusters = slots.clusters(self.of);
        let (of, over) = (self.of, self.over);
        self.first = clusters.start;
        self.chunks.resize_with(clusters.len().div_ceil(CHUNK), Chunk::default);
        team.fill(Rows::new(&mut self.chunks), |range, chunks| {
            for (k, chunk) in range.zip(chunks) {
                let first = clusters.start + k * CHUNK;
                let clusters = first..clusters.end.min(first + CHUNK);
                dispatch(Build { chunk, k, clusters, of, over, slots, candidates, reach });
            }
        });
    }

    /// The section whose particles they name.
    #[inline(always)]
    pub fn over(&self) -> Section {
        self.over
    }

    /// The list of a cluster.
    #[inline(always)]
    pub fn of(&self, cluster: usize) -> Near<'_> {
        let k = cluster - self.first;
        let chunk = &self.chunks[k / CHUNK];
        let (start, end) = (chunk.start(k % CHUNK), chunk.ends[k % CHUNK]);
        let all = &chunk.all[start.all as usize..end.all as usize];
        let own = if self.of == self.over { self.own_lanes(cluster, all) } else { 0 };
        Near { small: &chunk.small[start.small as usize..end.small as usize], all, own }
    }

    /// The other clusters that have slots in a cluster's list.
    pub fn clusters_of(&self, cluster: usize) -> &[u32] {
        let (chunk, k) = (&self.chunks[(cluster - self.first) / CHUNK], (cluster - self.first) % CHUNK);
        &chunk.clusters[chunk.start(k).clusters as usize..chunk.ends[k].clusters as usize]
    }

    /// The first slots of a list that are the cluster's own.
    #[inline(always)]
    fn own_lanes(&self, cluster: usize, slots: &[u32]) -> usize {
        slots.iter().take(LANES).take_while(|&&slot| slot as usize / LANES == cluster).count()
    }

    pub fn bytes(&self) -> usize {
        let bytes = |c: &Chunk| {
            (c.small.capacity() + c.all.capacity() + c.clusters.capacity()) * size_of::<u32>()
                + c.ends.capacity() * size_of::<Ends>()
                + c.candidates.capacity() * size_of::<(u32, u8)>()
        };
        self.chunks.iter().map(bytes).sum()
    }
}

/// Those among lists of one section that are over what has a pressure.
pub fn with_pressure(lists: &[Lists]) -> &[Lists] {
    &lists[lists.iter().take_while(|lists| lists.over.are_dummies()).count()..]
}

struct Build<'a> {
    chunk: &'a mut Chunk,
    /// The number of the chunk.
    k: usize,
    clusters: Range<usize>,
    of: Section,
    over: Section,
    slots: &'a Slots,
    candidates: Candidates<'a>,
    reach: Reach,
}

impl Kernel for Build<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Build { chunk, k, clusters, of, over, slots, candidates: source, reach } = self;
        let Chunk { small, all, clusters: listed, ends, candidates } = chunk;
        let small2 = s.splat(reach.small_m * reach.small_m);
        let large2 = s.splat(reach.large_m * reach.large_m);
        let (lanes, filled) = (&slots.lanes[..], slots.of(over));
        let mut end = Ends::default();
        ends.clear();
        for (member, cluster) in clusters.enumerate() {
            candidates.clear();
            match source {
                Candidates::Around(cells, around) => {
                    for &run in around.chunks[k].of(member) {
                        let range = cells.in_run(run);
                        push_blocks(range.start + filled.start..range.end + filled.start, candidates);
                    }
                }
                Candidates::Crossed(crossed) => {
                    for &block in crossed.of(cluster) {
                        let first = block as usize * LANES;
                        push_blocks(first..filled.end.min(first + LANES), candidates);
                    }
                }
            }
            // Whole vectors are written: what stands beyond the end is written over.
            let room = (candidates.len() + 1) * LANES;
            make_room(small, end.small as usize + room, 0);
            make_room(all, end.all as usize + room, 0);
            make_room(listed, end.clusters as usize + candidates.len() + 1, 0);
            let (small, all, listed) = (&mut small[..], &mut all[..], &mut listed[..]);
            if of == over {
                let own = 0xFF >> (LANES - slots.filled_lanes(of, cluster));
                let first = (cluster * LANES) as u32;
                end.small += s.compress(first, own, &mut small[end.small as usize..]) as u32;
                end.all += s.compress(first, own, &mut all[end.all as usize..]) as u32;
            }
            let x = &lanes[cluster];
            for &(block, inside) in candidates.iter() {
                let r2 = nearest2(s, &lanes[block as usize], x);
                let itself = of == over && block as usize == cluster;
                let inside = if itself { 0 } else { inside };
                let (in_small, in_large) =
                    (s.bits(s.below(r2, small2)) & inside, s.bits(s.below(r2, large2)) & inside);
                let first = block * LANES as u32;
                end.small += s.compress(first, in_small, &mut small[end.small as usize..]) as u32;
                end.all += s.compress(first, in_large, &mut all[end.all as usize..]) as u32;
                listed[end.clusters as usize] = block;
                end.clusters += u32::from(in_large != 0);
            }
            ends.push(end);
        }
        small.truncate(end.small as usize);
        all.truncate(end.all as usize);
        listed.truncate(end.clusters as usize);
    }
}

/// Appends the clusters that a range of slots reaches into, with the lanes that it holds; ranges come in ascending order.
#[inline(always)]
fn push_blocks(range: Range<usize>, blocks: &mut Vec<(u32, u8)>) {
    if range.is_empty() {
        return;
    }
    for block in range.start / LANES..range.end.div_ceil(LANES) {
        let first = block * LANES;
        let from = 0xFFu8 << range.start.saturating_sub(first);
        let until = 0xFFu8 >> (first + LANES).saturating_sub(range.end);
        match blocks.last_mut() {
            // The end of the range before.
            Some((last, inside)) if *last == block as u32 => *inside |= from & until,
            _ => blocks.push((block as u32, from & until)),
        }
    }
}

/// The square of the distance from each of eight particles to the nearest lane of a cluster.
#[inline(always)]
fn nearest2<S: Simd>(s: S, there: &Lanes, x: &Lanes) -> S::F {
    let there = [s.load(&there[0]), s.load(&there[1]), s.load(&there[2])];
    let mut nearest = s.splat(f64::INFINITY);
    for ((&x, &y), &z) in x[0].iter().zip(&x[1]).zip(&x[2]) {
        let r = [s.sub(there[0], s.splat(x)), s.sub(there[1], s.splat(y)), s.sub(there[2], s.splat(z))];
        nearest = s.min(s.dot(r, r), nearest);
    }
    nearest
}
