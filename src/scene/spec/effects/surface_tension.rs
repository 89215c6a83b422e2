//! `[effects.surface_tension]`

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, SCALAR};
use super::potential_tension::check_radius;
use crate::base::input::{Check, InputError};
use crate::engine::effects::surface_tension::SurfaceTension;
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SurfaceTensionSpec {
    /// Of the fluid against the empty space around it, newtons per metre.
    pub surface_tension_n_m: f64,
    /// How far a particle looks for what it lacks, in particle distances; without the key 4.1.
    pub radius: Option<f64>,
}

impl EffectTable for SurfaceTensionSpec {
    type Effect = SurfaceTension;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check.not_negative(&format!("{key}.surface_tension_n_m"), self.surface_tension_n_m)?;
        check_radius(check, key, self.radius)
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        of.particles * SCALAR
    }

    fn effect(&self, _scene: &Scene) -> SurfaceTension {
        SurfaceTension { surface_tension_n_m: self.surface_tension_n_m, radius: self.radius }
    }
}
