//! `[effects.rigid_bodies]`, and what holds the bodies of groups

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, INDEX, VECTOR};
use crate::base::input::{Check, InputError};
use crate::engine::effects::rigid_bodies::{Fixed, RigidBodies};
use crate::scene::Scene;

/// The `body` regions of a group are one rigid body, moved by the fluid.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct RigidBodiesSpec {}

/// A component of a body's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum FixedAxis {
    X,
    Y,
    Z,
    RotationX,
    RotationY,
    RotationZ,
}

fn to_engine(axes: &[FixedAxis]) -> Fixed {
    use FixedAxis::{RotationX, RotationY, RotationZ, X, Y, Z};
    Fixed {
        translation: [X, Y, Z].map(|axis| axes.contains(&axis)),
        rotation: [RotationX, RotationY, RotationZ].map(|axis| axes.contains(&axis)),
    }
}

impl EffectTable for RigidBodiesSpec {
    type Effect = RigidBodies;

    fn check(&self, _check: Check<'_>, _key: &str) -> Result<(), InputError> {
        Ok(())
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        of.bodies * (INDEX + VECTOR)
    }

    fn effect(&self, scene: &Scene) -> RigidBodies {
        let fixed = |name: String| {
            let named = scene.group.iter().find(|group| group.name == name);
            named.map_or(Fixed::default(), |group| to_engine(&group.fixed))
        };
        RigidBodies { fixed: scene.group_names().into_iter().map(fixed).collect() }
    }
}
