//! The textbook's explicit viscosity on clusters: `a_i += nu 2D / (n0_L lambda) sum_j (u_j - u_i) w(r_ij, re_L)`, gathered as
//! `sum_j w u_j - u_i sum_j w`.

use std::ops::Range;

use super::{PIECE, add_weighted, from_lanes, lane, load, scatter, walk};
use crate::base::parallel::{FirstIndex, Rows};
use crate::base::simd::{Kernel, LANES, Simd, dispatch};
use crate::base::vec3::{ZERO, add_scaled, is_finite};
use crate::engine::effects::viscosity::ExplicitViscosity;
use crate::engine::error::SimulationError;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::clusters::{Clusters, Lanes, Section};
use crate::engine::stage::{Stage, State};
use crate::engine::terms::PairTerm;
use crate::engine::time_step::StepLimit;

#[derive(Debug)]
pub struct ClusterViscosity {
    term: ExplicitViscosity,
    /// `re_L`, metres.
    radius_m: f64,
    /// By slot, metres per second.
    velocity: Vec<[f64; 4]>,
    sums: Vec<Lanes>,
}

impl ClusterViscosity {
    pub fn new(term: ExplicitViscosity, radius_m: f64) -> Self {
        ClusterViscosity { term, radius_m, velocity: Vec::new(), sums: Vec::new() }
    }

    /// Takes up the velocities; tells which sections move at all.
    fn gather(&mut self, state: &State<Clusters>) -> [bool; 3] {
        let slots = &state.candidates.slots;
        let velocity = &state.particles.velocity;
        self.velocity.resize(slots.particle.len(), [0.0; 4]);
        Section::ALL.map(|section| {
            let mut moves = false;
            for slot in slots.of(section) {
                let [x, y, z] = velocity[slots.particle[slot] as usize];
                moves |= [x, y, z] != ZERO;
                self.velocity[slot] = [x, y, z, 0.0];
            }
            moves
        })
    }

    fn sum(&mut self, state: &mut State<Clusters>, broken: &FirstIndex) {
        let moving = self.gather(state);
        let clusters = &state.candidates;
        let mobile = clusters.slots.clusters(Section::Mobile);
        self.sums.resize(mobile.len(), [[0.0; LANES]; 3]);
        let (velocity, radius_m) = (&self.velocity, self.radius_m);
        state.workers.scheduled().fill(Rows::of_width(&mut self.sums, PIECE), |pieces, sums| {
            let first = mobile.start + pieces.start * PIECE;
            let pieces = first..first + sums.len();
            dispatch(Sum { clusters, pieces, velocity, moving, radius_m, sums });
        });
        let (sums, factor, kind) = (&self.sums, self.term.factor, &state.particles.kind);
        let team = state.workers.scheduled();
        let first = mobile.start * LANES;
        scatter(&mut state.particles.acceleration, &clusters.slots, first, team, |i, slot, a| {
            *a = add_scaled(*a, factor, lane(sums, mobile.start, slot));
            if !is_finite(*a) && kind[i].moves() {
                broken.record(i);
            }
        });
    }
}

impl<T> Stage<Clusters, T> for ClusterViscosity {
    fn run(&mut self, state: &mut State<Clusters>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh_within(self.radius_m, probe)?;
        let broken = FirstIndex::default();
        within(probe, Phase::Viscosity, || self.sum(state, &broken));
        state.require_finite(&broken, Phase::Viscosity, "acceleration")
    }

    fn bytes(&self) -> usize {
        self.velocity.capacity() * size_of::<[f64; 4]>() + self.sums.capacity() * size_of::<Lanes>()
    }

    fn longest_step(&self, state: &State<Clusters>) -> Option<StepLimit> {
        self.term.longest_step(&state.particles)
    }
}

struct Sum<'a> {
    clusters: &'a Clusters,
    pieces: Range<usize>,
    velocity: &'a [[f64; 4]],
    moving: [bool; 3],
    radius_m: f64,
    sums: &'a mut [Lanes],
}

impl Kernel for Sum<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Sum { clusters, pieces, velocity, moving, radius_m, sums } = self;
        let (re, re2, one) = (s.splat(radius_m), s.splat(radius_m * radius_m), s.splat(-1.0));
        let points = &clusters.slots.points[..];
        for (cluster, sums) in pieces.zip(sums) {
            let x = load(s, &clusters.slots.lanes[cluster]);
            let zero = s.splat(0.0);
            let (mut weight, mut weighted) = (zero, [zero; 3]);
            for section in Section::ALL {
                let near = clusters.mobile[section as usize].of(cluster);
                for (j, choice) in walk(near, near.all()) {
                    let r = from_lanes(s, &points[j], &x);
                    let r2 = s.dot(r, r);
                    let w = s.mul_add(re, s.reciprocal_sqrt(r2), one);
                    let w = s.keep(s.both(s.mask(choice), s.below(r2, re2)), w);
                    weight = s.add(weight, w);
                    if moving[section as usize] {
                        let u = &velocity[j];
                        add_weighted(s, &mut weighted, w, [s.splat(u[0]), s.splat(u[1]), s.splat(u[2])]);
                    }
                }
            }
            for d in 0..3 {
                let first = cluster * LANES;
                let u: [f64; LANES] = std::array::from_fn(|k| velocity[first + k][d]);
                s.store(s.neg_mul_add(weight, s.load(&u), weighted[d]), &mut sums[d]);
            }
        }
    }
}
