//! Named groups of particles: properties, motions and bodies of their own.

use serde::Deserialize;

use super::Scene;
use super::effects::rigid_bodies::FixedAxis;
use super::effects::wall_motion::MotionSpec;
use crate::base::input::{Check, InputError};
use crate::engine::parameters::Property;
use crate::engine::particles::InitialParticle;
use crate::scene::geometry::Fill;

/// What the particles of a group have of their own. What is not named is the fluid's.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct GroupSpec {
    pub name: String,
    pub density_kg_m3: Option<f64>,
    pub kinematic_viscosity_m2_s: Option<f64>,
    pub conductivity_w_m_k: Option<f64>,
    pub heat_capacity_j_kg_k: Option<f64>,
    pub thermal_diffusivity_m2_s: Option<f64>,
    /// Of fluid at the start; of walls throughout, at their surface.
    pub temperature_k: Option<f64>,
    /// What enters the fluid through walls of the group; nothing where neither it nor a temperature is given.
    pub heat_flux_w_m2: Option<f64>,
    /// Of the passive scalar.
    pub diffusivity_m2_s: Option<f64>,
    /// Of fluid at the start; of walls throughout, at their surface.
    pub concentration: Option<f64>,
    /// How the group's walls move; `effects.wall_motion` must be named.
    pub motion: Option<MotionSpec>,
    /// The components of the group's body that are held at zero; `effects.rigid_bodies` must be named.
    #[serde(default)]
    pub fixed: Vec<FixedAxis>,
}

impl Scene {
    /// A property of the fluid, or of each group if one has a value of its own.
    pub fn property(&self, of_fluid: f64, of_group: impl Fn(&GroupSpec) -> Option<f64>) -> Property {
        if self.group.iter().all(|group| of_group(group).is_none()) {
            return Property::Uniform(of_fluid);
        }
        let value = |name: &String| {
            let named = self.group.iter().find(|group| group.name == *name);
            named.and_then(&of_group).unwrap_or(of_fluid)
        };
        Property::ByGroup(self.group_names().iter().map(value).collect())
    }

    /// What `of` makes of each group, in the order of their numbers.
    pub fn by_group<V>(&self, of: impl Fn(Option<&GroupSpec>) -> V) -> Vec<V> {
        let named = |name: &String| self.group.iter().find(|group| group.name == *name);
        self.group_names().iter().map(|name| of(named(name))).collect()
    }

    /// Gives every particle the temperature and the concentration of its group, or else of the effect's table.
    pub(super) fn set_carried(&self, particles: &mut [InitialParticle]) {
        let temperatures = self.by_group(|group| group.and_then(|group| group.temperature_k));
        let concentrations = self.by_group(|group| group.and_then(|group| group.concentration));
        let own = |values: &[Option<f64>], group: u8| values.get(group as usize).copied().flatten();
        for particle in particles {
            if let Some(heat) = &self.effects.heat {
                particle.temperature = own(&temperatures, particle.group).unwrap_or(heat.initial_k);
            }
            if let Some(scalar) = &self.effects.scalar {
                particle.concentration = own(&concentrations, particle.group).unwrap_or(scalar.initial);
            }
        }
    }

    /// Refuses groups that effects name and the scene does not.
    pub(super) fn check_groups(&self, check: Check<'_>) -> Result<(), InputError> {
        for (k, group) in self.group.iter().enumerate() {
            if let Some(value) = group.kinematic_viscosity_m2_s {
                check.not_negative(&format!("group[{k}].kinematic_viscosity_m2_s"), value)?;
            }
        }
        if let Some(name) = self.effects.rheology.as_ref().and_then(|rheology| rheology.group.as_ref()) {
            let known = self.group.iter().map(|group| group.name.clone()).collect::<Vec<_>>();
            let allowed = format!("allowed are the names of `[[group]]` tables: {}", known.join(", "));
            check.require(known.contains(name), "effects.rheology.group", format!("`{name}`"), allowed)?;
        }
        Ok(())
    }

    /// The number of a group, if particles may belong to it.
    pub fn group_number(&self, name: &str) -> Option<u8> {
        self.group_names().iter().position(|known| known == name).and_then(|k| u8::try_from(k).ok())
    }

    /// The groups by number; the first is that of particles whose region names none.
    pub(super) fn group_names(&self) -> Vec<String> {
        let names = self.geometry.group_names();
        if names.len() > 1 { names } else { Vec::new() }
    }

    /// Refuses motions that nothing carries out.
    pub(super) fn check_motions(&self, check: Check<'_>) -> Result<(), InputError> {
        let names = self.group_names();
        for (k, group) in self.group.iter().enumerate() {
            let key = format!("group[{k}].motion");
            let Some(motion) = &group.motion else { continue };
            motion.check(check, &key)?;
            let allowed = "name `[effects.wall_motion]` as well, or leave the motion out";
            check.require(self.effects.wall_motion.is_some(), &key, "given without its effect", allowed)?;
            let (key, allowed) = (format!("group[{k}].name"), "allowed with a motion are groups of regions");
            check.require(names.contains(&group.name), &key, format!("`{}`", group.name), allowed)?;
        }
        let moves = self.group.iter().any(|group| group.motion.is_some());
        let allowed = "give a `[[group]]` a `motion`, or leave this one out";
        let idle = self.effects.wall_motion.is_some() && !moves;
        check.require(!idle, "effects.wall_motion", "named where no group moves", allowed)
    }

    /// Refuses bodies that nothing keeps rigid.
    pub(super) fn check_bodies(&self, check: Check<'_>) -> Result<(), InputError> {
        let named = self.effects.rigid_bodies.is_some();
        let allowed = "name `[effects.rigid_bodies]` as well, or leave it out";
        for (k, region) in self.geometry.region.iter().enumerate() {
            let key = format!("geometry.region[{k}].fill");
            check.require(named || region.fill != Fill::Body, &key, "`body` without its effect", allowed)?;
        }
        for (k, group) in self.group.iter().enumerate() {
            let key = format!("group[{k}].fixed");
            check.require(named || group.fixed.is_empty(), &key, "given without its effect", allowed)?;
        }
        Ok(())
    }
}
