//! Rigid bodies: in free flight, floating and sinking.

use super::plane::{self, G};
use super::{Fidelity, Outcome};
use crate::base::vec3::{Vec3, ZERO, add, cross, dot, sub};
use crate::engine::effects::rigid_bodies::{Fixed, RigidBodies};
use crate::engine::kernel::Dimensions;
use crate::engine::parameters::{Domain, Effects, Parameters};
use crate::engine::particles::{InitialParticle, Kind, Particles};

/// Momentum and, about the origin, angular momentum of the bodies, in units of a particle's mass.
fn momenta(particles: &Particles) -> [Vec3; 2] {
    let body = (0..particles.len()).filter(|&i| particles.kind[i] == Kind::Body);
    body.fold([ZERO; 2], |[p, l], i| {
        let (x, u) = (particles.position[i], particles.velocity[i]);
        [add(p, u), add(l, cross(x, u))]
    })
}

fn length(v: Vec3) -> f64 {
    dot(v, v).sqrt()
}

/// A brick of three different sides that tumbles through empty space: momentum, angular momentum and shape stay.
pub fn free_flight(_: Fidelity) -> Result<Vec<Outcome>, String> {
    let l0 = 0.1;
    let (drift, spin) = ([0.3, -0.2, 0.1], [1.5, -0.4, 2.0]);
    let mut particles = Vec::new();
    for k in 0..5 * 3 * 2 {
        let x = [k / 6, k / 2 % 3, k % 2].map(|i| l0 * f64::from(i));
        let velocity = add(drift, cross(spin, sub(x, [0.2, 0.1, 0.05])));
        particles.push(InitialParticle { velocity, ..InitialParticle::at_rest(Kind::Body, x) });
    }
    let effects = Effects { rigid_bodies: Some(RigidBodies::default()), ..Effects::default() };
    let parameters = Parameters {
        dimensions: Dimensions::Three,
        domain: Domain::new([-5.0; 3], [5.0; 3]),
        ..plane::parameters(l0, 2e-3, &particles, 1.0, effects)
    };
    let mut simulation = plane::start(&parameters, &particles)?;
    let before = particles.iter().fold([ZERO; 2], |[p, l], particle| {
        [add(p, particle.velocity), add(l, cross(particle.position, particle.velocity))]
    });
    for _ in 0..2000 {
        plane::step(&mut *simulation)?;
    }
    let after = momenta(simulation.particles());
    let change = |k: usize| length(sub(after[k], before[k])) / length(before[k]);
    let place = &simulation.particles().position;
    let side = |i: usize, j: usize| length(sub(place[i], place[j]));
    let start = |i: usize, j: usize| length(sub(particles[i].position, particles[j].position));
    let pairs = (0..particles.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let bent = pairs.map(|(i, j)| (side(i, j) - start(i, j)).abs() / l0).fold(0.0, f64::max);
    let outcome = |quantity, error| Outcome {
        effect: "rigid_bodies",
        case: "a brick that tumbles through empty space",
        quantity,
        value: error,
        reference: 0.0,
        error,
        gate: 1e-12,
        source: "conservation",
    };
    Ok(vec![
        outcome("change of momentum over 2000 steps, relative", change(0)),
        outcome("change of angular momentum over 2000 steps, relative", change(1)),
        outcome("change of a distance in the body, particle distances", bent),
    ])
}

/// The box's side, the tank's width and its depth, in particle distances.
#[derive(Debug, Clone, Copy)]
struct Bath {
    side: i32,
    width: i32,
    depth: i32,
    l0: f64,
}

impl Bath {
    fn new(fidelity: Fidelity) -> Self {
        let side = match fidelity {
            Fidelity::Coarse => 10,
            Fidelity::Full => 20,
        };
        Bath { side, width: 4 * side, depth: 2 * side, l0: 0.2 / f64::from(side) }
    }

    /// Water around a box, group 1, whose lower edge is `draft` below the surface.
    fn particles(&self, draft: i32) -> Vec<InitialParticle> {
        let Bath { side, width, depth, l0 } = *self;
        let mut particles = plane::walls(l0, width, 3 * side, 0);
        let (left, bottom) = ((width - side) / 2, depth - draft);
        let is_box =
            |i: i32, j: i32| (left..left + side).contains(&i) && (bottom..bottom + side).contains(&j);
        for i in 0..width {
            for j in 0..3 * side {
                let at = plane::cell(l0, i, j);
                if is_box(i, j) {
                    particles.push(InitialParticle { group: 1, ..InitialParticle::at_rest(Kind::Body, at) });
                } else if j < depth {
                    particles.push(InitialParticle::at_rest(Kind::Fluid, at));
                }
            }
        }
        particles
    }

    /// Time, height of the box's middle and mean level of the water beside it, at every tenth step; and how many fluid
    /// particles are in the box's inscribed circle, less a tenth of its side, at the end.
    fn run(
        &self,
        draft: i32,
        density: f64,
        fixed: Fixed,
        end_s: f64,
    ) -> Result<(Vec<[f64; 3]>, usize), String> {
        let l0 = self.l0;
        let particles = self.particles(draft);
        let bodies = RigidBodies { fixed: vec![Fixed::default(), fixed] };
        let mut effects = Effects { rigid_bodies: Some(bodies), ..plane::water_effects() };
        if let Some(pressure) = &mut effects.pressure {
            pressure.density_by_group_kg_m3 = Some(vec![1000.0, density]);
        }
        let dt = 0.1 * l0 / (G * f64::from(self.depth) * l0).sqrt();
        let parameters = plane::parameters(l0, dt, &particles, 0.2, effects);
        let mut simulation = plane::start(&parameters, &particles)?;
        let mut path = Vec::new();
        for step in 0..(end_s / dt) as usize {
            let time_s = plane::step(&mut *simulation)?.time_s;
            if step % 10 == 0 {
                let particles = simulation.particles();
                path.push([time_s, middle(particles)[1], self.level(particles)?]);
            }
        }
        Ok((path, self.inside(simulation.particles())))
    }

    fn inside(&self, particles: &Particles) -> usize {
        let center = middle(particles);
        let reach = (0.5 - 0.1) * f64::from(self.side) * self.l0;
        let within = |&i: &usize| {
            let off = sub(particles.position[i], center);
            particles.kind[i] == Kind::Fluid && length(off) < reach
        };
        (0..particles.len()).filter(within).count()
    }

    /// The water's level a quarter of the width away from the walls, metres.
    fn level(&self, particles: &Particles) -> Result<f64, String> {
        let places = [self.width / 8, self.width - self.width / 8];
        let heights: Option<Vec<f64>> =
            places.iter().map(|&i| plane::surface_m(particles, f64::from(i) * self.l0, self.l0)).collect();
        let heights = heights.ok_or("no water beside the box")?;
        Ok(heights.iter().sum::<f64>() / heights.len() as f64)
    }
}

/// The middle of the body, metres.
fn middle(particles: &Particles) -> Vec3 {
    let body = (0..particles.len()).filter(|&i| particles.kind[i] == Kind::Body);
    let (count, sum) = body.fold((0.0, ZERO), |(n, sum), i| (n + 1.0, add(sum, particles.position[i])));
    sum.map(|x| x / count)
}

/// A box floats: draft over height is the ratio of densities. Started deeper than that.
/// The box goes on heaving on the tank's waves: the mean over the later two seconds comes out between 0.52 and 0.55.
pub fn floating_box(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let bath = Bath::new(fidelity);
    let (path, inside) = bath.run(bath.side * 3 / 4, 500.0, Fixed::default(), 4.0)?;
    let late = &path[path.len() / 2..];
    let mean = |k: usize| late.iter().map(|row| row[k]).sum::<f64>() / late.len() as f64;
    let side_m = f64::from(bath.side) * bath.l0;
    let draft = (mean(2) - mean(1) + 0.5 * side_m) / side_m;
    let floats = Outcome {
        effect: "rigid_bodies",
        case: "a box that floats",
        quantity: "draft over height (error: difference)",
        value: draft,
        reference: 0.5,
        error: (draft - 0.5).abs(),
        gate: 0.05,
        source: "Archimedes",
    };
    let tight = Outcome {
        quantity: "fluid particles in the box (error: their number)",
        value: inside as f64,
        reference: 0.0,
        error: inside as f64,
        gate: 0.0,
        source: "bodies are tight",
        ..floats.clone()
    };
    Ok(vec![floats, tight])
}

/// A box twice as dense as water sinks to the floor.
pub fn sinking_box(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let bath = Bath::new(fidelity);
    let (path, _) = bath.run(bath.side, 2000.0, Fixed::default(), 1.5)?;
    let last = path.last().ok_or("no step")?[1];
    let floor = 0.5 * f64::from(bath.side) * bath.l0;
    Ok(vec![Outcome {
        effect: "rigid_bodies",
        case: "a box that sinks",
        quantity: "height of its middle at the end, particle distances above rest on the floor (error: the same)",
        value: (last - floor) / bath.l0,
        reference: 0.0,
        error: (last - floor).abs() / bath.l0,
        gate: 1.0,
        source: "denser than water",
    }])
}

/// A box of half the density of water, let go a fifth of its side too deep, heaves with `w^2 = rho g B / (m + m_a)`. The
/// added mass is that of a square in unbounded fluid, `4.754 rho a^2` with the half side `a` (Newman 1977, table 4.3), of
/// which the half below the surface counts: the limit of high frequencies, where the surface is a mirror. Timed is the
/// first swing, before waves come back from the walls: what follows is the tank's own sloshing.
pub fn heave(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let bath = Bath::new(fidelity);
    let side_m = f64::from(bath.side) * bath.l0;
    let masses = 0.5 * side_m * side_m + 0.5 * 4.754 * 0.25 * side_m * side_m;
    let expected_s = std::f64::consts::TAU * (masses / (G * side_m)).sqrt();
    let upright = Fixed { translation: [true, false, false], rotation: [false, false, true] };
    let (path, _) = bath.run(bath.side * 7 / 10, 500.0, upright, 0.75 * expected_s)?;
    let start = path[0][1];
    let top = path.iter().map(|row| row[1]).fold(start, f64::max);
    // The turn lies in the middle between the places a little below it on the way up and down.
    let high = |row: &&[f64; 3]| row[1] > start + 0.95 * (top - start);
    let up = path.iter().find(high).ok_or("the box does not rise")?[0];
    let down = path.iter().rfind(high).ok_or("the box does not rise")?[0];
    if down >= path[path.len() - 1][0] {
        return Err("the box does not turn".to_string());
    }
    Ok(vec![Outcome {
        effect: "rigid_bodies",
        case: "a box that heaves",
        quantity: "twice the time to the first turn, s",
        value: up + down,
        reference: expected_s,
        error: ((up + down) / expected_s - 1.0).abs(),
        gate: 0.1,
        source: "added mass of half a square, Newman 1977",
    }])
}
