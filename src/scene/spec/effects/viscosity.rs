//! `[effects.viscosity]`

use serde::Deserialize;

use super::EffectTable;
use crate::base::input::{Check, InputError};
use crate::engine::effects::viscosity::Viscosity;
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ViscositySpec {
    pub kinematic_viscosity_m2_s: f64,
}

impl EffectTable for ViscositySpec {
    type Effect = Viscosity;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check.not_negative(&format!("{key}.kinematic_viscosity_m2_s"), self.kinematic_viscosity_m2_s)
    }

    fn effect(&self, _scene: &Scene) -> Viscosity {
        Viscosity { kinematic_viscosity_m2_s: self.kinematic_viscosity_m2_s }
    }
}
