//! `[effects.wall_motion]`, and the motions of groups

use serde::Deserialize;

use super::EffectTable;
use super::columns::{Counted, VECTOR};
use crate::base::input::{Check, InputError};
use crate::base::vec3::{Vec3, dot, scale};
use crate::engine::effects::wall_motion::{Hinge, Motion, Pose, WallMotion};
use crate::scene::Scene;
use crate::scene::number_table::TableFile;

/// Walls of groups with a `motion` move.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct WallMotionSpec {}

/// How the walls of a group move, from rest in the place where the scene puts them.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum MotionSpec {
    /// Back and forth along a line: a piston.
    Oscillation(OscillationSpec),
    /// Back and forth about an axis.
    Rocking(RockingSpec),
    /// Round and round an axis.
    Turning(TurningSpec),
    /// As a CSV file says.
    Table(TableSpec),
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct OscillationSpec {
    /// Displacement from the middle: half the stroke.
    pub amplitude_m: Vec3,
    pub frequency_hz: f64,
    #[serde(default)]
    pub phase_rad: f64,
    /// How long the motion takes to reach its amplitude.
    #[serde(default)]
    pub ramp_s: f64,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct RockingSpec {
    pub amplitude_rad: f64,
    pub frequency_hz: f64,
    #[serde(default)]
    pub phase_rad: f64,
    /// How long the motion takes to reach its amplitude.
    #[serde(default)]
    pub ramp_s: f64,
    /// A point on the axis.
    pub point_m: Vec3,
    /// Of any length but zero.
    #[serde(default = "z_axis")]
    pub axis: Vec3,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TurningSpec {
    pub rate_rad_s: f64,
    /// How long the motion takes to reach its rate, in proportion to time.
    #[serde(default)]
    pub ramp_s: f64,
    /// A point on the axis.
    pub point_m: Vec3,
    /// Of any length but zero.
    #[serde(default = "z_axis")]
    pub axis: Vec3,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct TableSpec {
    /// A CSV file with the columns time_s, x_m, y_m, z_m, angle_rad, of which the first row is the place at the start:
    /// straight between its times, at rest before and after them.
    pub file: TableFile,
    /// A point on the axis at the start.
    #[serde(default)]
    pub point_m: Vec3,
    /// Of any length but zero.
    #[serde(default = "z_axis")]
    pub axis: Vec3,
}

fn z_axis() -> Vec3 {
    [0.0, 0.0, 1.0]
}

fn hinge(point_m: Vec3, axis: Vec3) -> Hinge {
    Hinge { point_m, axis: scale(1.0 / dot(axis, axis).sqrt(), axis) }
}

impl MotionSpec {
    pub(in crate::scene::spec) fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let number = |name: &str, value: f64| check.finite(&format!("{key}.{name}"), value);
        let hinge = |point_m: Vec3, axis: Vec3| {
            check.finite_vector(&format!("{key}.point_m"), point_m)?;
            check.direction(&format!("{key}.axis"), axis)
        };
        let swing = |frequency_hz: f64, phase_rad: f64| {
            check.positive(&format!("{key}.frequency_hz"), frequency_hz)?;
            number("phase_rad", phase_rad)
        };
        let ramp = |value: f64| check.not_negative(&format!("{key}.ramp_s"), value);
        match self {
            MotionSpec::Oscillation(m) => {
                check.finite_vector(&format!("{key}.amplitude_m"), m.amplitude_m)?;
                swing(m.frequency_hz, m.phase_rad)?;
                ramp(m.ramp_s)
            }
            MotionSpec::Rocking(m) => {
                number("amplitude_rad", m.amplitude_rad)?;
                swing(m.frequency_hz, m.phase_rad)?;
                hinge(m.point_m, m.axis)?;
                ramp(m.ramp_s)
            }
            MotionSpec::Turning(m) => {
                number("rate_rad_s", m.rate_rad_s)?;
                hinge(m.point_m, m.axis)?;
                ramp(m.ramp_s)
            }
            MotionSpec::Table(m) => {
                hinge(m.point_m, m.axis)?;
                let columns = ["time_s", "x_m", "y_m", "z_m", "angle_rad"];
                m.file.read(check, &format!("{key}.table.file"), &columns)
            }
        }
    }

    fn to_engine(&self) -> Motion {
        match self {
            MotionSpec::Oscillation(m) => {
                let OscillationSpec { amplitude_m, frequency_hz, phase_rad, ramp_s } = *m;
                Motion::Oscillation { amplitude_m, frequency_hz, phase_rad, ramp_s }
            }
            MotionSpec::Rocking(m) => {
                let RockingSpec { amplitude_rad, frequency_hz, phase_rad, ramp_s, point_m, axis } = *m;
                Motion::Rocking {
                    hinge: hinge(point_m, axis),
                    amplitude_rad,
                    frequency_hz,
                    phase_rad,
                    ramp_s,
                }
            }
            MotionSpec::Turning(m) => {
                let TurningSpec { rate_rad_s, ramp_s, point_m, axis } = *m;
                Motion::Turning { hinge: hinge(point_m, axis), rate_rad_s, ramp_s }
            }
            MotionSpec::Table(m) => Motion::Table { hinge: hinge(m.point_m, m.axis), curve: m.file.curve() },
        }
    }
}

impl EffectTable for WallMotionSpec {
    type Effect = WallMotion;

    fn check(&self, _check: Check<'_>, _key: &str) -> Result<(), InputError> {
        Ok(())
    }

    fn column_bytes(&self, of: &Counted<'_>) -> usize {
        of.particles * VECTOR + of.scene.group_names().len() * size_of::<Option<Pose>>()
    }

    fn effect(&self, scene: &Scene) -> WallMotion {
        let motion = |name: String| {
            let named = scene.group.iter().find(|group| group.name == name);
            named.and_then(|group| group.motion.as_ref()).map(MotionSpec::to_engine)
        };
        WallMotion { by_group: scene.group_names().into_iter().map(motion).collect() }
    }
}
