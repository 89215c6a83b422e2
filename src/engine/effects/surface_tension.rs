//! Surface tension from the energy of particles that lack neighbours (after Kondo 2023, the attractive pressure of MPH).
//!
//! With `q = r_ij / re` and `W = (1 - q^2)^3`, `c_i = sum_j W / sum_lattice W` says how full the neighbourhood of a particle is,
//! walls and bodies counted in, and `d_i = min(c_i - b, 0)` what it lacks: nothing inside a fluid, where the share `b` leaves
//! room for disorder. The energy `E = A m / 2 sum_i d_i^2` is that of the surface, and its exact derivative the force:
//! `a_i = -(6 A / (sum_lattice W re^2)) sum_j (d_i + d_j) (1 - q^2)^2 r_ij`. Forces of a pair are opposite and central, so
//! they change neither momentum nor angular momentum, and the sum of kinetic energy and `E` stays as the steps become short.
//!
//! `A`, m2/s2, follows from a plane surface of the reference lattice, whose layers lack `d_1, d_2, ..`. Its energy for each
//! square metre, `A rho l0 sum_k d_k^2 / 2`, is `sigma`; but with the pressure gradient `transposed`, what it pulls with is.
//! There, linear motions keep their volume up to the surface: particles that a flow stretches along the surface come
//! nearer across it, and do not leave it or come to it. The pull is the energy's derivative by such a stretch, particles
//! followed, `A rho l0 sum_k d_k s_k` with `s_k = 6 / (sum_lattice W re^2) sum_missing (1 - q^2)^2 (r_x^2 - r_y^2)`, y across the
//! surface: 1.23 times the energy at the default radius in a plane (surface stress and surface energy differ by the latter's
//! derivative: Shuttleworth 1950). Particles that have settled into a surface pull by [`SETTLED`] more.
//!
//! With other gradients layers swell where the surface shrinks. The pressure in a drop is then right to some 5 %, but the
//! tension that moves its surface is 12 % too low in the mean, with a scatter of 11 % from the way particles lie.
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
use crate::engine::pressure::options::Gradient;
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Stage, State};
use crate::engine::time_step::StepLimit;

/// `b`: how full a neighbourhood inside the fluid is at least.
const FULL: f64 = 0.97;

/// The pull of a settled surface over that of the lattice's plane. A calibration: discs of 10, 20 and 30 particles' radius
/// at rest had pressures of 1.08, 1.06 and 1.06 times what the lattice alone gives; for a plane we take 1.05.
const SETTLED: f64 = 1.05;

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
    /// `sum_k d_k^2 / 2` over the layers below a plane surface.
    energy: f64,
    /// `sum_k d_k s_k` over them.
    stress: f64,
}

impl Lattice {
    fn new(dimensions: Dimensions, radius: f64) -> Lattice {
        let reach = radius.ceil() as i32;
        let reach_z = if dimensions == Dimensions::Two { 0 } else { reach };
        // Sums over all lattice vectors that rise by so many layers: of the weight, and of what a stretch makes of it.
        let rising = |layers: i32| {
            let (mut weight, mut stretch) = (0.0, 0.0);
            for ix in -reach..=reach {
                for iz in -reach_z..=reach_z {
                    let point = [ix, layers, iz].map(f64::from);
                    let a = nearness(dot(point, point), radius).max(0.0);
                    weight += if point == ZERO { 0.0 } else { a * a * a };
                    stretch += a * a * (point[0] * point[0] - point[1] * point[1]);
                }
            }
            (weight, stretch)
        };
        let whole: f64 = (-reach..=reach).map(|layers| rising(layers).0).sum();
        let (mut energy, mut stress) = (0.0, 0.0);
        for depth in 0..reach {
            let missing = (depth + 1..=reach).map(rising);
            let (weight, stretch) = missing.fold((0.0, 0.0), |sum, row| (sum.0 + row.0, sum.1 + row.1));
            let lack = (1.0 - weight / whole - FULL).min(0.0);
            energy += 0.5 * lack * lack;
            stress += lack * 6.0 / (whole * radius * radius) * stretch;
        }
        Lattice { whole, energy, stress }
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
        let transposed =
            parameters.effects.pressure.as_ref().is_some_and(|p| p.gradient == Gradient::Transposed);
        let pull = if transposed { SETTLED * lattice.stress } else { lattice.energy };
        let energy = sigma / (parameters.density_kg_m3 * l0 * pull);
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
