//! Viscosity, explicit in time: `a_i += sum_j c(r_ij) nu_ij (u_j - u_i)`, in either form of `engine::viscous`.
//!
//! Every other particle within `re_L` takes part, dummy walls too. Stable while `nu dt` stays below `lambda / (2 D)`; half
//! of that is usual.

use crate::base::vec3::{Vec3, add, add_scaled, sub};
use crate::engine::parameters::{Parameters, Property};
use crate::engine::particles::Particles;
use crate::engine::stage::Fields;
use crate::engine::terms::{Pair, PairTerm, Rates};
use crate::engine::time_step::StepLimit;
use crate::engine::viscous::{Form, PairForce, Viscosities, Walls};

/// A viscous fluid.
#[derive(Debug, Clone, PartialEq)]
pub struct Viscosity {
    /// `nu`, square metres per second.
    pub kinematic_viscosity_m2_s: Property,
    pub walls: Walls,
    pub form: Form,
}

impl Viscosity {
    /// The textbook's: the same everywhere, Laplacian form, walls that rest.
    pub fn uniform(kinematic_viscosity_m2_s: f64) -> Self {
        let kinematic_viscosity_m2_s = Property::Uniform(kinematic_viscosity_m2_s);
        Viscosity { kinematic_viscosity_m2_s, walls: Walls::default(), form: Form::default() }
    }

    /// Whether it is of that kind.
    pub fn is_the_textbooks(&self) -> bool {
        let uniform = self.kinematic_viscosity_m2_s.uniform();
        uniform.is_some() && self.walls == Walls::default() && self.form == Form::default()
    }
}

/// The term of a viscosity that is the same everywhere in the Laplacian form, its constant worked out once:
/// `a_i += nu 2D / (n0_L lambda) sum_j (u_j - u_i) w(r_ij, re_L)` (Koshizuka & Oka 1996).
#[derive(Debug, Clone, Copy)]
pub struct ExplicitViscosity {
    /// `nu 2D / (n0_L lambda)`, 1/s.
    pub factor: f64,
    longest_step_s: f64,
}

impl ExplicitViscosity {
    pub fn new(kinematic_viscosity_m2_s: f64, parameters: &Parameters) -> Self {
        let force = PairForce::new(Form::Laplacian, parameters);
        ExplicitViscosity {
            factor: kinematic_viscosity_m2_s * parameters.laplacian_factor(),
            longest_step_s: force.longest_step_s(kinematic_viscosity_m2_s),
        }
    }
}

impl PairTerm for ExplicitViscosity {
    type Sum = Vec3;

    #[inline(always)]
    fn add(&self, sum: &mut Vec3, pair: &Pair, fields: &Fields<'_>) {
        *sum = add_scaled(*sum, pair.w, sub(fields.velocity[pair.j], fields.velocity[pair.i]));
    }

    #[inline(always)]
    fn finish(&self, sum: Vec3, _i: usize, _fields: &Fields<'_>, rates: &mut Rates<'_>) {
        *rates.acceleration = add_scaled(*rates.acceleration, self.factor, sum);
    }

    fn longest_step(&self, _particles: &Particles) -> Option<StepLimit> {
        limit(self.longest_step_s)
    }
}

/// The term of every other viscosity: one that differs between particles, or the angular-momentum form.
#[derive(Debug, Clone, Copy)]
pub struct PairViscosity {
    force: PairForce,
    uniform_m2_s: f64,
}

impl PairViscosity {
    /// `uniform_m2_s` counts where the particles have no viscosities of their own.
    pub fn new(form: Form, uniform_m2_s: f64, parameters: &Parameters) -> Self {
        PairViscosity { force: PairForce::new(form, parameters), uniform_m2_s }
    }

    #[inline(always)]
    fn viscosities<'a>(&self, of_particle: &'a [f64]) -> Viscosities<'a> {
        Viscosities { uniform_m2_s: self.uniform_m2_s, of_particle }
    }
}

impl PairTerm for PairViscosity {
    type Sum = Vec3;

    #[inline(always)]
    fn add(&self, sum: &mut Vec3, pair: &Pair, fields: &Fields<'_>) {
        let &Pair { i, j, r_ij, r, w } = pair;
        let viscosities = self.viscosities(fields.viscosity);
        let own = viscosities.of(i);
        let between = if fields.kind[j].moves() { viscosities.between(own, j) } else { own };
        let part = self.force.part(sub(fields.velocity[j], fields.velocity[i]), r_ij, r);
        *sum = add_scaled(*sum, between * self.force.coefficient(r, w), part);
    }

    #[inline(always)]
    fn finish(&self, sum: Vec3, _i: usize, _fields: &Fields<'_>, rates: &mut Rates<'_>) {
        *rates.acceleration = add(*rates.acceleration, sum);
    }

    fn longest_step(&self, particles: &Particles) -> Option<StepLimit> {
        // Only of what moves: the column tells nothing about walls.
        let moving = particles.viscosity.iter().zip(&particles.kind).filter(|(_, kind)| kind.moves());
        let largest = moving.map(|(&nu, _)| nu).reduce(f64::max).unwrap_or(self.uniform_m2_s);
        limit(self.force.longest_step_s(largest))
    }
}

fn limit(time_step_s: f64) -> Option<StepLimit> {
    let reason = "the stability of explicit viscosity (`effects.implicit_viscosity` has no such limit)";
    time_step_s.is_finite().then_some(StepLimit { time_step_s, reason })
}
