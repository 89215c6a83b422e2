//! How long the next step may be, and whether the last one went too far.

use crate::base::vec3::{Vec3, dot, sub};
use crate::engine::columns::{Column, SavedState, Visitor};
use crate::engine::parameters::{AdaptiveTimeStep, Parameters};
use crate::engine::particles::Particles;

/// The longest stable step and what limits it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepLimit {
    /// Seconds.
    pub time_step_s: f64,
    /// In a few words, for people.
    pub reason: &'static str,
}

impl StepLimit {
    /// The shorter of two.
    pub fn or(self, other: StepLimit) -> StepLimit {
        if other.time_step_s < self.time_step_s { other } else { self }
    }
}

/// A particle may move this many times the Courant limit before its step is taken back.
const TOLERATED: f64 = 2.0;

/// Steps that follow the flow: at most `C l0 / max |u|` (Courant), at most `sqrt(C l0 / max |a|)` with the acceleration of
/// the last step, at most what the effects allow, and little longer than the step before.
#[derive(Debug)]
pub struct Adaptive {
    pub rules: AdaptiveTimeStep,
    /// The state before the step under way.
    pub before: SavedState,
    longest_s: f64,
    particle_distance_m: f64,
    /// Length of the last step, seconds.
    last_s: f64,
    /// Largest change of a velocity in the last step over its length, metres per second squared.
    max_acceleration: f64,
}

impl Adaptive {
    pub fn new(rules: AdaptiveTimeStep, parameters: &Parameters) -> Self {
        Adaptive {
            rules,
            before: SavedState::default(),
            longest_s: parameters.time_step_s,
            particle_distance_m: parameters.particle_distance_m,
            last_s: parameters.time_step_s,
            max_acceleration: 0.0,
        }
    }

    /// The length of the next step from the present state, and what limits it; `stable` are the effects' limits.
    pub fn next_step(&self, particles: &Particles, stable: impl Iterator<Item = StepLimit>) -> StepLimit {
        let way_m = self.rules.courant * self.particle_distance_m;
        let speed = max_speed(particles);
        let own = [
            (self.rules.growth * self.last_s, "the growth from the step before"),
            (way_m / speed, "the Courant limit"),
            ((way_m / self.max_acceleration).sqrt(), "the acceleration limit"),
        ];
        let own = own.map(|(time_step_s, reason)| StepLimit { time_step_s, reason });
        let stable = stable.map(|limit| StepLimit {
            time_step_s: self.rules.safety * limit.time_step_s,
            reason: limit.reason,
        });
        let longest = StepLimit { time_step_s: self.longest_s, reason: "`time_step_s`" };
        own.into_iter().chain(stable).fold(longest, StepLimit::or)
    }

    /// Whether no particle moved too far in the step that was just computed; takes note of it if so.
    pub fn accepts(&mut self, particles: &Particles, time_step_s: f64) -> bool {
        let way_m = max_speed(particles) * time_step_s;
        if way_m > TOLERATED * self.rules.courant * self.particle_distance_m {
            return false;
        }
        let velocity_before = self.before.vectors("velocity");
        let change2 = |(i, before): (usize, &Vec3)| match particles.kind[i].moves() {
            true => norm2(sub(particles.velocity[i], *before)),
            false => 0.0,
        };
        let change = velocity_before.iter().enumerate().map(change2).fold(0.0, f64::max).sqrt();
        (self.max_acceleration, self.last_s) = (change / time_step_s, time_step_s);
        true
    }

    /// Shows what the next step's length depends on.
    pub fn visit(&mut self, visitor: &mut Visitor<'_>) {
        visitor("last_step", Column::Number(&mut self.last_s));
        visitor("max_acceleration", Column::Number(&mut self.max_acceleration));
    }
}

/// Of everything that is there, walls that move among it, metres per second.
fn max_speed(particles: &Particles) -> f64 {
    particles.velocity.iter().map(|&u| norm2(u)).fold(0.0, f64::max).sqrt()
}

fn norm2(v: Vec3) -> f64 {
    dot(v, v)
}
