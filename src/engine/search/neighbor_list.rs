//! Neighbour lists: the pairs within the largest radius, found once after positions changed and shared by all walks of a step.
//!
//! Verlet's list (*Physical Review* 159, 1967, 98) without its skin: it is made anew whenever positions change, three times a
//! step of the textbook's scheme, so that it holds the pairs of the present positions in the order in which a walk over
//! buckets meets them, and every sum keeps its bits. A skin would spare some of the builds, but after particles have changed
//! buckets the order would be another one.
//!
//! Walks become short: the true neighbours instead of some 800 candidates. The price is the list's build, which is a walk for
//! every particle, whoever needs it later, and its memory, hundreds of bytes a particle. Whether that pays depends on how
//! many walks follow a build, and how small their radii are: a list for 3.1 particle distances holds three times the
//! neighbours within 2.1.

use std::fmt::Debug;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::base::parallel::{Rows, Team, Workers};
use crate::base::vec3::{Vec3, add, dot, sub};
use crate::engine::search::grid::{Buckets, Grid, Image};
use crate::engine::search::soa::Soa;
use crate::engine::search::{CandidateSearch, Lengths, NONE, Now};

/// What a list keeps of a neighbour: its index or, in a domain that repeats itself, by how many periods it is moved as well.
pub trait Listed: Copy + Default + Send + Sync + Debug + 'static {
    const PERIODIC: bool;

    fn new(particle: usize, shift: u8) -> Self;

    fn particle(self) -> usize;

    /// Where it is seen, `shifts` being those of [`Grid::shifts`].
    fn place(self, positions: &[Vec3], shifts: &[Vec3; 27]) -> Vec3;
}

impl Listed for u32 {
    const PERIODIC: bool = false;

    #[inline(always)]
    fn new(particle: usize, _shift: u8) -> Self {
        particle as u32
    }

    #[inline(always)]
    fn particle(self) -> usize {
        self as usize
    }

    #[inline(always)]
    fn place(self, positions: &[Vec3], _shifts: &[Vec3; 27]) -> Vec3 {
        positions[self as usize]
    }
}

/// A neighbour, and the number of the displacement that it is seen with.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moved {
    particle: u32,
    shift: u8,
}

impl Listed for Moved {
    const PERIODIC: bool = true;

    #[inline(always)]
    fn new(particle: usize, shift: u8) -> Self {
        Moved { particle: particle as u32, shift }
    }

    #[inline(always)]
    fn particle(self) -> usize {
        self.particle as usize
    }

    #[inline(always)]
    fn place(self, positions: &[Vec3], shifts: &[Vec3; 27]) -> Vec3 {
        add(positions[self.particle as usize], shifts[self.shift as usize])
    }
}

/// Who finds the pairs.
#[derive(Debug)]
struct Finder {
    search: Soa,
    /// What each bucket stands for; empty where no axis is periodic.
    images: Vec<Image>,
    shifts: [Vec3; 27],
}

impl Finder {
    /// Calls `stop_at(j, x_j, shift)` for the particles of a bucket, or of the one that it stands for.
    #[inline(always)]
    fn any_in_bucket(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        bucket: usize,
        mut stop_at: impl FnMut(usize, &Vec3, u8) -> bool,
    ) -> bool {
        match self.images.get(bucket) {
            None => self.search.any_in_bucket(buckets, positions, bucket, |j, there| stop_at(j, there, 0)),
            Some(&Image { bucket, shift }) => {
                let (bucket, by) = (bucket as usize, self.shifts[shift as usize]);
                self.search
                    .any_in_bucket(buckets, positions, bucket, |j, there| stop_at(j, &add(*there, by), shift))
            }
        }
    }

    /// Calls `push` for what is within the largest radius of particle `i`, itself included.
    #[inline(always)]
    fn find<L: Listed>(&self, buckets: &Buckets, positions: &[Vec3], i: usize, mut push: impl FnMut(L)) {
        let (here, radius) = (positions[i], buckets.grid.radius_m());
        let mut look = |j: usize, there: &Vec3, shift: u8| {
            let r_ij = sub(*there, here);
            if dot(r_ij, r_ij) < radius * radius {
                push(L::new(j, shift));
            }
            false
        };
        if L::PERIODIC {
            for bucket in buckets.grid.neighborhood(buckets.of_particle[i] as usize) {
                self.any_in_bucket(buckets, positions, bucket, &mut look);
            }
        } else {
            let look = |j: usize, there: &Vec3| look(j, there, 0);
            self.search.any_candidate_near(buckets, positions, i, radius, |_| true, look);
        }
    }
}

/// The lists: `NeighborList<u32>`, or `NeighborList<Moved>` where an axis is periodic.
#[derive(Debug)]
pub struct NeighborList<L> {
    finder: Finder,
    /// Room for a particle's neighbours. Rows are packed one behind the other within the range of particles that one worker
    /// took: they need no second walk to be counted, and the room behind them is not touched.
    width: usize,
    start: Vec<usize>,
    len: Vec<u32>,
    listed: Vec<L>,
}

impl<L: Listed> NeighborList<L> {
    /// Lists all neighbours, as far as there is room; returns the length of the longest list.
    fn fill(&mut self, buckets: &Buckets, positions: &[Vec3], team: Team<'_>) -> usize {
        let (finder, width, longest) = (&self.finder, self.width, AtomicUsize::new(0));
        let columns =
            (Rows::new(&mut self.start), Rows::new(&mut self.len), Rows::of_width(&mut self.listed, width));
        team.fill(columns, |range, (start, len, listed)| {
            let (first, mut packed, mut longest_here) = (range.start * width, 0, 0);
            for (k, i) in range.enumerate() {
                let row = &mut listed[packed..packed + width];
                let mut found = 0;
                if buckets.of_particle[i] != NONE {
                    finder.find(buckets, positions, i, |neighbor| {
                        if let Some(place) = row.get_mut(found) {
                            *place = neighbor;
                        }
                        found += 1;
                    });
                }
                let kept = found.min(width);
                (start[k], len[k]) = (first + packed, kept as u32);
                packed += kept;
                longest_here = longest_here.max(found);
            }
            longest.fetch_max(longest_here, Ordering::Relaxed);
        });
        longest.into_inner()
    }

    #[inline(always)]
    fn list(&self, i: usize) -> &[L] {
        &self.listed[self.start[i]..self.start[i] + self.len[i] as usize]
    }
}

impl<L: Listed> CandidateSearch for NeighborList<L> {
    fn new(grid: &Grid, lengths: Lengths, count: usize) -> Self {
        let images = if L::PERIODIC { grid.images() } else { Vec::new() };
        NeighborList {
            finder: Finder { search: Soa::new(grid, lengths, count), images, shifts: grid.shifts() },
            width: 1,
            start: vec![0; count],
            len: vec![0; count],
            listed: vec![L::default(); count],
        }
    }

    fn build(&mut self, buckets: &Buckets, now: Now<'_>, workers: &Workers) {
        self.finder.search.build(buckets, now, workers);
    }

    const RELOCATES: bool = true;

    fn relocate(&mut self, buckets: &Buckets, positions: &[Vec3], team: Team<'_>) {
        self.finder.search.relocate(buckets, positions, team);
        let longest = self.fill(buckets, positions, team);
        if longest > self.width {
            // An eighth more, so that crowds which grow slowly do not move the lists at every step.
            self.width = longest + longest / 8;
            // Zero pages that nobody has touched: the workers that write lists are the first.
            self.listed = vec![L::default(); self.start.len() * self.width];
            self.fill(buckets, positions, team);
        }
    }

    #[inline(always)]
    fn any_in_bucket(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        bucket: usize,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        self.finder.any_in_bucket(buckets, positions, bucket, |j, there, _| stop_at(j, there))
    }

    /// Of the candidates only those within the largest radius: no walk has a larger one.
    #[inline(always)]
    fn any_candidate(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        enter: impl Fn(usize) -> bool,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        self.list(i).iter().any(|listed| {
            let j = listed.particle();
            enter(buckets.of_particle[j] as usize)
                && stop_at(j, &listed.place(positions, &self.finder.shifts))
        })
    }

    fn bytes(&self) -> usize {
        self.finder.search.bytes()
            + size_of_val(&self.finder.images[..])
            + size_of_val(&self.start[..])
            + size_of_val(&self.len[..])
            + size_of_val(&self.listed[..])
    }
}
