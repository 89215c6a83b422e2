//! The lattice is filled: which region each point belongs to, and the particle that lies there.

use super::lattice::Axis;
use super::placement::Placement;
use super::region::{Fill, Region};
use super::shape::Shape;
use super::solid::Solid;
use super::{Geometry, SingleParticle};
use crate::base::input::{Check, InputError};
use crate::base::vec3::{Vec3, add_scaled};
use crate::engine::particles::{InitialParticle, Kind};

/// One region while the lattice is filled.
struct Filling<'a> {
    region: &'a Region,
    solid: Solid,
    group: u8,
    /// Whether a lattice point lies in the shape.
    reached: bool,
    /// How many points no later region took.
    held: usize,
}

impl Geometry {
    /// Places the particles: those of the lattice, then the single ones. The index of each is its identity. Refuses regions
    /// that hold nothing, and scenes in which nothing can move.
    pub fn fill(&self, placement: &Placement<'_>) -> Result<Vec<InitialParticle>, InputError> {
        let axes = [0, 1, 2].map(|d| self.lattice.axis(d, placement));
        let names = self.group_names();
        let mut fillings = self.fillings(&axes, &names, placement)?;
        let mut particles = self.fill_lattice(&axes, &mut fillings, placement);
        let check = Check { file: placement.file };
        for (k, filling) in fillings.iter().enumerate() {
            filling.require_points(check, &format!("geometry.region[{k}]"), &axes)?;
        }
        let group = |particle: &SingleParticle| group_index(&names, &particle.group);
        particles.extend(self.particle.iter().map(|particle| particle.place(group(particle))));
        self.require_motion(&particles, check, placement)?;
        Ok(particles)
    }

    fn fillings(
        &self,
        axes: &[Axis; 3],
        names: &[String],
        placement: &Placement<'_>,
    ) -> Result<Vec<Filling<'_>>, InputError> {
        let check = Check { file: placement.file };
        let filling = |(k, region)| {
            let region: &Region = region;
            let key = format!("geometry.region[{k}]");
            let shape = Shape::of(region, check, &key)?;
            let mut solid = Solid::new(shape, region.layers_outside, axes, (placement.file, &key))?;
            if placement.dimensions == 2 {
                solid = solid.flattened();
            }
            Ok(Filling { region, solid, group: group_index(names, &region.group), reached: false, held: 0 })
        };
        self.region.iter().enumerate().map(filling).collect()
    }

    fn fill_lattice(
        &self,
        axes: &[Axis; 3],
        fillings: &mut [Filling<'_>],
        placement: &Placement<'_>,
    ) -> Vec<InitialParticle> {
        let [x, y, z] = axes;
        let heights: Vec<f64> = (z.first..=z.last).map(|k| z.point(k)).collect();
        let mut owner = vec![None; heights.len()];
        let mut particles = Vec::new();
        for i in x.first..=x.last {
            for j in y.first..=y.last {
                owner.fill(None);
                for (number, filling) in fillings.iter_mut().enumerate() {
                    let (solid, reached) = (&filling.solid, &mut filling.reached);
                    solid.look(x.point(i), y.point(j), &heights, &mut |k| {
                        owner[k] = Some(number);
                        *reached = true;
                    });
                }
                for (k, number) in owner.iter().enumerate().filter_map(|(k, owner)| Some((k, (*owner)?))) {
                    let filling = &mut fillings[number];
                    filling.held += 1;
                    if let Some(kind) = filling.region.fill.kind() {
                        let index = [i, j, z.first + k as i64];
                        let position = self.displaced(kind, index, axes, placement);
                        particles.push(filling.region.particle(kind, filling.group, position, placement));
                    }
                }
            }
        }
        particles
    }

    /// Where the particle of a lattice point lies.
    fn displaced(&self, kind: Kind, index: [i64; 3], axes: &[Axis; 3], placement: &Placement<'_>) -> Vec3 {
        let point = [0, 1, 2].map(|d| axes[d].point(index[d]));
        let Some(jitter) = self.jitter.filter(|_| kind == Kind::Fluid) else { return point };
        let mut displacement = jitter.displacement(index);
        if placement.dimensions == 2 {
            displacement[2] = 0.0;
        }
        let displaced = add_scaled(point, placement.particle_distance_m, displacement);
        [0, 1, 2].map(|d| axes[d].wrapped(displaced[d]))
    }

    fn require_motion(
        &self,
        particles: &[InitialParticle],
        check: Check<'_>,
        placement: &Placement<'_>,
    ) -> Result<(), InputError> {
        let allowed = "a region must hold a lattice point, or a particle be given";
        check.require(!particles.is_empty(), "geometry", "empty", allowed)?;
        let moves = placement.moves_without_fluid
            || !self.particle.is_empty()
            || particles.iter().any(|particle| particle.kind == Kind::Fluid);
        let allowed =
            "nothing could ever move: let a region's `fill` be \"fluid\", or give a [[geometry.particle]]";
        check.require(moves, "geometry", "a geometry without fluid", allowed)
    }
}

impl Filling<'_> {
    /// A region that places nothing is a mistake that no result would show.
    fn require_points(&self, check: Check<'_>, key: &str, axes: &[Axis; 3]) -> Result<(), InputError> {
        if self.held > 0 || self.region.fill == Fill::Empty {
            return Ok(());
        }
        let (why, allowed) = if self.solid.is_outside() {
            let corner = |end: fn(&Axis) -> i64| [0, 1, 2].map(|d| axes[d].point(end(&axes[d])));
            let (low, high) = (corner(|axis| axis.first), corner(|axis| axis.last));
            let around = format!("its shape lies outside the lattice, which goes from {low:?} to {high:?} m");
            (around, "move it, or raise `geometry.lattice.extent_m` or `.layers`")
        } else if !self.reached {
            let between = "no lattice point lies in its shape".to_string();
            (between, "enlarge it, move it onto lattice points, or lower `particle_distance_m`")
        } else {
            ("later regions cover all of it".to_string(), "put it after them, or remove it")
        };
        let found = format!("{} that holds no particle: {why}", self.region.name());
        check.require(false, key, found, allowed)
    }
}

/// At most 255: more groups are refused before particles are placed.
fn group_index(names: &[String], group: &Option<String>) -> u8 {
    let named = group.as_ref().and_then(|group| names.iter().position(|name| name == group));
    u8::try_from(named.unwrap_or(0)).unwrap_or(u8::MAX)
}
