//! `[effects.surface_tension]`

use serde::Deserialize;

use super::EffectTable;
use super::potential_tension::{a_right_angle, check_radius, check_tension};
use crate::base::input::{Check, InputError};
use crate::engine::effects::potential_tension::wetting;
use crate::engine::effects::surface_tension::SurfaceTension;
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SurfaceTensionSpec {
    /// Of the fluid against the empty space around it, newtons per metre.
    pub surface_tension_n_m: f64,
    /// How far the curvature is looked for, in particle distances; without the key the Laplacian's radius.
    pub radius: Option<f64>,
    /// Between a wall and the fluid's surface, measured in the fluid, degrees: 0 wets all walls, 180 shuns them.
    #[serde(default = "a_right_angle")]
    pub contact_angle_deg: f64,
}

impl EffectTable for SurfaceTensionSpec {
    type Effect = SurfaceTension;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check_tension(check, key, self.surface_tension_n_m, self.contact_angle_deg)?;
        check_radius(check, key, self.radius)
    }

    fn effect(&self, _scene: &Scene) -> SurfaceTension {
        SurfaceTension {
            surface_tension_n_m: self.surface_tension_n_m,
            radius: self.radius,
            wetting: wetting(self.contact_angle_deg),
        }
    }
}
