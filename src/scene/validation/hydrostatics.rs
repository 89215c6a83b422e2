//! Water at rest: one pool; two pools of different depth and a full box with a lid, side by side in one simulation.
//!
//! The reference is `p = rho g h`, where the depth `h` counts from the middle of the uppermost particles, at which the
//! equation has the pressure zero, and in a closed box from where it makes the means equal.

use super::general::{self, DENSITY_KG_M3, G_M_S2, Tank};
use super::{Fidelity, Outcome};
use crate::engine::parameters::{Effects, Parameters};
use crate::engine::particles::{InitialParticle, Kind, Particles};
use crate::engine::pressure::options::Walls;

/// Water whose rest is looked at: the fluid between two abscissae.
#[derive(Debug, Clone, Copy)]
pub struct Pool {
    pub from_m: f64,
    pub to_m: f64,
    /// Depth `H`, metres.
    pub depth_m: f64,
    /// Whether it has no surface, so that pressures count from their mean.
    pub closed: bool,
}

/// What is read off a pool.
#[derive(Debug, Clone, Copy, Default)]
pub struct Rest {
    /// Of the time mean over the last half: `sqrt(sum (p - p_ref)^2 / sum p_ref^2)`.
    pub profile: f64,
    /// Standard deviation of the pressure in the middle of the floor over `rho g H`, last half.
    pub noise: f64,
    /// Largest speed of the last half over `sqrt(g H)`.
    pub speed: f64,
    /// Root mean square speed of the last half over `sqrt(g H)`.
    pub mean_speed: f64,
    /// Way of the centre of mass up, in particle distances.
    pub drift: f64,
}

/// The sums behind it.
struct Watch {
    pool: Pool,
    l0_m: f64,
    members: Vec<usize>,
    probe: usize,
    start_m: f64,
    pressure: Vec<f64>,
    reference: Vec<f64>,
    floor: [f64; 2],
    speed2: [f64; 2],
    steps: f64,
}

impl Watch {
    fn new(pool: Pool, l0_m: f64, particles: &Particles) -> Watch {
        let inside = |i: &usize| (pool.from_m..pool.to_m).contains(&particles.position[*i][0]);
        let members: Vec<usize> =
            (0..particles.len()).filter(inside).filter(|&i| particles.kind[i] == Kind::Fluid).collect();
        let middle = 0.5 * (pool.from_m + pool.to_m);
        let distance = |i: usize| (particles.position[i][0] - middle).abs() + particles.position[i][1].abs();
        let floor = (0..particles.len()).filter(inside).filter(|&i| particles.position[i][1] < 0.0);
        let count = members.len();
        let mut watch = Watch {
            pool,
            l0_m,
            members,
            probe: floor.min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0),
            start_m: 0.0,
            pressure: vec![0.0; count],
            reference: vec![0.0; count],
            floor: [0.0; 2],
            speed2: [0.0; 2],
            steps: 0.0,
        };
        watch.start_m = watch.mean(|i| particles.position[i][1]);
        watch
    }

    fn mean(&self, of: impl Fn(usize) -> f64) -> f64 {
        self.members.iter().map(|&i| of(i)).sum::<f64>() / self.members.len() as f64
    }

    /// Where the hydrostatic pressure of this moment is zero, metres: at the middle of the uppermost particles or, in a
    /// closed pool, where it makes the means equal.
    fn level(&self, now: &Particles) -> f64 {
        let mean_y = self.mean(|i| now.position[i][1]);
        match self.pool.closed {
            true => mean_y + self.mean(|i| now.pressure[i]) / (DENSITY_KG_M3 * G_M_S2),
            // Half a particle distance below the water's surface: there the equation has the pressure zero.
            false => mean_y + 0.5 * (self.pool.depth_m - self.l0_m),
        }
    }

    fn note(&mut self, now: &Particles) {
        let level = self.level(now);
        for (k, &i) in self.members.iter().enumerate() {
            self.pressure[k] += now.pressure[i];
            self.reference[k] += DENSITY_KG_M3 * G_M_S2 * (level - now.position[i][1]);
            let [u, v, _] = now.velocity[i];
            self.speed2[0] = self.speed2[0].max(u * u + v * v);
            self.speed2[1] += u * u + v * v;
        }
        self.floor[0] += now.pressure[self.probe];
        self.floor[1] += now.pressure[self.probe] * now.pressure[self.probe];
        self.steps += 1.0;
    }

    fn rest(&self, now: &Particles) -> Rest {
        let differences = self.pressure.iter().zip(&self.reference).map(|(p, r)| (p - r) * (p - r));
        let norm2: f64 = self.reference.iter().map(|r| r * r).sum();
        let [mean, square] = self.floor.map(|sum| sum / self.steps);
        let head = G_M_S2 * self.pool.depth_m;
        let samples = self.steps * self.members.len() as f64;
        Rest {
            profile: (differences.sum::<f64>() / norm2).sqrt(),
            noise: (square - mean * mean).max(0.0).sqrt() / (DENSITY_KG_M3 * head),
            speed: (self.speed2[0] / head).sqrt(),
            mean_speed: (self.speed2[1] / samples / head).sqrt(),
            drift: (self.mean(|i| now.position[i][1]) - self.start_m) / self.l0_m,
        }
    }
}

/// Lets `particles` rest for `duration_s`, and looks at the pools in the second half of it.
pub fn rest(
    parameters: &Parameters,
    particles: &[InitialParticle],
    pools: &[Pool],
    duration_s: f64,
) -> Result<Vec<Rest>, String> {
    let mut simulation = general::build(parameters, particles, 1)?;
    let steps = (duration_s / parameters.time_step_s).ceil() as usize;
    let l0 = parameters.particle_distance_m;
    let mut watches: Vec<Watch> =
        pools.iter().map(|&pool| Watch::new(pool, l0, simulation.particles())).collect();
    for n in 0..steps {
        general::step(simulation.as_mut())?;
        if 2 * n >= steps {
            watches.iter_mut().for_each(|watch| watch.note(simulation.particles()));
        }
    }
    let now = simulation.particles();
    Ok(watches.iter().map(|watch| watch.rest(now)).collect())
}

/// Depth of the deepest pool, metres.
const DEPTH_M: f64 = 0.4;
const SOURCE: &str = "p = rho g h";

/// Gates of accuracy.md for a depth of 20 particles: error of the profile, noise, largest speed, drift.
const GATES: [f64; 4] = [0.02, 0.02, 0.01, 0.5];

fn outcomes(case: &'static str, rest: &Rest) -> Vec<Outcome> {
    let values = [rest.profile, rest.noise, rest.speed, rest.drift.abs()];
    let quantities = [
        "error of the mean pressure, share of its root mean square",
        "standard deviation of the floor's pressure, share of rho g H",
        "largest speed, share of sqrt(g H)",
        "way of the centre of mass, particle distances",
    ];
    let rows = values.into_iter().zip(quantities).zip(GATES);
    rows.map(|((value, quantity), gate)| Outcome {
        effect: "pressure",
        case,
        quantity,
        value,
        reference: 0.0,
        error: value,
        gate,
        source: SOURCE,
    })
    .collect()
}

fn duration_s(fidelity: Fidelity) -> f64 {
    let units = if fidelity == Fidelity::Full { 50.0 } else { 20.0 };
    units * (DEPTH_M / G_M_S2).sqrt()
}

/// A square pool of 20 layers.
pub fn still(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let (n, l0, time_step_s) = (20, DEPTH_M / 20.0, 1e-3);
    let particles = Tank { width: n, height: n + 4, lid: false }.fill(l0, |_, j| j < n);
    let parameters = general::parameters(l0, time_step_s, &particles, 20.0, general::water());
    let pool = Pool { from_m: 0.0, to_m: DEPTH_M, depth_m: DEPTH_M, closed: false };
    let rest = rest(&parameters, &particles, &[pool], duration_s(fidelity))?;
    Ok(outcomes("still water, 20 layers", &rest[0]))
}

/// A full box with a lid, which no free surface tells the pressure's level, with shifting and the consistent gradient.
pub fn closed(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let (n, l0, time_step_s) = (20, DEPTH_M / 20.0, 1e-3);
    let particles = Tank { width: n, height: n, lid: true }.fill(l0, |_, _| true);
    let mut effects = Effects { gravity: general::water().gravity, ..general::closed(0.1) };
    if let Some(pressure) = &mut effects.pressure {
        pressure.walls = Walls::Mirrored;
    }
    let parameters = general::parameters(l0, time_step_s, &particles, 20.0, effects);
    let pool = Pool { from_m: 0.0, to_m: DEPTH_M, depth_m: DEPTH_M, closed: true };
    let rest = rest(&parameters, &particles, &[pool], duration_s(fidelity))?;
    Ok(outcomes("full box with a lid, 20 layers", &rest[0]))
}

/// Two pools, one half as deep as the other, and a full box with a lid, in one system with the options of water. Half as wide
/// as deep: a pressure that only depends on the height asks for no width.
pub fn pools(fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let (n, width, l0, time_step_s) = (20, 10, DEPTH_M / 20.0, 1e-3);
    let place = |which: i32| f64::from(which * (width + 12)) * l0;
    let open = Tank { width, height: n + 4, lid: false };
    let mut particles = Vec::new();
    for (which, tank, depth) in
        [(0, open, n), (1, open, n / 2), (2, Tank { height: n, lid: true, ..open }, n)]
    {
        let mut filled = tank.fill(l0, |_, j| j < depth);
        filled.iter_mut().for_each(|particle| particle.position[0] += place(which));
        particles.extend(filled);
    }
    let pool = |which: i32, depth_m: f64| Pool {
        from_m: place(which),
        to_m: place(which) + f64::from(width) * l0,
        depth_m,
        closed: which == 2,
    };
    let pools = [pool(0, DEPTH_M), pool(1, 0.5 * DEPTH_M), pool(2, DEPTH_M)];
    let parameters = general::parameters(l0, time_step_s, &particles, 20.0, general::water());
    let rest = rest(&parameters, &particles, &pools, duration_s(fidelity))?;
    let names =
        ["pools side by side: 20 layers", "pools side by side: 10 layers", "pools side by side: full box"];
    Ok(rest.iter().zip(names).flat_map(|(rest, name)| outcomes(name, rest)).collect())
}

/// Ten layers of 1000 kg/m3 below ten of 500 kg/m3: the floor carries the weight of both. The reference counts to where the
/// pressure is read: the floor's uppermost particles lie half a particle distance below the fluid's lower end, so that 10.5
/// particle distances of the heavy fluid are above them. (It once counted 10, and 3.9 % too much was found.)
pub fn two_layers(_fidelity: Fidelity) -> Result<Vec<Outcome>, String> {
    let (n, l0) = (20, 0.02);
    let tank = Tank { width: n, height: n + 4, lid: false };
    let mut particles = tank.fill(l0, |_, j| j < n);
    for particle in &mut particles {
        particle.group = u8::from(particle.position[1] > 10.0 * l0);
    }
    let mut effects = general::water();
    if let Some(pressure) = &mut effects.pressure {
        pressure.density_by_group_kg_m3 = Some(vec![1000.0, 500.0]);
    }
    let mut parameters = general::parameters(l0, 1e-3, &particles, 20.0, effects);
    parameters.groups = vec!["heavy".to_string(), "light".to_string()];
    let mut simulation = general::build(&parameters, &particles, 2)?;
    let floor = |p: &InitialParticle| p.kind == Kind::Wall && (-l0..0.0).contains(&p.position[1]);
    let middle = |p: &InitialParticle| (5.0 * l0..15.0 * l0).contains(&p.position[0]);
    let probes: Vec<usize> =
        (0..particles.len()).filter(|&i| floor(&particles[i]) && middle(&particles[i])).collect();
    let mut mean = 0.0;
    for n in 0..400 {
        general::step(simulation.as_mut())?;
        if n >= 200 {
            let pressure = &simulation.particles().pressure;
            mean += probes.iter().map(|&i| pressure[i]).sum::<f64>() / (200.0 * probes.len() as f64);
        }
    }
    // The pressure is zero at the middle of the uppermost layer.
    let reference = G_M_S2 * l0 * (1000.0 * 10.5 + 500.0 * 9.5);
    Ok(vec![Outcome {
        effect: "pressure",
        case: "a light layer on a heavy one",
        quantity: "mean pressure at the floor after 0.2 to 0.4 s, Pa",
        value: mean,
        reference,
        error: (mean / reference - 1.0).abs(),
        gate: 0.03,
        source: "hydrostatics",
    }])
}
