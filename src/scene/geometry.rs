//! Particles from boxes on a cubic lattice, and single ones anywhere.

use serde::Deserialize;

use crate::base::input::{Check, InputError};
use crate::base::vec3::{Vec3, ZERO, is_finite};
use crate::engine::particles::{InitialParticle, Kind};

/// The most lattice points a scene may have: identities are 32-bit numbers.
pub const MAX_LATTICE_POINTS: usize = 1 << 31;

/// A lattice, the regions that say which of its points carry which particle, and particles beside it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Geometry {
    pub lattice: Lattice,
    /// In order: a later region overrides an earlier one.
    #[serde(default)]
    pub region: Vec<Region>,
    /// In order, after the lattice's particles.
    #[serde(default)]
    pub particle: Vec<SingleParticle>,
}

/// Points `x = l0 i` with `i` from `-layers` to `extent / l0 + layers` in each direction, x outermost, z innermost.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Lattice {
    pub extent_m: Vec3,
    pub layers: u32,
}

/// A box `from < x <= to`, its faces moved outwards by whole layers.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Region {
    pub fill: Fill,
    /// The group of its particles.
    pub group: Option<String>,
    pub from_m: Vec3,
    pub to_m: Vec3,
    /// Particle distances by which the lower faces lie below `from_m`.
    #[serde(default)]
    pub layers_below: Vec3,
    /// Particle distances by which the upper faces lie above `to_m`.
    #[serde(default)]
    pub layers_above: Vec3,
}

/// What a region holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Fill {
    Fluid,
    Wall,
    DummyWall,
    Body,
    Empty,
}

impl Fill {
    fn kind(self) -> Option<Kind> {
        match self {
            Fill::Fluid => Some(Kind::Fluid),
            Fill::Wall => Some(Kind::Wall),
            Fill::DummyWall => Some(Kind::DummyWall),
            Fill::Body => Some(Kind::Body),
            Fill::Empty => None,
        }
    }
}

/// One particle wherever the scene wants it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SingleParticle {
    pub kind: SingleKind,
    pub position_m: Vec3,
    #[serde(default)]
    pub velocity_m_s: Vec3,
}

/// What a single particle is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "driver", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum SingleKind {
    Fluid,
    Wall,
    DummyWall,
}

impl SingleParticle {
    fn check(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        let allowed = "allowed are three finite numbers";
        for (name, vector) in [("position_m", self.position_m), ("velocity_m_s", self.velocity_m_s)] {
            check.require(is_finite(vector), &format!("{key}.{name}"), format!("{vector:?}"), allowed)?;
        }
        // Viscosity and collision would see a wall that moves and yet stays where it is.
        check.require(
            self.kind == SingleKind::Fluid || self.velocity_m_s == ZERO,
            &format!("{key}.velocity_m_s"),
            format!("{:?}", self.velocity_m_s),
            "only fluid particles may move",
        )
    }

    fn place(&self) -> InitialParticle {
        let kind = match self.kind {
            SingleKind::Fluid => Kind::Fluid,
            SingleKind::Wall => Kind::Wall,
            SingleKind::DummyWall => Kind::DummyWall,
        };
        InitialParticle { velocity: self.velocity_m_s, ..InitialParticle::at_rest(kind, self.position_m) }
    }
}

impl Geometry {
    pub(super) fn check(&self, check: Check<'_>, particle_distance_m: f64) -> Result<(), InputError> {
        let extent = self.lattice.extent_m;
        let allowed = "allowed are finite lengths from 0 up";
        check.require(
            extent.iter().all(|e| e.is_finite() && *e >= 0.0),
            "geometry.lattice.extent_m",
            format!("{extent:?}"),
            allowed,
        )?;
        let layers = self.lattice.layers;
        check.require(layers <= 64, "geometry.lattice.layers", layers, "allowed are 0 to 64")?;
        let points = self.lattice_points(particle_distance_m);
        check.require(
            points <= MAX_LATTICE_POINTS as f64,
            "particle_distance_m",
            particle_distance_m,
            format!("it makes a lattice of {points:.3e} points and at most {MAX_LATTICE_POINTS} are allowed: raise it"),
        )?;
        for (k, particle) in self.particle.iter().enumerate() {
            particle.check(check, &format!("geometry.particle[{k}]"))?;
        }
        for (k, region) in self.region.iter().enumerate() {
            let corners = [region.from_m, region.to_m, region.layers_below, region.layers_above];
            let key = format!("geometry.region[{k}]");
            let numbers = corners.iter().flatten().all(|c| !c.is_nan());
            check.require(
                numbers,
                &key,
                "not a number in a corner",
                "allowed are numbers; `inf` opens a side",
            )?;
            let (low, high) = region.bounds(particle_distance_m);
            let found = format!("the box {low:?} .. {high:?} m");
            check.require(
                (0..3).all(|d| low[d] < high[d]),
                &key,
                found,
                "every upper face must lie above its lower face",
            )?;
        }
        Ok(())
    }

    /// The number of lattice points, an upper bound of the number of their particles.
    pub fn lattice_points(&self, particle_distance_m: f64) -> f64 {
        let layers = f64::from(2 * self.lattice.layers + 1);
        self.lattice.extent_m.iter().map(|e| (e / particle_distance_m).trunc() + layers).product()
    }

    /// The corners of a box that holds every lattice point and every single particle, metres.
    pub fn bounds(&self, particle_distance_m: f64) -> (Vec3, Vec3) {
        let beyond = f64::from(self.lattice.layers) * particle_distance_m;
        let (mut low, mut high) = ([-beyond; 3], self.lattice.extent_m.map(|e| e + beyond));
        for particle in &self.particle {
            for d in 0..3 {
                low[d] = low[d].min(particle.position_m[d]);
                high[d] = high[d].max(particle.position_m[d]);
            }
        }
        (low, high)
    }

    /// Places the particles: those of the lattice, then the single ones. The index of each is its identity.
    pub fn fill(&self, particle_distance_m: f64, dimensions: u32) -> Vec<InitialParticle> {
        let layers = i64::from(self.lattice.layers);
        let axis = |d: usize| {
            let layers = if d < dimensions as usize { layers } else { 0 };
            let last = (self.lattice.extent_m[d] / particle_distance_m) as i64 + layers;
            (-layers..=last).map(move |i| particle_distance_m * i as f64)
        };
        let (mut particles, names) = (Vec::new(), self.group_names());
        for x in axis(0) {
            for y in axis(1) {
                for z in axis(2) {
                    if let Some((kind, group)) = self.kind_at([x, y, z], particle_distance_m) {
                        let group = names.iter().position(|name| Some(name) == group).unwrap_or(0) as u8;
                        particles
                            .push(InitialParticle { group, ..InitialParticle::at_rest(kind, [x, y, z]) });
                    }
                }
            }
        }
        particles.extend(self.particle.iter().map(SingleParticle::place));
        particles
    }

    fn kind_at(&self, point: Vec3, particle_distance_m: f64) -> Option<(Kind, Option<&String>)> {
        let holds = |region: &&Region| region.contains(point, particle_distance_m);
        let region = self.region.iter().rev().find(holds)?;
        Some((region.fill.kind()?, region.group.as_ref()))
    }

    /// The names of the groups by number: first "" for particles without one, then regions' as they come first.
    pub fn group_names(&self) -> Vec<String> {
        let mut names = vec![String::new()];
        for name in self.region.iter().filter_map(|region| region.group.as_ref()) {
            if !names.contains(name) {
                names.push(name.clone());
            }
        }
        names
    }
}

impl Region {
    fn bounds(&self, l0: f64) -> (Vec3, Vec3) {
        let low = [0, 1, 2].map(|d| self.from_m[d] - self.layers_below[d] * l0);
        let high = [0, 1, 2].map(|d| self.to_m[d] + self.layers_above[d] * l0);
        (low, high)
    }

    /// A lattice point on a face belongs to the box below it; a hundredth of `l0` absorbs rounding.
    fn contains(&self, point: Vec3, l0: f64) -> bool {
        let (epsilon, (low, high)) = (0.01 * l0, self.bounds(l0));
        (0..3).all(|d| point[d] > low[d] + epsilon && point[d] <= high[d] + epsilon)
    }
}
