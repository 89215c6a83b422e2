//! `[effects.buoyancy]`

use serde::Deserialize;

use super::EffectTable;
use crate::base::input::{Check, InputError};
use crate::base::vec3::ZERO;
use crate::engine::effects::buoyancy::Buoyancy;
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct BuoyancySpec {
    /// The volume's relative growth per kelvin.
    pub expansion_1_k: f64,
    /// The temperature at which the fluid has its density.
    pub reference_k: f64,
    /// In a box without a free surface: leave out the weight of the fluid at that temperature, so that pressure is what
    /// is beyond the hydrostatic one.
    #[serde(default)]
    pub without_weight: bool,
}

impl EffectTable for BuoyancySpec {
    type Effect = Buoyancy;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check.finite(&format!("{key}.expansion_1_k"), self.expansion_1_k)?;
        check.finite(&format!("{key}.reference_k"), self.reference_k)
    }

    fn effect(&self, scene: &Scene) -> Buoyancy {
        Buoyancy {
            expansion_1_k: self.expansion_1_k,
            reference_k: self.reference_k,
            gravity_m_s2: scene.effects.gravity.as_ref().map_or(ZERO, |gravity| gravity.acceleration_m_s2),
            without_weight: self.without_weight,
        }
    }
}
