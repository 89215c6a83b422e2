//! A plane channel between two walls, periodic along x, and what flows in it: the setting of several cases.
//!
//! `across` layers of fluid, with wall particles on either side; the walls' surfaces are half a particle distance beyond
//! the fluid's outer layers, so that the channel is `across` particle distances wide. No pressure: the flow is
//! unidirectional.

use std::sync::Arc;

use crate::base::parallel::Workers;
use crate::base::schedule::Schedule;
use crate::engine::effects::implicit_viscosity::ImplicitViscosity;
use crate::engine::effects::viscosity::Viscosity;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Domain, Effects, Parameters, Property, Radii};
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::engine::phase::NoProbe;
use crate::engine::preset::Preset;
use crate::engine::simulation::{self, Simulation, Start};
use crate::engine::viscous::{Form, Walls};

/// How viscosity is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scheme {
    pub name: &'static str,
    pub implicit: bool,
    pub form: Form,
}

/// Explicit and implicit, in both forms.
pub const SCHEMES: [Scheme; 4] = [
    Scheme { name: "explicit, Laplacian form", implicit: false, form: Form::Laplacian },
    Scheme { name: "explicit, angular-momentum form", implicit: false, form: Form::AngularMomentum },
    Scheme { name: "implicit, Laplacian form", implicit: true, form: Form::Laplacian },
    Scheme { name: "implicit, angular-momentum form", implicit: true, form: Form::AngularMomentum },
];

impl Scheme {
    /// The effect that the scheme holds to account.
    pub fn effect(&self) -> &'static str {
        match (self.implicit, self.form) {
            (false, Form::Laplacian) => "viscosity",
            (false, Form::AngularMomentum) => "viscosity, angular momentum",
            (true, Form::Laplacian) => "implicit_viscosity",
            (true, Form::AngularMomentum) => "implicit_viscosity, angular momentum",
        }
    }

    /// The scheme with a viscosity, and nothing else.
    pub fn effects(&self, kinematic_viscosity_m2_s: Property, walls: Walls) -> Effects {
        let form = self.form;
        match self.implicit {
            true => Effects {
                implicit_viscosity: Some(ImplicitViscosity { kinematic_viscosity_m2_s, walls, form }),
                ..Effects::default()
            },
            false => Effects {
                viscosity: Some(Viscosity { kinematic_viscosity_m2_s, walls, form }),
                ..Effects::default()
            },
        }
    }
}

/// Particles along the period: more than a neighbourhood is wide.
const ALONG: usize = 8;
/// Layers of wall and of dummy wall on either side.
const LAYERS: i32 = 2;

/// A channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// Layers of fluid.
    pub across: usize,
    /// Between the surfaces, metres.
    pub width_m: f64,
    /// At which the upper wall moves along x, metres per second.
    pub upper_wall_m_s: f64,
}

impl Channel {
    pub fn particle_distance_m(&self) -> f64 {
        self.width_m / self.across as f64
    }

    /// Constants for water in the channel.
    pub fn parameters(&self, time_step_s: f64, effects: Effects) -> Parameters {
        let l0 = self.particle_distance_m();
        let beyond = f64::from(2 * LAYERS) + 1.0;
        let (low, high) = (
            [-0.5 * l0, -beyond * l0, 0.0],
            [(ALONG as f64 - 0.5) * l0, (self.across as f64 + beyond) * l0, 0.0],
        );
        Parameters {
            dimensions: Dimensions::Two,
            particle_distance_m: l0,
            time_step_s,
            adaptive: None,
            density_kg_m3: 1000.0,
            radii: Radii { number_density: 2.1, gradient: 2.1, laplacian: 3.1 },
            domain: Domain { periodic: [true, false, false], ..Domain::new(low, high) },
            groups: Vec::new(),
            effects,
        }
    }

    /// Fluid with the velocity `profile(y)` along x, walls at rest or moving.
    pub fn particles(&self, profile: impl Fn(f64) -> f64) -> Vec<InitialParticle> {
        let (l0, across) = (self.particle_distance_m(), self.across as i32);
        let mut particles = Vec::new();
        for i in 0..ALONG {
            for j in -2 * LAYERS..across + 2 * LAYERS {
                let kind = match j {
                    _ if (0..across).contains(&j) => Kind::Fluid,
                    _ if (-LAYERS..across + LAYERS).contains(&j) => Kind::Wall,
                    _ => Kind::DummyWall,
                };
                let y = (f64::from(j) + 0.5) * l0;
                let u = match kind {
                    Kind::Fluid => profile(y),
                    _ if j >= across => self.upper_wall_m_s,
                    _ => 0.0,
                };
                particles.push(InitialParticle {
                    velocity: [u, 0.0, 0.0],
                    ..InitialParticle::at_rest(kind, [l0 * i as f64, y, 0.0])
                });
            }
        }
        particles
    }

    /// Fluid at rest.
    pub fn at_rest(&self) -> Vec<InitialParticle> {
        self.particles(|_| 0.0)
    }

    /// The velocity along x of one row of fluid particles, by the height above the lower surface in metres.
    pub fn profile(&self, particles: &Particles) -> Vec<(f64, f64)> {
        let row = self.across + 4 * LAYERS as usize;
        (0..row)
            .filter(|&i| particles.kind[i] == Kind::Fluid)
            .map(|i| (particles.position[i][1], particles.velocity[i][0]))
            .collect()
    }
}

/// Builds a simulation on one thread.
pub fn build(parameters: &Parameters, particles: &[InitialParticle]) -> Result<Box<dyn Simulation>, String> {
    let workers = Workers::new(1, Schedule::Static, &[]).map_err(|error| error.to_string())?;
    let start = Start { particles, steps_done: 0 };
    let options = Preset::PAPER_LINKED_LIST.options();
    simulation::build(parameters, &options, start, Arc::new(workers)).map_err(|error| error.to_string())
}

/// Computes so many steps.
pub fn advance(simulation: &mut dyn Simulation, steps: usize) -> Result<(), String> {
    for _ in 0..steps {
        simulation.step(&mut NoProbe).map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// `|u - reference| / |reference|` over a profile, in the 2-norm.
pub fn relative_l2(profile: &[(f64, f64)], reference: impl Fn(f64) -> f64) -> f64 {
    let square = |value: f64| value * value;
    let error: f64 = profile.iter().map(|&(y, u)| square(u - reference(y))).sum();
    let scale: f64 = profile.iter().map(|&(y, _)| square(reference(y))).sum();
    (error / scale).sqrt()
}

/// The order of convergence between an error and that at half the particle distance.
pub fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).log2()
}
