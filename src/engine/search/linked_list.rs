//! The textbook's bucket search: a linked list in each bucket (the paper's Figure 1).
//!
//! Cheap to build and small, but each candidate is found only after the one before it, and neighbours in a list lie
//! anywhere in memory.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use crate::base::parallel::{Rows, Workers};
use crate::base::vec3::Vec3;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::{CandidateSearch, Lengths, NONE, Now};

/// `bfst` and `next` of the paper, with the last entry of each bucket beside them while lists are built.
#[derive(Debug)]
pub struct LinkedList {
    /// `bfst`: the first particle of each bucket.
    first: Vec<u32>,
    /// `next`: the particle after this one in its bucket. Atomic only because several workers build lists at a time,
    /// each those of its own buckets; loading one costs what loading a plain number costs.
    next: Vec<AtomicU32>,
    last: Vec<u32>,
}

impl LinkedList {
    /// Calls `stop_at` for the particles of `bucket` by ascending index until it returns true; tells whether it did.
    #[inline(always)]
    pub(super) fn any_in_list(&self, bucket: usize, mut stop_at: impl FnMut(usize) -> bool) -> bool {
        // `NONE` is beyond the end of every column, so that the end of the list needs no test of its own.
        let mut j = self.first[bucket] as usize;
        while let Some(next) = self.next.get(j) {
            if stop_at(j) {
                return true;
            }
            j = next.load(Relaxed) as usize;
        }
        false
    }
}

impl CandidateSearch for LinkedList {
    fn new(grid: &Grid, _lengths: Lengths, count: usize) -> Self {
        LinkedList {
            first: vec![NONE; grid.len()],
            next: (0..count).map(|_| AtomicU32::new(NONE)).collect(),
            last: vec![NONE; grid.len()],
        }
    }

    /// Appends each particle to the tail of its bucket's list, so that lists ascend. Each worker looks at all particles
    /// and builds the lists of its own share of the buckets.
    fn build(&mut self, buckets: &Buckets, _now: Now<'_>, workers: &Workers) {
        let next = &self.next;
        let columns = (Rows::new(&mut self.first), Rows::new(&mut self.last));
        workers.shared_evenly().fill(columns, |mine, (first, last)| {
            first.fill(NONE);
            for (i, &bucket) in buckets.of_particle.iter().enumerate() {
                let Some(place) = (bucket as usize).checked_sub(mine.start).filter(|p| *p < first.len())
                else {
                    continue;
                };
                match first[place] {
                    NONE => first[place] = i as u32,
                    _ => next[last[place] as usize].store(i as u32, Relaxed),
                }
                next[i].store(NONE, Relaxed);
                last[place] = i as u32;
            }
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
        self.any_in_list(bucket, |j| stop_at(j, &positions[j]))
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.first[..]) + size_of_val(&self.next[..]) + size_of_val(&self.last[..])
    }
}
