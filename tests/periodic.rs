//! Periodic axes and planes: the same flow wherever the period is cut, by every search.

use std::sync::Arc;

use repro::base::parallel::Workers;
use repro::base::schedule::Schedule;
use repro::engine::columns::SavedState;
use repro::engine::effects::collision::Collision;
use repro::engine::effects::gravity::Gravity;
use repro::engine::effects::viscosity::Viscosity;
use repro::engine::effects::wall_motion::{Motion, WallMotion};
use repro::engine::kernel::Dimensions;
use repro::engine::parameters::{Domain, Effects, Parameters, Radii};
use repro::engine::particles::{InitialParticle, Kind};
use repro::engine::phase::NoProbe;
use repro::engine::preset::{Options, Preset, Search};
use repro::engine::pressure::Pressure;
use repro::engine::pressure::preconditioner::Preconditioning;
use repro::engine::pressure::values::MatrixValues;
use repro::engine::simulation::{self, Simulation, Start, StepReport};

const L0: f64 = 0.1;
const N: i32 = 12;

fn parameters() -> Parameters {
    let (low, high) = ([-0.05, -0.05, 0.0], [-0.05 + L0 * f64::from(N), -0.05 + L0 * f64::from(N), 0.0]);
    Parameters {
        dimensions: Dimensions::Two,
        particle_distance_m: L0,
        time_step_s: 1e-3,
        adaptive: None,
        density_kg_m3: 1000.0,
        radii: Radii { number_density: 2.1, gradient: 2.1, laplacian: 3.1 },
        domain: Domain { periodic: [true, true, false], ..Domain::new(low, high) },
        groups: Vec::new(),
        effects: Effects { viscosity: Some(Viscosity::uniform(0.5)), ..Effects::default() },
    }
}

/// Shear that varies as a sine along y, on the lattice: the discrete Laplacian has it as an eigenvector, so that every
/// particle, wherever the period is cut, decays by the same factor.
fn shear() -> Vec<InitialParticle> {
    let mut particles = Vec::new();
    for i in 0..N {
        for j in 0..N {
            let u = (std::f64::consts::TAU * f64::from(j) / f64::from(N)).sin();
            let position = [L0 * f64::from(i), L0 * f64::from(j), 0.0];
            particles.push(InitialParticle {
                velocity: [1e-6 * u, 0.0, 0.0],
                ..InitialParticle::at_rest(Kind::Fluid, position)
            });
        }
    }
    particles
}

#[test]
fn a_sine_decays_by_one_factor_everywhere_with_every_search() {
    let particles = shear();
    let mut decays: Vec<f64> = Vec::new();
    for preset in Preset::all() {
        let workers = Arc::new(Workers::new(2, Schedule::Static, &[]).unwrap());
        let start = Start { particles: &particles, steps_done: 0 };
        let mut simulation = simulation::build(&parameters(), &preset.options(), start, workers).unwrap();
        simulation.step(&mut NoProbe).unwrap();
        let velocity = &simulation.particles().velocity;
        let decay = velocity[1][0] / particles[1].velocity[0];
        for (u, start) in velocity.iter().zip(&particles) {
            assert!((u[0] - decay * start.velocity[0]).abs() < 1e-18, "{u:?}");
        }
        if matches!(preset.options().search, Search::BruteForce | Search::Clusters) {
            assert!((decay - decays[0]).abs() < 1e-12);
        } else {
            decays.push(decay);
            assert_eq!(decay, decays[0], "{preset}: all searches by buckets sum in one order");
        }
    }
    // exp(-nu k^2 dt) with k = 2 pi / 1.2 m, to the error of twelve particles a wave.
    let exact = (-0.5 * (std::f64::consts::TAU / 1.2).powi(2) * 1e-3f64).exp();
    assert!((decays[0] - exact).abs() < 0.1 * (1.0 - exact), "{} {exact}", decays[0]);
}

#[test]
fn particles_come_in_again_at_the_other_end() {
    let thrown = InitialParticle {
        velocity: [40.0, -70.0, 0.0],
        ..InitialParticle::at_rest(Kind::Fluid, [1.1, 0.0, 0.0])
    };
    let mut parameters = parameters();
    parameters.effects = Effects::default();
    let workers = Arc::new(Workers::new(1, Schedule::Static, &[]).unwrap());
    let start = Start { particles: &[thrown], steps_done: 0 };
    let options = Preset::PAPER_LINKED_LIST.options();
    parameters.effects.collision = Some(Collision { distance: 0.5, restitution: 0.2 });
    let mut simulation = simulation::build(&parameters, &options, start, workers).unwrap();
    for _ in 0..30 {
        let report = simulation.step(&mut NoProbe).unwrap();
        assert_eq!(report.ghosts, 0);
    }
    // 1.1 + 1.2 and 0 - 2.1, in a period of 1.2 from -0.05 up.
    let x = simulation.particles().position[0];
    assert!((x[0] - (1.1 + 1.2 - 1.2)).abs() < 1e-12 && (x[1] - (-2.1 + 2.4)).abs() < 1e-12, "{x:?}");
}

/// Water that flows over walls with dummy walls below, periodic along the flow and, in space, across it.
#[derive(Debug, Clone, Copy)]
struct Channel {
    /// In particle distances; across it 0 in a plane.
    along: i32,
    across: i32,
    /// How far there is water, from the end on.
    wet: i32,
}

/// As long as three radii, shorter than two of them along both axes, and a plane of either kind.
const CHANNELS: [Channel; 4] = [
    Channel { along: 10, across: 7, wet: 99 },
    Channel { along: 5, across: 4, wet: 99 },
    Channel { along: 16, across: 0, wet: 99 },
    Channel { along: 4, across: 0, wet: 99 },
];

/// Layers of walls, and of water.
const WALLS: i32 = 2;
const DEPTH: i32 = 8;
const STEPS: usize = 20;
/// Farthest that a particle may be from where another search has it after [`STEPS`] steps, metres: with
/// the same solver, and with two levels. Solved to 1e-13, since the usual tolerance leaves more than another order of sums does.
const SAME_SOLVER_M: f64 = 1e-13;
const TWO_LEVELS_M: f64 = 1e-12;
/// What dry walls may change, as much as the usual tolerance.
const DRY_WALLS_M: f64 = 1e-9;

impl Channel {
    fn parameters(self) -> Parameters {
        let in_space = self.across > 0;
        let high = [L0 * f64::from(self.along), 3.0, L0 * f64::from(self.across)];
        let effects = Effects {
            gravity: Some(Gravity { acceleration_m_s2: [0.0, -9.81, 0.0] }),
            viscosity: Some(Viscosity::uniform(0.05)),
            collision: Some(Collision { distance: 0.5, restitution: 0.2 }),
            pressure: Some(Pressure::default()),
            ..Effects::default()
        };
        Parameters {
            dimensions: if in_space { Dimensions::Three } else { Dimensions::Two },
            domain: Domain { periodic: [true, false, in_space], ..Domain::new([0.0, -3.0, 0.0], high) },
            effects,
            ..parameters()
        }
    }

    /// Disordered water, pressed together, that crosses the ends, and above it some that meet across them.
    fn particles(self) -> Vec<InitialParticle> {
        let mut random = fastrand::Rng::with_seed(5);
        let mut off = |is_free: bool| if is_free { 0.2 * L0 * random.f64() } else { 0.0 };
        let (along, in_space) = (self.along, self.across > 0);
        let columns = (0..along).flat_map(|i| (0..self.across.max(1)).map(move |k| (i, k)));
        let mut particles = Vec::new();
        for (i, k) in columns {
            let place = |j: i32| [i, j, k].map(|n| L0 * f64::from(n));
            let dummies = (-WALLS - 2..-WALLS).map(|j| InitialParticle::at_rest(Kind::DummyWall, place(j)));
            let walls = (-WALLS..0).map(|j| InitialParticle::at_rest(Kind::Wall, place(j)));
            let water = (0..if i < self.wet { DEPTH } else { 0 }).map(|j| {
                let [x, y, z] = place(j);
                InitialParticle {
                    velocity: [6.0, 0.0, if in_space { -4.0 } else { 0.0 }],
                    ..InitialParticle::at_rest(
                        Kind::Fluid,
                        [x + off(true), 0.98 * y + off(true), z + off(in_space)],
                    )
                }
            });
            particles.extend(dummies.chain(walls).chain(water));
        }
        let (end, middle) = (L0 * f64::from(along), 0.5 * L0 * f64::from(self.across));
        for (x, u) in [(0.01, -1.0), (end - 0.02, 1.0), (end - 0.045, 2.0)] {
            particles.push(InitialParticle {
                velocity: [u, 0.0, 0.0],
                ..InitialParticle::at_rest(Kind::Fluid, [x, 1.5, middle])
            });
        }
        particles
    }

    fn simulation(self, options: &Options, threads: usize) -> Box<dyn Simulation> {
        let workers = Arc::new(Workers::new(threads, options.schedule, &[]).unwrap());
        let particles = self.particles();
        let start = Start { particles: &particles, steps_done: 0 };
        simulation::build(&self.parameters(), options, start, workers).unwrap()
    }

    fn after(self, options: &Options, threads: usize) -> (Box<dyn Simulation>, StepReport) {
        let mut simulation = self.simulation(options, threads);
        let reports = (0..STEPS).map(|_| simulation.step(&mut NoProbe).unwrap());
        let last = reports.last().unwrap();
        (simulation, last)
    }

    /// Of all particles and coordinates, whatever end a particle at an end is said to be at.
    fn farthest(self, a: &dyn Simulation, b: &dyn Simulation) -> f64 {
        let periods = [self.along, 0, self.across].map(|n| L0 * f64::from(n));
        let off = |d: usize, off: f64| {
            if off > 0.5 * periods[d] && periods[d] > 0.0 { periods[d] - off } else { off }
        };
        let pairs = a.particles().position.iter().zip(&b.particles().position);
        pairs.flat_map(|(a, b)| [0, 1, 2].map(|d| off(d, (a[d] - b[d]).abs()))).fold(0.0, f64::max)
    }
}

fn closely(preset: Preset) -> Options {
    let mut options = Options { matrix_values: MatrixValues::F64, ..preset.options() };
    options.cg.tolerance = 1e-13;
    options
}

fn state(simulation: &mut dyn Simulation) -> SavedState {
    let mut state = SavedState::default();
    state.keep(|visitor| simulation.visit(visitor));
    state
}

#[test]
fn clusters_see_what_lies_across_the_ends() {
    for channel in CHANNELS {
        let (expected, report) = channel.after(&closely(Preset::GENERAL), 2);
        let mut same = closely(Preset::FAST_ALL_WALLS);
        same.cg.preconditioner = Preconditioning::None;
        let (same, of_clusters) = channel.after(&same, 2);
        let (fast, _) = channel.after(&closely(Preset::FAST), 2);
        let counts = |report: StepReport| report.pressure.map(|p| (p.unknowns, p.surface, p.enclosed));
        assert_eq!(counts(report), counts(of_clusters));
        let apart = [same, fast].map(|simulation| channel.farthest(&*simulation, &*expected));
        let (start, ends) = (channel.particles(), expected.particles());
        let crossed =
            start.iter().zip(&ends.position).filter(|(p, x)| (p.position[0] - x[0]).abs() > 2.0 * L0);
        let (crossed, unknowns) = (crossed.count(), report.pressure.unwrap().unknowns);
        println!(
            "{channel:?}: {:e} m with the same solver, {:e} m with two levels; {crossed} crossed, {unknowns} unknowns",
            apart[0], apart[1]
        );
        assert!(apart[0] <= SAME_SOLVER_M && apart[1] <= TWO_LEVELS_M, "{apart:?}");
        let pressed = ends.pressure.iter().any(|&p| p > 0.0);
        assert!(
            pressed && crossed >= DEPTH as usize && unknowns >= 2 * DEPTH as usize,
            "{crossed} {unknowns}"
        );
        let met = ends.velocity[start.len() - 3][0];
        assert!(met > start[start.len() - 3].velocity[0] + 0.5, "{met} m/s after those above the water met");
    }
}

/// Walls come in again at the other end as well.
#[test]
fn clusters_see_walls_that_cross_the_ends() {
    for channel in [CHANNELS[1], CHANNELS[2]] {
        let (mut parameters, mut particles) = (channel.parameters(), channel.particles());
        let motion = Motion::Oscillation {
            amplitude_m: [0.15, 0.0, 0.0],
            frequency_hz: 15.0,
            phase_rad: 0.0,
            ramp_s: 0.0,
        };
        parameters.groups = ["water", "floor"].map(String::from).to_vec();
        parameters.effects.wall_motion = Some(WallMotion { by_group: vec![None, Some(motion)] });
        for particle in &mut particles {
            particle.group = u8::from(particle.kind != Kind::Fluid);
        }
        let ends = [Preset::GENERAL, Preset::FAST].map(|preset| {
            let workers = Arc::new(Workers::new(2, Schedule::Static, &[]).unwrap());
            let start = Start { particles: &particles, steps_done: 0 };
            let mut simulation = simulation::build(&parameters, &closely(preset), start, workers).unwrap();
            for _ in 0..STEPS {
                simulation.step(&mut NoProbe).unwrap();
            }
            simulation
        });
        let apart = channel.farthest(&*ends[0], &*ends[1]);
        let came_in =
            |(p, x): (&InitialParticle, &[f64; 3])| p.kind == Kind::Wall && x[0] < p.position[0] - L0;
        let came_in =
            particles.iter().zip(&ends[0].particles().position).filter(|&pair| came_in(pair)).count();
        println!("{channel:?}: {apart:e} m, {came_in} walls came in again");
        assert!(apart <= TWO_LEVELS_M && came_in > 0, "{apart:e} {came_in}");
    }
}

/// Walls far from the water have known pressures; those near it across the end have not.
#[test]
fn dry_walls_are_left_out_across_the_ends() {
    let channel = Channel { along: 80, across: 0, wet: 8 };
    let (all, with_all) = channel.after(&Preset::FAST_ALL_WALLS.options(), 2);
    let (known, with_fewer) = channel.after(&Preset::FAST.options(), 2);
    let apart = channel.farthest(&*all, &*known);
    let unknowns = [with_all, with_fewer].map(|report| report.pressure.unwrap().unknowns);
    println!("{unknowns:?} unknowns, {apart:e} m");
    assert!(10 * unknowns[1] < 9 * unknowns[0] && apart <= DRY_WALLS_M, "{unknowns:?}, {apart:e}");
}

#[test]
fn the_bits_of_clusters_do_not_depend_on_threads() {
    for channel in CHANNELS {
        let options = Preset::FAST.options();
        let expected = state(&mut *channel.after(&options, 1).0);
        for (threads, schedule) in [(2, "static"), (3, "dynamic:1")] {
            let options = Options { schedule: schedule.parse().unwrap(), ..options };
            assert!(state(&mut *channel.after(&options, threads).0) == expected, "{channel:?} {threads}");
        }
    }
}

/// A particle may have crossed an end since lists were made.
#[test]
fn clusters_that_are_put_back_go_on_to_the_same_bits() {
    for channel in CHANNELS {
        let mut whole = channel.simulation(&Preset::FAST.options(), 2);
        for stop in 1..=STEPS {
            whole.step(&mut NoProbe).unwrap();
            if stop % 6 == 1 {
                let kept = state(&mut *whole);
                let mut resumed = channel.simulation(&Preset::FAST.options(), 1);
                kept.restore(|visitor| resumed.visit(visitor));
                for _ in 0..4 {
                    whole.step(&mut NoProbe).unwrap();
                    resumed.step(&mut NoProbe).unwrap();
                }
                assert!(state(&mut *whole) == state(&mut *resumed), "{channel:?} stopped after {stop} steps");
            }
        }
    }
}
