//! The points where a scene's particles may lie.

use serde::Deserialize;

use super::placement::Placement;
use crate::base::input::{Check, InputError};
use crate::base::vec3::{Vec3, ZERO, is_finite};

/// The most lattice points a scene may have: identities are 32-bit numbers.
pub const MAX_LATTICE_POINTS: usize = 1 << 31;
/// How far an extent along a periodic axis may be from whole particle distances, relative.
const PERIODIC_TOLERANCE: f64 = 1e-6;

/// Points `x = origin + l0 i` with `i` from `-layers` to `extent / l0 + layers` (cut to a whole number) in each direction,
/// x outermost, z innermost. Along a periodic axis `i` goes from 0 to `extent / l0 - 1` and there are no layers; in two
/// dimensions there is only z = 0.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Lattice {
    /// Metres in x, y and z. In two dimensions the third is 0.
    pub extent_m: Vec3,
    /// Layers of lattice points around the extent, room for walls; none along a periodic axis.
    pub layers: u32,
    /// The lattice point with the indices 0, metres.
    #[serde(default)]
    pub origin_m: Vec3,
}

/// The lattice points along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Axis {
    pub origin: f64,
    pub spacing: f64,
    pub first: i64,
    pub last: i64,
    /// Metres; after it the scene repeats itself.
    pub period: Option<f64>,
}

impl Axis {
    /// Zero plus a coordinate is that coordinate, to the last bit.
    pub fn point(&self, i: i64) -> f64 {
        self.origin + self.spacing * i as f64
    }

    /// A coordinate within the period: from the origin up to, and not at, its end.
    pub fn wrapped(&self, x: f64) -> f64 {
        let Some(period) = self.period else { return x };
        let shifted = if x < self.origin {
            x + period
        } else if x >= self.origin + period {
            x - period
        } else {
            return x;
        };
        // Rounding may put a point just below the origin onto the period's end.
        if shifted >= self.origin + period { self.origin } else { shifted.max(self.origin) }
    }
}

impl Lattice {
    pub(super) fn axis(&self, d: usize, placement: &Placement<'_>) -> Axis {
        let (origin, spacing) = (self.origin_m[d], placement.particle_distance_m);
        if d >= placement.dimensions {
            return Axis { origin: 0.0, spacing, first: 0, last: 0, period: None };
        }
        let quotient = self.extent_m[d] / spacing;
        if placement.periodic[d] {
            let count = quotient.round();
            let period = Some(count * spacing);
            return Axis { origin, spacing, first: 0, last: count as i64 - 1, period };
        }
        let layers = i64::from(self.layers);
        Axis { origin, spacing, first: -layers, last: quotient as i64 + layers, period: None }
    }

    /// The number of points, not cut to what an integer holds.
    pub(super) fn points(&self, placement: &Placement<'_>) -> f64 {
        let layers = f64::from(2 * self.layers + 1);
        let along = |d: usize| {
            let quotient = self.extent_m[d] / placement.particle_distance_m;
            if placement.periodic[d] { quotient.round() } else { quotient.trunc() + layers }
        };
        (0..placement.dimensions).map(along).product()
    }

    pub(super) fn check(&self, check: Check<'_>, placement: &Placement<'_>) -> Result<(), InputError> {
        let extent = self.extent_m;
        check.require(
            extent.iter().all(|e| e.is_finite() && *e >= 0.0),
            "geometry.lattice.extent_m",
            format!("{extent:?}"),
            "allowed are finite lengths from 0 up",
        )?;
        check.require(
            is_finite(self.origin_m),
            "geometry.lattice.origin_m",
            format!("{:?}", self.origin_m),
            "allowed are three finite numbers",
        )?;
        let layers = self.layers;
        check.require(layers <= 64, "geometry.lattice.layers", layers, "allowed are 0 to 64")?;
        self.check_plane(check, placement)?;
        for d in 0..placement.dimensions {
            self.check_period(d, check, placement)?;
        }
        let (points, l0) = (self.points(placement), placement.particle_distance_m);
        check.require(
            points <= MAX_LATTICE_POINTS as f64,
            "particle_distance_m",
            l0,
            format!("it makes a lattice of {points:.3e} points and at most {MAX_LATTICE_POINTS} are allowed: raise it"),
        )
    }

    fn check_plane(&self, check: Check<'_>, placement: &Placement<'_>) -> Result<(), InputError> {
        if placement.dimensions == 3 {
            return Ok(());
        }
        for (name, vector) in [("extent_m", self.extent_m), ("origin_m", self.origin_m)] {
            let key = format!("geometry.lattice.{name}");
            let allowed = "in two dimensions the third number must be 0";
            check.require(vector[2] == 0.0, &key, format!("{vector:?}"), allowed)?;
        }
        Ok(())
    }

    fn check_period(&self, d: usize, check: Check<'_>, placement: &Placement<'_>) -> Result<(), InputError> {
        if !placement.periodic[d] {
            return Ok(());
        }
        let (l0, axis) = (placement.particle_distance_m, ["x", "y", "z"][d]);
        let quotient = self.extent_m[d] / l0;
        let count = quotient.round().max(1.0);
        // Nine digits: the length that a person would write, not the product's last bit.
        let length = format!("{:.8e}", count * l0).parse::<f64>().unwrap_or(count * l0);
        let allowed = format!(
            "along the periodic axis {axis} it must be whole particle distances: {count} of {l0} m would be {length} m"
        );
        let whole = (quotient - count).abs() <= PERIODIC_TOLERANCE * count;
        check.require(whole, "geometry.lattice.extent_m", format!("{:?}", self.extent_m), allowed)
    }
}

impl Default for Lattice {
    fn default() -> Self {
        Lattice { extent_m: ZERO, layers: 0, origin_m: ZERO }
    }
}
