//! `[effects.shifting]`

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, SCALAR, VECTOR};
use crate::base::input::{Check, InputError};
use crate::engine::effects::shifting::{AtSurface, Shifting};
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ShiftingSpec {
    /// Shift over the way that neighbours move past each other in a step, times the gradient of their concentration.
    pub strength: f64,
    /// The largest shift of a step, in particle distances.
    #[serde(default = "a_tenth")]
    pub limit: f64,
    /// What happens near a free surface.
    #[serde(default)]
    pub surface: ShiftingSurface,
}

fn a_tenth() -> f64 {
    0.1
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum ShiftingSurface {
    /// Nothing shifts.
    #[default]
    None,
    /// Only along the surface.
    Tangential,
}

impl EffectTable for ShiftingSpec {
    type Effect = Shifting;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check.not_negative(&format!("{key}.strength"), self.strength)?;
        let (limit, allowed) = (self.limit, "allowed are numbers above 0 up to 0.5");
        check.require(limit > 0.0 && limit <= 0.5, &format!("{key}.limit"), limit, allowed)
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        let effects = &of.scene.effects;
        let carried = usize::from(effects.heat.is_some() || effects.scalar.is_some());
        of.particles * (3 * VECTOR + carried * SCALAR)
    }

    fn effect(&self, _scene: &Scene) -> Shifting {
        let at_surface = match self.surface {
            ShiftingSurface::None => AtSurface::None,
            ShiftingSurface::Tangential => AtSurface::Tangential,
        };
        Shifting { strength: self.strength, limit: self.limit, at_surface }
    }
}
