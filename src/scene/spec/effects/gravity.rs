//! `[effects.gravity]`

use serde::Deserialize;

use super::EffectTable;
use crate::base::input::{Check, InputError};
use crate::base::vec3::Vec3;
use crate::engine::effects::gravity::Gravity;
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct GravitySpec {
    pub acceleration_m_s2: Vec3,
}

impl EffectTable for GravitySpec {
    type Effect = Gravity;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check.finite_vector(&format!("{key}.acceleration_m_s2"), self.acceleration_m_s2)
    }

    fn effect(&self, _scene: &Scene) -> Gravity {
        Gravity { acceleration_m_s2: self.acceleration_m_s2 }
    }
}
