//! A free drop in a plane, in units of its radius, density and surface tension: `R = rho = sigma = 1`.

use std::sync::Arc;

use crate::base::parallel::{Schedule, Workers};
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
use crate::engine::simulation::{self, Simulation, Start};

/// How tension is modelled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Model {
    Potential,
    Lack,
}

/// A drop and the fluid that it is of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drop {
    pub model: Model,
    pub surface_tension: f64,
    /// Particle distances in the radius.
    pub particles_per_radius: u32,
    /// `nu / sqrt(sigma R / rho)`; none where it is zero.
    pub viscosity: f64,
    pub radius: Option<f64>,
    /// What share of the capillary limit a step is.
    pub safety: f64,
    pub pressure: Pressure,
    pub collision: Option<Collision>,
    pub gradient_radius: f64,
    pub laplacian_radius: f64,
}

impl Drop {
    pub fn particle_distance(&self) -> f64 {
        1.0 / f64::from(self.particles_per_radius)
    }

    /// The engine's parameters, in a domain that reaches `reach` radii in each direction from the middle.
    pub fn parameters(&self, reach: f64) -> Parameters {
        let (tension, radius) = (self.surface_tension, self.radius);
        let mut parameters = Parameters {
            dimensions: Dimensions::Two,
            particle_distance_m: self.particle_distance(),
            time_step_s: 0.0,
            adaptive: None,
            density_kg_m3: 1.0,
            radii: Radii {
                number_density: 2.1,
                gradient: self.gradient_radius,
                laplacian: self.laplacian_radius,
            },
            domain: Domain::new([-reach, -reach, 0.0], [reach, reach, 0.0]),
            groups: Vec::new(),
            effects: Effects {
                viscosity: (self.viscosity > 0.0)
                    .then_some(Viscosity { kinematic_viscosity_m2_s: self.viscosity }),
                potential_tension: (self.model == Model::Potential).then_some(PotentialTension {
                    surface_tension_n_m: tension,
                    radius,
                    wetting: 0.5,
                }),
                surface_tension: (self.model == Model::Lack)
                    .then_some(SurfaceTension { surface_tension_n_m: tension, radius }),
                collision: self.collision,
                pressure: Some(self.pressure),
                ..Effects::default()
            },
        };
        parameters.time_step_s = self.safety * capillary_limit_s(tension, &parameters);
        parameters
    }

    /// Particles on rings around the middle, as far apart along a ring as the rings are.
    pub fn rings(&self) -> Vec<InitialParticle> {
        let l0 = self.particle_distance();
        let mut particles = vec![InitialParticle::at_rest(Kind::Fluid, [0.0; 3])];
        for ring in 1..self.particles_per_radius {
            let radius = f64::from(ring) * l0;
            let count = (std::f64::consts::TAU * f64::from(ring)).round();
            for k in 0..count as u32 {
                // The golden angle turns the rings against each other.
                let angle = std::f64::consts::TAU * f64::from(k) / count + 2.39996 * f64::from(ring);
                let position = [radius * angle.cos(), radius * angle.sin(), 0.0];
                particles.push(InitialParticle::at_rest(Kind::Fluid, position));
            }
        }
        particles
    }

    /// Particles of the square lattice around the middle for which `inside` holds.
    pub fn lattice(&self, inside: impl Fn(f64, f64) -> bool) -> Vec<InitialParticle> {
        let (l0, reach) = (self.particle_distance(), 3 * self.particles_per_radius as i32);
        let mut particles = Vec::new();
        for ix in -reach..reach {
            for iy in -reach..reach {
                let [x, y] = [ix, iy].map(|k| (f64::from(k) + 0.5) * l0);
                if inside(x, y) {
                    particles.push(InitialParticle::at_rest(Kind::Fluid, [x, y, 0.0]));
                }
            }
        }
        particles
    }

    /// A simulation of `particles`.
    pub fn simulation(&self, particles: &[InitialParticle]) -> Result<Box<dyn Simulation>, String> {
        simulate(&self.parameters(4.0), particles)
    }
}

/// A simulation on one thread.
pub fn simulate(
    parameters: &Parameters,
    particles: &[InitialParticle],
) -> Result<Box<dyn Simulation>, String> {
    let workers = Workers::new(1, Schedule::Static, &[]).map_err(|error| error.to_string())?;
    let start = Start { particles, steps_done: 0 };
    let options = Preset::PAPER_LINKED_LIST.options();
    simulation::build(parameters, &options, start, Arc::new(workers)).map_err(|error| error.to_string())
}

/// Runs up to a time and shows the particles after each step.
pub fn run(
    simulation: &mut dyn Simulation,
    until: f64,
    mut look: impl FnMut(f64, &Particles),
) -> Result<(), String> {
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
