//! The grid of buckets: cubes whose side is the largest influence radius, or a whole part of it.

use crate::base::parallel::{FirstIndex, Rows, Team};
use crate::base::vec3::{Vec3, is_finite};
use crate::engine::parameters::Domain;
use crate::engine::particles::Kind;
use crate::engine::search::NONE;

/// A box tiled with cubic buckets, numbered with x outermost and z innermost. As many layers of buckets as a radius
/// reaches across stay empty around the domain, so that a walk over the neighbouring buckets needs no test for the
/// border.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    domain: Domain,
    side: f64,
    /// How many buckets a radius reaches across.
    reach: usize,
    /// Buckets in each direction, the empty border counted in.
    cells: [usize; 3],
    /// Offsets -reach..reach with x outermost, then y, then z.
    neighborhood: Box<[isize]>,
}

/// A domain that cannot be tiled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "a domain of {extent_m:?} m with buckets of {side_m} m would need {cells} buckets; at most {max} are allowed: \
     raise `particle_distance_m` or shrink the domain",
    max = Grid::MAX_BUCKETS
)]
pub struct TooManyBuckets {
    pub extent_m: Vec3,
    pub side_m: f64,
    pub cells: f64,
}

impl Grid {
    /// The most buckets a grid may have: their numbers fit into 32 bits with room to spare.
    pub const MAX_BUCKETS: usize = 1 << 30;

    /// Tiles `domain` with buckets, starting at its lower corner. `reach` buckets side by side are as long as the
    /// largest influence radius of `radius_m` metres.
    pub fn new(domain: Domain, radius_m: f64, reach: usize) -> Result<Self, TooManyBuckets> {
        let (side, border) = (radius_m / reach as f64, 2 * reach);
        let extent_m = [0, 1, 2].map(|d| domain.high[d] - domain.low[d]);
        let cells = extent_m.map(|e| (e / side).floor() + 1.0 + border as f64);
        let product = cells[0] * cells[1] * cells[2];
        if product.is_nan() || product > Self::MAX_BUCKETS as f64 {
            return Err(TooManyBuckets { extent_m, side_m: side, cells: product });
        }
        let cells = cells.map(|c| c as usize);
        let steps = || -(reach as isize)..=reach as isize;
        let mut neighborhood = Vec::new();
        for dx in steps() {
            for dy in steps() {
                neighborhood.extend(steps().map(|dz| (dx * cells[1] as isize + dy) * cells[2] as isize + dz));
            }
        }
        Ok(Grid { domain, side, reach, cells, neighborhood: neighborhood.into_boxed_slice() })
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
            let cell = ((x - self.domain.low[d]) / self.side) as usize + self.reach;
            bucket = bucket * self.cells[d] + cell.min(self.cells[d] - 1 - self.reach);
        }
        Some(bucket)
    }

    /// The buckets around `bucket` that a radius reaches, itself among them: x outermost, then y, then z; 27 of them
    /// where a bucket is as long as the radius, 125 where it is half as long.
    #[inline(always)]
    pub fn neighborhood(&self, bucket: usize) -> impl Iterator<Item = usize> + '_ {
        self.neighborhood.iter().map(move |offset| bucket.wrapping_add_signed(*offset))
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
    /// Puts every particle that is no ghost into its bucket. Those outside the domain are in none.
    pub fn assign(&mut self, kind: &[Kind], positions: &[Vec3], team: Team<'_>) -> Assigned {
        let (not_finite, left) = (FirstIndex::default(), FirstIndex::default());
        let grid = &self.grid;
        team.fill(Rows::new(&mut self.of_particle), |range, bucket| {
            for (i, bucket) in range.zip(bucket) {
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

    const DOMAIN: Domain = Domain { low: [-1.0, 0.0, 2.0], high: [1.0, 1.05, 2.3] };

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
        let domain = Domain { low: [0.0; 3], high: [1e6; 3] };
        assert!(Grid::new(domain, 1e-3, 1).unwrap_err().to_string().contains("particle_distance_m"));
        assert!(Grid::new(Domain { low: [0.0; 3], high: [f64::NAN; 3] }, 1e-3, 1).is_err());
    }
}
