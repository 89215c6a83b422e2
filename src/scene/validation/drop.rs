//! A free drop in a plane, in units of its radius, density and surface tension, `R = rho = sigma = 1`; and what is
//! measured of it.

use std::sync::Arc;

use crate::base::parallel::Workers;
use crate::base::schedule::Schedule;
use crate::base::vec3::{Vec3, dot};
use crate::engine::effects::collision::Collision;
use crate::engine::effects::potential_tension::{PotentialTension, capillary_limit_s};
use crate::engine::effects::surface_tension::SurfaceTension;
use crate::engine::effects::viscosity::Viscosity;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Domain, Effects, Parameters, Radii};
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::engine::phase::NoProbe;
use crate::engine::preset::Preset;
use crate::engine::pressure::Pressure;
use crate::engine::pressure::options::{Clamp, Gradient, Source, Surface};
use crate::engine::simulation::{self, Start};

/// How tension is modelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    Potential,
    Lack,
}

impl Model {
    pub const ALL: [Model; 2] = [Model::Potential, Model::Lack];

    /// The effect by name.
    pub fn effect(self) -> &'static str {
        match self {
            Model::Potential => "potential_tension",
            Model::Lack => "surface_tension",
        }
    }
}

/// A drop and the fluid that it is of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drop {
    pub model: Model,
    /// `sigma`: 1, or 0 for a drop without tension.
    pub surface_tension: f64,
    /// Particle distances in the radius.
    pub particles_per_radius: u32,
    /// `nu / sqrt(sigma R / rho)`; none where it is zero.
    pub viscosity: f64,
}

/// The share of the capillary limit that a step is.
const SAFETY: f64 = 0.5;
/// Time in which a density error decays, in units of `sqrt(rho l0^3 / sigma)`.
const FEEDBACK: f64 = 5.8;

impl Drop {
    pub fn new(model: Model, particles_per_radius: u32, viscosity: f64) -> Drop {
        Drop { model, surface_tension: 1.0, particles_per_radius, viscosity }
    }

    pub fn particle_distance(&self) -> f64 {
        1.0 / f64::from(self.particles_per_radius)
    }

    /// The pressure solve that keeps a free drop together: nothing jumps at its surface, and momentum and energy are
    /// kept.
    fn pressure(&self) -> Pressure {
        let l0 = self.particle_distance();
        Pressure {
            source: Source::Divergence { density_feedback_s: FEEDBACK * (l0 * l0 * l0).sqrt() },
            gradient: Gradient::Transposed,
            surface: Surface::Truncated,
            clamp: Clamp::Never,
            ..Pressure::default()
        }
    }

    /// The engine's parameters, in a domain that reaches four radii in each direction from the middle.
    pub fn parameters(&self) -> Parameters {
        let surface_tension_n_m = self.surface_tension;
        let potential = PotentialTension { surface_tension_n_m, radius: None, wetting: 0.5 };
        let lack = SurfaceTension { surface_tension_n_m, radius: None };
        let viscosity = Viscosity::uniform(self.viscosity);
        let mut parameters = Parameters {
            dimensions: Dimensions::Two,
            particle_distance_m: self.particle_distance(),
            time_step_s: 0.0,
            adaptive: None,
            density_kg_m3: 1.0,
            radii: Radii { number_density: 2.1, gradient: 2.1, laplacian: 3.1 },
            domain: Domain::new([-4.0, -4.0, 0.0], [4.0, 4.0, 0.0]),
            groups: Vec::new(),
            effects: Effects {
                viscosity: (self.viscosity > 0.0).then_some(viscosity),
                potential_tension: (self.model == Model::Potential).then_some(potential),
                surface_tension: (self.model == Model::Lack).then_some(lack),
                collision: Some(Collision { distance: 0.5, restitution: 0.2 }),
                pressure: Some(self.pressure()),
                ..Effects::default()
            },
        };
        parameters.time_step_s = SAFETY * capillary_limit_s(1.0, &parameters);
        parameters
    }

    /// Particles of the square lattice around the middle for which `inside` holds, each with its velocity.
    pub fn lattice(
        &self,
        inside: impl Fn(f64, f64) -> bool,
        velocity: impl Fn(f64, f64) -> Vec3,
    ) -> Vec<InitialParticle> {
        let (l0, reach) = (self.particle_distance(), 3 * self.particles_per_radius as i32);
        let mut particles = Vec::new();
        for ix in -reach..reach {
            for iy in -reach..reach {
                let [x, y] = [ix, iy].map(|k| (f64::from(k) + 0.5) * l0);
                if inside(x, y) {
                    let at_rest = InitialParticle::at_rest(Kind::Fluid, [x, y, 0.0]);
                    particles.push(InitialParticle { velocity: velocity(x, y), ..at_rest });
                }
            }
        }
        particles
    }

    /// The radius of a circle with the area of so many particles.
    pub fn radius_of(&self, particles: usize) -> f64 {
        self.particle_distance() * (particles as f64 / std::f64::consts::PI).sqrt()
    }

    /// Runs `particles` up to a time and shows them after each step.
    pub fn run(
        &self,
        particles: &[InitialParticle],
        until: f64,
        look: impl FnMut(f64, &Particles),
    ) -> Result<(), String> {
        run(&self.parameters(), particles, until, look)
    }
}

/// Runs `particles` up to a time and shows them after each step.
pub fn run(
    parameters: &Parameters,
    particles: &[InitialParticle],
    until: f64,
    mut look: impl FnMut(f64, &Particles),
) -> Result<(), String> {
    let workers = Workers::new(1, Schedule::Static, &[]).map_err(|error| error.to_string())?;
    let start = Start { particles, steps_done: 0 };
    let options = Preset::PAPER_LINKED_LIST.options();
    let mut simulation = simulation::build(parameters, &options, start, Arc::new(workers))
        .map_err(|error| error.to_string())?;
    loop {
        let report = simulation.step(&mut NoProbe).map_err(|error| error.to_string())?;
        look(report.time_s, simulation.particles());
        if report.time_s >= until {
            return Ok(());
        }
    }
}

/// Mean position of the fluid.
pub fn middle(particles: &Particles) -> Vec3 {
    let count = particles.position.len() as f64;
    [0, 1, 2].map(|d| particles.position.iter().map(|x| x[d]).sum::<f64>() / count)
}

/// Fastest particle.
pub fn max_speed(particles: &Particles) -> f64 {
    particles.velocity.iter().map(|&u| dot(u, u)).fold(0.0, f64::max).sqrt()
}

/// `(sum x^2 - y^2) / (sum x^2 + y^2)` about the middle: `2 a / R` for a drop `r = R + a cos 2 theta`.
pub fn elongation(particles: &Particles) -> f64 {
    let [mx, my, _] = middle(particles);
    let (mut difference, mut sum) = (0.0, 0.0);
    for x in &particles.position {
        let (dx, dy) = (x[0] - mx, x[1] - my);
        difference += dx * dx - dy * dy;
        sum += dx * dx + dy * dy;
    }
    difference / sum
}

/// Mean pressure within `share` of the radius.
pub fn mean_pressure(particles: &Particles, share: f64) -> f64 {
    let [mx, my, _] = middle(particles);
    let (mut sum, mut count) = (0.0, 0.0);
    for (x, p) in particles.position.iter().zip(&particles.pressure) {
        let (dx, dy) = (x[0] - mx, x[1] - my);
        if dx * dx + dy * dy < share * share {
            sum += p;
            count += 1.0;
        }
    }
    sum / count
}

/// Outermost particle in each of `N` sectors, half a particle distance added.
pub fn outline<const N: usize>(particles: &Particles, particle_distance: f64) -> [f64; N] {
    let [mx, my, _] = middle(particles);
    let mut outline = [0.0f64; N];
    for x in &particles.position {
        let (dx, dy) = (x[0] - mx, x[1] - my);
        let turn = dy.atan2(dx) / std::f64::consts::TAU;
        let sector = ((turn - turn.floor()) * N as f64) as usize % N;
        outline[sector] = outline[sector].max((dx * dx + dy * dy).sqrt() + 0.5 * particle_distance);
    }
    outline
}

/// Times at which a signal passes zero, each by a straight line between two samples.
#[derive(Debug, Default)]
pub struct Crossings {
    last: Option<(f64, f64)>,
    pub times: Vec<f64>,
    /// Largest magnitude between two crossings.
    pub peaks: Vec<f64>,
    peak: f64,
}

impl Crossings {
    pub fn add(&mut self, time: f64, value: f64) {
        if let Some((t, v)) = self.last
            && v * value < 0.0
        {
            self.times.push(t + (time - t) * v / (v - value));
            self.peaks.push(self.peak);
            self.peak = 0.0;
        }
        self.peak = self.peak.max(value.abs());
        self.last = Some((time, value));
    }

    /// Twice the mean time between crossings.
    pub fn period(&self) -> Option<f64> {
        let (first, last) = (self.times.first()?, self.times.last()?);
        (self.times.len() > 1).then(|| 2.0 * (last - first) / (self.times.len() - 1) as f64)
    }
}
