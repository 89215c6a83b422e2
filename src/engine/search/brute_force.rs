//! Every pair: the oracle that the other searches are tested against. Quadratic, for small scenes only.

use crate::base::parallel::Workers;
use crate::base::vec3::Vec3;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::{CandidateSearch, Lengths, NONE, Now};

/// No data at all. Candidates come by ascending index, so sums agree with the bucket searches to rounding only.
#[derive(Debug, Clone)]
pub struct BruteForce;

impl CandidateSearch for BruteForce {
    fn new(_grid: &Grid, _lengths: Lengths, _count: usize) -> Self {
        BruteForce
    }

    fn build(&mut self, _buckets: &Buckets, _now: Now<'_>, _workers: &Workers) {}

    const RELOCATES: bool = false;

    fn any_in_bucket(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        bucket: usize,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        (0..positions.len()).any(|j| buckets.of_particle[j] as usize == bucket && stop_at(j, &positions[j]))
    }

    fn any_candidate(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        _i: usize,
        enter: impl Fn(usize) -> bool,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        let in_reach = |j: usize| match buckets.of_particle[j] {
            NONE => false,
            bucket => enter(bucket as usize),
        };
        (0..positions.len()).any(|j| in_reach(j) && stop_at(j, &positions[j]))
    }

    fn bytes(&self) -> usize {
        0
    }
}
