//! The frame of the scene: a tank that is shaken or turns, seen from the tank.
//!
//! `a_i -= a_frame(t) + dW/dt x r + W x (W x r) + 2 W x u`, with `r = x_i - point` and `W` the rotation vector: the
//! accelerations of a frame that moves and turns (any textbook of mechanics). `a_frame` is a sum of harmonics
//! `A sin(2 pi f t + phase)` and of a table, at the time at which the step starts. `W` stands, or grows in proportion to
//! time until `spin_up_s`. Positions and velocities are those that the frame sees; walls at rest turn with it.
//!
//! All terms but the last are explicit. The last one, Coriolis', takes the mean of the velocities before and after, all
//! other accelerations of the predictor counted in: with `(1 + dt W x) y = a - 2 W x u` the acceleration is `y`, in closed
//! form `y = (b + w (w . b) - w x b) / (1 + w^2)` for `w = dt W`. So it turns velocities without adding to their length,
//! however long the step is.
//!
//! In a plane, z = 0, only what lies in the plane counts: a cup that turns about y is a slice through its axis, whose
//! centrifugal acceleration is that of the cup and whose Coriolis acceleration, out of the plane, is none.

use std::f64::consts::TAU;

use crate::base::parallel::Rows;
use crate::base::vec3::{Vec3, ZERO, add, add_scaled, cross, dot, scale, sub};
use crate::engine::curve::Curve;
use crate::engine::error::SimulationError;
use crate::engine::kernel::Dimensions;
use crate::engine::phase::{Phase, Probe, within};
use crate::engine::search::CandidateSearch;
use crate::engine::stage::{Forces, Stage, State};

/// How the frame moves.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    /// `W`, radians per second.
    pub angular_velocity_rad_s: Vec3,
    /// How long the rotation takes to get going; zero where it is there from the start.
    pub spin_up_s: f64,
    /// A point on the axis, metres.
    pub point_m: Vec3,
    pub harmonics: Vec<Harmonic>,
    /// Acceleration of the frame over time, metres per second squared.
    pub table: Option<Curve<3>>,
}

/// An acceleration of the frame, `A sin(2 pi f t + phase)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    /// `A`, metres per second squared.
    pub amplitude_m_s2: Vec3,
    /// `f`, 1/s.
    pub frequency_hz: f64,
    pub phase_rad: f64,
}

impl Frame {
    /// `a_frame`, metres per second squared.
    pub fn acceleration(&self, time_s: f64) -> Vec3 {
        let table = self.table.as_ref().map_or(ZERO, |table| table.at(time_s));
        self.harmonics.iter().fold(table, |sum, harmonic| {
            let angle = TAU * harmonic.frequency_hz * time_s + harmonic.phase_rad;
            add_scaled(sum, angle.sin(), harmonic.amplitude_m_s2)
        })
    }

    /// `W` and `dW/dt`.
    pub fn rotation(&self, time_s: f64) -> (Vec3, Vec3) {
        if time_s >= self.spin_up_s {
            return (self.angular_velocity_rad_s, ZERO);
        }
        let rate = scale(1.0 / self.spin_up_s, self.angular_velocity_rad_s);
        (scale(time_s, rate), rate)
    }
}

/// The stage.
#[derive(Debug)]
pub struct FrameAcceleration {
    pub frame: Frame,
    pub dimensions: Dimensions,
}

impl<C: CandidateSearch, T> Stage<C, T> for FrameAcceleration {
    fn run(&mut self, state: &mut State<C>, probe: &mut dyn Probe) -> Result<(), SimulationError> {
        within(probe, Phase::Frame, || {
            let (time_s, dt) = (state.time_s, state.time_step_s);
            let ((omega, spin_up), translation) =
                (self.frame.rotation(time_s), self.frame.acceleration(time_s));
            let plane = self.dimensions == Dimensions::Two;
            // Coriolis' acceleration by the axis' components in the plane is out of the plane.
            let coriolis = if plane { [0.0, 0.0, omega[2]] } else { omega };
            let (w, point_m) = (scale(dt, coriolis), self.frame.point_m);
            let Forces { near, fields, acceleration, team, .. } = state.forces();
            team.fill(Rows::new(acceleration), |range, acceleration| {
                for (i, a) in range.zip(acceleration) {
                    if !fields.kind[i].moves() {
                        continue;
                    }
                    let (r, u) = (sub(near.positions[i], point_m), fields.velocity[i]);
                    let turning = add(cross(spin_up, r), cross(omega, cross(omega, r)));
                    let b = sub(sub(*a, add(translation, turning)), scale(2.0, cross(coriolis, u)));
                    let y = sub(add_scaled(b, dot(w, b), w), cross(w, b));
                    *a = scale(1.0 / (1.0 + dot(w, w)), y);
                    if plane {
                        a[2] = 0.0;
                    }
                }
            });
        });
        Ok(())
    }

    fn bytes(&self) -> usize {
        let table =
            self.frame.table.as_ref().map_or(0, |t| size_of_val(&t.time_s[..]) + size_of_val(&t.value[..]));
        size_of_val(&self.frame.harmonics[..]) + table
    }
}
