//! `[effects.wall_contact]`, in particle distances

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, VECTOR};
use crate::base::input::{Check, InputError};
use crate::engine::effects::wall_contact::WallContact;
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct WallContactSpec {
    pub height: f64,
    pub reach: f64,
}

impl EffectTable for WallContactSpec {
    type Effect = WallContact;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        for (name, value) in [("height", self.height), ("reach", self.reach)] {
            let (key, allowed) = (format!("{key}.{name}"), "allowed are numbers between 0 and 1.5");
            check.require(value > 0.0 && value < 1.5, &key, value, allowed)?;
        }
        Ok(())
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        of.particles * 2 * VECTOR
    }

    fn effect(&self, _scene: &Scene) -> WallContact {
        WallContact { height: self.height, reach: self.reach }
    }
}
