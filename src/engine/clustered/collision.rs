//! Collisions on clusters: close pairs are found in vectors, the few there are collide one by one as in
//! [`collision`](crate::engine::effects::collision), in the order in which a walk over buckets would meet them.

use super::{from_lanes, load, walk};
use crate::base::parallel::{FirstIndex, Rows};
use crate::base::simd::{Kernel, LANES, Simd, dispatch};
use crate::base::vec3::{Vec3, ZERO, dot, is_finite, sub};
use crate::engine::effects::collision::{Collision, Impact};
use crate::engine::effects::motion::take_over;
use crate::engine::error::SimulationError;
use crate::engine::parameters::Parameters;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::clusters::{CHUNK, Clusters, Section};
use crate::engine::stage::{Stage, State};
use std::ops::Range;

#[derive(Debug)]
pub struct ClusterCollisions {
    distance_m: f64,
    impact: Impact,
    /// The close pairs of each chunk of clusters: `i`, and the slot of `j`.
    found: Vec<Vec<(u32, u32)>>,
    velocity_after: Vec<Vec3>,
}

impl ClusterCollisions {
    pub fn new(collision: Collision, parameters: &Parameters, state: &State<Clusters>) -> Self {
        ClusterCollisions {
            distance_m: collision.distance * parameters.particle_distance_m,
            impact: Impact::new(collision),
            found: Vec::new(),
            velocity_after: state.workers.column(state.particles.len(), ZERO),
        }
    }

    fn collide(&mut self, state: &State<Clusters>, broken: &FirstIndex) -> bool {
        let clusters = &state.candidates;
        let mobile = clusters.slots.clusters(Section::Mobile);
        self.found.resize_with(mobile.len().div_ceil(CHUNK), Vec::new);
        let distance_m = self.distance_m;
        state.workers.scheduled_over(CHUNK * LANES).fill(Rows::new(&mut self.found), |range, found| {
            for (k, found) in range.zip(found) {
                let first = mobile.start + k * CHUNK;
                let pieces = first..mobile.end.min(first + CHUNK);
                found.clear();
                dispatch(Find { clusters, pieces, distance_m, found });
            }
        });
        if self.found.iter().all(Vec::is_empty) {
            return false;
        }
        let (velocity, grid, slots) = (&state.particles.velocity, &state.buckets().grid, &clusters.slots);
        self.velocity_after.copy_from_slice(velocity);
        for found in &mut self.found {
            found.sort_unstable_by_key(|&(i, slot)| {
                (i, grid.layers(slots.place(slot as usize)), slots.particle[slot as usize])
            });
            for pairs in found.chunk_by(|a, b| a.0 == b.0) {
                let i = pairs[0].0 as usize;
                let (mut u_i, here) = (velocity[i], slots.place(slots.of_particle[i] as usize));
                for &(_, slot) in pairs {
                    let (slot, j) = (slot as usize, slots.particle[slot as usize] as usize);
                    let r_ij = sub(slots.place(slot), here);
                    let r = dot(r_ij, r_ij).sqrt();
                    if !self.impact.with(&mut u_i, velocity[j], r_ij, r) {
                        broken.record(i);
                    }
                }
                if !is_finite(u_i) {
                    broken.record(i);
                }
                self.velocity_after[i] = u_i;
            }
        }
        true
    }
}

impl<T> Stage<Clusters, T> for ClusterCollisions {
    fn run(&mut self, state: &mut State<Clusters>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh_within(self.distance_m, probe)?;
        let broken = FirstIndex::default();
        within(probe, Phase::Collision, || {
            let someone = self.collide(state, &broken);
            state.require_finite(&broken, Phase::Collision, "velocity")?;
            if someone {
                take_over(&self.velocity_after, state);
            }
            Ok(())
        })
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.velocity_after[..])
            + self.found.iter().map(|found| found.capacity() * size_of::<(u32, u32)>()).sum::<usize>()
    }
}

struct Find<'a> {
    clusters: &'a Clusters,
    pieces: Range<usize>,
    distance_m: f64,
    found: &'a mut Vec<(u32, u32)>,
}

impl Kernel for Find<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Find { clusters, pieces, distance_m, found } = self;
        let (points, particle) = (&clusters.slots.points[..], &clusters.slots.particle[..]);
        let close = s.splat(distance_m * distance_m);
        let small = clusters.small_reaches(distance_m);
        for cluster in pieces {
            let x = load(s, &clusters.slots.lanes[cluster]);
            for lists in &clusters.mobile {
                let near = lists.of(cluster);
                for (j, choice) in walk(near, near.reaching(small)) {
                    let r = from_lanes(s, &points[j], &x);
                    let mut hits = s.bits(s.below(s.dot(r, r), close)) & choice;
                    while hits != 0 {
                        let i = particle[cluster * LANES + hits.trailing_zeros() as usize];
                        found.push((i, j as u32));
                        hits &= hits - 1;
                    }
                }
            }
        }
    }
}
