//! The textbook's explicit viscosity on clusters: `a_i += nu 2D / (n0_L lambda) sum_j (u_j - u_i) w(r_ij, re_L)`, gathered as
//! `sum_j w u_j - u_i sum_j w`.
//!
//! What fluid carries may share the walk, as `dT_i/dt = alpha 2D / (n0_L lambda) sum_j (T_j - T_i) w` over fluid and bodies, where
//! the diffusivity is the same everywhere and walls are insulated: it stands in the fourth lane of a velocity and takes one sum more.

use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

use super::{PIECE, add_weighted, from_lanes, load, scatter, walk};
use crate::base::parallel::{FirstIndex, Rows};
use crate::base::simd::{Kernel, LANES, Simd, dispatch};
use crate::base::vec3::{ZERO, add_scaled, is_finite};
use crate::engine::effects::diffusion::Carried;
use crate::engine::effects::viscosity::ExplicitViscosity;
use crate::engine::error::SimulationError;
use crate::engine::parameters::Parameters;
use crate::engine::particles::Particles;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::clusters::{Clusters, Lanes, Section};
use crate::engine::shared_walk::SharedWalk;
use crate::engine::stage::{Stage, State};
use crate::engine::terms::PairTerm;
use crate::engine::time_step::StepLimit;
use crate::engine::viscous_stages::{ExplicitTerm, explicit_term};

#[derive(Debug)]
pub struct ClusterViscosity {
    term: ExplicitViscosity,
    /// `re_L`, metres.
    radius_m: f64,
    diffusing: Option<Diffusing>,
    /// By slot, metres per second; beside it what diffuses.
    velocity: Vec<[f64; 4]>,
    sums: Vec<Sums>,
}

/// What shares the walk.
#[derive(Debug)]
struct Diffusing {
    carried: Carried,
    /// `alpha 2D / (n0_L lambda)`, 1/s.
    factor: f64,
}

/// `sum_j (u_j - u_i) w` of each lane, and the same of what diffuses.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    velocity: Lanes,
    diffusing: [f64; LANES],
}

impl ClusterViscosity {
    pub fn new(term: ExplicitViscosity, radius_m: f64) -> Self {
        ClusterViscosity { term, radius_m, diffusing: None, velocity: Vec::new(), sums: Vec::new() }
    }

    /// The same with one quantity that diffuses. `None` where other terms share the walk, or these have constants that differ.
    pub fn with_diffusion(shared: SharedWalk, parameters: &Parameters) -> Option<Self> {
        let effects = &parameters.effects;
        let (carried, diffusion) = match shared {
            SharedWalk { viscosity: true, temperature: true, concentration: false, tension: false } => {
                (Carried::Temperature, effects.heat.as_ref()?)
            }
            SharedWalk { viscosity: true, temperature: false, concentration: true, tension: false } => {
                (Carried::Concentration, effects.scalar.as_ref()?)
            }
            _ => return None,
        };
        let ExplicitTerm::Uniform(term) = explicit_term(effects.viscosity.as_ref()?, parameters) else {
            return None;
        };
        let factor = diffusion.insulated_uniform_diffusivity()? * parameters.laplacian_factor();
        let radius_m = parameters.laplacian_radius_m();
        Some(ClusterViscosity { diffusing: Some(Diffusing { carried, factor }), ..Self::new(term, radius_m) })
    }

    /// Takes up the velocities; tells which sections move at all.
    fn gather(&mut self, state: &State<Clusters>) -> [bool; 6] {
        let slots = &state.candidates.slots;
        let Particles { velocity, temperature, concentration, .. } = &state.particles;
        let carried = self.diffusing.as_ref().map(|diffusing| match diffusing.carried {
            Carried::Temperature => temperature,
            Carried::Concentration => concentration,
        });
        self.velocity.resize(slots.particle.len(), [0.0; 4]);
        Section::ALL.map(|section| {
            let (particle, moves) = (&slots.particle[slots.of(section)], AtomicBool::new(false));
            let rows = Rows::new(&mut self.velocity[slots.of(section)]);
            state.workers.shared_evenly().fill(rows, |range, rows| {
                for (row, &i) in rows.iter_mut().zip(&particle[range]) {
                    let [x, y, z] = velocity[i as usize];
                    if [x, y, z] != ZERO {
                        moves.store(true, Relaxed);
                    }
                    *row = [x, y, z, carried.map_or(0.0, |values| values[i as usize])];
                }
            });
            moves.into_inner()
        })
    }

    fn sum(&mut self, state: &mut State<Clusters>, broken: &FirstIndex) {
        let moving = self.gather(state);
        let clusters = &state.candidates;
        let mobile = clusters.slots.clusters(Section::Mobile);
        self.sums.resize(mobile.len(), Sums::default());
        let (velocity, radius_m, diffuses) = (&self.velocity, self.radius_m, self.diffusing.is_some());
        state.workers.scheduled_over(PIECE * LANES).fill(
            Rows::of_width(&mut self.sums, PIECE),
            |pieces, sums| {
                let first = mobile.start + pieces.start * PIECE;
                let pieces = first..first + sums.len();
                match diffuses {
                    false => dispatch(Sum::<false> { clusters, pieces, velocity, moving, radius_m, sums }),
                    true => dispatch(Sum::<true> { clusters, pieces, velocity, moving, radius_m, sums }),
                }
            },
        );
        let (sums, factor, kind) = (&self.sums, self.term.factor, &state.particles.kind);
        let team = state.workers.scheduled();
        let first = mobile.start * LANES;
        scatter(&mut state.particles.acceleration, &clusters.slots, first, team, |i, slot, a| {
            let Sums { velocity, .. } = &sums[slot / LANES - mobile.start];
            *a = add_scaled(*a, factor, [0, 1, 2].map(|d| velocity[d][slot % LANES]));
            if !is_finite(*a) && kind[i].moves() {
                broken.record(i);
            }
        });
        let Some(Diffusing { carried, factor }) = &self.diffusing else { return };
        let rates = match carried {
            Carried::Temperature => &mut state.particles.temperature_rate,
            Carried::Concentration => &mut state.particles.concentration_rate,
        };
        scatter(rates, &clusters.slots, first, team, |i, slot, rate| {
            if kind[i].moves() {
                *rate += factor * sums[slot / LANES - mobile.start].diffusing[slot % LANES];
            }
        });
    }
}

impl<T> Stage<Clusters, T> for ClusterViscosity {
    fn run(&mut self, state: &mut State<Clusters>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh_within(self.radius_m, probe)?;
        let broken = FirstIndex::default();
        let phase = if self.diffusing.is_some() { Phase::PairTerms } else { Phase::Viscosity };
        within(probe, phase, || self.sum(state, &broken));
        state.require_finite(&broken, phase, "acceleration")
    }

    fn bytes(&self) -> usize {
        self.velocity.capacity() * size_of::<[f64; 4]>() + self.sums.capacity() * size_of::<Sums>()
    }

    fn longest_step(&self, state: &State<Clusters>) -> Option<StepLimit> {
        self.term.longest_step(&state.particles)
    }
}

struct Sum<'a, const DIFFUSES: bool> {
    clusters: &'a Clusters,
    pieces: Range<usize>,
    velocity: &'a [[f64; 4]],
    moving: [bool; 6],
    radius_m: f64,
    sums: &'a mut [Sums],
}

impl<const DIFFUSES: bool> Kernel for Sum<'_, DIFFUSES> {
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
            let (mut of_mobile, mut carried) = (zero, zero);
            for lists in &clusters.mobile {
                let (near, section) = (lists.of(cluster), lists.over());
                for (j, choice) in walk(near, near.all) {
                    let r = from_lanes(s, &points[j], &x);
                    let r2 = s.dot(r, r);
                    let w = s.mul_add(re, s.reciprocal_sqrt(r2), one);
                    let w = s.keep(s.both(s.mask(choice), s.below(r2, re2)), w);
                    weight = s.add(weight, w);
                    if moving[section as usize] {
                        let u = &velocity[j];
                        add_weighted(s, &mut weighted, w, [s.splat(u[0]), s.splat(u[1]), s.splat(u[2])]);
                    }
                    if DIFFUSES && section.are_mobile() {
                        of_mobile = s.add(of_mobile, w);
                        carried = s.mul_add(w, s.splat(velocity[j][3]), carried);
                    }
                }
            }
            let first = cluster * LANES;
            for d in 0..3 {
                let u: [f64; LANES] = std::array::from_fn(|k| velocity[first + k][d]);
                s.store(s.neg_mul_add(weight, s.load(&u), weighted[d]), &mut sums.velocity[d]);
            }
            if DIFFUSES {
                let own: [f64; LANES] = std::array::from_fn(|k| velocity[first + k][3]);
                s.store(s.neg_mul_add(of_mobile, s.load(&own), carried), &mut sums.diffusing);
            }
        }
    }
}
