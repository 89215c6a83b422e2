//! `[effects.turbulence]`

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, SCALAR};
use crate::base::input::{Check, InputError};
use crate::engine::effects::turbulence::Turbulence;
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TurbulenceSpec {
    /// `C_s`, dimensionless; 0.1 to 0.2 are usual.
    pub smagorinsky_constant: f64,
}

impl EffectTable for TurbulenceSpec {
    type Effect = Turbulence;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let (constant, allowed) = (self.smagorinsky_constant, "allowed are numbers from 0 to 1");
        let key = format!("{key}.smagorinsky_constant");
        check.require((0.0..=1.0).contains(&constant), &key, constant, allowed)
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        // The viscosities that a rheology would write as well.
        if of.scene.effects.rheology.is_some() { 0 } else { of.particles * SCALAR }
    }

    fn effect(&self, _scene: &Scene) -> Turbulence {
        Turbulence { smagorinsky_constant: self.smagorinsky_constant }
    }
}
