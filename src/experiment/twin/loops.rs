//! The loop of the paper's Figure 3 in Rust, through the engine's own searches: the twin of `scripts/twin/twin.c`.

use std::time::Instant;

use anyhow::{Result, ensure};

use crate::base::parallel::{Rows, Workers};
use crate::base::vec3::{Vec3, ZERO};
use crate::engine::kernel::weight;
use crate::engine::parameters::{Domain, Parameters};
use crate::engine::particles::{InitialParticle, Kind};
use crate::engine::preset::Test;
use crate::engine::search::aos_relocation::AosRelocation;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::linked_list::LinkedList;
use crate::engine::search::{
    CandidateSearch, DistanceTest, Lengths, NONE, Neighborhood, Now, RootFirst, SquaredFirst,
};
use crate::experiment::interrupt;
use crate::experiment::twin::outcome::{TwinAnswer, TwinPass};

/// What both programs are told about a scene, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometry {
    pub domain: Domain,
    pub bucket_side_m: f64,
    /// The number density's.
    pub radius_m: f64,
}

impl Geometry {
    pub fn of(parameters: &Parameters) -> Geometry {
        Geometry {
            domain: parameters.domain,
            bucket_side_m: parameters.largest_radius_m(),
            radius_m: parameters.number_density_radius_m(),
        }
    }
}

/// Measures `passes` passes over both layouts, after one that warms up. The seed orders the two in each pass.
pub fn measure(
    geometry: &Geometry,
    particles: &[InitialParticle],
    test: Test,
    workers: &Workers,
    passes: usize,
    seed: u64,
) -> Result<TwinAnswer> {
    let mut twin = Twin::new(geometry, particles, workers)?;
    let random = fastrand::Rng::with_seed(seed);
    let passes = workers.install(|| match test {
        Test::Sqrt => twin.run_passes::<RootFirst>(passes, random),
        Test::Squared => twin.run_passes::<SquaredFirst>(passes, random),
    })?;
    let (particles, threads, digest) = (particles.len(), workers.threads(), digest(&twin.list_sums));
    Ok(TwinAnswer { particles, threads, passes, digest })
}

/// Particles that stay where they are, with both searches and the sums that each gives.
struct Twin<'a> {
    workers: &'a Workers,
    radius_m: f64,
    positions: Vec<Vec3>,
    buckets: Buckets,
    list: LinkedList,
    relocated: AosRelocation,
    list_sums: Vec<f64>,
    relocated_sums: Vec<f64>,
}

impl<'a> Twin<'a> {
    fn new(geometry: &Geometry, particles: &[InitialParticle], workers: &'a Workers) -> Result<Self> {
        let count = particles.len();
        let grid = Grid::new(geometry.domain, geometry.bucket_side_m, 1)?;
        let mut positions = workers.column(count, ZERO);
        for (position, particle) in positions.iter_mut().zip(particles) {
            *position = particle.position;
        }
        let kinds: Vec<Kind> = particles.iter().map(|particle| particle.kind).collect();
        let (radius_m, side_m) = (geometry.radius_m, geometry.bucket_side_m);
        let lengths = Lengths { particle_distance_m: side_m, small_m: radius_m, large_m: side_m };
        let (mut list, mut relocated) =
            (LinkedList::new(&grid, lengths, count), AosRelocation::new(&grid, lengths, count));
        let mut buckets = Buckets { grid, of_particle: workers.column(count, NONE) };
        buckets.assign(&kinds, &positions, true, workers.scheduled());
        let now = Now { kind: &kinds, position: &positions, radius_m, walls_moved: false };
        list.build(&buckets, now, workers);
        relocated.build(&buckets, now, workers);
        Ok(Twin {
            workers,
            radius_m: geometry.radius_m,
            positions,
            buckets,
            list,
            relocated,
            list_sums: workers.column(count, 0.0),
            relocated_sums: workers.column(count, 0.0),
        })
    }

    fn run_passes<T: DistanceTest>(
        &mut self,
        passes: usize,
        mut random: fastrand::Rng,
    ) -> Result<Vec<TwinPass>> {
        self.run_pass::<T>(random.bool())?;
        (0..passes).map(|_| self.run_pass::<T>(random.bool())).collect()
    }

    fn run_pass<T: DistanceTest>(&mut self, list_first: bool) -> Result<TwinPass> {
        interrupt::check()?;
        let (mut list_s, mut relocation_s, mut relocated_s) = (0.0, 0.0, 0.0);
        for list_has_its_turn in [list_first, !list_first] {
            if list_has_its_turn {
                list_s = self.walk_lists::<T>();
            } else {
                (relocation_s, relocated_s) = self.walk_rows::<T>();
            }
        }
        self.require_same_sums()?;
        Ok(TwinPass { list_first, list_s, relocation_s, relocated_s })
    }

    /// Seconds of the loop along the linked lists.
    fn walk_lists<T: DistanceTest>(&mut self) -> f64 {
        let began = Instant::now();
        let near =
            Neighborhood { candidates: &self.list, buckets: &self.buckets, positions: &self.positions };
        sum_weights::<_, T>(&near, self.radius_m, self.workers, &mut self.list_sums);
        began.elapsed().as_secs_f64()
    }

    /// Seconds of the copy, and of the loop along the relocated rows.
    fn walk_rows<T: DistanceTest>(&mut self) -> (f64, f64) {
        let began = Instant::now();
        self.relocated.relocate(&self.buckets, &self.positions, self.workers.scheduled());
        let relocation_s = began.elapsed().as_secs_f64();
        let began = Instant::now();
        let near =
            Neighborhood { candidates: &self.relocated, buckets: &self.buckets, positions: &self.positions };
        sum_weights::<_, T>(&near, self.radius_m, self.workers, &mut self.relocated_sums);
        (relocation_s, began.elapsed().as_secs_f64())
    }

    fn require_same_sums(&self) -> Result<()> {
        for (i, (list, relocated)) in self.list_sums.iter().zip(&self.relocated_sums).enumerate() {
            ensure!(
                list.is_finite(),
                "particle {i}: its sum is not finite: another one lies at the same place"
            );
            let same = list.to_bits() == relocated.to_bits();
            ensure!(same, "particle {i}: {list:e} with the list, {relocated:e} relocated");
        }
        Ok(())
    }
}

/// The loop: for every particle the sum of the weights of its neighbours within `radius_m`.
fn sum_weights<C: CandidateSearch, T: DistanceTest>(
    near: &Neighborhood<'_, C>,
    radius_m: f64,
    workers: &Workers,
    sums: &mut [f64],
) {
    workers.scheduled().fill(Rows::new(sums), |range, sums| {
        for (i, total) in range.zip(sums) {
            let mut sum = 0.0;
            if near.buckets.of_particle[i] != NONE {
                near.for_each_neighbor::<T>(i, radius_m, |_, _, r| sum += weight(r, radius_m));
            }
            *total = sum;
        }
    });
}

/// FNV-1a, 64 bits, over the bits of all sums, lowest byte first.
pub fn digest(sums: &[f64]) -> String {
    let bytes = sums.iter().flat_map(|sum| sum.to_bits().to_le_bytes());
    let hash = bytes.fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::schedule::Schedule;

    /// The offset basis as published, and eight bytes by the definition's decimal constants in wider arithmetic.
    #[test]
    fn the_digest_is_fnv_1a() {
        assert_eq!(digest(&[]), "cbf29ce484222325");
        let hash = b"foobarba".iter().fold(14_695_981_039_346_656_037u128, |hash, &byte| {
            ((hash ^ u128::from(byte)) * 1_099_511_628_211) % (1 << 64)
        });
        assert_eq!(digest(&[f64::from_le_bytes(*b"foobarba")]), format!("{hash:016x}"));
    }

    /// Three particles on a line at distances 1, 1 and 2 within a radius of 1.5, a ghost among them and one far outside.
    #[test]
    fn sums_are_those_of_the_formula() {
        let at = |kind, x| InitialParticle::at_rest(kind, [x, 0.0, 0.0]);
        let particles = [
            at(Kind::Fluid, 0.0),
            at(Kind::Wall, 1.0),
            at(Kind::Ghost, 1.5),
            at(Kind::DummyWall, 2.0),
            at(Kind::Fluid, 99.0),
        ];
        let domain = Domain::new([-1.0; 3], [3.0; 3]);
        let geometry = Geometry { domain, bucket_side_m: 2.0, radius_m: 1.5 };
        for (threads, test) in [(1, Test::Sqrt), (2, Test::Squared)] {
            let workers = Workers::new(threads, Schedule::Static, &[]).unwrap();
            let answer = measure(&geometry, &particles, test, &workers, 3, 7).unwrap();
            assert_eq!((answer.particles, answer.threads, answer.passes.len()), (5, threads, 3));
            assert_eq!(answer.digest, digest(&[0.5, 1.0, 0.0, 0.5, 0.0]));
        }
        let workers = Workers::new(1, Schedule::Static, &[]).unwrap();
        let twice = [particles[0], particles[0]];
        let error = measure(&geometry, &twice, Test::Sqrt, &workers, 1, 7).unwrap_err().to_string();
        assert!(error.contains("not finite") && error.contains("particle 0"), "{error}");
    }
}
