//! What is looked at after every step of an observed run, and the numbers that come of it.

use std::collections::BTreeMap;

use crate::base::vec3::{Vec3, add_scaled, dot, is_finite, scale, sub};
use crate::engine::diagnostics::{FlowState, LeakWatch, energy};
use crate::engine::parameters::Parameters;
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::engine::simulation::StepReport;
use crate::experiment::observe::front::FrontWatch;
use crate::experiment::observe::profile::Profile;
use crate::experiment::quantity::Quantity;
use crate::scene::Scene;

/// Looks at a run after every step. `H`, the fluid's depth, counts half a particle distance below its lowest and above
/// its highest particle.
pub struct Watch<'a> {
    initial: &'a [InitialParticle],
    parameters: &'a Parameters,
    scene: &'a Scene,
    /// Simulated time after the last step, seconds.
    time_s: f64,
    pub steps_done: usize,
    depth_m: f64,
    gravity: Vec3,
    start_energy: f64,
    most_energy: f64,
    max_speed_m_s: f64,
    max_courant: f64,
    late_speed_m_s: f64,
    max_pressure_pa: f64,
    /// At the end, J/kg.
    kinetic_energy: f64,
    /// At the end; `None` in a scene without heat.
    mean_temperature: Option<f64>,
    mean_concentration: Option<f64>,
    cg_iterations: usize,
    last: Vec<Alive>,
    left: usize,
    not_finite: usize,
    leaks: LeakWatch,
    pub front: FrontWatch,
    profile: Option<Profile>,
}

/// When a run ends, seconds.
fn end_s(scene: &Scene) -> f64 {
    match scene.adaptive_time_step {
        None => scene.steps() as f64 * scene.time_step_s,
        Some(_) => scene.end_time_s,
    }
}

/// A fluid particle that is still there.
#[derive(Debug, Clone, Copy)]
struct Alive {
    index: usize,
    position: Vec3,
}

impl<'a> Watch<'a> {
    pub fn new(initial: &'a [InitialParticle], parameters: &'a Parameters, scene: &'a Scene) -> Self {
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
            scene,
            time_s: 0.0,
            steps_done: 0,
            depth_m,
            gravity,
            start_energy: 0.0,
            most_energy: f64::NEG_INFINITY,
            max_speed_m_s: 0.0,
            max_courant: 0.0,
            late_speed_m_s: 0.0,
            max_pressure_pa: 0.0,
            kinetic_energy: 0.0,
            mean_temperature: None,
            mean_concentration: None,
            cg_iterations: 0,
            last: Vec::new(),
            left: 0,
            not_finite: 0,
            leaks: LeakWatch::new(initial, parameters.particle_distance_m),
            front: FrontWatch::new(end_s(scene)),
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

    pub fn look(&mut self, particles: &Particles, report: StepReport) {
        self.steps_done += 1;
        // The sum of equal steps gathers rounding errors, their product does not.
        self.time_s = match self.scene.adaptive_time_step {
            None => self.steps_done as f64 * self.parameters.time_step_s,
            Some(_) => report.time_s,
        };
        let late = match self.scene.adaptive_time_step {
            None => 2 * self.steps_done > self.scene.steps(),
            Some(_) => 2.0 * self.time_s > self.scene.end_time_s,
        };
        let flow = FlowState::of(particles);
        let energy = energy(particles, self.gravity);
        let energy = energy.kinetic + energy.potential - flow.fluid as f64 * self.least_potential();
        self.most_energy = self.most_energy.max(energy);
        self.max_speed_m_s = self.max_speed_m_s.max(flow.max_speed_m_s);
        let courant = flow.max_speed_m_s * report.time_step_s / self.parameters.particle_distance_m;
        self.max_courant = self.max_courant.max(courant);
        if late {
            self.late_speed_m_s = self.late_speed_m_s.max(flow.max_speed_m_s);
        }
        self.max_pressure_pa = self.max_pressure_pa.max(flow.max_pressure_pa);
        self.cg_iterations += report.pressure.map_or(0, |solve| solve.cg.iterations);
        self.left = report.ghosts;
        self.leaks.look(particles);
        self.front.look(self.time_s, flow.front_p99_m);
        if let Some(profile) = self.profile.as_mut().filter(|_| late) {
            profile.look(particles);
        }
        if self.scene.is_over(self.steps_done, self.time_s) {
            self.look_last(particles);
        }
    }

    fn look_last(&mut self, particles: &Particles) {
        let alive = particles.count(Kind::Fluid).max(1) as f64;
        self.kinetic_energy = energy(particles, self.gravity).kinetic / alive;
        let mean = |column: &[f64]| {
            let fluid = column.iter().zip(&particles.kind).filter(|&(_, kind)| *kind == Kind::Fluid);
            (!column.is_empty()).then(|| fluid.map(|(value, _)| value).sum::<f64>() / alive)
        };
        (self.mean_temperature, self.mean_concentration) =
            (mean(&particles.temperature), mean(&particles.concentration));
        let fluid = (0..particles.len()).filter(|&i| particles.kind[i] == Kind::Fluid);
        self.last = fluid.map(|index| Alive { index, position: particles.position[index] }).collect();
        let broken = |i: usize| {
            let pressure = particles.pressure.get(i).copied().unwrap_or(0.0);
            !is_finite(particles.position[i]) || !is_finite(particles.velocity[i]) || !pressure.is_finite()
        };
        self.not_finite = (0..particles.len()).filter(|&i| broken(i)).count();
    }

    pub fn quantities(&self) -> BTreeMap<Quantity, f64> {
        let fluid = self.initial.iter().filter(|p| p.kind == Kind::Fluid).count() as f64;
        let mut found = BTreeMap::from([(Quantity::Fluid, fluid)]);
        if self.steps_done == 0 {
            return found;
        }
        found.insert(Quantity::Left, self.left as f64);
        found.insert(Quantity::Leaks, self.leaks.count() as f64);
        found.insert(Quantity::MaxSpeed, self.max_speed_m_s);
        found.insert(Quantity::MaxCourant, self.max_courant);
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
        if self.scene.is_over(self.steps_done, self.time_s) {
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
        found.insert(Quantity::KineticEnergy, self.kinetic_energy);
        found.extend(self.mean_temperature.map(|mean| (Quantity::MeanTemperature, mean)));
        found.extend(self.mean_concentration.map(|mean| (Quantity::MeanConcentration, mean)));
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
            if length(fall) > 0.0 {
                found.insert(Quantity::FallError, length(sub(drift, fall)) / length(fall));
            }
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
