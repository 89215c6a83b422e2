//! The grid of buckets: cubes whose side is the largest influence radius, or a whole part of it.

use std::ops::Range;

use crate::base::parallel::{FirstIndex, Rows, Team};
use crate::base::vec3::{Vec3, is_finite};
use crate::engine::parameters::Domain;
use crate::engine::particles::Kind;
use crate::engine::search::NONE;

/// A box tiled with cubic buckets, numbered with x outermost and z innermost. As many layers of buckets as a radius
/// reaches across lie around the domain, so that a walk over the neighbouring buckets needs no test for the border: they
/// stay empty or, along a periodic axis, stand for buckets at the other end. A direction in which the domain has no
/// extent, as z in a plane, has one bucket and no border.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    domain: Domain,
    /// The largest influence radius, metres.
    radius_m: f64,
    /// The length of a bucket in each direction, metres: along a periodic axis a whole part of the period.
    side: Vec3,
    /// How many buckets a radius reaches across in each direction.
    reach: [usize; 3],
    /// Buckets in each direction, the border counted in.
    cells: [usize; 3],
    /// Offsets -reach..reach with x outermost, then y, then z.
    neighborhood: Box<[isize]>,
    /// The same offsets as runs of buckets that follow one another: where each begins, and how long it is.
    runs: Box<[(isize, usize)]>,
}

/// A bucket as a walk meets it: the bucket that holds the particles, and by how many periods they are moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Image {
    pub bucket: u32,
    /// Of each axis -1, 0 or 1, as a number to base 3 with x first; 13 for none.
    pub shift: u8,
}

/// A domain that cannot be tiled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BadDomain {
    #[error(
        "a domain of {extent_m:?} m with buckets of {side_m} m would need {cells} buckets; at most {max} are allowed: \
         raise `particle_distance_m` or shrink the domain",
        max = Grid::MAX_BUCKETS
    )]
    TooManyBuckets { extent_m: Vec3, side_m: f64, cells: f64 },
    #[error(
        "the period of {period_m} m along axis {axis} is shorter than the largest influence radius, {radius_m} m, so that \
         a particle would meet itself: lengthen the domain or lower `particle_distance_m`"
    )]
    ShortPeriod { axis: char, period_m: f64, radius_m: f64 },
}

impl Grid {
    /// The most buckets a grid may have: their numbers fit into 32 bits with room to spare.
    pub const MAX_BUCKETS: usize = 1 << 30;

    /// Tiles `domain` with buckets, starting at its lower corner. `reach` buckets side by side are as long as the
    /// largest influence radius of `radius_m` metres.
    pub fn new(domain: Domain, radius_m: f64, reach: usize) -> Result<Self, BadDomain> {
        let extent_m = [0, 1, 2].map(|d| domain.high[d] - domain.low[d]);
        let (mut side, mut reaches, mut cells) = ([radius_m / reach as f64; 3], [reach; 3], [0.0; 3]);
        for d in 0..3 {
            let inside = if domain.periodic[d] {
                if extent_m[d] < radius_m {
                    let axis = ['x', 'y', 'z'][d];
                    return Err(BadDomain::ShortPeriod { axis, period_m: extent_m[d], radius_m });
                }
                let whole = (extent_m[d] / side[d]).floor();
                side[d] = extent_m[d] / whole;
                whole
            } else {
                (extent_m[d] / side[d]).floor() + 1.0
            };
            if extent_m[d] == 0.0 {
                reaches[d] = 0;
            }
            cells[d] = inside + 2.0 * reaches[d] as f64;
        }
        let product = cells[0] * cells[1] * cells[2];
        if product.is_nan() || product > Self::MAX_BUCKETS as f64 {
            return Err(BadDomain::TooManyBuckets { extent_m, side_m: side[0], cells: product });
        }
        let cells = cells.map(|c| c as usize);
        let steps = |d: usize| -(reaches[d] as isize)..=reaches[d] as isize;
        let mut neighborhood = Vec::new();
        for dx in steps(0) {
            for dy in steps(1) {
                neighborhood
                    .extend(steps(2).map(|dz| (dx * cells[1] as isize + dy) * cells[2] as isize + dz));
            }
        }
        let runs = neighborhood.chunk_by(|a, b| a + 1 == *b).map(|run| (run[0], run.len())).collect();
        let neighborhood = neighborhood.into_boxed_slice();
        Ok(Grid { domain, radius_m, side, reach: reaches, cells, neighborhood, runs })
    }

    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// The largest influence radius, metres.
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// What each bucket stands for. Only those in the border of a periodic axis stand for another one.
    pub fn images(&self) -> Vec<Image> {
        let [_, ny, nz] = self.cells;
        let image = |bucket: usize| {
            let at = [bucket / (ny * nz), bucket / nz % ny, bucket % nz];
            let (mut home, mut shift) = (0, 0);
            for (d, cell) in at.into_iter().enumerate() {
                let (mut cell, mut periods) = (cell as isize, 0);
                if self.domain.periodic[d] {
                    let (first, whole) =
                        (self.reach[d] as isize, (self.cells[d] - 2 * self.reach[d]) as isize);
                    periods = (cell - first).div_euclid(whole);
                    cell -= periods * whole;
                }
                home = home * self.cells[d] + cell as usize;
                shift = 3 * shift + (periods.clamp(-1, 1) + 1) as u8;
            }
            Image { bucket: home as u32, shift }
        };
        (0..self.len()).map(image).collect()
    }

    /// The 27 displacements that an [`Image`]'s `shift` names, metres.
    pub fn shifts(&self) -> [Vec3; 27] {
        std::array::from_fn(|shift| {
            let periods = [shift / 9, shift / 3 % 3, shift % 3].map(|k| k as f64 - 1.0);
            [0, 1, 2].map(|d| match self.domain.periodic[d] {
                true => periods[d] * (self.domain.high[d] - self.domain.low[d]),
                false => 0.0,
            })
        })
    }

    /// The number of buckets.
    pub fn len(&self) -> usize {
        self.cells.iter().product()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The bucket that holds `position`, or none outside the domain.
    pub fn bucket_at(&self, position: Vec3) -> Option<usize> {
        let mut bucket = 0;
        for (d, x) in position.into_iter().enumerate() {
            if !(self.domain.low[d]..=self.domain.high[d]).contains(&x) {
                return None;
            }
            let cell = ((x - self.domain.low[d]) / self.side[d]) as usize + self.reach[d];
            bucket = bucket * self.cells[d] + cell.min(self.cells[d] - 1 - self.reach[d]);
        }
        Some(bucket)
    }

    /// Where along each axis the bucket of a position stands, in the order of buckets' numbers. Buckets are counted on beyond the ends
    /// of periodic axes.
    pub fn layers(&self, position: Vec3) -> [i32; 3] {
        [0, 1, 2].map(|d| {
            let layer = ((position[d] - self.domain.low[d]) / self.side[d]).floor() as i32;
            let last = (self.cells[d] - 1 - 2 * self.reach[d]) as i32;
            if self.domain.periodic[d] { layer } else { layer.clamp(0, last) }
        })
    }

    /// The buckets around `bucket` that a radius reaches, itself among them: x outermost, then y, then z; 27 of them
    /// where a bucket is as long as the radius, 125 where it is half as long.
    #[inline(always)]
    pub fn neighborhood(&self, bucket: usize) -> impl Iterator<Item = usize> + '_ {
        self.neighborhood.iter().map(move |offset| bucket.wrapping_add_signed(*offset))
    }

    /// The same buckets in the same order, as ranges of numbers that follow one another: 9 instead of 27.
    #[inline(always)]
    pub fn runs(&self, bucket: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        self.runs.iter().map(move |&(offset, len)| {
            let first = bucket.wrapping_add_signed(offset);
            first..first + len
        })
    }
}

/// Which bucket each particle is in.
#[derive(Debug, Clone)]
pub struct Buckets {
    pub grid: Grid,
    /// The bucket of each particle; [`NONE`] for a ghost.
    pub of_particle: Vec<u32>,
}

/// What an assignment met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Assigned {
    /// The first particle whose position is not finite.
    pub not_finite: Option<usize>,
    /// Whether a particle that is no ghost lies outside the domain.
    pub someone_left: bool,
}

impl Buckets {
    /// Puts every particle that is no ghost into its bucket; walls, only if `walls_too`. Those outside the domain are in none.
    pub fn assign(&mut self, kind: &[Kind], positions: &[Vec3], walls_too: bool, team: Team<'_>) -> Assigned {
        let (not_finite, left) = (FirstIndex::default(), FirstIndex::default());
        let grid = &self.grid;
        team.fill(Rows::new(&mut self.of_particle), |range, bucket| {
            for (i, bucket) in range.zip(bucket) {
                if !walls_too && matches!(kind[i], Kind::Wall | Kind::DummyWall) {
                    continue;
                }
                if kind[i] == Kind::Ghost {
                    *bucket = NONE;
                    continue;
                }
                if !is_finite(positions[i]) {
                    not_finite.record(i);
                }
                *bucket = grid.bucket_at(positions[i]).map_or_else(
                    || {
                        left.record(i);
                        NONE
                    },
                    |b| b as u32,
                );
            }
        });
        Assigned { not_finite: not_finite.get(), someone_left: left.get().is_some() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DOMAIN: Domain = Domain { low: [-1.0, 0.0, 2.0], high: [1.0, 1.05, 2.3], periodic: [false; 3] };

    fn grid() -> Grid {
        Grid::new(DOMAIN, 0.1, 1).unwrap()
    }

    #[test]
    fn the_neighborhood_has_x_outermost_and_stays_inside() {
        let grid = grid();
        let corner = grid.bucket_at([-1.0, 0.0, 2.0]).unwrap();
        let opposite = grid.bucket_at([1.0, 1.05, 2.3]).unwrap();
        assert!(grid.neighborhood(corner).all(|b| b < grid.len()));
        assert!(grid.neighborhood(opposite).all(|b| b < grid.len()));
        assert!(grid.neighborhood(corner).is_sorted());
        assert_eq!(grid.neighborhood(corner).nth(13), Some(corner));
        assert_eq!(grid.bucket_at([-0.85, 0.0, 2.0]), grid.neighborhood(corner).nth(22));
    }

    #[test]
    fn smaller_buckets_reach_as_far() {
        let grid = Grid::new(DOMAIN, 0.1, 2).unwrap();
        let corner = grid.bucket_at(DOMAIN.low).unwrap();
        let opposite = grid.bucket_at(DOMAIN.high).unwrap();
        for bucket in [corner, opposite] {
            let around: Vec<usize> = grid.neighborhood(bucket).collect();
            assert_eq!((around.len(), around[62]), (125, bucket));
            assert!(around.is_sorted() && around.iter().all(|&b| b < grid.len()));
            let runs: Vec<_> = grid.runs(bucket).collect();
            assert_eq!((runs.len(), runs.into_iter().flatten().collect()), (25, around));
        }
        let reached = grid.bucket_at([-0.91, 0.09, 2.09]).unwrap();
        assert!(grid.neighborhood(corner).any(|bucket| bucket == reached));
    }

    #[test]
    fn only_the_domain_has_buckets() {
        let grid = grid();
        for outside in [[-1.001, 0.5, 2.1], [0.0, 1.06, 2.1], [0.0, 0.5, 1.999], [f64::NAN, 0.5, 2.1]] {
            assert_eq!(grid.bucket_at(outside), None);
        }
    }

    #[test]
    fn a_domain_of_too_many_buckets_is_refused() {
        let domain = Domain { low: [0.0; 3], high: [1e6; 3], periodic: [false; 3] };
        assert!(Grid::new(domain, 1e-3, 1).unwrap_err().to_string().contains("particle_distance_m"));
        assert!(Grid::new(Domain { high: [f64::NAN; 3], ..domain }, 1e-3, 1).is_err());
        let narrow = Domain { high: [0.5, 0.9, 0.9], periodic: [false, true, false], ..domain };
        assert!(Grid::new(narrow, 1.0, 1).unwrap_err().to_string().contains("axis y"));
    }

    #[test]
    fn a_plane_has_nine_buckets_around_a_bucket() {
        let grid = Grid::new(Domain { high: [1.0, 1.05, 2.0], ..DOMAIN }, 0.1, 1).unwrap();
        let corner = grid.bucket_at(DOMAIN.low).unwrap();
        assert_eq!(grid.neighborhood(corner).count(), 9);
        assert!(grid.neighborhood(corner).all(|b| b < grid.len()));
    }

    /// Two metres and buckets of 0.3 m make 6 of 1/3 m, and one more at either end that stands for the last and first.
    #[test]
    fn buckets_beyond_a_periodic_axis_stand_for_those_at_the_other_end() {
        let domain = Domain { low: [-1.0, 0.0, 0.0], high: [1.0, 1.0, 0.0], periodic: [true, false, false] };
        let grid = Grid::new(domain, 0.3, 1).unwrap();
        let (images, shifts) = (grid.images(), grid.shifts());
        let first = grid.bucket_at([-0.99, 0.5, 0.0]).unwrap();
        let last = grid.bucket_at([0.99, 0.5, 0.0]).unwrap();
        let before = images[grid.neighborhood(first).nth(1).unwrap()];
        assert_eq!((before.bucket as usize, shifts[before.shift as usize]), (last, [-2.0, 0.0, 0.0]));
        let after = images[grid.neighborhood(last).nth(7).unwrap()];
        assert_eq!((after.bucket as usize, shifts[after.shift as usize]), (first, [2.0, 0.0, 0.0]));
        assert_eq!(images[first], Image { bucket: first as u32, shift: 13 });
        assert_eq!(shifts[13], [0.0; 3]);
    }
}
