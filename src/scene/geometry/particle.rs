//! Particles beside the lattice.

use serde::Deserialize;

use super::placement::Placement;
use super::region::{check_group, check_velocity};
use crate::base::input::{Check, InputError};
use crate::base::vec3::{Vec3, ZERO, is_finite};
use crate::engine::particles::{InitialParticle, Kind};

/// One particle wherever the scene wants it, even where another one is.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SingleParticle {
    /// What it is.
    pub kind: SingleKind,
    /// Metres.
    pub position_m: Vec3,
    /// Velocity at the start, metres per second; fluid only.
    #[serde(default)]
    pub velocity_m_s: Vec3,
    /// A name by which it can be addressed; regions and particles may share it.
    pub group: Option<String>,
}

/// What a single particle is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SingleKind {
    /// Moves.
    Fluid,
    /// Stands still and has a pressure.
    Wall,
    /// Stands still and has none.
    DummyWall,
}

impl SingleParticle {
    pub(super) fn check(
        &self,
        check: Check<'_>,
        key: &str,
        placement: &Placement<'_>,
    ) -> Result<(), InputError> {
        let (found, position) = (format!("{:?}", self.position_m), format!("{key}.position_m"));
        check.require(is_finite(self.position_m), &position, &found, "allowed are three finite numbers")?;
        let plane = placement.dimensions == 3 || self.position_m[2] == 0.0;
        check.require(plane, &position, &found, "in two dimensions the third number must be 0")?;
        let velocity = format!("{key}.velocity_m_s");
        check_velocity(self.velocity_m_s, check, &velocity, placement.dimensions)?;
        // Viscosity and collision would see a wall that moves and yet stays where it is.
        check.require(
            self.kind == SingleKind::Fluid || self.velocity_m_s == ZERO,
            &velocity,
            format!("{:?}", self.velocity_m_s),
            "only fluid particles may move",
        )?;
        self.group.as_ref().map_or(Ok(()), |group| check_group(group, check, key))
    }

    pub(super) fn place(&self, group: u8) -> InitialParticle {
        let kind = match self.kind {
            SingleKind::Fluid => Kind::Fluid,
            SingleKind::Wall => Kind::Wall,
            SingleKind::DummyWall => Kind::DummyWall,
        };
        InitialParticle {
            velocity: self.velocity_m_s,
            group,
            ..InitialParticle::at_rest(kind, self.position_m)
        }
    }
}
