//! Particle shifting: after the step's motion, particles move from where they crowd to where they are sparse.
//!
//! Fluid that follows a flow exactly gathers along stream lines and leaves voids beside them. Shifting moves each particle
//! by `dx_i = -A dt u_i c_i`, at most `limit l0`, with `c_i = (l0 D / n0) sum_j r_ij w(r_ij, re_n) / r_ij^2`, the
//! dimensionless gradient of the concentration of particles, and `u_i = max_j |u_j - u_i|` over the neighbours within
//! `re_n`, walls among them. Fick's law as in Lind et al. 2012 and Skillen et al. 2013, with their `A h |u| dt grad C`; the
//! speed is the neighbours' relative one, so that nothing shifts in a fluid at rest or in one that moves as a whole, and
//! where steps are shorter shifts are shorter in proportion.
//!
//! Near the free surface the gradient of the concentration points out of the fluid, and shifting would make it spread. A
//! particle is on the surface if `n_i < 0.97 n0` and `|sum w r_ij| > 0.2 l0 n_i`, and near it if such a one is its
//! neighbour. There nothing shifts, or only along the surface: `dx -= (dx . m) m` with the unit vector `m` along the sum of
//! `sum w r_ij` of the surface particles around (after Khayyer et al. 2017).
//!
//! Fields are carried along to first order, `u_i += (D / n0) sum_j (u_j - u_i) (dx_i . r_ij) w / r_ij^2`, and so are
//! temperature and concentration, from fluid neighbours alone.

use crate::base::parallel::{FirstIndex, Rows};
use crate::base::vec3::{Vec3, ZERO, add, add_scaled, dot, is_finite, scale, sub};
use crate::engine::error::SimulationError;
use crate::engine::kernel::weight;
use crate::engine::parameters::Parameters;
use crate::engine::particles::{Kind, Particles};
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::{Stage, State};

/// Share of `n0` and asymmetry over `l0` that tell a surface particle.
const SURFACE: (f64, f64) = (0.97, 0.2);
/// Pairs closer than this, in particle distances, count as that far apart.
const FLOOR: f64 = 0.5;

/// How particles shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shifting {
    /// `A`.
    pub strength: f64,
    /// Largest displacement in a step, in particle distances.
    pub limit: f64,
    pub at_surface: AtSurface,
}

/// What happens near a free surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AtSurface {
    /// Nothing shifts.
    #[default]
    None,
    /// Only along the surface.
    Tangential,
}

/// The stage and its columns.
#[derive(Debug)]
pub struct Shifts {
    shifting: Shifting,
    radius_m: f64,
    floor_m: f64,
    l0_m: f64,
    /// `D / n0`.
    factor: f64,
    n0: f64,
    /// Metres.
    shift: Vec<Vec3>,
    /// `sum w r_ij` of surface particles, metres; zero for all others.
    outward: Vec<Vec3>,
    /// What a field changes by: of velocities and of one scalar.
    change: Vec<Vec3>,
    scalar_change: Vec<f64>,
}

impl Shifts {
    pub fn new<C: CandidateSearch>(shifting: Shifting, parameters: &Parameters, state: &State<C>) -> Self {
        let (radius_m, l0_m) = (parameters.number_density_radius_m(), parameters.particle_distance_m);
        let n0 = parameters.reference(radius_m).number_density;
        let count = state.particles.len();
        let scalars = state.particles.temperature.len().max(state.particles.concentration.len());
        Shifts {
            shifting,
            radius_m,
            floor_m: FLOOR * l0_m,
            l0_m,
            factor: parameters.dimensions.count() / n0,
            n0,
            shift: state.workers.column(count, ZERO),
            outward: state.workers.column(count, ZERO),
            change: state.workers.column(count, ZERO),
            scalar_change: state.workers.column(scalars, 0.0),
        }
    }

    /// Weight of a pair in sums of `r_ij / r_ij^2`, 1/m2.
    #[inline(always)]
    fn pair(&self, r: f64) -> f64 {
        let r = r.max(self.floor_m);
        weight(r, self.radius_m) / (r * r)
    }

    /// Shifts as if there were no surface, and who is on it.
    fn find<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        let (mut shift, mut outward) = (std::mem::take(&mut self.shift), std::mem::take(&mut self.outward));
        let Particles { kind, velocity, .. } = &state.particles;
        let near = state.neighborhood();
        state.team().fill((Rows::new(&mut shift), Rows::new(&mut outward)), |range, (shift, outward)| {
            for (k, i) in range.enumerate() {
                (shift[k], outward[k]) = (ZERO, ZERO);
                if kind[i] != Kind::Fluid {
                    continue;
                }
                let (mut crowding, mut moment, mut n, mut speed2) = (ZERO, ZERO, 0.0, 0.0f64);
                near.for_each_neighbor::<T>(i, self.radius_m, |j, r_ij, r| {
                    let (w, u_ij) =
                        (weight(r.max(self.floor_m), self.radius_m), sub(velocity[j], velocity[i]));
                    crowding = add_scaled(crowding, self.pair(r), r_ij);
                    moment = add_scaled(moment, w, r_ij);
                    n += w;
                    speed2 = speed2.max(dot(u_ij, u_ij));
                });
                if n < SURFACE.0 * self.n0 && dot(moment, moment).sqrt() > SURFACE.1 * self.l0_m * n {
                    outward[k] = moment;
                }
                let way =
                    self.shifting.strength * state.time_step_s * speed2.sqrt() * self.l0_m * self.factor;
                shift[k] = self.limited(scale(-way, crowding));
            }
        });
        (self.shift, self.outward) = (shift, outward);
    }

    fn limited(&self, shift: Vec3) -> Vec3 {
        let (length, most) = (dot(shift, shift).sqrt(), self.shifting.limit * self.l0_m);
        if length > most { scale(most / length, shift) } else { shift }
    }

    /// Takes back what would carry the surface away.
    fn spare_surface<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        let (near, kind, outward) = (state.neighborhood(), &state.particles.kind, &self.outward);
        let (radius_m, at_surface) = (self.radius_m, self.shifting.at_surface);
        state.team().fill(Rows::new(&mut self.shift), |range, shift| {
            for (i, shift) in range.zip(shift) {
                if kind[i] != Kind::Fluid {
                    continue;
                }
                let mut normal = outward[i];
                near.for_each_neighbor::<T>(i, radius_m, |j, _, _| normal = add(normal, outward[j]));
                let length2 = dot(normal, normal);
                if length2 > 0.0 {
                    *shift = match at_surface {
                        AtSurface::None => ZERO,
                        AtSurface::Tangential => add_scaled(*shift, -dot(*shift, normal) / length2, normal),
                    };
                }
            }
        });
    }

    /// What velocities are at the new places.
    fn carry_velocity<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        state: &mut State<C>,
        broken: &FirstIndex,
    ) {
        let mut change = std::mem::take(&mut self.change);
        let (near, velocity) = (state.neighborhood(), &state.particles.velocity);
        state.team().fill(Rows::new(&mut change), |range, change| {
            for (i, change) in range.zip(change) {
                let (shift, mut sum) = (self.shift[i], ZERO);
                if shift != ZERO {
                    near.for_each_neighbor::<T>(i, self.radius_m, |j, r_ij, r| {
                        let u_ij = sub(velocity[j], velocity[i]);
                        sum = add_scaled(sum, dot(shift, r_ij) * self.pair(r), u_ij);
                    });
                }
                *change = scale(self.factor, sum);
                if !is_finite(add(*change, shift)) {
                    broken.record(i);
                }
            }
        });
        self.change = change;
    }

    /// Carries a scalar field along.
    fn carry_scalar<C: CandidateSearch, T: DistanceTest>(
        &mut self,
        column: impl Fn(&mut Particles) -> &mut Vec<f64>,
        state: &mut State<C>,
    ) {
        let mut values = std::mem::take(column(&mut state.particles));
        let mut change = std::mem::take(&mut self.scalar_change);
        if !values.is_empty() {
            let (near, kind, field) = (state.neighborhood(), &state.particles.kind, &values);
            state.team().fill(Rows::new(&mut change), |range, change| {
                for (i, change) in range.zip(change) {
                    let (shift, mut sum) = (self.shift[i], 0.0);
                    if shift != ZERO {
                        near.for_each_neighbor::<T>(i, self.radius_m, |j, r_ij, r| {
                            if kind[j] == Kind::Fluid {
                                sum += (field[j] - field[i]) * (dot(shift, r_ij) * self.pair(r));
                            }
                        });
                    }
                    *change = self.factor * sum;
                }
            });
            for (value, change) in values.iter_mut().zip(&change) {
                *value += change;
            }
        }
        self.scalar_change = change;
        *column(&mut state.particles) = values;
    }

    fn apply<C: CandidateSearch>(&self, state: &mut State<C>) {
        let Particles { kind, position, velocity, .. } = &mut state.particles;
        let (shift, change) = (&self.shift, &self.change);
        let columns = (Rows::new(position), Rows::new(velocity));
        state.workers.scheduled().fill(columns, |range, (position, velocity)| {
            for (k, i) in range.enumerate() {
                if kind[i] == Kind::Fluid {
                    position[k] = add(position[k], shift[i]);
                    velocity[k] = add(velocity[k], change[i]);
                }
            }
        });
        state.positions_changed();
    }
}

impl<C: CandidateSearch, T: DistanceTest> Stage<C, T> for Shifts {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        state.refresh(probe)?;
        within(probe, Phase::Shifting, || {
            let broken = FirstIndex::default();
            self.find::<C, T>(state);
            self.spare_surface::<C, T>(state);
            self.carry_velocity::<C, T>(state, &broken);
            state.require_finite(&broken, Phase::Shifting, "shift")?;
            self.carry_scalar::<C, T>(|particles| &mut particles.temperature, state);
            self.carry_scalar::<C, T>(|particles| &mut particles.concentration, state);
            self.apply(state);
            Ok(())
        })
    }

    fn bytes(&self) -> usize {
        [&self.shift, &self.outward, &self.change].iter().map(|c| size_of_val(&c[..])).sum::<usize>()
            + size_of_val(&self.scalar_change[..])
    }
}
