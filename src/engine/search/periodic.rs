//! Any search by buckets in a domain that repeats itself along some axes.
//!
//! The border of the grid stands for the buckets at the other end: a walk that enters it is given that bucket's particles,
//! moved by a period. Two additions a candidate and a table of five bytes a bucket; scenes without periodic axes have
//! neither.

use crate::base::parallel::{Team, Workers};
use crate::base::vec3::{Vec3, add};
use crate::engine::search::grid::{Buckets, Grid, Image};
use crate::engine::search::{CandidateSearch, Lengths, Now};

#[derive(Debug)]
pub struct Periodic<C> {
    search: C,
    images: Vec<Image>,
    shifts: [Vec3; 27],
}

impl<C: CandidateSearch> CandidateSearch for Periodic<C> {
    fn new(grid: &Grid, lengths: Lengths, count: usize) -> Self {
        Periodic { search: C::new(grid, lengths, count), images: grid.images(), shifts: grid.shifts() }
    }

    fn build(&mut self, buckets: &Buckets, now: Now<'_>, workers: &Workers) {
        self.search.build(buckets, now, workers);
    }

    const RELOCATES: bool = C::RELOCATES;

    fn relocate(&mut self, buckets: &Buckets, positions: &[Vec3], team: Team<'_>) {
        self.search.relocate(buckets, positions, team);
    }

    #[inline(always)]
    fn any_in_bucket(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        bucket: usize,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        let Image { bucket, shift } = self.images[bucket];
        let shift = self.shifts[shift as usize];
        self.search
            .any_in_bucket(buckets, positions, bucket as usize, |j, there| stop_at(j, &add(*there, shift)))
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
        let home = buckets.of_particle[i] as usize;
        buckets.grid.neighborhood(home).any(|bucket| {
            enter(self.images[bucket].bucket as usize)
                && self.any_in_bucket(buckets, positions, bucket, |j, there| stop_at(j, there))
        })
    }

    fn bytes(&self) -> usize {
        self.search.bytes() + size_of_val(&self.images[..])
    }
}
