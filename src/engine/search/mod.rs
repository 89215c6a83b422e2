//! Neighbour search: which particles lie within a radius of another one.
//!
//! A search supplies candidates and nothing else; the distance test and the kernels are written once, above it, and
//! compiled anew for each search. A new search is one new file here and one line in `preset.rs`.

pub mod aos_relocation;
pub mod aosoa;
pub mod brute_force;
pub mod cell_list;
pub mod clusters;
pub mod erased;
pub mod grid;
pub mod lanes;
pub mod linked_list;
pub mod neighbor_list;
pub mod periodic;
pub mod soa;
pub mod sorted_particles;

use std::hint::cold_path;

use crate::base::parallel::{Team, Workers};
use crate::base::vec3::{Vec3, dot, sub};
use crate::engine::columns::Visitor;
use crate::engine::particles::Kind;
use grid::{Buckets, Grid};

/// Marks the end of a list, and a particle that is in no bucket.
pub const NONE: u32 = u32::MAX;

/// The lengths that a search is asked for, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lengths {
    pub particle_distance_m: f64,
    /// The radius of most walks beside the largest.
    pub small_m: f64,
    /// The largest radius of any walk.
    pub large_m: f64,
}

/// The particles as they are when a search takes them up.
#[derive(Debug, Clone, Copy)]
pub struct Now<'a> {
    pub kind: &'a [Kind],
    pub position: &'a [Vec3],
    /// The largest radius of a walk before positions change again, metres.
    pub radius_m: f64,
    /// Whether walls may have moved since the last time.
    pub walls_moved: bool,
}

/// Supplies, for each particle, all particles that may be its neighbours.
pub trait CandidateSearch: Send + Sync + Sized {
    /// A search over `count` particles in the buckets of `grid`.
    fn new(grid: &Grid, lengths: Lengths, count: usize) -> Self;

    /// Takes up the particles' new buckets.
    fn build(&mut self, buckets: &Buckets, now: Now<'_>, workers: &Workers);

    /// Whether walks of a radius, metres, find all pairs with what was taken up last.
    fn reaches(&self, _radius_m: f64) -> bool {
        true
    }

    /// Shows what the order of its sums depends on beside the particles.
    fn visit(&mut self, _visitor: &mut Visitor<'_>) {}

    /// Whether something is made of the positions after each build, so that the step has a `relocation` phase.
    const RELOCATES: bool;

    /// The same, for a search that knows only when it is made.
    fn relocates(&self) -> bool {
        Self::RELOCATES
    }

    /// Copies positions to where the search reads them, or makes of them what else it needs.
    fn relocate(&mut self, _buckets: &Buckets, _positions: &[Vec3], _team: Team<'_>) {}

    /// Calls `stop_at(j, x_j)` for the particles `j` in `bucket` by ascending index, until it returns true; tells whether
    /// it did.
    fn any_in_bucket(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        bucket: usize,
        stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool;

    /// Calls `stop_at(j, x_j)` for the candidates `j` of particle `i`, itself among them, bucket by bucket in the order
    /// of [`Grid::neighborhood`], until it returns true; tells whether it did. Passes over the buckets that `enter` does
    /// not hold for.
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
            enter(bucket) && self.any_in_bucket(buckets, positions, bucket, |j, there| stop_at(j, there))
        })
    }

    /// The same, but may leave out candidates that lie `radius` metres or farther from particle `i`, so that a search can
    /// sift them in its own way. Whoever asks looks at the distance of those that come.
    #[inline(always)]
    fn any_candidate_near(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        _radius: f64,
        enter: impl Fn(usize) -> bool,
        stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        self.any_candidate(buckets, positions, i, enter, stop_at)
    }

    /// Bytes that the search's own arrays take.
    fn bytes(&self) -> usize;
}

/// How a distance is compared with a radius.
pub trait DistanceTest: Send + Sync + 'static {
    /// The distance, if its square `r2` says that it is below `radius`.
    fn within(r2: f64, radius: f64) -> Option<f64>;
}

/// Takes the root first and compares distances, as the paper's Figure 3 does.
#[derive(Debug, Clone, Copy)]
pub struct RootFirst;

impl DistanceTest for RootFirst {
    #[inline(always)]
    fn within(r2: f64, radius: f64) -> Option<f64> {
        let r = r2.sqrt();
        (r < radius).then_some(r)
    }
}

/// Compares squares and takes the root of neighbours only.
#[derive(Debug, Clone, Copy)]
pub struct SquaredFirst;

impl DistanceTest for SquaredFirst {
    #[inline(always)]
    fn within(r2: f64, radius: f64) -> Option<f64> {
        (r2 < radius * radius).then(|| r2.sqrt())
    }
}

/// A search over the particles where they are now.
#[derive(Debug)]
pub struct Neighborhood<'a, C> {
    pub candidates: &'a C,
    pub buckets: &'a Buckets,
    pub positions: &'a [Vec3],
}

impl<C: CandidateSearch> Neighborhood<'_, C> {
    /// Calls `visit(j, r_ij, r)` for every other particle `j` within `radius` metres of particle `i`, where
    /// `r_ij = x_j - x_i` and `r = |r_ij|`.
    #[inline(always)]
    pub fn for_each_neighbor<T: DistanceTest>(
        &self,
        i: usize,
        radius: f64,
        mut visit: impl FnMut(usize, Vec3, f64),
    ) {
        self.any_neighbor::<T>(i, radius, |j, r_ij, r| {
            visit(j, r_ij, r);
            false
        });
    }

    /// The same, but ends with the first neighbour for which `stop_at` returns true; tells whether there was one.
    #[inline(always)]
    pub fn any_neighbor<T: DistanceTest>(
        &self,
        i: usize,
        radius: f64,
        mut stop_at: impl FnMut(usize, Vec3, f64) -> bool,
    ) -> bool {
        let here = self.positions[i];
        let everywhere = |_| true;
        self.candidates.any_candidate_near(self.buckets, self.positions, i, radius, everywhere, |j, there| {
            let r_ij = sub(*there, here);
            match T::within(dot(r_ij, r_ij), radius) {
                Some(r) => {
                    // Few candidates are neighbours. Told so, the compiler keeps the branch; otherwise it may work out
                    // root and quotient of every candidate, which costs more than the walk.
                    cold_path();
                    j != i && stop_at(j, r_ij, r)
                }
                None => false,
            }
        })
    }

    /// Whether a particle `j` for which `wanted(j)` holds lies within `radius` metres of particle `i`. Looks only into
    /// buckets for which `enter` holds, and asks `wanted` before it looks at the distance.
    #[inline(always)]
    pub fn has_neighbor<T: DistanceTest>(
        &self,
        i: usize,
        radius: f64,
        enter: impl Fn(usize) -> bool,
        wanted: impl Fn(usize) -> bool,
    ) -> bool {
        let here = self.positions[i];
        self.candidates.any_candidate_near(self.buckets, self.positions, i, radius, enter, |j, there| {
            wanted(j) && j != i && {
                let r_ij = sub(*there, here);
                T::within(dot(r_ij, r_ij), radius).is_some()
            }
        })
    }
}
