//! What one reads off the particles: fronts, extremes, energy, leaks through walls, and the digest of a state.

use std::collections::HashSet;

use sha2::{Digest, Sha256};

use crate::base::vec3::{Vec3, dot};
use crate::engine::particles::{InitialParticle, Kind, Particles};

/// 128 bits, as 32 hexadecimal digits, over kind, position, velocity and pressure of every particle by its index. Two
/// states have the same digest exactly if they are the same to the last bit.
pub fn digest(particles: &Particles) -> String {
    let mut hasher = Sha256::new();
    let mut bytes = Vec::with_capacity(24 * particles.len());
    bytes.extend(particles.kind.iter().map(|&kind| kind as u8));
    hasher.update(&bytes);
    let mut column = |values: &mut dyn Iterator<Item = f64>| {
        bytes.clear();
        bytes.extend(values.flat_map(|value| value.to_bits().to_le_bytes()));
        hasher.update(&bytes);
    };
    column(&mut particles.position.iter().flatten().copied());
    column(&mut particles.velocity.iter().flatten().copied());
    column(&mut particles.pressure.iter().copied());
    hasher.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect()
}

/// Where the fluid is and how fast.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowState {
    pub fluid: usize,
    /// Largest x of the fluid, metres: one drop of spray decides it.
    pub front_max_m: f64,
    /// 99th percentile of the fluid's x, metres: the bulk's front.
    pub front_p99_m: f64,
    /// Largest y of the fluid, metres.
    pub top_m: f64,
    pub max_speed_m_s: f64,
    pub max_pressure_fluid_pa: f64,
    pub max_pressure_pa: f64,
}

impl FlowState {
    /// Zeros where there is no fluid.
    pub fn of(particles: &Particles) -> Self {
        let fluid: Vec<usize> = (0..particles.len()).filter(|&i| particles.kind[i] == Kind::Fluid).collect();
        let position = |axis: usize| fluid.iter().map(move |&i| particles.position[i][axis]);
        let pressure = |i: usize| particles.pressure.get(i).copied().unwrap_or(0.0);
        let mut x: Vec<f64> = position(0).collect();
        x.sort_by(f64::total_cmp);
        let largest = |values: &mut dyn Iterator<Item = f64>| values.reduce(f64::max).unwrap_or(0.0);
        FlowState {
            fluid: fluid.len(),
            front_max_m: x.last().copied().unwrap_or(0.0),
            front_p99_m: percentile(&x, 0.99),
            top_m: largest(&mut position(1)),
            max_speed_m_s: largest(&mut fluid.iter().map(|&i| norm(particles.velocity[i]))),
            max_pressure_fluid_pa: largest(&mut fluid.iter().map(|&i| pressure(i))),
            max_pressure_pa: largest(&mut (0..particles.len()).map(pressure)),
        }
    }
}

/// The fluid's energy over the mass of one particle, all of which weigh the same: J/kg times the number of particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energy {
    /// `sum u^2 / 2`, m2/s2.
    pub kinetic: f64,
    /// `-sum g . x`, m2/s2: zero at the origin's height.
    pub potential: f64,
}

/// The energy of the fluid under `gravity` in m/s2. A particle that left the domain takes its share along.
pub fn energy(particles: &Particles, gravity: Vec3) -> Energy {
    let mut energy = Energy { kinetic: 0.0, potential: 0.0 };
    for i in (0..particles.len()).filter(|&i| particles.kind[i] == Kind::Fluid) {
        energy.kinetic += dot(particles.velocity[i], particles.velocity[i]) / 2.0;
        energy.potential -= dot(gravity, particles.position[i]);
    }
    energy
}

/// A point of the lattice, in particle distances.
type Site = [i64; 3];

/// Counts the fluid particles that get into a wall, past its first layer.
///
/// Our own measure. The inside of a wall are the lattice sites whose solid particle has solid ones at all 26 sites around
/// it, at the start: the first layer, the rim and an edge between two walls are not among them, so that splash over the
/// rim is no leak, nor is a particle that is pressed into an edge. A particle has leaked once its nearest site is inside.
/// Walls of fewer than three layers have no inside, and a particle that crosses it within one step is missed.
#[derive(Debug, Clone)]
pub struct LeakWatch {
    particle_distance_m: f64,
    inside: HashSet<Site>,
    /// Particles ever seen inside.
    leaked: HashSet<usize>,
}

impl LeakWatch {
    /// Watches the walls of `initial`, whose particles stand on a lattice of spacing `particle_distance_m` through the
    /// origin.
    pub fn new(initial: &[InitialParticle], particle_distance_m: f64) -> Self {
        let is_solid = |p: &&InitialParticle| matches!(p.kind, Kind::Wall | Kind::DummyWall);
        let site = |p: &InitialParticle| nearest_site(p.position, particle_distance_m);
        let solid: HashSet<Site> = initial.iter().filter(is_solid).map(site).collect();
        let surrounded = |site: &&Site| sites_around(**site).all(|near| solid.contains(&near));
        let inside = solid.iter().filter(surrounded).copied().collect();
        LeakWatch { particle_distance_m, inside, leaked: HashSet::new() }
    }

    /// Notes who is inside a wall now. To be called after every step, or a particle that passes is missed.
    pub fn look(&mut self, particles: &Particles) {
        for (i, &position) in particles.position.iter().enumerate() {
            let site = nearest_site(position, self.particle_distance_m);
            if particles.kind[i] == Kind::Fluid && self.inside.contains(&site) {
                self.leaked.insert(i);
            }
        }
    }

    /// How many different particles were ever seen inside a wall.
    pub fn count(&self) -> usize {
        self.leaked.len()
    }
}

fn nearest_site(position: Vec3, particle_distance_m: f64) -> Site {
    position.map(|x| (x / particle_distance_m).round() as i64)
}

/// The 27 sites of a cube around `site`, itself among them.
fn sites_around([x, y, z]: Site) -> impl Iterator<Item = Site> {
    (0..27).map(move |k| [x + k / 9 - 1, y + k / 3 % 3 - 1, z + k % 3 - 1])
}

fn norm(v: Vec3) -> f64 {
    dot(v, v).sqrt()
}

/// The value below which a share of an ascending slice lies, interpolated linearly; 0 for an empty one.
fn percentile(ascending: &[f64], share: f64) -> f64 {
    let Some(last) = ascending.len().checked_sub(1) else {
        return 0.0;
    };
    let place = share * last as f64;
    let (below, rest) = (place.floor() as usize, place.fract());
    ascending[below] + rest * (ascending[(below + 1).min(last)] - ascending[below])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_interpolate() {
        assert_eq!(percentile(&[], 0.99), 0.0);
        assert_eq!(percentile(&[3.0], 0.99), 3.0);
        assert_eq!(percentile(&[0.0, 1.0, 2.0], 0.75), 1.5);
    }

    /// Columns of fluid particles at rest.
    fn fluid_at(positions: &[Vec3]) -> Particles {
        Particles {
            kind: vec![Kind::Fluid; positions.len()],
            position: positions.to_vec(),
            velocity: vec![[0.0; 3]; positions.len()],
            ..Particles::default()
        }
    }

    /// A tub of l0 = 0.5 with walls of four layers at x, y, z <= 0, open above and on the far sides.
    fn tub() -> LeakWatch {
        let mut initial = Vec::new();
        for k in 0..9 * 9 * 9 {
            let site = [k / 81 - 3, k / 9 % 9 - 3, k % 9 - 3];
            let kind = match site.into_iter().min() {
                Some(..=-2) => Kind::DummyWall,
                Some(..=0) => Kind::Wall,
                _ => Kind::Fluid,
            };
            initial.push(InitialParticle::at_rest(kind, site.map(|i| 0.5 * f64::from(i))));
        }
        LeakWatch::new(&initial, 0.5)
    }

    #[test]
    fn a_particle_leaks_once_it_is_past_the_first_layer() {
        let mut watch = tub();
        let before_the_wall = [[0.26, 1.0, 1.0], [0.0, 1.0, 1.0], [-0.24, 1.0, 1.0]];
        watch.look(&fluid_at(&before_the_wall));
        let in_the_edges = [[0.1, 0.1, 1.0], [-0.2, -0.2, 1.0], [-0.2, -0.2, -0.2]];
        watch.look(&fluid_at(&in_the_edges));
        assert_eq!(watch.count(), 0, "the first layer is the wall's surface, in an edge too");
        watch.look(&fluid_at(&[[-0.26, 1.0, 1.0], [1.0; 3], [-0.3, -0.3, 1.0]]));
        watch.look(&fluid_at(&[[1.0; 3], [1.0; 3], [-1.0, 0.5, 1.0]]));
        assert_eq!(watch.count(), 2, "each particle counts once, even when it comes back");
    }

    #[test]
    fn splash_over_the_rim_and_behind_the_wall_is_no_leak() {
        let mut watch = tub();
        watch.look(&fluid_at(&[[-0.5, 2.6, 1.0], [-0.5, 3.0, 1.0], [-1.5, 1.0, 1.0], [-2.0, 0.0, 1.0]]));
        assert_eq!(watch.count(), 0);
        let mut ghost = fluid_at(&[[-0.5, 1.0, 1.0]]);
        ghost.kind[0] = Kind::Ghost;
        watch.look(&ghost);
        assert_eq!(watch.count(), 0, "a ghost is no fluid");
    }

    #[test]
    fn energy_is_that_of_the_fluid_alone() {
        let mut particles =
            fluid_at(&[[1.0, 2.0, 3.0], [0.0, -1.0, 0.0], [0.0, 50.0, 0.0], [0.0, 60.0, 0.0]]);
        particles.velocity = vec![[3.0, 4.0, 0.0], [0.0, 0.0, 1.0], [9.0; 3], [9.0; 3]];
        particles.kind[2..].copy_from_slice(&[Kind::Ghost, Kind::Wall]);
        let expected = Energy { kinetic: 12.5 + 0.5, potential: 10.0 * 2.0 - 10.0 };
        assert_eq!(energy(&particles, [0.0, -10.0, 0.0]), expected);
    }

    #[test]
    fn a_digest_sees_every_bit() {
        let mut particles = Particles {
            kind: vec![Kind::Fluid; 2],
            position: vec![[0.0, 1.0, 2.0]; 2],
            velocity: vec![[0.0; 3]; 2],
            acceleration: vec![[0.0; 3]; 2],
            ..Particles::default()
        };
        let before = digest(&particles);
        assert_eq!((before.len(), digest(&particles)), (32, before.clone()));
        particles.velocity[1][2] = -0.0;
        assert_ne!(digest(&particles), before);
    }
}
