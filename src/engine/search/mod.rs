//! Neighbour search: which particles lie within a radius of another one.
//!
//! A search supplies candidates and nothing else; the distance test and the kernels are written once, above it, and
//! compiled anew for each search. A new search is one new file here and one line in `preset.rs`.

pub mod aos_relocation;
pub mod brute_force;
pub mod grid;
pub mod linked_list;

use crate::base::parallel::Team;
use crate::base::vec3::{Vec3, dot, sub};
use grid::{Buckets, Grid};

/// Marks the end of a list, and a particle that is in no bucket.
pub const NONE: u32 = u32::MAX;

/// Supplies, for each particle, all particles that may be its neighbours.
pub trait CandidateSearch: Send + Sync + Sized {
    /// A search over `count` particles in the buckets of `grid`.
    fn new(grid: &Grid, count: usize) -> Self;

    /// Takes up the particles' new buckets.
    fn build(&mut self, buckets: &Buckets);

    /// Whether positions are copied after each build, so that the step has a `relocation` phase.
    const RELOCATES: bool;

    /// Copies positions to where the search reads them.
    fn relocate(&mut self, _positions: &[Vec3], _team: Team<'_>) {}

    /// Calls `stop_at(j, x_j)` for the candidates `j` of particle `i`, itself among them, bucket by bucket in the order
    /// of [`Grid::neighborhood`] and by ascending index within a bucket, until it returns true; tells whether it did.
    fn any_candidate(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool;

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
        let here = self.positions[i];
        self.candidates
            .any_candidate(self.buckets, self.positions, i, |j, there| {
                let r_ij = sub(*there, here);
                if let Some(r) = T::within(dot(r_ij, r_ij), radius)
                    && j != i
                {
                    visit(j, r_ij, r);
                }
                false
            });
    }

    /// Whether some particle `j` for which `wanted(j)` holds lies within `radius` metres of particle `i`. Asks `wanted`
    /// before it looks at the distance.
    #[inline(always)]
    pub fn any_neighbor<T: DistanceTest>(
        &self,
        i: usize,
        radius: f64,
        wanted: impl Fn(usize) -> bool,
    ) -> bool {
        let here = self.positions[i];
        self.candidates
            .any_candidate(self.buckets, self.positions, i, |j, there| {
                wanted(j) && j != i && {
                    let r_ij = sub(*there, here);
                    T::within(dot(r_ij, r_ij), radius).is_some()
                }
            })
    }
}
