//! How particles start that are neither at rest nor without pressure.

use serde::Deserialize;

use super::placement::{Hydrostatics, Placement};
use crate::base::input::{Check, InputError};
use crate::base::vec3::{Vec3, ZERO, add, dot, is_finite, sub};

/// The velocity `u = rotation x (x - about) + gradient (x - about)`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct VelocityField {
    /// Where the field is zero, metres; the origin if not given.
    #[serde(default)]
    pub about_m: Vec3,
    /// A rigid rotation: its axis, and how fast it turns, radians per second; anticlockwise as seen from its tip.
    #[serde(default)]
    pub rotation_rad_s: Vec3,
    /// The rows of the velocity's gradient `du_i / dx_j`, 1/s: `[[-1, 0, 0], [0, 1, 0], [0, 0, 0]]` stretches along y.
    #[serde(default)]
    pub gradient_1_s: [Vec3; 3],
}

impl VelocityField {
    pub(super) fn check(&self, check: Check<'_>, key: &str, dimensions: usize) -> Result<(), InputError> {
        let numbers = [self.about_m, self.rotation_rad_s].into_iter().chain(self.gradient_1_s);
        let found = format!(
            "about {:?} rotation {:?} gradient {:?}",
            self.about_m, self.rotation_rad_s, self.gradient_1_s
        );
        check.require(numbers.into_iter().all(is_finite), key, &found, "allowed are finite numbers")?;
        let turns = self.rotation_rad_s != ZERO || self.gradient_1_s != [ZERO; 3];
        let allowed = "give it `rotation_rad_s`, `gradient_1_s` or both, or remove it";
        check.require(turns, key, "zero everywhere", allowed)?;
        let plane = self.rotation_rad_s[0] == 0.0 && self.rotation_rad_s[1] == 0.0;
        let plane = plane && self.gradient_1_s[2] == ZERO;
        let allowed = "in two dimensions the rotation is [0, 0, w] and the gradient's third row is zero";
        check.require(dimensions == 3 || plane, key, found, allowed)
    }

    /// Metres per second.
    pub(super) fn at(&self, position: Vec3) -> Vec3 {
        let (w, x) = (self.rotation_rad_s, sub(position, self.about_m));
        let rotation = [w[1] * x[2] - w[2] * x[1], w[2] * x[0] - w[0] * x[2], w[0] * x[1] - w[1] * x[0]];
        add(rotation, self.gradient_1_s.map(|row| dot(row, x)))
    }
}

/// The pressure of fluid at rest below a free surface.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Hydrostatic {
    /// The height of the surface, metres: measured against gravity from the origin, so y where gravity points along -y.
    pub surface_m: f64,
}

impl Hydrostatic {
    pub(super) fn check(
        &self,
        check: Check<'_>,
        key: &str,
        placement: &Placement<'_>,
    ) -> Result<(), InputError> {
        let allowed = "allowed are finite numbers";
        check.require(self.surface_m.is_finite(), &format!("{key}.surface_m"), self.surface_m, allowed)?;
        let falls = placement.hydrostatics.is_some_and(|rest| rest.magnitude() > 0.0);
        let allowed = "it needs `effects.gravity` with an acceleration other than zero: name it, or remove the pressure";
        check.require(falls, key, "given in a scene without gravity", allowed)
    }

    /// Pascals.
    pub(super) fn pressure(&self, position: Vec3, rest: &Hydrostatics) -> f64 {
        rest.pressure(position, self.surface_m)
    }
}
