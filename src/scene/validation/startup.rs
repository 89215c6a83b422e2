//! Start-up of plane flows from rest (Morris, Fox & Zhu 1997: `nu = 1e-6 m2/s`, `L = 1e-3 m`).

use std::f64::consts::PI;

use crate::engine::effects::gravity::Gravity;
use crate::engine::parameters::Property;
use crate::engine::viscous::Walls;
use crate::scene::validation::Outcome;
use crate::scene::validation::channel::{self, Channel, Scheme};

pub const VISCOSITY_M2_S: f64 = 1e-6;
pub const WIDTH_M: f64 = 1e-3;
pub const SOURCE: &str = "series solution, Morris, Fox & Zhu 1997";

/// When profiles are compared, seconds.
const TIMES: [(f64, &str); 4] = [
    (0.045, "velocity at mid-channel at 0.045 s, m/s; error: L2 of the profile"),
    (0.1125, "velocity at mid-channel at 0.1125 s, m/s; error: L2 of the profile"),
    (0.225, "velocity at mid-channel at 0.225 s, m/s; error: L2 of the profile"),
    (1.0, "velocity at mid-channel at 1 s, m/s; error: L2 of the profile"),
];

/// What drives the flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    pub case: &'static str,
    /// Of the upper wall, metres per second.
    pub speed_m_s: f64,
    /// Of the fluid, metres per second squared.
    pub force_m_s2: f64,
}

impl Drive {
    /// The velocity at height `y` after the time `t`.
    pub fn exact(&self, y: f64, t: f64) -> f64 {
        couette(y, t, self.speed_m_s, WIDTH_M, VISCOSITY_M2_S)
            + poiseuille(y, t, self.force_m_s2, WIDTH_M, VISCOSITY_M2_S)
    }

    /// The profiles at [`TIMES`] against the series. Explicit steps are half as long as the limit, `lambda / (4 D nu)` with
    /// `lambda = 2.4485 l0^2`, implicit ones twice as long as it, unless `explicit_limits` says otherwise.
    pub fn run(
        &self,
        across: usize,
        scheme: Scheme,
        walls: Walls,
        explicit_limits: Option<f64>,
    ) -> Result<Vec<Outcome>, String> {
        let channel = Channel { across, width_m: WIDTH_M, upper_wall_m_s: self.speed_m_s };
        let l0 = channel.particle_distance_m();
        let limits = explicit_limits.unwrap_or(if scheme.implicit { 2.0 } else { 0.5 });
        let dt = limits * 2.4485 / 4.0 * l0 * l0 / VISCOSITY_M2_S;
        let mut effects = scheme.effects(Property::Uniform(VISCOSITY_M2_S), walls);
        if self.force_m_s2 != 0.0 {
            effects.gravity = Some(Gravity { acceleration_m_s2: [self.force_m_s2, 0.0, 0.0] });
        }
        let mut simulation = channel::build(&channel.parameters(dt, effects), &channel.at_rest())?;
        let (mut outcomes, mut steps) = (Vec::new(), 0);
        for (time, quantity) in TIMES {
            let until = (time / dt).round() as usize;
            channel::advance(simulation.as_mut(), until - steps)?;
            steps = until;
            let (profile, now) = (channel.profile(simulation.particles()), steps as f64 * dt);
            let (y, u) = profile[across / 2];
            outcomes.push(Outcome {
                effect: scheme.effect(),
                case: self.case,
                quantity,
                value: u,
                reference: self.exact(y, now),
                error: channel::relative_l2(&profile, |y| self.exact(y, now)),
                gate: 0.01,
                source: SOURCE,
            });
        }
        Ok(outcomes)
    }
}

/// Start-up of plane Couette flow: `u(y, t)` for the speed `speed` of the wall at `y = width`.
fn couette(y: f64, t: f64, speed: f64, width: f64, viscosity: f64) -> f64 {
    let mode = |n: f64| {
        let sign = if n % 2.0 == 0.0 { 1.0 } else { -1.0 };
        let decay = (-viscosity * (n * PI / width) * (n * PI / width) * t).exp();
        2.0 * speed / (n * PI) * sign * (n * PI * y / width).sin() * decay
    };
    speed * y / width + (1..=100).map(|n| mode(f64::from(n))).sum::<f64>()
}

/// Start-up of plane Poiseuille flow under the acceleration `force`.
fn poiseuille(y: f64, t: f64, force: f64, width: f64, viscosity: f64) -> f64 {
    let mode = |n: f64| {
        let k = (2.0 * n + 1.0) * PI;
        let decay = (-(k / width) * (k / width) * viscosity * t).exp();
        4.0 * force * width * width / (viscosity * k * k * k) * (k * y / width).sin() * decay
    };
    force * y * (width - y) / (2.0 * viscosity) - (0..100).map(|n| mode(f64::from(n))).sum::<f64>()
}
