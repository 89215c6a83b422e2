//! The system of one step, `A d = b` with `A = I - dt nu L`: a row of three components a particle.
//!
//! `A x = x - L x` and `b = L u*` are sums over pairs, `(L x)_i = sum_j c_ij (x_j - x_i)` or
//! `sum_j s_ij (s_ij . (x_j - x_i))` with `s_ij = sqrt(c_ij) r_ij / r`. Particles that do not move have an empty row: there
//! `d = 0`, and `u*` is the wall's velocity. A pair with a mirrored wall has the wall's nearest surface particle as `j`.

use crate::base::parallel::Rows;
use crate::base::vec3::{Vec3, ZERO, add_scaled, dot, scale, sub};
use crate::engine::kernel::weight;
use crate::engine::parameters::Parameters;
use crate::engine::pressure::matrix::{RowWriter, SparseMatrix, Storage};
use crate::engine::search::{CandidateSearch, DistanceTest};
use crate::engine::stage::State;
use crate::engine::viscous::{Form, PairForce, Viscosities, Walls};
use crate::engine::wall_mirror::WallMirror;

#[derive(Debug)]
pub struct System {
    force: PairForce,
    uniform_m2_s: f64,
    mirror: Option<WallMirror>,
    /// Of each pair `c_ij` or, one after another, the components of `s_ij`. The diagonal is `A`'s mean over components.
    pairs: SparseMatrix,
    /// `u* = u + dt a`, metres per second.
    pub before: Vec<Vec3>,
    /// `1 / D`.
    per_component: f64,
}

impl System {
    pub fn new(
        form: Form,
        walls: Walls,
        uniform_m2_s: f64,
        parameters: &Parameters,
        storage: Storage,
    ) -> Self {
        let neighbors = parameters.reference(parameters.laplacian_radius_m()).neighbors;
        let entries = if form == Form::Laplacian { 1 } else { 3 };
        System {
            force: PairForce::new(form, parameters),
            uniform_m2_s,
            mirror: (walls == Walls::Mirrored).then(|| WallMirror::new(parameters)),
            pairs: SparseMatrix::new(storage, neighbors * entries),
            before: Vec::new(),
            per_component: 1.0 / parameters.dimensions.count(),
        }
    }

    /// Takes up the pairs and the velocities of a state whose buckets are fresh.
    pub fn assemble<C: CandidateSearch, T: DistanceTest>(&mut self, state: &State<C>) {
        if let Some(mirror) = &mut self.mirror {
            mirror.refresh::<C, T>(state);
        }
        self.advance_velocities(state);
        let System { force, uniform_m2_s, mirror, per_component, .. } = self;
        let (force, per_component, mirror) = (*force, *per_component, mirror.as_ref());
        let (kind, dt) = (&state.particles.kind, state.time_step_s);
        let viscosities =
            Viscosities { uniform_m2_s: *uniform_m2_s, of_particle: &state.particles.viscosity };
        self.pairs.assemble(state.particles.len(), &state.workers, |i, entries| {
            let mut diagonal = 1.0;
            if !kind[i].moves() {
                return diagonal;
            }
            let own = viscosities.of(i);
            state.neighborhood().for_each_neighbor::<T>(i, force.radius_m, |j, r_ij, r| {
                let w = weight(r, force.radius_m);
                let (mut target, mut between, mut times) = (j, own, 1.0);
                if kind[j].moves() {
                    between = viscosities.between(own, j);
                } else if let Some((mirror, behind)) = mirror.and_then(|m| Some((m, m.surface_of(j)?))) {
                    (target, times) = (behind.nearest as usize, 1.0 + mirror.steepness(behind, r_ij));
                }
                let c = dt * (between * force.coefficient(r, w)) * times;
                push(entries, force.form, target as u32, c, r_ij, r);
                diagonal += if force.form == Form::Laplacian { c } else { per_component * c };
            });
            diagonal
        });
    }

    /// `u* = u + dt a` of what moves, `u` of all others.
    fn advance_velocities<C: CandidateSearch>(&mut self, state: &State<C>) {
        let particles = &state.particles;
        self.before.resize(particles.len(), ZERO);
        state.workers.shared_evenly().fill(Rows::new(&mut self.before), |range, before| {
            for (i, before) in range.zip(before) {
                let dt = if particles.kind[i].moves() { state.time_step_s } else { 0.0 };
                *before = add_scaled(particles.velocity[i], dt, particles.acceleration[i]);
            }
        });
    }

    pub fn rows(&self) -> usize {
        self.before.len()
    }

    /// `(L x)_i`.
    #[inline]
    pub fn pull(&self, i: usize, x: &[Vec3]) -> Vec3 {
        let (columns, values) = self.pairs.row(i);
        let here = x[i];
        match self.force.form {
            Form::Laplacian => columns
                .iter()
                .zip(values)
                .fold(ZERO, |sum, (&j, &c)| add_scaled(sum, c, sub(x[j as usize], here))),
            Form::AngularMomentum => {
                let pairs = columns.as_chunks::<3>().0.iter().zip(values.as_chunks::<3>().0);
                pairs.fold(ZERO, |sum, (&[j, ..], &s)| add_scaled(sum, dot(s, sub(x[j as usize], here)), s))
            }
        }
    }

    /// `(A x)_i`.
    #[inline]
    pub fn product(&self, i: usize, x: &[Vec3]) -> Vec3 {
        sub(x[i], self.pull(i, x))
    }

    /// The preconditioner: `x_i` over the diagonal of row `i`.
    #[inline]
    pub fn precondition(&self, i: usize, x: Vec3) -> Vec3 {
        scale(1.0 / self.pairs.diagonal[i], x)
    }

    pub fn bytes(&self) -> usize {
        self.pairs.bytes() + size_of_val(&self.before[..]) + self.mirror.as_ref().map_or(0, WallMirror::bytes)
    }
}

#[inline(always)]
fn push(entries: &mut RowWriter<'_>, form: Form, target: u32, c: f64, r_ij: Vec3, r: f64) {
    match form {
        Form::Laplacian => entries.push(target, c),
        Form::AngularMomentum => {
            for s in scale(c.sqrt() / r, r_ij) {
                entries.push(target, s);
            }
        }
    }
}
