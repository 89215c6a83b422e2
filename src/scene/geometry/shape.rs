//! The shapes of regions, as a scene file describes them.

use serde::Deserialize;

use super::region::Region;
use crate::base::input::{Check, InputError};
use crate::base::vec3::{Vec3, dot, is_finite, sub};

/// All points within a distance of a centre.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Sphere {
    /// Metres.
    pub center_m: Vec3,
    /// Metres, above 0. In two dimensions the sphere is a circle if its centre lies at z = 0.
    pub radius_m: f64,
}

/// A round bar with plane ends, along any axis. As in a box, points on the end at `from_m` are outside.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// The middle of one end, metres.
    pub from_m: Vec3,
    /// The middle of the other end, metres.
    pub to_m: Vec3,
    /// Metres, above 0.
    pub radius_m: f64,
}

/// All points on one side of a plane.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct HalfSpace {
    /// A point of the plane, metres.
    pub point_m: Vec3,
    /// Points out of the half space: inside are the plane and what lies behind it. Any length but 0.
    pub normal: Vec3,
}

/// A solid whose surface is in an STL file, binary or ASCII. The surface must be closed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Stl {
    /// The file's path, from the folder of the scene file.
    pub file: String,
    /// Metres per unit of the file: 0.001 for a drawing in millimetres.
    #[serde(default = "one")]
    pub scale: f64,
    /// Added to all coordinates after scaling, metres.
    #[serde(default)]
    pub translate_m: Vec3,
}

fn one() -> f64 {
    1.0
}

/// Whether a vector is long enough, and short enough, to be made one of length 1.
fn has_direction(vector: Vec3) -> bool {
    dot(vector, vector).is_normal()
}

/// The one shape of a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape<'a> {
    Box { from: Vec3, to: Vec3, below: Vec3, above: Vec3 },
    Sphere(&'a Sphere),
    Cylinder(&'a Cylinder),
    HalfSpace(&'a HalfSpace),
    Stl(&'a Stl),
}

const SHAPES: &str = "give it one: `from_m` and `to_m` of a box, `sphere`, `cylinder`, `half_space` or `stl`";

impl<'a> Shape<'a> {
    /// The shape of the region called `key`, if it has one and no more.
    pub fn of(region: &'a Region, check: Check<'_>, key: &str) -> Result<Shape<'a>, InputError> {
        let corners = (region.from_m, region.to_m);
        let (below, above) = (region.layers_below, region.layers_above);
        let shapes = [
            corners.0.zip(corners.1).map(|(from, to)| ("a box", Shape::Box { from, to, below, above })),
            region.sphere.as_ref().map(|shape| ("`sphere`", Shape::Sphere(shape))),
            region.cylinder.as_ref().map(|shape| ("`cylinder`", Shape::Cylinder(shape))),
            region.half_space.as_ref().map(|shape| ("`half_space`", Shape::HalfSpace(shape))),
            region.stl.as_ref().map(|shape| ("`stl`", Shape::Stl(shape))),
        ];
        let given: Vec<_> = shapes.into_iter().flatten().collect();
        let names: Vec<&str> = given.iter().map(|(name, _)| *name).collect();
        match corners {
            (Some(_), None) => {
                check.require(false, key, "a box without `to_m`", "a box needs both corners")?
            }
            (None, Some(_)) => {
                check.require(false, key, "a box without `from_m`", "a box needs both corners")?
            }
            _ => {}
        }
        let [(_, shape)] = given.as_slice() else {
            let found = match names.as_slice() {
                [] => "a region without a shape".to_string(),
                names => format!("a region with {}", names.join(" and ")),
            };
            return Err(InputError::new(check.file, key, found, SHAPES));
        };
        Ok(*shape)
    }

    pub fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let finite = |name: &str, vector: Vec3| {
            let allowed = "allowed are three finite numbers";
            check.require(is_finite(vector), &format!("{key}.{name}"), format!("{vector:?}"), allowed)
        };
        match self {
            // Its corners may be infinite; `Region::check` holds them in order.
            Shape::Box { .. } => Ok(()),
            Shape::Sphere(sphere) => {
                finite("sphere.center_m", sphere.center_m)?;
                check.positive(&format!("{key}.sphere.radius_m"), sphere.radius_m)
            }
            Shape::Cylinder(cylinder) => {
                finite("cylinder.from_m", cylinder.from_m)?;
                finite("cylinder.to_m", cylinder.to_m)?;
                check.require(
                    has_direction(sub(cylinder.to_m, cylinder.from_m)),
                    &format!("{key}.cylinder.to_m"),
                    format!("{:?}", cylinder.to_m),
                    "it must lie away from `from_m`: the two are the ends of the axis",
                )?;
                check.positive(&format!("{key}.cylinder.radius_m"), cylinder.radius_m)
            }
            Shape::HalfSpace(half) => {
                finite("half_space.point_m", half.point_m)?;
                finite("half_space.normal", half.normal)?;
                check.require(
                    has_direction(half.normal),
                    &format!("{key}.half_space.normal"),
                    format!("{:?}", half.normal),
                    "allowed is any direction, such as [0, 1, 0] for all that lies below the point",
                )
            }
            Shape::Stl(stl) => {
                let allowed = "allowed is the path of an STL file, from the scene file's folder";
                check.require(!stl.file.is_empty(), &format!("{key}.stl.file"), "empty", allowed)?;
                check.positive(&format!("{key}.stl.scale"), stl.scale)?;
                finite("stl.translate_m", stl.translate_m)
            }
        }
    }
}
