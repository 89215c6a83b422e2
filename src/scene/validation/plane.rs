//! Tanks in a plane, for cases of moving water: particles, parameters, and what is read off the fluid.

use std::sync::Arc;

use crate::base::parallel::Workers;
use crate::base::schedule::Schedule;
use crate::base::vec3::Vec3;
use crate::engine::effects::collision::Collision;
use crate::engine::effects::gravity::Gravity;
use crate::engine::effects::wall_contact::WallContact;
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Domain, Effects, Parameters, Radii};
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::engine::phase::NoProbe;
use crate::engine::preset::Preset;
use crate::engine::pressure::Pressure;
use crate::engine::pressure::options::Surface;
use crate::engine::simulation::{self, Simulation, Start, StepReport};

/// Standard gravity, rounded as in the paper's scene, m/s2.
pub const G: f64 = 9.8;

/// Layers of wall particles with pressure, and of all wall particles.
const LAYERS: [i32; 2] = [2, 4];

/// What water in a tank with a free surface needs.
pub fn water_effects() -> Effects {
    Effects {
        gravity: Some(Gravity { acceleration_m_s2: [0.0, -G, 0.0] }),
        collision: Some(Collision { distance: 0.5, restitution: 0.2 }),
        wall_contact: Some(WallContact { height: 0.7, reach: 0.75 }),
        pressure: Some(Pressure {
            kernel_floor: Some(0.5),
            surface: Surface::DensityAndAsymmetry,
            ..Pressure::default()
        }),
        ..Effects::default()
    }
}

/// Parameters of a case in a plane, in a domain that reaches `margin_m` beyond the particles.
pub fn parameters(
    l0: f64,
    time_step_s: f64,
    particles: &[InitialParticle],
    margin_m: f64,
    effects: Effects,
) -> Parameters {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for d in 0..2 {
        low[d] = particles.iter().map(|p| p.position[d]).fold(low[d], f64::min) - margin_m;
        high[d] = particles.iter().map(|p| p.position[d]).fold(high[d], f64::max) + margin_m;
    }
    (low[2], high[2]) = (0.0, 0.0);
    let groups = particles.iter().map(|p| p.group).max().filter(|&last| last > 0);
    Parameters {
        dimensions: Dimensions::Two,
        particle_distance_m: l0,
        time_step_s,
        adaptive: None,
        density_kg_m3: 1000.0,
        radii: Radii { number_density: 2.1, gradient: 2.1, laplacian: 3.1 },
        domain: Domain::new(low, high),
        groups: groups.map_or(Vec::new(), |last| (0..=last).map(|k| format!("group {k}")).collect()),
        effects,
    }
}

/// The simulation, on one thread: cases run side by side.
pub fn start(parameters: &Parameters, particles: &[InitialParticle]) -> Result<Box<dyn Simulation>, String> {
    let workers = Workers::new(1, Schedule::Static, &[]).map_err(|error| error.to_string())?;
    let start = Start { particles, steps_done: 0 };
    let options = Preset::PAPER_AOS_RELOCATION.options();
    simulation::build(parameters, &options, start, Arc::new(workers)).map_err(|error| error.to_string())
}

/// One step; an error as a text.
pub fn step(simulation: &mut dyn Simulation) -> Result<StepReport, String> {
    simulation.step(&mut NoProbe).map_err(|error| error.to_string())
}

/// The point of column `i` and row `j` of a lattice whose cells, not whose points, start at the origin.
pub fn cell(l0: f64, i: i32, j: i32) -> Vec3 {
    [(f64::from(i) + 0.5) * l0, (f64::from(j) + 0.5) * l0, 0.0]
}

/// Walls around the cells `0..columns`, `0..rows`, open above.
pub fn walls(l0: f64, columns: i32, rows: i32, group: u8) -> Vec<InitialParticle> {
    let [solid, all] = LAYERS;
    let mut particles = Vec::new();
    for i in -all..columns + all {
        for j in -all..rows {
            let depth = (-i).max(-j).max(i - columns + 1);
            // The rim is wall to the last layer, so that fluid above it meets pressure.
            let kind = match depth <= solid || j >= rows - 2 {
                _ if depth <= 0 => continue,
                true => Kind::Wall,
                false => Kind::DummyWall,
            };
            particles.push(InitialParticle { group, ..InitialParticle::at_rest(kind, cell(l0, i, j)) });
        }
    }
    particles
}

/// Fluid in the cells `columns`, each column up to the height that `top_m` gives at its middle.
pub fn fluid(l0: f64, columns: std::ops::Range<i32>, top_m: impl Fn(f64) -> f64) -> Vec<InitialParticle> {
    let mut particles = Vec::new();
    for i in columns {
        let x = cell(l0, i, 0)[0];
        for j in 0..(top_m(x) / l0).round() as i32 {
            particles.push(InitialParticle::at_rest(Kind::Fluid, cell(l0, i, j)));
        }
    }
    particles
}

/// Where the fluid's volume fraction falls to one half above `x`: with hats of two particle distances to either side,
/// `phi(y) = sum_j hat(x - x_j) hat(y - y_j)`, the highest `y` with `phi = 1 / 2`. Meant for places at least two particle
/// distances away from walls.
pub fn surface_m(particles: &Particles, x: f64, l0: f64) -> Option<f64> {
    let reach = 2.0 * l0;
    let hat = |d: f64| (1.0 - d.abs() / reach).max(0.0) * l0 / reach;
    let near: Vec<(f64, f64)> = (0..particles.len())
        .filter(|&i| particles.kind[i] == Kind::Fluid && (particles.position[i][0] - x).abs() < reach)
        .map(|i| (particles.position[i][1], hat(particles.position[i][0] - x)))
        .collect();
    let phi = |y: f64| near.iter().map(|&(y_j, share)| share * hat(y - y_j)).sum::<f64>();
    let mut y = near.iter().map(|&(y, _)| y).reduce(f64::max)? + reach;
    let lowest = near.iter().map(|&(y, _)| y).fold(f64::INFINITY, f64::min);
    let (mut above, fine) = (phi(y), 0.1 * l0);
    while y > lowest {
        let below = phi(y - fine);
        if below >= 0.5 {
            return Some(y - fine * (0.5 - above) / (below - above));
        }
        (above, y) = (below, y - fine);
    }
    None
}
