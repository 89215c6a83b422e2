//! `[effects.collision]`

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, VECTOR};
use crate::base::input::{Check, InputError};
use crate::engine::effects::collision::Collision;
use crate::scene::Scene;

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CollisionSpec {
    /// In particle distances.
    pub distance: f64,
    pub restitution: f64,
}

impl EffectTable for CollisionSpec {
    type Effect = Collision;

    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let (distance, allowed) = (self.distance, "allowed are numbers between 0 and 1");
        check.require(distance > 0.0 && distance < 1.0, &format!("{key}.distance"), distance, allowed)?;
        let (restitution, allowed) = (self.restitution, "allowed are numbers from 0 to 1");
        let key = format!("{key}.restitution");
        check.require((0.0..=1.0).contains(&restitution), &key, restitution, allowed)
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        of.particles * VECTOR
    }

    fn effect(&self, _scene: &Scene) -> Collision {
        Collision { distance: self.distance, restitution: self.restitution }
    }
}
