//! What cases of general scenes share: the recommended pressure solve, and boxes of water in a plane.

use std::sync::Arc;

use crate::base::parallel::Workers;
use crate::base::schedule::Schedule;
use crate::base::vec3::Vec3;
use crate::engine::effects::collision::Collision;
use crate::engine::effects::gravity::Gravity;
use crate::engine::effects::shifting::{AtSurface, Shifting};
use crate::engine::effects::wall_contact::WallContact;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Domain, Effects, Parameters, Radii};
use crate::engine::particles::{InitialParticle, Kind};
use crate::engine::phase::NoProbe;
use crate::engine::preset::Preset;
use crate::engine::pressure::Pressure;
use crate::engine::pressure::options::{Clamp, Enclosed, Gradient, Source, Surface, Walls};
use crate::engine::simulation::{self, Simulation, Start, StepReport};

/// Standard gravity as in the paper's scene, m/s2.
pub const G_M_S2: f64 = 9.8;
/// Water, kg/m3.
pub const DENSITY_KG_M3: f64 = 1000.0;

/// Water with a free surface under gravity: contact with walls and the recommended pressure solve, in which walls are
/// mirrors. With walls that are solved for, water of 20 layers at rest on a lattice fell with 0.13 to 0.39 g in its first
/// step, its largest speed later was 0.05 to 0.16 sqrt(g H), and a standing wave lost half of its amplitude in five periods.
pub fn water() -> Effects {
    Effects {
        gravity: Some(Gravity { acceleration_m_s2: [0.0, -G_M_S2, 0.0] }),
        collision: Some(Collision { distance: 0.8, restitution: 0.0 }),
        wall_contact: Some(WallContact { height: 0.7, reach: 0.75 }),
        pressure: Some(Pressure {
            kernel_floor: Some(0.5),
            compressibility_1_pa: 0.0,
            source: Source::Divergence { density_feedback_s: 0.1 },
            gradient: Gradient::Consistent,
            surface: Surface::DensityAndAsymmetry,
            clamp: Clamp::NearSurface,
            enclosed: Enclosed::Project,
            walls: Walls::Mirrored,
            ..Pressure::default()
        }),
        shifting: Some(Shifting { strength: 10.0, limit: 0.1, at_surface: AtSurface::Tangential }),
        ..Effects::default()
    }
}

/// Fluid without a free surface, in a box or a period: the consistent gradient, with particles held apart by shifting.
pub fn closed(density_feedback_s: f64) -> Effects {
    Effects {
        collision: Some(Collision { distance: 0.5, restitution: 0.2 }),
        pressure: Some(Pressure {
            kernel_floor: Some(0.5),
            compressibility_1_pa: 0.0,
            source: Source::Divergence { density_feedback_s },
            gradient: Gradient::Consistent,
            surface: Surface::DensityAndAsymmetry,
            clamp: Clamp::Never,
            enclosed: Enclosed::Project,
            ..Pressure::default()
        }),
        shifting: Some(Shifting { strength: 15.0, limit: 0.1, at_surface: AtSurface::None }),
        ..Effects::default()
    }
}

/// Where walls are mirrors the Laplacian reaches no further than the gradient. Beneath a free surface it lacks neighbours,
/// and of a given flux through the first layer it makes a difference of pressures that is too large: by 1.56 with a radius
/// of 3.1 particle distances, which throws the layer up, and by 1.09 with 2.1.
fn radii(effects: &Effects) -> Radii {
    let mirrored = effects.pressure.as_ref().is_some_and(|pressure| pressure.walls == Walls::Mirrored);
    Radii { number_density: 2.1, gradient: 2.1, laplacian: if mirrored { 2.1 } else { 3.1 } }
}

/// Parameters of a case in the plane whose domain reaches `margin` particle distances beyond the particles.
pub fn parameters(
    l0: f64,
    time_step_s: f64,
    particles: &[InitialParticle],
    margin: f64,
    effects: Effects,
) -> Parameters {
    let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
    for d in 0..2 {
        let x = particles.iter().map(|p| p.position[d]);
        low[d] = x.clone().fold(f64::INFINITY, f64::min) - margin * l0;
        high[d] = x.fold(f64::NEG_INFINITY, f64::max) + margin * l0;
    }
    Parameters {
        dimensions: Dimensions::Two,
        particle_distance_m: l0,
        time_step_s,
        adaptive: None,
        density_kg_m3: DENSITY_KG_M3,
        radii: radii(&effects),
        domain: Domain::new(low, high),
        groups: Vec::new(),
        effects,
    }
}

/// Layers of wall particles with a pressure, and of all wall particles.
const LAYERS: [i32; 2] = [2, 4];

/// A box in cells of a particle distance: its inside, whose lower left corner lies at the origin and whose cells each hold
/// one particle at their middle, and the walls around.
#[derive(Debug, Clone, Copy)]
pub struct Tank {
    pub width: i32,
    /// Of the walls.
    pub height: i32,
    /// Whether there is a wall above.
    pub lid: bool,
}

impl Tank {
    /// The walls, and fluid in the cells for which `filled(i, j)` holds.
    pub fn fill(&self, l0: f64, filled: impl Fn(i32, i32) -> bool) -> Vec<InitialParticle> {
        let mut particles = Vec::new();
        let top = if self.lid { self.height + LAYERS[1] } else { self.height };
        for i in -LAYERS[1]..self.width + LAYERS[1] {
            for j in -LAYERS[1]..top {
                let beyond = [-1 - i, i - self.width, -1 - j, if self.lid { j - self.height } else { -1 }];
                let layer = beyond.into_iter().max().unwrap_or(-1);
                let kind = match layer {
                    0.. if layer < LAYERS[0] => Kind::Wall,
                    0.. => Kind::DummyWall,
                    _ if filled(i, j) => Kind::Fluid,
                    _ => continue,
                };
                particles.push(InitialParticle::at_rest(kind, middle(l0, i, j)));
            }
        }
        particles
    }
}

/// The middle of a cell.
pub fn middle(l0: f64, i: i32, j: i32) -> Vec3 {
    [l0 * (f64::from(i) + 0.5), l0 * (f64::from(j) + 0.5), 0.0]
}

/// Builds a simulation on `threads` threads.
pub fn build(
    parameters: &Parameters,
    particles: &[InitialParticle],
    threads: usize,
) -> Result<Box<dyn Simulation>, String> {
    let workers = Workers::new(threads, Schedule::Static, &[]).map_err(|error| error.to_string())?;
    let start = Start { particles, steps_done: 0 };
    let options = Preset::PAPER_AOS_RELOCATION.options();
    simulation::build(parameters, &options, start, Arc::new(workers)).map_err(|error| error.to_string())
}

/// One step.
pub fn step(simulation: &mut dyn Simulation) -> Result<StepReport, String> {
    simulation.step(&mut NoProbe).map_err(|error| error.to_string())
}

/// Numbers from -1 to 1 that are the same everywhere (a linear congruential generator, Knuth's constants).
#[derive(Debug)]
pub struct Noise(pub u64);

impl Noise {
    pub fn draw(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}
