//! `[effects.scalar]`, and what groups have of it

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, SCALAR};
use super::heat::LaplacianSpec;
use crate::base::input::{Check, InputError};
use crate::engine::effects::diffusion::{Diffusion, WallCondition};
use crate::engine::parameters::Property;
use crate::scene::Scene;
use crate::scene::spec::GroupSpec;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ScalarSpec {
    pub diffusivity_m2_s: f64,
    /// Of all particles whose group has no concentration of its own, in the scene's own unit.
    pub initial: f64,
    #[serde(default)]
    pub laplacian: LaplacianSpec,
}

impl EffectTable for ScalarSpec {
    type Effect = Diffusion;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check.not_negative(&format!("{key}.diffusivity_m2_s"), self.diffusivity_m2_s)?;
        check.finite(&format!("{key}.initial"), self.initial)
    }

    fn check_scene(&self, check: Check<'_>, scene: &Scene) -> Result<(), InputError> {
        for (k, group) in scene.group.iter().enumerate() {
            if let Some(diffusivity) = group.diffusivity_m2_s {
                check.not_negative(&format!("group[{k}].diffusivity_m2_s"), diffusivity)?;
            }
        }
        Ok(())
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        of.particles * 2 * SCALAR
    }

    fn effect(&self, scene: &Scene) -> Diffusion {
        let wall = |group: Option<&GroupSpec>| {
            let held = group.and_then(|group| group.concentration);
            held.map_or(WallCondition::Flux(0.0), WallCondition::Value)
        };
        Diffusion {
            conductivity: scene.property(self.diffusivity_m2_s, |group| group.diffusivity_m2_s),
            capacity: Property::Uniform(1.0),
            walls: scene.by_group(wall),
            laplacian: self.laplacian.to_engine(),
        }
    }
}
