//! Regions: a shape, what fills it, and how that starts.

use serde::Deserialize;

use super::motion::{Hydrostatic, VelocityField};
use super::placement::Placement;
use super::shape::{Cylinder, HalfSpace, Shape, Sphere, Stl};
use crate::base::input::{Check, InputError};
use crate::base::vec3::{Vec3, ZERO, add, is_finite};
use crate::engine::particles::{InitialParticle, Kind};

/// The lattice points of one shape: a box `from < x <= to`, its faces moved outwards by whole layers, or one of the others.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// What lies on the region's lattice points.
    pub fill: Fill,
    /// The lower corner of a box, metres; `-inf` opens a side. In two dimensions the third number is not looked at.
    pub from_m: Option<Vec3>,
    /// The upper corner of a box, metres; `inf` opens a side.
    pub to_m: Option<Vec3>,
    /// Particle distances by which the lower faces of a box lie below `from_m`.
    #[serde(default)]
    pub layers_below: Vec3,
    /// Particle distances by which the upper faces of a box lie above `to_m`.
    #[serde(default)]
    pub layers_above: Vec3,
    /// A sphere in place of the box.
    pub sphere: Option<Sphere>,
    /// A cylinder in place of the box.
    pub cylinder: Option<Cylinder>,
    /// A half space in place of the box.
    pub half_space: Option<HalfSpace>,
    /// A solid from an STL file in place of the box.
    pub stl: Option<Stl>,
    /// Makes the region the shell around its shape, so many particle distances thick, in place of its inside: walls.
    pub layers_outside: Option<f64>,
    /// A name by which the region's particles can be addressed; regions may share it.
    pub group: Option<String>,
    /// Velocity at the start, metres per second; fluid and bodies only.
    pub velocity_m_s: Option<Vec3>,
    /// A velocity at the start that depends on the place, added to `velocity_m_s`; fluid and bodies only.
    pub velocity_field: Option<VelocityField>,
    /// The pressure of fluid at rest below a surface; fluid and wall only.
    pub hydrostatic: Option<Hydrostatic>,
}

/// What a region holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Fill {
    /// Moves.
    Fluid,
    /// The wall layers next to the fluid, which have a pressure.
    Wall,
    /// The outer wall layers, which have none.
    DummyWall,
    /// Part of a rigid body, which is that of the region's group.
    Body,
    /// Nothing: takes away what earlier regions placed there.
    Empty,
}

impl Fill {
    pub(super) fn kind(self) -> Option<Kind> {
        match self {
            Fill::Fluid => Some(Kind::Fluid),
            Fill::Wall => Some(Kind::Wall),
            Fill::DummyWall => Some(Kind::DummyWall),
            Fill::Body => Some(Kind::Body),
            Fill::Empty => None,
        }
    }
}

impl Region {
    /// `key` names the region in errors.
    pub(super) fn check(
        &self,
        check: Check<'_>,
        key: &str,
        placement: &Placement<'_>,
    ) -> Result<(), InputError> {
        let shape = Shape::of(self, check, key)?;
        shape.check(check, key)?;
        match shape {
            Shape::Box { from, to, below, above } => {
                self.check_box([from, to, below, above], check, key, placement)?
            }
            _ => check.require(
                self.layers_below == ZERO && self.layers_above == ZERO,
                &format!("{key}.layers_below and .layers_above"),
                "given",
                "only a box has them: around other shapes `layers_outside` makes a shell",
            )?,
        }
        if let Some(layers) = self.layers_outside {
            let key = format!("{key}.layers_outside");
            let boxed = matches!(shape, Shape::Box { .. });
            let allowed =
                "a box has `layers_below` and `layers_above`: place the larger box, then what is inside";
            check.require(!boxed, &key, layers, allowed)?;
            let allowed = "allowed are numbers above 0 up to 64 particle distances";
            check.require(layers > 0.0 && layers <= 64.0, &key, layers, allowed)?;
        }
        self.check_start(check, key, placement)
    }

    fn check_box(
        &self,
        corners: [Vec3; 4],
        check: Check<'_>,
        key: &str,
        placement: &Placement<'_>,
    ) -> Result<(), InputError> {
        let numbers = corners.iter().flatten().all(|c| !c.is_nan());
        let allowed = "allowed are numbers; `inf` opens a side";
        check.require(numbers, key, "not a number in a corner", allowed)?;
        let l0 = placement.particle_distance_m;
        let [from, to, below, above] = corners;
        let low = [0, 1, 2].map(|d| from[d] - below[d] * l0);
        let high = [0, 1, 2].map(|d| to[d] + above[d] * l0);
        check.require(
            (0..placement.dimensions).all(|d| low[d] < high[d]),
            key,
            format!("the box {low:?} .. {high:?} m"),
            "every upper face must lie above its lower face",
        )
    }

    /// What the region's particles start with.
    fn check_start(&self, check: Check<'_>, key: &str, placement: &Placement<'_>) -> Result<(), InputError> {
        if let Some(group) = &self.group {
            check_group(group, check, key)?;
        }
        if let Some(velocity) = self.velocity_m_s {
            let key = format!("{key}.velocity_m_s");
            check_velocity(velocity, check, &key, placement.dimensions)?;
        }
        if let Some(field) = &self.velocity_field {
            field.check(check, &format!("{key}.velocity_field"), placement.dimensions)?;
        }
        if let Some(hydrostatic) = &self.hydrostatic {
            hydrostatic.check(check, &format!("{key}.hydrostatic"), placement)?;
        }
        let moves = matches!(self.fill, Fill::Fluid | Fill::Body);
        let given = [
            ("group", self.group.is_some(), "no `empty` region", self.fill != Fill::Empty),
            ("velocity_m_s", self.velocity_m_s.is_some(), "only fluid and bodies", moves),
            ("velocity_field", self.velocity_field.is_some(), "only fluid and bodies", moves),
            (
                "hydrostatic",
                self.hydrostatic.is_some(),
                "only fluid and wall",
                matches!(self.fill, Fill::Fluid | Fill::Wall),
            ),
        ];
        for (name, _, who, _) in given.into_iter().filter(|(_, given, _, may)| *given && !may) {
            let found = format!("given for {}", self.name());
            let allowed = format!("{who} may have it: remove it");
            check.require(false, &format!("{key}.{name}"), found, allowed)?;
        }
        Ok(())
    }

    /// What messages call it.
    pub(super) fn name(&self) -> &'static str {
        match self.fill {
            Fill::Fluid => "a fluid region",
            Fill::Wall => "a wall region",
            Fill::DummyWall => "a dummy_wall region",
            Fill::Body => "a body region",
            Fill::Empty => "an empty region",
        }
    }

    /// The particle at a place of the region.
    pub(super) fn particle(
        &self,
        kind: Kind,
        group: u8,
        position: Vec3,
        placement: &Placement<'_>,
    ) -> InitialParticle {
        let mut velocity = self.velocity_m_s.unwrap_or(ZERO);
        if let Some(field) = &self.velocity_field {
            velocity = add(velocity, field.at(position));
        }
        let pressure = match (&self.hydrostatic, &placement.hydrostatics) {
            (Some(hydrostatic), Some(rest)) => hydrostatic.pressure(position, rest),
            _ => 0.0,
        };
        InitialParticle { velocity, pressure, group, ..InitialParticle::at_rest(kind, position) }
    }
}

/// A name that can stand in file names, columns and options.
pub(super) fn check_group(group: &str, check: Check<'_>, key: &str) -> Result<(), InputError> {
    let letter = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    check.require(
        !group.is_empty() && group.len() <= 64 && group.chars().all(letter),
        &format!("{key}.group"),
        format!("`{}`", group.chars().take(80).collect::<String>()),
        "allowed are names of 1 to 64 letters, digits, `-` and `_`",
    )
}

pub(super) fn check_velocity(
    velocity: Vec3,
    check: Check<'_>,
    key: &str,
    dimensions: usize,
) -> Result<(), InputError> {
    let found = format!("{velocity:?}");
    check.require(is_finite(velocity), key, &found, "allowed are three finite numbers")?;
    let plane = dimensions == 3 || velocity[2] == 0.0;
    check.require(plane, key, &found, "in two dimensions the third number must be 0")
}
