//! The keys of a probe in a scene file, and their checks.

use serde::Deserialize;

use crate::base::input::{Check, InputError};
use crate::base::vec3::{Vec3, is_finite};

/// Something that is looked at while a scene is simulated, and written to `probes.csv`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ProbeSpec {
    /// Begins the names of the probe's columns: letters, digits, `-` and `_`.
    pub name: String,
    /// Time steps between two rows; without it every step has one.
    #[serde(default = "every_step")]
    pub every_steps: usize,
    /// What is measured.
    pub measure: Measure,
}

/// What a probe measures.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// The pressure at a point, Pa.
    PointPressure(PointPressure),
    /// The height of the free surface on a vertical line, metres.
    Gauge(Gauge),
    /// The volume that goes through a rectangle, m3/s.
    Flux(Flux),
    /// The force of the fluid's pressure on walls, N.
    GroupForce(GroupForce),
    /// Kinetic and potential energy of the fluid, J.
    Energy,
    /// The fluid's centre of mass, metres.
    CentreOfMass,
    /// How far the fluid reaches along an axis, metres.
    Front(Front),
}

/// The mean pressure of fluid and walls around a point.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PointPressure {
    /// The point, metres.
    pub at_m: Vec3,
    /// Particles nearer than this count, the nearest most; metres. Without it three particle distances.
    pub radius_m: Option<f64>,
}

/// A wave gauge: a vertical line.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Gauge {
    /// Metres.
    pub x_m: f64,
    /// Metres; in a planar scene that of its plane.
    pub z_m: f64,
}

/// A rectangle across an axis: `from_m` and `to_m` are equal in that one component and in no other.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Flux {
    /// The lower corner, metres.
    pub from_m: Vec3,
    /// The upper corner, metres.
    pub to_m: Vec3,
}

/// Walls on which the fluid presses.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct GroupForce {
    /// A group that the scene names; without it all walls.
    pub group: Option<String>,
}

/// The direction in which a front is looked for.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Front {
    /// The axis along which the fluid advances.
    pub axis: Axis,
}

/// An axis of space; y points upwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    X,
    Y,
    Z,
}

fn every_step() -> usize {
    1
}

/// Checks what needs no particles: names, numbers, shapes.
pub fn check(probes: &[ProbeSpec], check: Check<'_>) -> Result<(), InputError> {
    for (k, probe) in probes.iter().enumerate() {
        let key = |name: &str| format!("probe[{k}].{name}");
        let name = &probe.name;
        let plain = |letter: char| letter.is_ascii_alphanumeric() || "-_".contains(letter);
        let allowed = "allowed are letters, digits, `-` and `_`";
        check.require(
            !name.is_empty() && name.chars().all(plain),
            &key("name"),
            format!("`{name}`"),
            allowed,
        )?;
        let taken = probes[..k].iter().any(|other| other.name == *name);
        check.require(
            !taken,
            &key("name"),
            format!("`{name}`"),
            "another probe has that name: choose a new one",
        )?;
        check.require(probe.every_steps > 0, &key("every_steps"), 0, "allowed are numbers from 1 up")?;
        probe.measure.check(check, &key("measure"))?;
    }
    Ok(())
}

impl Measure {
    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let finite = |name: &str, point: Vec3| {
            let allowed = "allowed are finite numbers";
            check.require(is_finite(point), &format!("{key}.{name}"), format!("{point:?}"), allowed)
        };
        match self {
            Measure::PointPressure(PointPressure { at_m, radius_m }) => {
                finite("point_pressure.at_m", *at_m)?;
                radius_m.map_or(Ok(()), |r| check.positive(&format!("{key}.point_pressure.radius_m"), r))
            }
            Measure::Gauge(Gauge { x_m, z_m }) => finite("gauge", [*x_m, 0.0, *z_m]),
            Measure::Flux(Flux { from_m, to_m }) => {
                finite("flux.from_m", *from_m)?;
                finite("flux.to_m", *to_m)?;
                let flat = (0..3).filter(|&d| from_m[d] == to_m[d]).count() == 1;
                let upright = (0..3).all(|d| from_m[d] <= to_m[d]);
                let found = format!("the box {from_m:?} .. {to_m:?} m");
                let allowed =
                    "allowed is a rectangle: equal in one component, and `to_m` above `from_m` in the others";
                check.require(flat && upright, &format!("{key}.flux"), found, allowed)
            }
            Measure::GroupForce(_) | Measure::Energy | Measure::CentreOfMass | Measure::Front(_) => Ok(()),
        }
    }
}
