//! Particles from shapes on a cubic lattice, and single ones anywhere.

mod filling;
mod jitter;
mod lattice;
mod motion;
mod particle;
mod placement;
mod region;
mod shape;
mod solid;
pub mod stl;

use serde::Deserialize;

use crate::base::input::{Check, InputError};
use crate::base::vec3::Vec3;

pub use jitter::Jitter;
pub use lattice::{Lattice, MAX_LATTICE_POINTS};
pub use motion::{Hydrostatic, VelocityField};
pub use particle::{SingleKind, SingleParticle};
pub use placement::{Hydrostatics, Placement};
pub use region::{Fill, Region};
pub use shape::{Cylinder, HalfSpace, Sphere, Stl};

/// The most named groups: a particle carries its group as a byte, and 0 is none.
pub const MAX_GROUPS: usize = 255;

/// A lattice, the regions that say which of its points carry which particle, and particles beside it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Geometry {
    /// The points where particles may lie.
    pub lattice: Lattice,
    /// In order: a later region overrides an earlier one.
    #[serde(default)]
    pub region: Vec<Region>,
    /// In order, after the lattice's particles.
    #[serde(default)]
    pub particle: Vec<SingleParticle>,
    /// Moves fluid particles a little away from their lattice points.
    pub jitter: Option<Jitter>,
}

impl Geometry {
    /// Checks what can be told without placing a particle or opening an STL file.
    pub fn check(&self, check: Check<'_>, placement: &Placement<'_>) -> Result<(), InputError> {
        self.lattice.check(check, placement)?;
        if let Some(jitter) = &self.jitter {
            jitter.check(check)?;
        }
        for (k, particle) in self.particle.iter().enumerate() {
            let key = format!("geometry.particle[{k}]");
            particle.check(check, &key, placement)?;
            self.check_within_period(particle, check, &key, placement)?;
        }
        for (k, region) in self.region.iter().enumerate() {
            region.check(check, &format!("geometry.region[{k}]"), placement)?;
        }
        let groups = self.group_names().len() - 1;
        let allowed = format!("at most {MAX_GROUPS} are allowed: let regions share them");
        check.require(groups <= MAX_GROUPS, "geometry", format!("a geometry of {groups} groups"), allowed)
    }

    fn check_within_period(
        &self,
        particle: &SingleParticle,
        check: Check<'_>,
        key: &str,
        placement: &Placement<'_>,
    ) -> Result<(), InputError> {
        for (d, period) in self.periods(placement).into_iter().enumerate() {
            let Some((from, to)) = period else { continue };
            let x = particle.position_m[d];
            check.require(
                x >= from && x < to,
                &format!("{key}.position_m"),
                format!("{:?}", particle.position_m),
                format!(
                    "along the periodic axis {} allowed are {from} m up to, and not, {to} m",
                    ["x", "y", "z"][d]
                ),
            )?;
        }
        Ok(())
    }

    /// Where the periods along x, y and z begin and end, metres; none along an axis without one.
    pub fn periods(&self, placement: &Placement<'_>) -> [Option<(f64, f64)>; 3] {
        [0, 1, 2].map(|d| {
            let axis = self.lattice.axis(d, placement);
            axis.period.map(|period| (axis.origin, axis.origin + period))
        })
    }

    /// The names of the groups in the order of `InitialParticle::group`: first "" for particles without one, then regions'
    /// and particles' names as they come first.
    pub fn group_names(&self) -> Vec<String> {
        let mut names = vec![String::new()];
        let regions = self.region.iter().map(|region| &region.group);
        for name in regions.chain(self.particle.iter().map(|particle| &particle.group)).flatten() {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        names
    }

    /// The number of lattice points, an upper bound of the number of their particles.
    pub fn lattice_points(&self, placement: &Placement<'_>) -> f64 {
        self.lattice.points(placement)
    }

    /// The corners of a box that holds every lattice point, displaced or not, and every single particle, metres.
    pub fn bounds(&self, placement: &Placement<'_>) -> (Vec3, Vec3) {
        let l0 = placement.particle_distance_m;
        let displaced = self.jitter.map_or(0.0, |jitter| jitter.amplitude * l0);
        let layers = f64::from(self.lattice.layers) * l0;
        let (mut low, mut high) = (self.lattice.origin_m, self.lattice.origin_m);
        for d in 0..placement.dimensions {
            let beyond = if placement.periodic[d] { 0.0 } else { layers + displaced };
            low[d] -= beyond;
            high[d] += self.lattice.extent_m[d] + beyond;
        }
        for particle in &self.particle {
            for d in 0..3 {
                low[d] = low[d].min(particle.position_m[d]);
                high[d] = high[d].max(particle.position_m[d]);
            }
        }
        (low, high)
    }
}
