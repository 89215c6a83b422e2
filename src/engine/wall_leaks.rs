//! Fluid that gets into walls that move.

use std::collections::HashSet;

use crate::base::vec3::Vec3;
use crate::engine::effects::wall_motion::WallMotion;
use crate::engine::particles::{InitialParticle, Kind, Particles};

/// Counts the fluid particles that get into a moving wall, past its first layer: as `LeakWatch` does for walls at rest, in
/// the frame of each moving group. The inside of a group are its particles that have others of the group all around them at
/// the start, on a lattice that need not go through the origin. A wall of fewer than three layers has no inside.
#[derive(Debug, Clone)]
pub struct WallLeaks {
    particle_distance_m: f64,
    motion: WallMotion,
    /// Of each group: a lattice point, and the sites inside.
    inside: Vec<(Vec3, HashSet<[i64; 3]>)>,
    leaked: HashSet<usize>,
}

impl WallLeaks {
    /// Watches the walls that `motion` moves.
    pub fn new(initial: &[InitialParticle], particle_distance_m: f64, motion: WallMotion) -> Self {
        let plane = initial.iter().all(|p| p.position[2] == 0.0);
        let watched = |(group, motion): (usize, &Option<_>)| {
            let is_part = |p: &&InitialParticle| {
                matches!(p.kind, Kind::Wall | Kind::DummyWall) && usize::from(p.group) == group
            };
            let part: Vec<Vec3> = initial.iter().filter(is_part).map(|p| p.position).collect();
            let origin = part.first().copied().unwrap_or_default();
            let solid: HashSet<_> = part.iter().map(|&x| site(x, origin, particle_distance_m)).collect();
            let surrounded = |site: &&[i64; 3]| around(**site, plane).all(|near| solid.contains(&near));
            let inside = if motion.is_some() {
                solid.iter().filter(surrounded).copied().collect()
            } else {
                HashSet::new()
            };
            (origin, inside)
        };
        let inside = motion.by_group.iter().enumerate().map(watched).collect();
        WallLeaks { particle_distance_m, motion, inside, leaked: HashSet::new() }
    }

    /// Notes who is inside a wall at the end of a step. To be called after every step.
    pub fn look(&mut self, particles: &Particles, time_s: f64) {
        for (motion, (origin, inside)) in self.motion.by_group.iter().zip(&self.inside) {
            let Some(pose) = motion.as_ref().map(|motion| motion.pose(time_s)) else { continue };
            for (i, &x) in particles.position.iter().enumerate() {
                let here = || site(pose.origin(x), *origin, self.particle_distance_m);
                if particles.kind[i] == Kind::Fluid && inside.contains(&here()) {
                    self.leaked.insert(i);
                }
            }
        }
    }

    /// How many different particles were ever seen inside a moving wall.
    pub fn count(&self) -> usize {
        self.leaked.len()
    }
}

fn site(x: Vec3, origin: Vec3, l0: f64) -> [i64; 3] {
    std::array::from_fn(|d| ((x[d] - origin[d]) / l0).round() as i64)
}

/// The sites of a cube around `site`, or of a square in a plane; itself among them.
fn around([x, y, z]: [i64; 3], plane: bool) -> impl Iterator<Item = [i64; 3]> {
    let layers = if plane { 1 } else { 3 };
    (0..9 * layers).map(move |k| {
        let dz = if plane { 0 } else { k / 9 - 1 };
        [x + k / 3 % 3 - 1, y + k % 3 - 1, z + dz]
    })
}
