//! One observed run: a scene from its start to its end, and what is seen on the way.
//!
//! Only the steps are timed; looking happens between them. A run that breaks down is an observation too: it says where
//! and why, and has the numbers up to there.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use serde::{Deserialize, Serialize};

use crate::base::parallel::Workers;
use crate::base::statistics::standard_deviation;
use crate::base::vec3::{Vec3, add_scaled, dot, is_finite, scale, sub};
use crate::engine::diagnostics::{FlowState, LeakWatch, digest, energy};
use crate::engine::error::SimulationError;
use crate::engine::parameters::Parameters;
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::engine::phase::NoProbe;
use crate::engine::simulation::{self, Simulation, Start, StepReport};
use crate::experiment::interrupt;
use crate::experiment::plan::pin_order;
use crate::experiment::quantity::Quantity;
use crate::experiment::record::{FrontSample, Observation, Variant};
use crate::scene::library;

/// The front is recorded at this many equal parts of the run.
const FRONT_SAMPLES: usize = 10;

/// What to simulate.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObserveRequest {
    pub scene: String,
    pub sets: Vec<String>,
    pub variant: Variant,
    pub threads: usize,
    pub pin: String,
}

/// Simulates the scene and looks after every step.
pub fn run(request: &ObserveRequest) -> Result<Observation> {
    let sets = [&request.sets[..], &request.variant.scene_changes].concat();
    let scene = library::load(&request.scene, &sets)?;
    let initial = scene.particles(&request.scene)?;
    let (parameters, options) = (scene.parameters(&initial), request.variant.options("trial")?);
    let workers = Arc::new(Workers::new(request.threads, options.schedule, &pin_order(&request.pin)?)?);
    let threads_observed = workers.threads();
    let initial = request.variant.memory_order("trial")?.arrange(&initial, &parameters)?;
    let start = Start { particles: &initial, steps_done: 0 };
    let mut simulation = simulation::build(&parameters, &options, start, workers)?;
    let bytes = |simulation: &dyn Simulation| simulation.bytes() as f64 / initial.len() as f64;
    let column_bytes = bytes(&*simulation);
    let mut watch = Watch::new(&initial, &parameters, scene.steps());
    let (mut stepping_s, mut error) = (0.0, None);
    for _ in 0..scene.steps() {
        interrupt::check()?;
        let began = Instant::now();
        let step = simulation.step(&mut NoProbe);
        stepping_s += began.elapsed().as_secs_f64();
        match step {
            Ok(report) => watch.look(simulation.particles(), report),
            Err(broken) => {
                error = Some(broken);
                break;
            }
        }
    }
    let mut quantities = watch.quantities();
    quantities.insert(Quantity::ColumnBytes, column_bytes);
    quantities.insert(Quantity::BytesPerParticle, bytes(&*simulation));
    Ok(Observation {
        threads_observed,
        particles: initial.len(),
        ended: error.as_ref().map_or(Observation::COMPLETED, kind_of).to_string(),
        error: error.as_ref().map(ToString::to_string).unwrap_or_default(),
        steps: watch.steps_done,
        time_step_s: parameters.time_step_s,
        stepping_s,
        quantities,
        digest: error.map_or_else(|| digest(simulation.particles()), |_| String::new()),
        front: watch.front.samples,
    })
}

fn kind_of(error: &SimulationError) -> &'static str {
    match error {
        SimulationError::Coincident { .. } => "coincident",
        SimulationError::NotFinite { .. } => "not_finite",
        SimulationError::Solver { .. } => "solver",
    }
}

/// Looks at a run after every step. `H`, the fluid's depth, counts half a particle distance below its lowest and above
/// its highest particle.
struct Watch<'a> {
    initial: &'a [InitialParticle],
    parameters: &'a Parameters,
    steps: usize,
    steps_done: usize,
    depth_m: f64,
    gravity: Vec3,
    start_energy: f64,
    most_energy: f64,
    max_speed_m_s: f64,
    late_speed_m_s: f64,
    max_pressure_pa: f64,
    cg_iterations: usize,
    last: Vec<Alive>,
    left: usize,
    not_finite: usize,
    leaks: LeakWatch,
    front: FrontWatch,
    profile: Option<Profile>,
}

/// A fluid particle that is still there.
#[derive(Debug, Clone, Copy)]
struct Alive {
    index: usize,
    position: Vec3,
}

impl<'a> Watch<'a> {
    fn new(initial: &'a [InitialParticle], parameters: &'a Parameters, steps: usize) -> Self {
        let fluid = || initial.iter().filter(|p| p.kind == Kind::Fluid);
        let heights = || fluid().map(|p| p.position[1]);
        let (low, high) =
            (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
        let depth_m = (high - low).max(0.0) + parameters.particle_distance_m;
        let gravity = parameters.effects.gravity.map_or([0.0; 3], |g| g.acceleration_m_s2);
        let surface_m = high + 0.5 * parameters.particle_distance_m;
        let mut watch = Watch {
            initial,
            parameters,
            steps,
            steps_done: 0,
            depth_m,
            gravity,
            start_energy: 0.0,
            most_energy: f64::NEG_INFINITY,
            max_speed_m_s: 0.0,
            late_speed_m_s: 0.0,
            max_pressure_pa: 0.0,
            cg_iterations: 0,
            last: Vec::new(),
            left: 0,
            not_finite: 0,
            leaks: LeakWatch::new(initial, parameters.particle_distance_m),
            front: FrontWatch::new(steps as f64 * parameters.time_step_s),
            profile: Profile::new(initial, parameters, surface_m),
        };
        let at_start = fluid().map(|p| 0.5 * dot(p.velocity, p.velocity) - dot(gravity, p.position));
        watch.start_energy = at_start.sum::<f64>() - fluid().count() as f64 * watch.least_potential();
        watch
    }

    /// Potential energy of a particle as deep as the deepest one at the start, J/kg.
    fn least_potential(&self) -> f64 {
        let fluid = self.initial.iter().filter(|p| p.kind == Kind::Fluid);
        let least = fluid.map(|p| -dot(self.gravity, p.position)).fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { 0.0 }
    }

    fn look(&mut self, particles: &Particles, report: StepReport) {
        self.steps_done += 1;
        let late = 2 * self.steps_done > self.steps;
        let flow = FlowState::of(particles);
        let energy = energy(particles, self.gravity);
        let energy = energy.kinetic + energy.potential - flow.fluid as f64 * self.least_potential();
        self.most_energy = self.most_energy.max(energy);
        self.max_speed_m_s = self.max_speed_m_s.max(flow.max_speed_m_s);
        if late {
            self.late_speed_m_s = self.late_speed_m_s.max(flow.max_speed_m_s);
        }
        self.max_pressure_pa = self.max_pressure_pa.max(flow.max_pressure_pa);
        self.cg_iterations += report.pressure.map_or(0, |solve| solve.cg.iterations);
        self.left = report.ghosts;
        self.leaks.look(particles);
        self.front.look(self.steps_done as f64 * self.parameters.time_step_s, flow.front_p99_m);
        if let Some(profile) = self.profile.as_mut().filter(|_| late) {
            profile.look(particles);
        }
        if self.steps_done == self.steps {
            self.look_last(particles);
        }
    }

    fn look_last(&mut self, particles: &Particles) {
        let fluid = (0..particles.len()).filter(|&i| particles.kind[i] == Kind::Fluid);
        self.last = fluid.map(|index| Alive { index, position: particles.position[index] }).collect();
        let broken = |i: usize| {
            let pressure = particles.pressure.get(i).copied().unwrap_or(0.0);
            !is_finite(particles.position[i]) || !is_finite(particles.velocity[i]) || !pressure.is_finite()
        };
        self.not_finite = (0..particles.len()).filter(|&i| broken(i)).count();
    }

    fn quantities(&self) -> BTreeMap<Quantity, f64> {
        let fluid = self.initial.iter().filter(|p| p.kind == Kind::Fluid).count() as f64;
        let mut found = BTreeMap::from([(Quantity::Fluid, fluid)]);
        if self.steps_done == 0 {
            return found;
        }
        let (l0, time_step_s) = (self.parameters.particle_distance_m, self.parameters.time_step_s);
        found.insert(Quantity::Left, self.left as f64);
        found.insert(Quantity::Leaks, self.leaks.count() as f64);
        found.insert(Quantity::MaxSpeed, self.max_speed_m_s);
        found.insert(Quantity::MaxCourant, self.max_speed_m_s * time_step_s / l0);
        found.insert(Quantity::CgIterations, self.cg_iterations as f64 / self.steps_done as f64);
        if self.start_energy > 0.0 {
            found.insert(Quantity::EnergyRise, (self.most_energy / self.start_energy - 1.0).max(0.0));
        }
        let g = dot(self.gravity, self.gravity).sqrt();
        if g > 0.0 {
            let hydrostatic_pa = self.parameters.density_kg_m3 * g * self.depth_m;
            found.insert(Quantity::PeakPressure, self.max_pressure_pa / hydrostatic_pa);
            found.insert(Quantity::LateSpeed, self.late_speed_m_s / (g * self.depth_m).sqrt());
        }
        if let Some(profile) = &self.profile {
            found.extend(profile.quantities());
        }
        if self.steps_done == self.steps {
            self.add_last(&mut found);
        }
        found
    }

    /// What the last state alone shows.
    fn add_last(&self, found: &mut BTreeMap<Quantity, f64>) {
        let fluid = self.initial.iter().filter(|p| p.kind == Kind::Fluid).count() as f64;
        let alive = self.last.len() as f64;
        found.insert(Quantity::Alive, alive);
        found.insert(Quantity::Missing, fluid - alive - self.left as f64);
        found.insert(Quantity::NotFinite, self.not_finite as f64);
        if let Some(front) = self.front.samples.last() {
            found.insert(Quantity::FrontP99, front.front_p99_m);
        }
        if self.last.is_empty() {
            return;
        }
        let share = 1.0 / alive;
        let moved = |p: &Alive| sub(p.position, self.initial[p.index].position);
        let drift = self.last.iter().fold([0.0; 3], |sum, p| add_scaled(sum, share, moved(p)));
        let length = |v: Vec3| dot(v, v).sqrt();
        found.insert(Quantity::CentreDrift, length(drift) / self.depth_m);
        if self.initial.iter().all(|p| p.kind == Kind::Fluid) {
            let furthest = self.last.iter().map(|p| length(sub(moved(p), drift))).fold(0.0, f64::max);
            found.insert(Quantity::ShapeChange, furthest / self.parameters.particle_distance_m);
            let fall = self.free_fall();
            found.insert(Quantity::FallError, length(sub(drift, fall)) / length(fall));
        }
    }

    /// Where free fall takes the centre of mass in the scheme's steps: `u += g dt`, then `x += u dt`.
    fn free_fall(&self) -> Vec3 {
        let (n, dt) = (self.steps_done as f64, self.parameters.time_step_s);
        let share = 1.0 / self.last.len() as f64;
        let velocity =
            self.last.iter().fold([0.0; 3], |sum, p| add_scaled(sum, share, self.initial[p.index].velocity));
        add_scaled(scale(n * dt, velocity), 0.5 * n * (n + 1.0) * dt * dt, self.gravity)
    }
}

/// The front at equal parts of the run, interpolated between steps.
struct FrontWatch {
    end_s: f64,
    before: Option<FrontSample>,
    samples: Vec<FrontSample>,
}

impl FrontWatch {
    fn new(end_s: f64) -> Self {
        FrontWatch { end_s, before: None, samples: Vec::new() }
    }

    fn look(&mut self, time_s: f64, front_p99_m: f64) {
        let now = FrontSample { time_s, front_p99_m };
        let before = self.before.unwrap_or(now);
        loop {
            let due_s = self.end_s * (self.samples.len() + 1) as f64 / FRONT_SAMPLES as f64;
            // Rounding may put the last step a hair before the end.
            if self.samples.len() == FRONT_SAMPLES || due_s > time_s + 1e-9 * self.end_s {
                break;
            }
            let span = now.time_s - before.time_s;
            let share = if span > 0.0 { ((due_s - before.time_s) / span).clamp(0.0, 1.0) } else { 1.0 };
            let front_p99_m = before.front_p99_m + share * (now.front_p99_m - before.front_p99_m);
            self.samples.push(FrontSample { time_s: due_s, front_p99_m });
        }
        self.before = Some(now);
    }
}

/// The pressure of still water: its mean over time in layers one particle distance high, and its course at the middle of
/// the floor.
struct Profile {
    particle_distance_m: f64,
    surface_m: f64,
    /// Pascals a metre.
    gradient_pa_m: f64,
    depth_m: f64,
    /// Sums of pressure and of height, and the count, by layer.
    layers: BTreeMap<i64, (f64, f64, f64)>,
    /// The wall particle under the middle of the fluid.
    floor: usize,
    floor_pressure_pa: Vec<f64>,
}

impl Profile {
    /// `None` where there is no pressure, no gravity along -y, or where walls do not hold the fluid on all sides.
    fn new(initial: &[InitialParticle], parameters: &Parameters, surface_m: f64) -> Option<Self> {
        parameters.effects.pressure?;
        let [gx, gy, gz] = parameters.effects.gravity?.acceleration_m_s2;
        let fluid = || initial.iter().filter(|p| p.kind == Kind::Fluid);
        let count = fluid().count() as f64;
        let lowest = fluid().map(|p| p.position[1]).fold(f64::INFINITY, f64::min);
        let middle = |d: usize| fluid().map(|p| p.position[d]).sum::<f64>() / count;
        let centre = [middle(0), lowest - parameters.particle_distance_m, middle(2)];
        let off = |i: &usize| {
            let away = sub(initial[*i].position, centre);
            dot(away, away)
        };
        let walls = (0..initial.len()).filter(|&i| initial[i].kind == Kind::Wall);
        let floor = walls.min_by(|a, b| off(a).total_cmp(&off(b)))?;
        let still = gx == 0.0 && gz == 0.0 && gy < 0.0 && is_held(initial, parameters.particle_distance_m);
        still.then_some(Profile {
            particle_distance_m: parameters.particle_distance_m,
            surface_m,
            gradient_pa_m: -gy * parameters.density_kg_m3,
            depth_m: surface_m - lowest + 0.5 * parameters.particle_distance_m,
            layers: BTreeMap::new(),
            floor,
            floor_pressure_pa: Vec::new(),
        })
    }

    fn look(&mut self, particles: &Particles) {
        for (i, kind) in particles.kind.iter().enumerate() {
            let height_m = particles.position[i][1];
            if *kind == Kind::Fluid && height_m < self.surface_m {
                let layer = (height_m / self.particle_distance_m).round() as i64;
                let (pressure, height, count) = self.layers.entry(layer).or_default();
                (*pressure, *height) = (*pressure + particles.pressure[i], *height + height_m);
                *count += 1.0;
            }
        }
        self.floor_pressure_pa.push(particles.pressure[self.floor]);
    }

    /// `sqrt(sum (p - rho g h)^2 / sum (rho g h)^2)` over the layers' means, and the noise.
    fn quantities(&self) -> Vec<(Quantity, f64)> {
        let (mut wrong, mut right) = (0.0, 0.0);
        for (pressure, height, count) in self.layers.values() {
            let exact = self.gradient_pa_m * (self.surface_m - height / count);
            wrong += (pressure / count - exact).powi(2);
            right += exact * exact;
        }
        let (Some(deviation), true) = (standard_deviation(&self.floor_pressure_pa), right > 0.0) else {
            return Vec::new();
        };
        let noise = deviation / (self.gradient_pa_m * self.depth_m);
        vec![(Quantity::ProfileError, (wrong / right).sqrt()), (Quantity::PressureNoise, noise)]
    }
}

/// Whether a wall particle stands a particle distance beyond the fluid on each of its four upright sides.
fn is_held(initial: &[InitialParticle], particle_distance_m: f64) -> bool {
    let fluid = || initial.iter().filter(|p| p.kind == Kind::Fluid);
    let low = [0, 1, 2].map(|d| fluid().map(|p| p.position[d]).fold(f64::INFINITY, f64::min));
    let high = [0, 1, 2].map(|d| fluid().map(|p| p.position[d]).fold(f64::NEG_INFINITY, f64::max));
    let wall_at = |d: usize, x: f64| {
        initial.iter().any(|p| {
            let beside = (0..3).all(|e| e == d || (low[e]..=high[e]).contains(&p.position[e]));
            p.kind == Kind::Wall && (p.position[d] - x).abs() < 0.1 * particle_distance_m && beside
        })
    };
    let l0 = particle_distance_m;
    [0, 2].into_iter().all(|d| wall_at(d, low[d] - l0) && wall_at(d, high[d] + l0))
}
