//! `[effects.pressure]`

use serde::Deserialize;

use super::EffectTable;
use crate::base::input::{Check, InputError};
use crate::engine::pressure::Pressure;
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PressureSpec {
    pub surface_threshold: f64,
    pub source_relaxation: f64,
    pub compressibility_1_pa: f64,
    /// In particle distances.
    pub kernel_floor: Option<f64>,
}

impl EffectTable for PressureSpec {
    type Effect = Pressure;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let shares =
            [("surface_threshold", self.surface_threshold), ("source_relaxation", self.source_relaxation)];
        for (name, value) in shares {
            let (key, allowed) = (format!("{key}.{name}"), "allowed are numbers above 0 up to 1");
            check.require(value > 0.0 && value <= 1.0, &key, value, allowed)?;
        }
        check.not_negative(&format!("{key}.compressibility_1_pa"), self.compressibility_1_pa)?;
        if let Some(floor) = self.kernel_floor {
            let allowed = "allowed are numbers above 0 up to 1; without the key there is no floor";
            check.require(floor > 0.0 && floor <= 1.0, &format!("{key}.kernel_floor"), floor, allowed)?;
        }
        Ok(())
    }

    fn effect(&self, _scene: &Scene) -> Pressure {
        Pressure {
            surface_threshold: self.surface_threshold,
            source_relaxation: self.source_relaxation,
            compressibility_1_pa: self.compressibility_1_pa,
            kernel_floor: self.kernel_floor,
        }
    }
}
