//! The textbook's bucket search: a linked list in each bucket (the paper's Figure 1).
//!
//! Cheap to build and small, but each candidate is found only after the one before it, and neighbours in a list lie
//! anywhere in memory.

use crate::base::vec3::Vec3;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::{CandidateSearch, NONE};

/// `bfst` and `next` of the paper, with the last entry of each bucket beside them while lists are built.
#[derive(Debug, Clone)]
pub struct LinkedList {
    /// `bfst`: the first particle of each bucket.
    pub(super) first: Vec<u32>,
    /// `next`: the particle after this one in its bucket.
    pub(super) next: Vec<u32>,
    last: Vec<u32>,
}

impl LinkedList {
    /// Calls `stop_at` for the particles of `bucket` by ascending index until it returns true; tells whether it did.
    #[inline(always)]
    pub(super) fn any_in_bucket(
        &self,
        bucket: usize,
        mut stop_at: impl FnMut(usize) -> bool,
    ) -> bool {
        // `NONE` is beyond the end of every column, so that the end of the list needs no test of its own.
        let mut j = self.first[bucket] as usize;
        while let Some(&next) = self.next.get(j) {
            if stop_at(j) {
                return true;
            }
            j = next as usize;
        }
        false
    }
}

impl CandidateSearch for LinkedList {
    fn new(grid: &Grid, count: usize) -> Self {
        LinkedList {
            first: vec![NONE; grid.len()],
            next: vec![NONE; count],
            last: vec![NONE; grid.len()],
        }
    }

    /// Appends each particle to the tail of its bucket's list, so that lists ascend.
    fn build(&mut self, buckets: &Buckets) {
        self.first.fill(NONE);
        self.last.fill(NONE);
        for (i, &bucket) in buckets.of_particle.iter().enumerate() {
            if bucket == NONE {
                continue;
            }
            let last = &mut self.last[bucket as usize];
            match *last {
                NONE => self.first[bucket as usize] = i as u32,
                tail => self.next[tail as usize] = i as u32,
            }
            self.next[i] = NONE;
            *last = i as u32;
        }
    }

    const RELOCATES: bool = false;

    #[inline(always)]
    fn any_candidate(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        enter: impl Fn(usize) -> bool,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        let home = buckets.of_particle[i] as usize;
        buckets.grid.neighborhood(home).any(|bucket| {
            enter(bucket) && self.any_in_bucket(bucket, |j| stop_at(j, &positions[j]))
        })
    }

    fn bytes(&self) -> usize {
        [&self.first, &self.next, &self.last]
            .iter()
            .map(|column| size_of_val(&column[..]))
            .sum()
    }
}
