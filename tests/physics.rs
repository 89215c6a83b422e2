//! Effects against values that one can work out by hand, and the ways in which a simulation refuses to go on.

mod common;

use std::sync::Arc;

use common::{Run, dam_break, run_scene};
use repro::base::parallel::Workers;
use repro::base::schedule::Schedule;
use repro::base::vec3::{Vec3, add_scaled, dot, scale, sub};
use repro::engine::diagnostics::LeakWatch;
use repro::engine::effects::collision::Collision;
use repro::engine::effects::gravity::Gravity;
use repro::engine::effects::viscosity::Viscosity;
use repro::engine::effects::wall_contact::WallContact;
use repro::engine::error::SimulationError;
use repro::engine::kernel::{Dimensions, Reference};
use repro::engine::parameters::{Domain, Effects, Parameters, Radii};
use repro::engine::particles::{InitialParticle, Kind};
use repro::engine::phase::{NoProbe, Phase};
use repro::engine::preset::{Options, Preset};
use repro::engine::pressure::Pressure;
use repro::engine::pressure::conjugate_gradient::CgError;
use repro::engine::simulation::{self, Simulation, Start};
use repro::scene::Scene;

const L0: f64 = 0.1;
const DT: f64 = 0.001;

fn parameters(effects: Effects) -> Parameters {
    Parameters {
        dimensions: Dimensions::Three,
        particle_distance_m: L0,
        time_step_s: DT,
        adaptive: None,
        groups: Vec::new(),
        density_kg_m3: 1000.0,
        radii: Radii { number_density: 2.1, gradient: 2.1, laplacian: 3.1 },
        domain: Domain::new([-2.0; 3], [2.0; 3]),
        effects,
    }
}

fn pressure() -> Option<Pressure> {
    Some(Pressure {
        surface_threshold: 0.97,
        source_relaxation: 0.2,
        compressibility_1_pa: 0.45e-9,
        ..Pressure::default()
    })
}

fn fluid(position: Vec3, velocity: Vec3) -> InitialParticle {
    InitialParticle { velocity, ..InitialParticle::at_rest(Kind::Fluid, position) }
}

fn build_with(effects: Effects, particles: &[InitialParticle], options: &Options) -> Box<dyn Simulation> {
    let workers = Arc::new(Workers::new(1, Schedule::Static, &[]).unwrap());
    let start = Start { particles, steps_done: 0 };
    simulation::build(&parameters(effects), options, start, workers).unwrap()
}

fn build(effects: Effects, particles: &[InitialParticle]) -> Box<dyn Simulation> {
    build_with(effects, particles, &Preset::PAPER_AOS_RELOCATION.options())
}

#[test]
fn a_lone_particle_falls_on_the_discrete_parabola() {
    let gravity = Some(Gravity { acceleration_m_s2: [0.0, -9.8, 0.0] });
    let effects = Effects {
        gravity,
        collision: Some(Collision { distance: 0.5, restitution: 0.2 }),
        pressure: pressure(),
        ..Effects::default()
    };
    let mut simulation = build(effects, &[fluid([0.0; 3], [1.0, 0.0, 0.0])]);
    let steps = 100;
    for _ in 0..steps {
        let report = simulation.step(&mut NoProbe).unwrap();
        let solve = report.pressure.unwrap();
        assert_eq!((solve.unknowns, solve.cg.iterations), (0, 0), "nothing to solve in free flight");
    }
    let (n, x) = (f64::from(steps), simulation.particles().position[0]);
    // u_k = -g dt k and x_n = dt sum u_k: the symplectic Euler method's parabola.
    let y = -9.8 * DT * DT * n * (n + 1.0) / 2.0;
    assert!((x[1] - y).abs() < 1e-14 && (x[0] - n * DT).abs() < 1e-14, "{x:?}");
}

/// On a lattice sheared as u = (s y^2, 0, 0) the Laplacian model gives exactly 2 s where all neighbours are there: it
/// is the sum of (y_j - y_i)^2 w, whose lattice mean lambda / 3 the factor divides by.
#[test]
fn viscosity_of_a_parabolic_profile_is_its_second_derivative() {
    let (nu, s) = (0.1, 0.5);
    let mut particles = Vec::new();
    for i in -4i32..=4 {
        for j in -4i32..=4 {
            for k in -4i32..=4 {
                let x = [i, j, k].map(|c| L0 * f64::from(c));
                particles.push(fluid(x, [s * x[1] * x[1], 0.0, 0.0]));
            }
        }
    }
    let viscosity = Some(Viscosity::uniform(nu));
    let mut simulation = build(Effects { viscosity, ..Effects::default() }, &particles);
    simulation.step(&mut NoProbe).unwrap();
    let centre = particles.len() / 2;
    let change = simulation.particles().velocity[centre][0] - particles[centre].velocity[0];
    assert!((change - nu * 2.0 * s * DT).abs() < 1e-15, "{change}");
}

/// A compressed block with one particle too many beside its centre, and the pressure effect's constants.
fn crowd(kernel_floor: Option<f64>) -> (Vec<InitialParticle>, Effects) {
    let axis = || (-3i32..=3).map(|i| 0.9 * L0 * f64::from(i));
    let lattice = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| [x, y, z])));
    let mut particles: Vec<InitialParticle> = lattice.map(|x| fluid(x, [0.0; 3])).collect();
    particles.push(fluid([0.1 * L0, 0.2 * L0, 0.0], [0.0; 3]));
    let pressure = pressure().map(|pressure| Pressure { kernel_floor, ..pressure });
    (particles, Effects { pressure, ..Effects::default() })
}

/// A neighbour within `radius` particle distances: its index, `r_ij`, the distance that counts, and its weight.
fn pairs(start: &[InitialParticle], i: usize, radius: f64, floor: f64) -> Vec<(usize, Vec3, f64, f64)> {
    let mut pairs = Vec::new();
    for (j, other) in start.iter().enumerate().filter(|&(j, _)| j != i) {
        let r_ij = sub(other.position, start[i].position);
        let r = dot(r_ij, r_ij).sqrt();
        if r < radius * L0 {
            let counted = r.max(floor * L0);
            pairs.push((j, r_ij, counted, radius * L0 / counted - 1.0));
        }
    }
    pairs
}

/// Number density, pressure equation and gradient of a crowd, worked out pair by pair from their formulae.
#[test]
fn a_kernel_floor_counts_in_number_density_matrix_and_gradient() {
    let [density, laplacian] =
        [2.1, 3.1].map(|radius| Reference::on_lattice(Dimensions::Three, L0, radius * L0));
    let n0 = density.number_density;
    let coefficient = 6.0 / (laplacian.number_density * laplacian.lambda_m2 * 1000.0);
    for floor in [0.0, 0.5, 1.0] {
        let (start, effects) = crowd(Some(floor).filter(|&floor| floor > 0.0));
        let mut simulation = build(effects, &start);
        simulation.step(&mut NoProbe).unwrap();
        let (p, n) = (&simulation.particles().pressure, &simulation.particles().number_density);
        let close = |found: f64, expected: f64, scale: f64, what: &str| {
            assert!((found - expected).abs() <= 1e-6 * scale, "{what}, floor {floor}: {found} {expected}");
        };
        for i in 0..start.len() {
            let near = pairs(&start, i, 2.1, floor);
            close(n[i], near.iter().map(|pair| pair.3).sum(), 1e-6 * n0, "number density");
            if p[i] > 0.0 {
                let wide = pairs(&start, i, 3.1, floor);
                let flux: f64 = wide.iter().map(|&(j, _, _, w)| coefficient * w * (p[i] - p[j])).sum();
                let relaxation = 0.2 / (DT * DT);
                let source = relaxation * (n[i] - n0) / n0;
                close(flux + 0.45e-9 / (DT * DT) * p[i], source, relaxation, "pressure equation");
            }
            let least = near.iter().map(|pair| p[pair.0]).fold(p[i], f64::min);
            let push = |sum: Vec3, &(j, r_ij, r, w): &(usize, Vec3, f64, f64)| {
                add_scaled(sum, -3.0 / (n0 * 1000.0) * (p[j] - least) * w / (r * r), r_ij)
            };
            let expected = near.iter().fold([0.0; 3], push);
            let found = scale(1.0 / DT, simulation.particles().velocity[i]);
            for (found, expected) in found.into_iter().zip(expected) {
                close(found, expected, 1e-3 * expected.abs().max(1.0), "acceleration");
            }
        }
        assert!(p.iter().filter(|&&p| p > 0.0).count() > 50, "there is pressure to speak of");
    }
}

#[test]
fn two_equal_particles_collide_with_the_stated_restitution() {
    let collision = Some(Collision { distance: 0.5, restitution: 0.2 });
    let particles = [fluid([0.0; 3], [1.0, 0.0, 0.0]), fluid([0.045, 0.0, 0.0], [-1.0, 0.0, 0.0])];
    let mut simulation = build(Effects { collision, ..Effects::default() }, &particles);
    simulation.step(&mut NoProbe).unwrap();
    let after = &simulation.particles().velocity;
    // s = 2 m/s of approach, of which each takes (1 + e) / 2 off: they part with e times the approach.
    assert!((after[0][0] + 0.2).abs() < 1e-15 && (after[1][0] - 0.2).abs() < 1e-15, "{after:?}");
}

/// The solid particles of a box whose inner lattice sites run from 1 to `inside`: two layers of wall, two of dummy wall.
fn walled_box(inside: i32) -> Vec<InitialParticle> {
    let axis = || -3..=inside + 4;
    let sites = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| [x, y, z])));
    let depth = |site: [i32; 3]| site.into_iter().map(|c| (1 - c).max(c - inside)).max().unwrap();
    let kind = |site| match depth(site) {
        ..=0 => None,
        1..=2 => Some(Kind::Wall),
        _ => Some(Kind::DummyWall),
    };
    let place = |site: [i32; 3]| Some(InitialParticle::at_rest(kind(site)?, site.map(|c| L0 * f64::from(c))));
    sites.filter_map(place).collect()
}

/// The velocity of a fluid particle at `place`, in particle distances, one step after it had `velocity` in a walled box.
fn after_contact(place: Vec3, velocity: Vec3) -> Vec3 {
    let mut particles = walled_box(9);
    particles.push(fluid(scale(L0, place), velocity));
    let wall_contact = Some(WallContact { height: 0.7, reach: 0.75 });
    let mut simulation = build(Effects { wall_contact, ..Effects::default() }, &particles);
    simulation.step(&mut NoProbe).unwrap();
    let (found, last) = (simulation.particles(), particles.len() - 1);
    let moved = sub(found.position[last], particles[last].position);
    let expected = scale(DT, found.velocity[last]);
    assert!(sub(moved, expected).into_iter().all(|c| c.abs() < 1e-15), "it moves as it ends up");
    found.velocity[last]
}

#[test]
fn a_wall_takes_off_the_velocity_into_its_plane_and_no_other() {
    // In the middle of a floor, above the hole between four of its particles and above one of them.
    for [x, z] in [[5.5, 4.5], [5.0, 5.0], [5.3, 4.9]] {
        let touched = after_contact([x, 0.65, z], [1.0, -2.0, 0.5]);
        let off = sub(touched, [1.0, 0.0, 0.5]);
        assert!(off.into_iter().all(|c| c.abs() < 1e-12), "{touched:?} at {x} {z}");
        for (height, vertical) in [(0.65, 2.0), (0.75, -2.0), (-0.3, 1.0)] {
            let free = [1.0, vertical, 0.5];
            assert_eq!(after_contact([x, height, z], free), free, "nothing to stop at {height}");
        }
        assert!(after_contact([x, -0.3, z], [0.0, -1.0, 0.0])[1].abs() < 1e-12, "it gets no deeper");
    }
}

/// Particles that feel nothing but the walls, shot in all directions at up to a particle distance a step.
fn leaks_of_shots(effects: Effects) -> usize {
    let mut particles = walled_box(5);
    let mut random = fastrand::Rng::with_seed(1);
    for _ in 0..400 {
        let place = [0; 3].map(|_| L0 * (1.0 + 4.0 * random.f64()));
        let velocity = [0; 3].map(|_| 0.57 * L0 / DT * (2.0 * random.f64() - 1.0));
        particles.push(fluid(place, velocity));
    }
    let mut watch = LeakWatch::new(&particles, L0);
    let mut simulation = build(effects, &particles);
    for _ in 0..100 {
        simulation.step(&mut NoProbe).unwrap();
        watch.look(simulation.particles());
    }
    watch.count()
}

#[test]
fn walls_edges_and_corners_hold_what_is_shot_at_them() {
    assert!(leaks_of_shots(Effects::default()) > 300, "nothing holds them without contact");
    let wall_contact = Some(WallContact { height: 0.7, reach: 0.75 });
    assert_eq!(leaks_of_shots(Effects { wall_contact, ..Effects::default() }), 0);
}

#[test]
fn a_particle_that_leaves_the_domain_is_counted_and_out_of_all_sums() {
    let effects = Effects {
        collision: Some(Collision { distance: 0.5, restitution: 0.2 }),
        pressure: pressure(),
        ..Effects::default()
    };
    let mut simulation =
        build(effects, &[fluid([0.0; 3], [0.0; 3]), fluid([1.9995, 0.0, 0.0], [1.0, 0.0, 0.0])]);
    let mut ghosts = Vec::new();
    for _ in 0..3 {
        ghosts.push(simulation.step(&mut NoProbe).unwrap().ghosts);
    }
    let particles = simulation.particles();
    assert_eq!(ghosts, [1, 1, 1]);
    assert_eq!(
        (particles.kind[1], particles.velocity[1], particles.pressure[1]),
        (Kind::Ghost, [0.0; 3], 0.0)
    );
    assert_eq!(particles.count(Kind::Fluid) + 1, 2);
}

#[test]
fn coincident_particles_end_the_run_with_step_phase_and_particles() {
    let place = [0.3, 0.1, 0.2];
    let apart = fluid([0.0; 3], [0.0; 3]);
    let twins = [apart, fluid(place, [0.0; 3]), fluid(place, [0.0; 3])];
    let viscosity = Some(Viscosity::uniform(1e-6));
    let collision = Some(Collision { distance: 0.5, restitution: 0.2 });
    for (effects, phase) in [
        (Effects { viscosity, collision, pressure: pressure(), ..Effects::default() }, Phase::Viscosity),
        (Effects { collision, pressure: pressure(), ..Effects::default() }, Phase::Collision),
        (Effects { pressure: pressure(), ..Effects::default() }, Phase::NumberDensity),
    ] {
        for preset in [Preset::PAPER_LINKED_LIST, Preset::PAPER_AOS_RELOCATION] {
            let mut simulation = build_with(effects.clone(), &twins, &preset.options());
            let error = simulation.step(&mut NoProbe).unwrap_err();
            assert_eq!(error, SimulationError::Coincident { step: 1, phase, particle: 1, other: 2 });
            assert!(error.to_string().contains("step 1") && error.to_string().contains("distance zero"));
        }
    }
}

#[test]
fn a_position_that_is_not_finite_ends_the_run() {
    let particles = [fluid([0.0; 3], [0.0; 3]), fluid([0.5, f64::NAN, 0.0], [0.0; 3])];
    let mut simulation = build(Effects { pressure: pressure(), ..Effects::default() }, &particles);
    let error = simulation.step(&mut NoProbe).unwrap_err();
    let expected =
        SimulationError::NotFinite { step: 1, phase: Phase::BucketBuild, particle: 1, quantity: "position" };
    assert_eq!(error, expected);
}

#[test]
fn a_solver_that_does_not_converge_ends_the_run() {
    let scene = dam_break(0.075);
    let particles = scene.particles("test").unwrap();
    let mut options = Preset::PAPER_LINKED_LIST.options();
    options.cg.max_iterations = 2;
    let workers = Arc::new(Workers::new(1, options.schedule, &[]).unwrap());
    let start = Start { particles: &particles, steps_done: 0 };
    let mut simulation = simulation::build(&scene.parameters(&particles), &options, start, workers).unwrap();
    let error = simulation.step(&mut NoProbe).unwrap_err();
    let SimulationError::Solver { step: 1, source: CgError::NotConverged { residual, iterations: 2 } } =
        error
    else {
        panic!("{error}");
    };
    assert!(residual > 1e-8);
}

/// A box full of fluid with walls all around, beside an open pool or alone.
fn closed_box(with_pool: bool) -> Scene {
    let pool = if with_pool {
        "[[geometry.region]]\nfill = \"fluid\"\nfrom_m = [2.0, -0.05, -0.05]\nto_m = [2.3, 0.3, 0.3]\n"
    } else {
        ""
    };
    let text = format!(
        r#"
        schema = 1
        name = "closed-box"
        description = "no free surface"
        particle_distance_m = 0.1
        time_step_s = 0.001
        end_time_s = 0.001
        fluid = {{ density_kg_m3 = 1000.0 }}
        radii = {{ number_density = 2.1, gradient = 2.1, laplacian = 3.1 }}
        domain = {{ margin_m = 0.1, headroom_m = 0.0 }}
        effects.gravity = {{ acceleration_m_s2 = [0.0, -9.8, 0.0] }}
        effects.pressure = {{ surface_threshold = 0.97, source_relaxation = 0.2, compressibility_1_pa = 0.45e-9 }}
        geometry.lattice = {{ extent_m = [2.5, 0.6, 0.6], layers = 4 }}
        [[geometry.region]]
        fill = "dummy_wall"
        from_m = [-0.05, -0.05, -0.05]
        to_m = [0.6, 0.6, 0.6]
        layers_below = [3.5, 3.5, 3.5]
        layers_above = [4.0, 4.0, 4.0]
        [[geometry.region]]
        fill = "wall"
        from_m = [-0.05, -0.05, -0.05]
        to_m = [0.6, 0.6, 0.6]
        layers_below = [1.5, 1.5, 1.5]
        layers_above = [2.0, 2.0, 2.0]
        [[geometry.region]]
        fill = "fluid"
        from_m = [-0.05, -0.05, -0.05]
        to_m = [0.6, 0.6, 0.6]
        {pool}"#
    );
    Scene::parse(&text, "closed-box", &[]).unwrap()
}

#[test]
fn a_pool_without_a_free_surface_is_found_and_anchored() {
    let alone = closed_box(false);
    for preset in ["paper-linked-list", "paper-aos-relocation", "brute-force"] {
        let (_, report) = run_scene(&alone, &Run { steps: 1, preset, threads: 2, ..Run::default() });
        let solve = report.pressure.unwrap();
        assert!(solve.unknowns > 500 && solve.surface == 0, "{preset}: {solve:?}");
        assert_eq!(solve.enclosed, solve.unknowns, "{preset}");
    }
    let (_, alone) = run_scene(&alone, &Run { steps: 1, ..Run::default() });
    let (_, both) = run_scene(&closed_box(true), &Run { steps: 1, ..Run::default() });
    let both = both.pressure.unwrap();
    assert_eq!(both.enclosed, alone.pressure.unwrap().enclosed, "the open pool is not enclosed");
    assert!(both.surface > 0);
}

/// The residual that a step reports is the true one, and tighter tolerances converge to one answer.
#[test]
fn tighter_tolerances_converge_to_one_answer() {
    let scene = dam_break(0.075);
    let pressures = |tolerance: f64, change: fn(&mut Options)| {
        let run = Run { steps: 10, change, ..Run::default() };
        let (simulation, report) = run_scene(&scene, &run);
        assert!(report.pressure.unwrap().cg.residual <= 10.0 * tolerance);
        simulation.particles().pressure.clone()
    };
    let best = pressures(1e-12, |o| o.cg.tolerance = 1e-12);
    let error = |p: &[f64]| {
        let difference: f64 = p.iter().zip(&best).map(|(a, b)| (a - b) * (a - b)).sum();
        let norm: f64 = best.iter().map(|b| b * b).sum();
        (difference / norm).sqrt()
    };
    let loose = error(&pressures(1e-4, |o| o.cg.tolerance = 1e-4));
    let tight = error(&pressures(1e-8, |o| o.cg.tolerance = 1e-8));
    assert!(loose < 1e-2 && tight < 1e-6 && tight < loose, "{loose:e} {tight:e}");
}
