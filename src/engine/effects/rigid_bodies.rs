//! Rigid bodies that float, sink and fly, moved by the fluid.
//!
//! The passively moving solid of Koshizuka, Nobe & Oka 1998: a body's particles are computed as fluid through prediction
//! and pressure, with the body's own density where groups have one. Then the step's motion is replaced by the rigid one
//! with the same momentum and angular momentum. With `N` particles of equal mass at `r_i` from the centre,
//!
//! `U = sum u_i / N`, `L = sum r_i x (u_i - U)`, `W = J^-1 L` with `J = sum (r_i . r_i) 1 - r_i r_i`,
//!
//! the centre moves by `U dt`, the body turns by `W dt` at the middle of the step, `x_i = c + R r_i(0)` and
//! `u_i = U + W x r_i`. Places follow from the shape at the start, so that it keeps to rounding; in free flight so do
//! momentum and angular momentum. A fixed axis takes a component of `U` or `W` away.
//!
//! All `Kind::Body` particles of a group are one body. The bucket domain must hold it.

use std::ops::Range;

use crate::base::vec3::{Vec3, ZERO, add, add_scaled, cross, dot, scale, sub};
use crate::engine::columns::{Column, Visitor};
use crate::engine::error::SimulationError;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::Parameters;
use crate::engine::particles::{Kind, Particles};
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::rotation::Rotation;
use crate::engine::search::CandidateSearch;
use crate::engine::stage::{Stage, State};

/// What holds the bodies, by group. Bodies of groups beyond the list are free.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RigidBodies {
    pub fixed: Vec<Fixed>,
}

/// The components of a body's motion that are held at zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Fixed {
    /// Along x, y, z.
    pub translation: [bool; 3],
    /// About x, y, z.
    pub rotation: [bool; 3],
}

/// A symmetric matrix.
type Tensor = [Vec3; 3];

/// The stage.
#[derive(Debug)]
pub struct BodyMotion {
    bodies: Vec<Body>,
    /// The particles of the bodies, one body after another.
    members: Vec<u32>,
    /// Where each is from the body's centre before the body turned, metres.
    shape: Vec<Vec3>,
    center: Vec<Vec3>,
    /// `w, x, y, z` of each body's rotation.
    rotation: Vec<f64>,
}

#[derive(Debug)]
struct Body {
    range: Range<usize>,
    fixed: Fixed,
}

impl BodyMotion {
    pub fn new<C: CandidateSearch>(bodies: RigidBodies, parameters: &Parameters, state: &State<C>) -> Self {
        let particles = &state.particles;
        let mut motion = BodyMotion {
            bodies: Vec::new(),
            members: Vec::new(),
            shape: Vec::new(),
            center: Vec::new(),
            rotation: Vec::new(),
        };
        for group in 0..=u8::MAX {
            let first = motion.members.len();
            let belongs = |&i: &u32| {
                particles.kind[i as usize] == Kind::Body && particles.group_of(i as usize) == group
            };
            motion.members.extend((0..particles.len() as u32).filter(belongs));
            let range = first..motion.members.len();
            if range.is_empty() {
                continue;
            }
            let position = |&i: &u32| particles.position[i as usize];
            let center = mean(motion.members[range.clone()].iter().map(position));
            motion.shape.extend(motion.members[range.clone()].iter().map(|i| sub(position(i), center)));
            // What rounding left of the mean would drive momentum one way step after step.
            let rest = mean(motion.shape[range.clone()].iter().copied());
            motion.shape[range.clone()].iter_mut().for_each(|r| *r = sub(*r, rest));
            let mut fixed = bodies.fixed.get(group as usize).copied().unwrap_or_default();
            if parameters.dimensions == Dimensions::Two {
                fixed.translation[2] = true;
                fixed.rotation = [true, true, fixed.rotation[2]];
            }
            motion.bodies.push(Body { range, fixed });
            motion.center.push(center);
            motion.rotation.extend([1.0, 0.0, 0.0, 0.0]);
        }
        motion
    }

    /// Makes the motion of body `b` in this step rigid.
    fn project(&mut self, b: usize, dt: f64, particles: &mut Particles) {
        let Body { range, fixed } = &self.bodies[b];
        let (members, shape) = (&self.members[range.clone()], &self.shape[range.clone()]);
        let Particles { position, velocity, .. } = particles;
        let mut drift = mean(members.iter().map(|&i| velocity[i as usize]));
        let [w, x, y, z] = std::array::from_fn(|k| self.rotation[4 * b + k]);
        let before = Rotation { w, v: [x, y, z] };
        let spin = members
            .iter()
            .zip(shape)
            .fold(ZERO, |sum, (&i, &r)| add(sum, cross(before.turn(r), sub(velocity[i as usize], drift))));
        for d in (0..3).filter(|&d| fixed.translation[d]) {
            drift[d] = 0.0;
        }
        let rate = |rotation: Rotation| solve(inertia(shape, rotation), spin, fixed.rotation);
        let middle = Rotation::by(scale(0.5 * dt, rate(before))).after(before);
        let after = Rotation::by(scale(dt, rate(middle))).after(before);
        let turning = rate(after);
        self.center[b] = add_scaled(self.center[b], dt, drift);
        let Rotation { w, v } = after;
        self.rotation[4 * b..4 * b + 4].copy_from_slice(&[w, v[0], v[1], v[2]]);
        for (&i, &r) in members.iter().zip(shape) {
            let r = after.turn(r);
            position[i as usize] = add(self.center[b], r);
            velocity[i as usize] = add(drift, cross(turning, r));
        }
    }
}

/// Divided, not multiplied by an inverse whose rounding would drive momentum one way step after step.
fn mean(vectors: impl ExactSizeIterator<Item = Vec3>) -> Vec3 {
    let count = vectors.len() as f64;
    vectors.fold(ZERO, add).map(|sum| sum / count)
}

/// `J` of a shape that has been turned, in units of a particle's mass.
fn inertia(shape: &[Vec3], rotation: Rotation) -> Tensor {
    let mut sum = [ZERO; 3];
    for &r in shape {
        let r = rotation.turn(r);
        for d in 0..3 {
            sum[d] = add_scaled(sum[d], -r[d], r);
            sum[d][d] += dot(r, r);
        }
    }
    sum
}

/// `W` with `J W = L` along the axes that are not fixed, and zero along the others. Elimination with full pivoting; a
/// direction about which there is nothing to turn, as along a rod, keeps a rate of zero.
fn solve(inertia: Tensor, spin: Vec3, fixed: [bool; 3]) -> Vec3 {
    let (mut a, mut b, mut open) = (inertia, spin, fixed.map(|fixed| !fixed));
    let nothing = 1e-12 * (inertia[0][0] + inertia[1][1] + inertia[2][2]);
    let (mut pivots, mut count) = ([0; 3], 0);
    while let Some(p) = (0..3).filter(|&d| open[d]).max_by(|&d, &e| a[d][d].total_cmp(&a[e][e])) {
        if a[p][p] <= nothing {
            break;
        }
        open[p] = false;
        pivots[count] = p;
        count += 1;
        for d in (0..3).filter(|&d| open[d]) {
            let factor = a[d][p] / a[p][p];
            a[d] = add_scaled(a[d], -factor, a[p]);
            b[d] -= factor * b[p];
        }
    }
    let mut rate = ZERO;
    for &p in pivots[..count].iter().rev() {
        let others: f64 = (0..3).filter(|&d| d != p).map(|d| a[p][d] * rate[d]).sum();
        rate[p] = (b[p] - others) / a[p][p];
    }
    rate
}

impl<C: CandidateSearch, T> Stage<C, T> for BodyMotion {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        within(probe, Phase::RigidBodies, || {
            for b in 0..self.bodies.len() {
                self.project(b, state.time_step_s, &mut state.particles);
            }
            state.positions_changed();
        });
        Ok(())
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.members[..]) + size_of_val(&self.shape[..])
    }

    fn visit(&mut self, visitor: &mut Visitor<'_>) {
        visitor("body_shape", Column::Vectors(&mut self.shape));
        visitor("body_center", Column::Vectors(&mut self.center));
        visitor("body_rotation", Column::Scalars(&mut self.rotation));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_follow_from_angular_momentum_also_where_nothing_resists() {
        let block = [[1.0, 0.2, 0.0], [-1.0, 0.1, 0.3], [0.4, -0.6, 0.2], [-0.4, 0.3, -0.5]];
        let (tensor, rate) = (inertia(&block, Rotation::NONE), [0.3, -0.7, 1.1]);
        let spin = tensor.map(|row| dot(row, rate));
        let found = solve(tensor, spin, [false; 3]);
        assert!(dot(sub(found, rate), sub(found, rate)) < 1e-28, "{found:?}");
        let rod = inertia(&[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], Rotation::NONE);
        assert_eq!(solve(rod, [0.0, 2.0, 4.0], [false; 3]), [0.0, 1.0, 2.0]);
        assert_eq!(solve(rod, [0.0, 2.0, 4.0], [true, true, false]), [0.0, 0.0, 2.0]);
        assert_eq!(solve(inertia(&[ZERO], Rotation::NONE), ZERO, [false; 3]), ZERO);
    }
}
