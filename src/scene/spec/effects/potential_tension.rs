//! `[effects.potential_tension]`

use serde::Deserialize;

use super::EffectTable;
use crate::base::input::{Check, InputError};
use crate::engine::effects::potential_tension::{PotentialTension, wetting};
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PotentialTensionSpec {
    /// Of the fluid against the empty space around it, newtons per metre.
    pub surface_tension_n_m: f64,
    /// How far particles attract each other, in particle distances; without the key the Laplacian's radius.
    pub radius: Option<f64>,
    /// Between a wall and the fluid's surface, measured in the fluid, degrees: 0 wets all walls, 180 shuns them.
    #[serde(default = "a_right_angle")]
    pub contact_angle_deg: f64,
}

pub(super) fn a_right_angle() -> f64 {
    90.0
}

/// Refuses what is no tension, or no angle.
pub(super) fn check_tension(
    check: Check<'_>,
    key: &str,
    tension: f64,
    angle_deg: f64,
) -> Result<(), InputError> {
    check.not_negative(&format!("{key}.surface_tension_n_m"), tension)?;
    let allowed = "allowed are angles from 0 to 180 degrees";
    let is_angle = (0.0..=180.0).contains(&angle_deg);
    check.require(is_angle, &format!("{key}.contact_angle_deg"), angle_deg, allowed)
}

/// Refuses radii without neighbours, and endless ones.
pub(super) fn check_radius(check: Check<'_>, key: &str, radius: Option<f64>) -> Result<(), InputError> {
    let allowed = "allowed are radii from 1.5 to 10 particle distances; without the key the default";
    let radius = radius.unwrap_or(2.0);
    check.require((1.5..=10.0).contains(&radius), &format!("{key}.radius"), radius, allowed)
}

impl EffectTable for PotentialTensionSpec {
    type Effect = PotentialTension;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check_tension(check, key, self.surface_tension_n_m, self.contact_angle_deg)?;
        check_radius(check, key, self.radius)
    }

    fn effect(&self, _scene: &Scene) -> PotentialTension {
        PotentialTension {
            surface_tension_n_m: self.surface_tension_n_m,
            radius: self.radius,
            wetting: wetting(self.contact_angle_deg),
        }
    }
}
