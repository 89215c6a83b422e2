//! Probes: numbers that are read off the particles while a scene is simulated.
//!
//! ```toml
//! [[probe]]
//! name = "wall"
//! every_steps = 10
//! measure.point_pressure = { at_m = [1.0, 0.05, 0.15] }
//!
//! [[probe]]
//! name = "budget"
//! measure = "energy"
//! ```

pub mod measure;
pub mod near;
pub mod prepared;
pub mod spec;

#[cfg(test)]
mod tests;

use crate::base::input::InputError;
use crate::base::vec3::Vec3;
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::scene::Scene;
use prepared::{Flow, Prepared, Setting};

/// The probes of a scene while it is simulated.
#[derive(Debug)]
pub struct Probes {
    setting: Setting,
    probes: Vec<Prepared>,
    flows: Vec<Flow>,
    /// Kinds and positions after the step before, where a flux is measured.
    before: (Vec<Kind>, Vec<Vec3>),
    /// The group of each particle.
    group: Vec<u8>,
}

impl Probes {
    /// The probes that a scene names, held against its domain; `file` names the scene in errors, `group_number` knows its
    /// groups.
    pub fn new(
        scene: &Scene,
        file: &str,
        initial: &[InitialParticle],
        group_number: &dyn Fn(&str) -> Option<u8>,
    ) -> Result<Probes, InputError> {
        let setting = Setting::new(scene, initial);
        let mut probes = Vec::new();
        for (k, spec) in scene.probe.iter().enumerate() {
            let key = format!("probe[{k}].measure");
            probes.push(Prepared::new(spec, &setting, file, &key, group_number)?);
        }
        let flows = probes.iter().filter_map(Prepared::flow).collect();
        let group = initial.iter().map(|particle| particle.group).collect();
        Ok(Probes { setting, probes, flows, before: Default::default(), group })
    }

    pub fn is_empty(&self) -> bool {
        self.probes.is_empty()
    }

    /// The names of the columns: probe, quantity, unit.
    pub fn columns(&self) -> Vec<String> {
        let columns = |probe: &Prepared| {
            let names = probe.quantities(self.setting.planar);
            names.into_iter().map(|name| format!("{}_{name}", probe.name)).collect::<Vec<_>>()
        };
        self.probes.iter().flat_map(columns).collect()
    }

    /// Looks at the particles after a step, which it must see all of where a flux is measured, and returns a row where one
    /// is due. Probes that are not due have no values in it, nor has a flux at the start.
    pub fn look(&mut self, step: usize, time_s: f64, particles: &Particles) -> Option<Vec<Option<f64>>> {
        for flow in &mut self.flows {
            flow.count(&self.before, particles);
        }
        if !self.flows.is_empty() {
            self.before.0.clone_from(&particles.kind);
            self.before.1.clone_from(&particles.position);
        }
        let due = |probe: &Prepared| step.is_multiple_of(probe.every_steps);
        if !self.probes.iter().any(due) {
            return None;
        }
        let mut flows = self.flows.iter_mut();
        let mut row = Vec::new();
        for probe in &self.probes {
            let flow = if probe.flow().is_some() { flows.next() } else { None };
            let width = probe.quantities(self.setting.planar).len();
            match (due(probe), flow) {
                (false, _) => row.extend(vec![None; width]),
                (true, Some(flow)) => row.push(flow.rate(time_s, self.setting.volume)),
                (true, None) => row.extend(probe.values(&self.setting, particles, &self.group)),
            }
        }
        Some(row)
    }
}
