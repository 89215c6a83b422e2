//! Cell list: the indices of all particles in one array, bucket by bucket, and where each bucket begins.
//!
//! The classic cell list with a counting sort in place of chains (Hockney & Eastwood, *Computer Simulation Using Particles*,
//! 1981, chapter 8, sorts particles into chaining cells; the packed form is that of compressed sparse rows). A walk knows
//! the next index without having read the one before, and buckets with neighbouring numbers are one run: 9 runs instead of
//! 27 lists. Positions are still read where particles lie. As small as the linked lists; the price is a second pass over all
//! particles and one over all buckets a build.

use std::ops::Range;

use crate::base::parallel::{PackedRows, Rows, Workers};
use crate::base::vec3::Vec3;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::{CandidateSearch, Lengths, Now};

#[derive(Debug)]
pub struct CellList {
    /// The place of each bucket's first index, and behind the last bucket the number of particles that are in one.
    start: Vec<u32>,
    /// Indices by bucket, ascending within one.
    index: Vec<u32>,
    /// How many particles of each bucket were met, while it is counted and while it is filled.
    met: Vec<u32>,
}

impl CellList {
    /// How many places are taken: one for each particle that is in a bucket.
    pub(super) fn len(&self) -> usize {
        self.start[self.start.len() - 1] as usize
    }

    /// The particle at each place, bucket by bucket.
    #[inline(always)]
    pub(super) fn particles(&self) -> &[u32] {
        &self.index
    }

    /// The places of all particles in a range of buckets.
    #[inline(always)]
    pub(super) fn places(&self, run: Range<usize>) -> Range<usize> {
        self.start[run.start] as usize..self.start[run.end] as usize
    }

    /// Calls `any_at` for the places of particle `i`'s candidates, a run of buckets at a time, until it returns true; tells
    /// whether it did. A run in which `enter` does not hold for all buckets is taken bucket by bucket.
    #[inline(always)]
    pub(super) fn any_run(
        &self,
        buckets: &Buckets,
        i: usize,
        enter: impl Fn(usize) -> bool,
        mut any_at: impl FnMut(Range<usize>) -> bool,
    ) -> bool {
        let home = buckets.of_particle[i] as usize;
        buckets.grid.runs(home).any(|run| {
            if run.clone().all(&enter) {
                return any_at(self.places(run));
            }
            run.into_iter().any(|bucket| enter(bucket) && any_at(self.places(bucket..bucket + 1)))
        })
    }

    /// Calls `meet` for the particles in buckets of `mine` by ascending index, with their bucket as seen from the first.
    #[inline(always)]
    fn for_each_in(buckets: &Buckets, mine: &Range<usize>, mut meet: impl FnMut(usize, u32)) {
        for (i, &bucket) in buckets.of_particle.iter().enumerate() {
            // A ghost's bucket lies beyond all.
            match (bucket as usize).checked_sub(mine.start) {
                Some(bucket) if bucket < mine.len() => meet(bucket, i as u32),
                _ => {}
            }
        }
    }
}

impl CandidateSearch for CellList {
    fn new(grid: &Grid, _lengths: Lengths, count: usize) -> Self {
        CellList { start: vec![0; grid.len() + 1], index: vec![0; count], met: vec![0; grid.len()] }
    }

    /// A counting sort. Each worker looks at all particles, twice, and counts and places those of its own share of the
    /// buckets: nothing depends on how many workers there are.
    fn build(&mut self, buckets: &Buckets, _now: Now<'_>, workers: &Workers) {
        let team = workers.shared_evenly();
        team.fill(Rows::new(&mut self.met), |mine, met| {
            met.fill(0);
            Self::for_each_in(buckets, &mine, |bucket, _| met[bucket] += 1);
        });
        let mut sum = 0;
        for (start, &met) in self.start[1..].iter_mut().zip(&self.met) {
            sum += met;
            *start = sum;
        }
        let start = &self.start[..];
        let columns = (PackedRows::new(&mut self.index, start), Rows::new(&mut self.met));
        team.fill(columns, |mine, (index, met)| {
            met.fill(0);
            let first = start[mine.start];
            Self::for_each_in(buckets, &mine, |bucket, i| {
                index[(start[mine.start + bucket] - first + met[bucket]) as usize] = i;
                met[bucket] += 1;
            });
        });
    }

    const RELOCATES: bool = false;

    #[inline(always)]
    fn any_in_bucket(
        &self,
        _buckets: &Buckets,
        positions: &[Vec3],
        bucket: usize,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        self.index[self.places(bucket..bucket + 1)]
            .iter()
            .any(|&j| stop_at(j as usize, &positions[j as usize]))
    }

    #[inline(always)]
    fn any_candidate(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        enter: impl Fn(usize) -> bool,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        self.any_run(buckets, i, enter, |places| {
            self.index[places].iter().any(|&j| stop_at(j as usize, &positions[j as usize]))
        })
    }

    fn bytes(&self) -> usize {
        [&self.start, &self.index, &self.met].map(|column| size_of_val(&column[..])).iter().sum()
    }
}
