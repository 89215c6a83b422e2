//! Surface tension from the energy of particles that lack neighbours (after Kondo 2023, the attractive pressure of MPH).
//!
//! With `q = r_ij / re` and `W = (1 - q^2)^3`, `c_i = sum_j W / sum_lattice W` says how full the neighbourhood of a particle is,
//! walls and bodies counted in, and `d_i = min(c_i - b, 0)` what it lacks: nothing inside a fluid, where the share `b` leaves
//! room for disorder. The energy `E = A m / 2 sum_i d_i^2` is that of the surface, and its exact derivative the force:
//! `a_i = -(6 A / (sum_lattice W re^2)) sum_j (d_i + d_j) (1 - q^2)^2 r_ij`. Forces of a pair are opposite and central, so
//! momentum and angular momentum stay, and the sum of kinetic energy and `E` stays as the steps become short.
//!
//! `A`, m2/s2, follows from a plane surface of the reference lattice, whose layers lack `d_1, d_2, ..`: its energy for each
//! square metre, `A rho l0 sum_k d_k^2 / 2`, is `sigma`.
//!
//! Why this and no curvature: particles at a free surface have no neighbours outside to take a normal's divergence from, and
//! a tension that is no energy's derivative fed the motion of free drops until they broke. Why not the potential between
//! pairs alone: it acts inside the fluid too, where the pressure must bear it, some thirty times the pressure of a drop of
//! fifteen particles' radius; here nothing acts inside.
//!
//! Limits: walls and bodies are neutral, with a contact angle of 90 degrees. Sheets thinner than `re` have less tension.

use crate::base::parallel::{FirstIndex, Rows};
use crate::base::vec3::{Vec3, ZERO, add_scaled, dot, is_finite};
use crate::engine::effects::potential_tension::capillary_limit_s;
use crate::engine::error::SimulationError;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::Parameters;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Stage, State};
use crate::engine::time_step::StepLimit;

/// `b`: how full a neighbourhood inside the fluid is at least.
const FULL: f64 = 0.97;

/// `re` where a scene names none: below it, layers beneath the surface count for too little (see `scene/validation/tension.rs`).
const RADIUS: f64 = 4.1;

/// Tension of the fluid's surface by what particles lack there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceTension {
    /// `sigma`, newtons per metre.
    pub surface_tension_n_m: f64,
    /// `re`, in particle distances: `None` for [`RADIUS`].
    pub radius: Option<f64>,
}

impl SurfaceTension {
    /// `re` in metres.
    pub fn radius_m(&self, parameters: &Parameters) -> f64 {
        self.radius.unwrap_or(RADIUS) * parameters.particle_distance_m
    }
}

/// `1 - q^2` for a vector of the length `r2.sqrt()`.
#[inline(always)]
fn nearness(r2: f64, radius: f64) -> f64 {
    1.0 - r2 / (radius * radius)
}

/// Sums of `W` on the reference lattice, the radius in particle distances.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Lattice {
    /// `sum W` around a particle inside.
    whole: f64,
    /// `sum_k d_k^2` over the layers below a plane surface.
    lack: f64,
}

impl Lattice {
    fn new(dimensions: Dimensions, radius: f64) -> Lattice {
        let reach = radius.ceil() as i32;
        let reach_z = if dimensions == Dimensions::Two { 0 } else { reach };
        // The weight of all lattice vectors that rise by so many layers.
        let rising = |layers: i32| {
            let mut sum = 0.0;
            for ix in -reach..=reach {
                for iz in -reach_z..=reach_z {
                    let point = [ix, layers, iz].map(f64::from);
                    let a = nearness(dot(point, point), radius).max(0.0);
                    sum += if point == ZERO { 0.0 } else { a * a * a };
                }
            }
            sum
        };
        let whole: f64 = (-reach..=reach).map(rising).sum();
        let lack = |depth: i32| {
            let missing: f64 = (depth + 1..=reach).map(rising).sum();
            (1.0 - missing / whole - FULL).min(0.0)
        };
        Lattice { whole, lack: (0..reach).map(|depth| lack(depth) * lack(depth)).sum() }
    }
}

/// The stage, and what each particle lacks.
#[derive(Debug)]
pub struct Lacking {
    radius_m: f64,
    /// `1 / sum_lattice W`.
    share: f64,
    /// `-6 A / (sum_lattice W re^2)`, 1/s2.
    factor: f64,
    longest_step_s: f64,
    /// `d_i`, zero or below.
    lack: Vec<f64>,
}

impl Lacking {
    pub fn new<C: CandidateSearch>(
        tension: SurfaceTension,
        parameters: &Parameters,
        state: &State<C>,
    ) -> Self {
        let (sigma, l0) = (tension.surface_tension_n_m, parameters.particle_distance_m);
        let radius_m = tension.radius_m(parameters);
        let lattice = Lattice::new(parameters.dimensions, radius_m / l0);
        let energy = 2.0 * sigma / (parameters.density_kg_m3 * l0 * lattice.lack);
        Lacking {
            radius_m,
            share: 1.0 / lattice.whole,
            factor: -6.0 * energy / (lattice.whole * radius_m * radius_m),
            longest_step_s: capillary_limit_s(sigma, parameters),
            lack: state.workers.column(state.particles.len(), 0.0),
        }
    }

    fn find<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        let (near, radius_m, share) = (state.neighborhood(), self.radius_m, self.share);
        let kind = &state.particles.kind;
        state.team().fill(Rows::new(&mut self.lack), |range, lack| {
            for (i, lack) in range.zip(lack) {
                *lack = 0.0;
                if kind[i].moves() {
                    let mut sum = 0.0;
                    near.for_each_neighbor::<T>(i, radius_m, |_, _, r| {
                        let a = nearness(r * r, radius_m);
                        sum += a * a * a;
                    });
                    *lack = (share * sum - FULL).min(0.0);
                }
            }
        });
    }

    fn pull<C: CandidateSearch, T: DistanceTest>(&self, state: &mut State<C>, broken: &FirstIndex) {
        let (lack, radius_m, factor) = (&self.lack, self.radius_m, self.factor);
        let forces = state.forces();
        let (near, kind) = (&forces.near, forces.fields.kind);
        forces.team.fill(Rows::new(forces.acceleration), |range, acceleration| {
            for (i, acceleration) in range.zip(acceleration) {
                if !kind[i].moves() {
                    continue;
                }
                let (mut sum, own): (Vec3, f64) = (ZERO, lack[i]);
                near.for_each_neighbor::<T>(i, radius_m, |j, r_ij, r| {
                    let both = own + lack[j];
                    if both < 0.0 {
                        let a = nearness(r * r, radius_m);
                        sum = add_scaled(sum, both * (a * a), r_ij);
                    }
                });
                *acceleration = add_scaled(*acceleration, factor, sum);
                if !is_finite(*acceleration) {
                    broken.record(i);
                }
            }
        });
    }
}

impl<C: CandidateSearch, T: DistanceTest> Stage<C, T> for Lacking {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh(probe)?;
        let broken = FirstIndex::default();
        within(probe, Phase::SurfaceTension, || {
            self.find::<C, T>(state);
            self.pull::<C, T>(state, &broken);
        });
        state.require_finite(&broken, Phase::SurfaceTension, "acceleration")
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.lack[..])
    }

    fn longest_step(&self, _state: &State<C>) -> Option<StepLimit> {
        Some(StepLimit { time_step_s: self.longest_step_s, reason: "the fastest capillary wave" })
    }
}
