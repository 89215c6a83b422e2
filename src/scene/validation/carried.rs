//! Plane boxes of particles that carry something: what the cases of heat, scalars and convection share.

use std::sync::Arc;

use crate::base::parallel::Workers;
use crate::base::schedule::Schedule;
use crate::base::vec3::Vec3;
use crate::engine::effects::diffusion::{Diffusion, Laplacian, WallCondition};
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Domain, Effects, Parameters, Property, Radii};
use crate::engine::particles::{InitialParticle, Kind};
use crate::engine::phase::NoProbe;
use crate::engine::preset::Preset;
use crate::engine::simulation::{self, Simulation, Start};

/// Layers of wall around a box.
const LAYERS: i32 = 4;

/// A plane box `nx` by `ny` particles, its lower left corner the origin, each particle in the middle of its cell.
#[derive(Debug, Clone, Copy)]
pub struct PlaneBox {
    pub particle_distance_m: f64,
    pub nx: i32,
    pub ny: i32,
    /// Whether walls stand to the left and right; without, the box repeats itself along x.
    pub walls_x: bool,
    /// The same for y.
    pub walls_y: bool,
    /// Fluid is displaced by up to this many particle distances along each axis.
    pub jitter: f64,
}

/// The groups of particles of a box, in this order.
pub const FLUID: u8 = 0;
pub const LEFT: u8 = 1;
pub const RIGHT: u8 = 2;
/// Walls below and above.
pub const ENDS: u8 = 3;
/// Fluid of a second kind, where a case has one.
pub const SECOND: u8 = 4;

impl PlaneBox {
    /// Particles at rest, the fluid at the temperature and concentration `at` its place.
    pub fn fill(&self, at: impl Fn(Vec3) -> f64) -> Vec<InitialParticle> {
        let mut random = fastrand::Rng::with_seed(1);
        let beyond = |walls: bool| if walls { LAYERS } else { 0 };
        let (bx, by) = (beyond(self.walls_x), beyond(self.walls_y));
        let mut particles = Vec::new();
        for i in -bx..self.nx + bx {
            for j in -by..self.ny + by {
                let outside = [-i, i - self.nx + 1, -j, j - self.ny + 1].into_iter().fold(0, i32::max);
                let group = match () {
                    () if i < 0 => LEFT,
                    () if i >= self.nx => RIGHT,
                    () if outside > 0 => ENDS,
                    () => FLUID,
                };
                let kind = match outside {
                    0 => Kind::Fluid,
                    1 | 2 => Kind::Wall,
                    _ => Kind::DummyWall,
                };
                let mut shifted = |index: i32| {
                    let jitter = if outside == 0 { self.jitter * (2.0 * random.f64() - 1.0) } else { 0.0 };
                    (f64::from(index) + 0.5 + jitter) * self.particle_distance_m
                };
                let position = [shifted(i), shifted(j), 0.0];
                let carried = if outside == 0 { at(position) } else { 0.0 };
                particles.push(InitialParticle {
                    group,
                    temperature: carried,
                    concentration: carried,
                    ..InitialParticle::at_rest(kind, position)
                });
            }
        }
        particles
    }

    pub fn parameters(&self, time_step_s: f64, effects: Effects) -> Parameters {
        let l0 = self.particle_distance_m;
        let (mut low, mut high) = ([0.0; 3], [f64::from(self.nx) * l0, f64::from(self.ny) * l0, 0.0]);
        for (d, walls) in [self.walls_x, self.walls_y].into_iter().enumerate() {
            if walls {
                low[d] -= f64::from(LAYERS + 1) * l0;
                high[d] += f64::from(LAYERS + 1) * l0;
            }
        }
        Parameters {
            dimensions: Dimensions::Two,
            particle_distance_m: l0,
            time_step_s,
            adaptive: None,
            density_kg_m3: 1.0,
            radii: Radii { number_density: 2.1, gradient: 2.1, laplacian: 3.1 },
            domain: Domain { low, high, periodic: [!self.walls_x, !self.walls_y, false] },
            groups: ["fluid", "left", "right", "ends", "second"].map(String::from).to_vec(),
            effects,
        }
    }
}

/// A medium of diffusivity `diffusivity` between walls to the left and right, and walls at the ends that let nothing pass.
pub fn medium(
    diffusivity: f64,
    left: WallCondition,
    right: WallCondition,
    laplacian: Laplacian,
) -> Diffusion {
    let closed = WallCondition::Flux(0.0);
    Diffusion {
        conductivity: Property::Uniform(diffusivity),
        capacity: Property::Uniform(1.0),
        walls: vec![closed, left, right, closed],
        laplacian,
    }
}

/// A simulation on one thread.
pub fn build(parameters: &Parameters, particles: &[InitialParticle]) -> Result<Box<dyn Simulation>, String> {
    let workers = Workers::new(1, Schedule::Static, &[]).map_err(|error| error.to_string())?;
    let options = Preset::PAPER_AOS_RELOCATION.options();
    simulation::build(parameters, &options, Start { particles, steps_done: 0 }, Arc::new(workers))
        .map_err(|error| error.to_string())
}

/// Computes `steps` steps.
pub fn run(simulation: &mut dyn Simulation, steps: usize) -> Result<(), String> {
    (0..steps).try_for_each(|_| simulation.step(&mut NoProbe).map(|_| ()).map_err(|error| error.to_string()))
}

/// `sqrt(sum (a - b)^2 / sum b^2)` over pairs of a value found and the exact one.
pub fn relative_l2(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut wrong2, mut right2) = (0.0, 0.0);
    for (found, exact) in pairs {
        wrong2 += (found - exact) * (found - exact);
        right2 += exact * exact;
    }
    (wrong2 / right2).sqrt()
}
