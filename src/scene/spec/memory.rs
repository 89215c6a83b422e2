//! The memory that a scene needs, told before anything is built.

use super::Scene;
use crate::base::input::{Check, InputError};
use crate::scene::geometry::MAX_LATTICE_POINTS;

/// An upper estimate of the memory that a particle takes in one simulation, bytes: its columns, its share of the
/// search, and a row of the pressure matrix with room for a crowded neighbourhood.
pub const BYTES_PER_PARTICLE: usize = 3000;
/// The same for a bucket: its list, and a row of the relocated copy as wide as a crowded bucket.
pub const BYTES_PER_BUCKET: usize = 2000;

impl Scene {
    /// Refuses a scene that would need more memory than there is: `copies` simulations of it at a time.
    pub fn require_memory(&self, file: &str, copies: usize, available_bytes: u64) -> Result<(), InputError> {
        let single = (self.geometry.particle.len() + self.reserve()) as f64;
        let points = self.geometry.lattice_points(&self.placement(file)) + single;
        let there = Check { file };
        let allowed = format!("its lattice would have {points:.0} points: raise it, or shrink `domain`");
        let few = points <= MAX_LATTICE_POINTS as f64;
        there.require(few, "particle_distance_m", self.particle_distance_m, allowed)?;
        self.require_memory_of(file, points, copies, available_bytes)
    }

    /// The same once the number of particles is known, which is smaller than that of the lattice's points.
    pub fn require_memory_of(
        &self,
        file: &str,
        particles: f64,
        copies: usize,
        available_bytes: u64,
    ) -> Result<(), InputError> {
        let buckets = self.buckets();
        let per_particle = BYTES_PER_PARTICLE + self.effects.more_bytes_per_particle();
        let bytes = particles * per_particle as f64 + buckets * BYTES_PER_BUCKET as f64;
        let needed = bytes * copies as f64;
        let gib = f64::from(1 << 30);
        Check { file }.require(
            needed <= available_bytes as f64,
            "particle_distance_m",
            self.particle_distance_m,
            format!(
                "up to {particles:.0} particles in {buckets:.0} buckets would need up to {:.1} GiB and {:.1} GiB are \
                 available: raise it, or shrink `domain`",
                needed / gib,
                available_bytes as f64 / gib
            ),
        )
    }

    /// An upper estimate of the number of buckets.
    pub(super) fn buckets(&self) -> f64 {
        let radii = &self.radii;
        let side = radii.number_density.max(radii.gradient).max(radii.laplacian) * self.particle_distance_m;
        let (low, high) = self.geometry.bounds(&self.placement(""));
        let margins = 2.0 * self.domain.margin_m;
        let headroom = [0.0, self.domain.headroom_m, 0.0];
        (0..self.dimensions as usize)
            .map(|d| ((high[d] - low[d] + margins + headroom[d]) / side).floor() + 3.0)
            .product()
    }
}
