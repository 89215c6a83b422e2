//! Any search behind a pointer: one compiled copy of all effects serves every search that has none of its own.
//!
//! Effects are compiled anew for each search, which pays where the search is what is measured: in the textbook's step. All
//! other scenes ask the searches beyond the paper's two through this one. The search sifts by distance on its own side, so
//! that a virtual call is made for a neighbour, not for a candidate.

use std::fmt::{Debug, Formatter, Result};

use crate::base::parallel::{Team, Workers};
use crate::base::vec3::{Vec3, dot, sub};
use crate::engine::search::brute_force::BruteForce;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::{CandidateSearch, DistanceTest, Lengths, Now, SquaredFirst};

/// What a walk tells whether to stop.
type StopAt<'a> = &'a mut dyn FnMut(usize, &Vec3) -> bool;

/// A search whose type is not known.
trait Search: Send + Sync {
    fn build(&mut self, buckets: &Buckets, now: Now<'_>, workers: &Workers);
    fn relocates(&self) -> bool;
    fn relocate(&mut self, buckets: &Buckets, positions: &[Vec3], team: Team<'_>);
    fn any_in_bucket(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        bucket: usize,
        stop_at: StopAt<'_>,
    ) -> bool;
    /// Calls `stop_at` for those alone that lie within `radius`.
    fn any_near(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        radius: f64,
        enter: &dyn Fn(usize) -> bool,
        stop_at: StopAt<'_>,
    ) -> bool;
    fn bytes(&self) -> usize;
}

impl<C: CandidateSearch> Search for C {
    fn build(&mut self, buckets: &Buckets, now: Now<'_>, workers: &Workers) {
        CandidateSearch::build(self, buckets, now, workers);
    }

    fn relocates(&self) -> bool {
        CandidateSearch::relocates(self)
    }

    fn relocate(&mut self, buckets: &Buckets, positions: &[Vec3], team: Team<'_>) {
        CandidateSearch::relocate(self, buckets, positions, team);
    }

    fn any_in_bucket(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        bucket: usize,
        stop_at: StopAt<'_>,
    ) -> bool {
        CandidateSearch::any_in_bucket(self, buckets, positions, bucket, stop_at)
    }

    fn any_near(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        radius: f64,
        enter: &dyn Fn(usize) -> bool,
        stop_at: StopAt<'_>,
    ) -> bool {
        let here = positions[i];
        self.any_candidate_near(buckets, positions, i, radius, enter, |j, there| {
            let r_ij = sub(*there, here);
            SquaredFirst::within(dot(r_ij, r_ij), radius).is_some() && stop_at(j, there)
        })
    }

    fn bytes(&self) -> usize {
        CandidateSearch::bytes(self)
    }
}

/// A search of any type.
pub struct Erased(Box<dyn Search>);

impl Erased {
    /// The search `C` over `count` particles in the buckets of `grid`.
    pub fn of<C: CandidateSearch + 'static>(grid: &Grid, lengths: Lengths, count: usize) -> Self {
        Erased(Box::new(C::new(grid, lengths, count)))
    }
}

impl Debug for Erased {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str("Erased")
    }
}

impl CandidateSearch for Erased {
    /// Every pair, where nobody says which search it is to be.
    fn new(grid: &Grid, lengths: Lengths, count: usize) -> Self {
        Erased::of::<BruteForce>(grid, lengths, count)
    }

    fn build(&mut self, buckets: &Buckets, now: Now<'_>, workers: &Workers) {
        self.0.build(buckets, now, workers);
    }

    const RELOCATES: bool = true;

    fn relocates(&self) -> bool {
        self.0.relocates()
    }

    fn relocate(&mut self, buckets: &Buckets, positions: &[Vec3], team: Team<'_>) {
        self.0.relocate(buckets, positions, team);
    }

    fn any_in_bucket(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        bucket: usize,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        self.0.any_in_bucket(buckets, positions, bucket, &mut stop_at)
    }

    fn any_candidate(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        enter: impl Fn(usize) -> bool,
        stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        self.any_candidate_near(buckets, positions, i, f64::INFINITY, enter, stop_at)
    }

    fn any_candidate_near(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        radius: f64,
        enter: impl Fn(usize) -> bool,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        self.0.any_near(buckets, positions, i, radius, &enter, &mut stop_at)
    }

    fn bytes(&self) -> usize {
        self.0.bytes()
    }
}
