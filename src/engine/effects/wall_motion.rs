//! Walls that move as the scene says: pistons, rocking tanks, turning drums.
//!
//! Before anything else in a step the wall particles of a moving group go to their places at its end, `x(t + dt)`, and
//! carry `u = (x(t + dt) - x(t)) / dt`, which viscosity, collisions and wall contact see. Places follow from those at the
//! start and from time alone, `x(t) = p + d(t) + R(t) (x(0) - p)`, so that they do not drift. Motions begin at rest in
//! place: `d(0) = 0`, `R(0) = 1`.
//!
//! A wall that leaves the bucket domain is gone, as fluid is: the domain's margin must hold the motion. Steps should keep a
//! wall's way in one below about a tenth of the particle distance.

use std::f64::consts::TAU;

use crate::base::parallel::Rows;
use crate::base::vec3::{Vec3, ZERO, add, scale, sub};
use crate::engine::columns::{Column, Visitor};
use crate::engine::curve::Curve;
use crate::engine::error::SimulationError;
use crate::engine::particles::{Kind, Particles};
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::rotation::Rotation;
use crate::engine::search::CandidateSearch;
use crate::engine::stage::{Stage, State};

/// The motion of each group's walls; `None` for those at rest.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WallMotion {
    pub by_group: Vec<Option<Motion>>,
}

/// How the walls of a group move.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// `d = amplitude s(t) (sin(2 pi f t + phase) - sin(phase))`.
    Oscillation { amplitude_m: Vec3, frequency_hz: f64, phase_rad: f64, ramp_s: f64 },
    /// Rotation about the hinge by `amplitude s(t) (sin(2 pi f t + phase) - sin(phase))`.
    Rocking { hinge: Hinge, amplitude_rad: f64, frequency_hz: f64, phase_rad: f64, ramp_s: f64 },
    /// Rotation about the hinge at a rate that grows in proportion to time until `ramp_s` and stays.
    Turning { hinge: Hinge, rate_rad_s: f64, ramp_s: f64 },
    /// Displacement in metres and rotation about the hinge in radians over time, less those of the first point.
    Table { hinge: Hinge, curve: Curve<4> },
}

/// An axis in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinge {
    /// A point on it, metres.
    pub point_m: Vec3,
    /// Of unit length.
    pub axis: Vec3,
}

/// Where a group is: displaced, and turned about a point that is displaced with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    pub point_m: Vec3,
    pub displacement_m: Vec3,
    pub rotation: Rotation,
}

/// The share `s` of the full amplitude: from 0 to 1 without a kink, `3 q^2 - 2 q^3` with `q = t / ramp`.
fn ramp(time_s: f64, ramp_s: f64) -> f64 {
    if time_s >= ramp_s {
        return 1.0;
    }
    let q = time_s / ramp_s;
    q * q * (3.0 - 2.0 * q)
}

fn swing(time_s: f64, frequency_hz: f64, phase_rad: f64, ramp_s: f64) -> f64 {
    ramp(time_s, ramp_s) * ((TAU * frequency_hz * time_s + phase_rad).sin() - phase_rad.sin())
}

impl Motion {
    /// Where the group is at a time from 0 on, seconds.
    pub fn pose(&self, time_s: f64) -> Pose {
        let turned = |hinge: &Hinge, angle: f64, displacement_m: Vec3| Pose {
            point_m: hinge.point_m,
            displacement_m,
            rotation: Rotation::about(hinge.axis, angle),
        };
        match self {
            Motion::Oscillation { amplitude_m, frequency_hz, phase_rad, ramp_s } => {
                let share = swing(time_s, *frequency_hz, *phase_rad, *ramp_s);
                Pose { point_m: ZERO, displacement_m: scale(share, *amplitude_m), rotation: Rotation::NONE }
            }
            Motion::Rocking { hinge, amplitude_rad, frequency_hz, phase_rad, ramp_s } => {
                turned(hinge, amplitude_rad * swing(time_s, *frequency_hz, *phase_rad, *ramp_s), ZERO)
            }
            Motion::Turning { hinge, rate_rad_s, ramp_s } => {
                let turned_for_s = match time_s < *ramp_s {
                    true => 0.5 * time_s * time_s / ramp_s,
                    false => time_s - 0.5 * ramp_s,
                };
                turned(hinge, rate_rad_s * turned_for_s, ZERO)
            }
            Motion::Table { hinge, curve } => {
                let (now, first) = (curve.at(time_s), curve.value[0]);
                let [x, y, z, angle] = std::array::from_fn(|k| now[k] - first[k]);
                turned(hinge, angle, [x, y, z])
            }
        }
    }
}

impl Pose {
    /// Where a particle of the group is, by its place at the start.
    pub fn place(&self, origin: Vec3) -> Vec3 {
        if self.rotation == Rotation::NONE {
            return add(origin, self.displacement_m);
        }
        let turned = self.rotation.turn(sub(origin, self.point_m));
        add(add(self.point_m, self.displacement_m), turned)
    }

    /// Which place at the start is here now.
    pub fn origin(&self, place: Vec3) -> Vec3 {
        let moved = sub(place, self.displacement_m);
        if self.rotation == Rotation::NONE {
            return moved;
        }
        add(self.point_m, self.rotation.inverse().turn(sub(moved, self.point_m)))
    }
}

/// The stage: where the walls were at the start.
#[derive(Debug)]
pub struct WallMotions {
    motion: WallMotion,
    /// Places at time zero; not read for particles that are not moved.
    origin: Vec<Vec3>,
    /// Of each group at the end of the step under way.
    pose: Vec<Option<Pose>>,
}

impl WallMotions {
    pub fn new<C: CandidateSearch>(motion: WallMotion, time_s: f64, state: &State<C>) -> Self {
        let mut origin = state.particles.position.clone();
        let pose: Vec<_> = motion.by_group.iter().map(|m| m.as_ref().map(|m| m.pose(time_s))).collect();
        if time_s > 0.0 {
            for (i, x) in origin.iter_mut().enumerate() {
                if let Some(Some(pose)) = pose.get(state.particles.group_of(i) as usize) {
                    *x = pose.origin(*x);
                }
            }
        }
        WallMotions { motion, origin, pose }
    }
}

impl<C: CandidateSearch, T> Stage<C, T> for WallMotions {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        within(probe, Phase::WallMotion, || {
            let (dt, end_s) = (state.time_step_s, state.time_s + state.time_step_s);
            for (pose, motion) in self.pose.iter_mut().zip(&self.motion.by_group) {
                *pose = motion.as_ref().map(|motion| motion.pose(end_s));
            }
            let Particles { kind, group, position, velocity, .. } = &mut state.particles;
            let (origin, pose) = (&self.origin, &self.pose);
            let columns = (Rows::new(position), Rows::new(velocity));
            state.workers.scheduled().fill(columns, |range, (position, velocity)| {
                for (k, i) in range.enumerate() {
                    let group = group.get(i).copied().unwrap_or(0);
                    if let (Kind::Wall | Kind::DummyWall, Some(Some(pose))) =
                        (kind[i], pose.get(group as usize))
                    {
                        let place = pose.place(origin[i]);
                        velocity[k] = scale(1.0 / dt, sub(place, position[k]));
                        position[k] = place;
                    }
                }
            });
            state.walls_moved = true;
            state.positions_changed();
        });
        Ok(())
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.origin[..]) + size_of_val(&self.pose[..])
    }

    fn visit(&mut self, visitor: &mut Visitor<'_>) {
        visitor("wall_origin", Column::Vectors(&mut self.origin));
    }
}
