//! Viscous effects as parts of the engine: what is not there when a coefficient is zero, what does not depend on who
//! computes, steps that follow the stability limit, and what scenes may say.

mod common;

use std::sync::Arc;

use common::{Run, run_scene};
use repro::base::parallel::Workers;
use repro::base::vec3::{dot, sub};
use repro::engine::diagnostics::{FlowState, digest};
use repro::engine::effects::gravity::Gravity;
use repro::engine::effects::rheology::{Model, Rheology, Yielding};
use repro::engine::effects::turbulence::Turbulence;
use repro::engine::parameters::{AdaptiveTimeStep, Effects, Parameters, Property};
use repro::engine::particles::{Kind, Particles};
use repro::engine::phase::NoProbe;
use repro::engine::preset::Preset;
use repro::engine::pressure::matrix::Storage;
use repro::engine::simulation::{self, Start};
use repro::engine::viscous::Walls;
use repro::scene::library;
use repro::scene::validation::channel::{self, Channel, SCHEMES, Scheme};

const CHANNEL: Channel = Channel { across: 12, width_m: 1.0, upper_wall_m_s: 0.1 };
const STEP_S: f64 = 1e-3;

fn gravity() -> Option<Gravity> {
    Some(Gravity { acceleration_m_s2: [0.3, 0.0, 0.0] })
}

/// A parabola between the walls after twenty steps.
fn after_steps(effects: Effects) -> Particles {
    let effects = Effects { gravity: gravity(), ..effects };
    let particles = CHANNEL.particles(|y| y * (1.0 - y) + 0.1 * y);
    let mut simulation = channel::build(&CHANNEL.parameters(STEP_S, effects), &particles).unwrap();
    channel::advance(simulation.as_mut(), 20).unwrap();
    simulation.particles().clone()
}

fn farthest_apart(a: &Particles, b: &Particles) -> f64 {
    let difference = |(a, b): (&[f64; 3], &[f64; 3])| dot(sub(*a, *b), sub(*a, *b)).sqrt();
    a.velocity.iter().zip(&b.velocity).map(difference).fold(0.0, f64::max)
}

fn same(what: &str, a: Effects, b: Effects) {
    let difference = farthest_apart(&after_steps(a), &after_steps(b));
    assert!(difference < 1e-14, "{what}: velocities differ by {difference:e} m/s");
}

#[test]
fn a_coefficient_of_zero_is_as_good_as_no_effect() {
    for scheme in SCHEMES {
        for walls in [Walls::Resting, Walls::Mirrored] {
            same(scheme.name, scheme.effects(Property::Uniform(0.0), walls), Effects::default());
            let plain = || scheme.effects(Property::Uniform(0.01), walls);
            let turbulence = Some(Turbulence { smagorinsky_constant: 0.0 });
            same("turbulence", Effects { turbulence, ..plain() }, plain());
            let rheology = Some(rheology(0.0));
            same("rheology", Effects { rheology, ..plain() }, plain());
            let by_group = scheme.effects(Property::ByGroup(vec![0.01, 0.01]), walls);
            let ends = [by_group, plain()].map(|effects| digest(&after_steps(effects)));
            assert_eq!(ends[0], ends[1], "groups of the same viscosity are uniform to the last bit");
        }
    }
}

/// Bingham's fluid, of the viscosity 0.01 m2/s where nothing yields.
fn rheology(yield_stress_pa: f64) -> Rheology {
    Rheology {
        model: Model::Bingham {
            plastic_viscosity_pa_s: 10.0,
            yielding: Yielding { yield_stress_pa, regularisation_s: 1.0 },
        },
        minimum_viscosity_pa_s: 0.0,
        maximum_viscosity_pa_s: 100.0,
        group: None,
    }
}

fn everything(scheme: Scheme) -> Effects {
    Effects {
        rheology: Some(rheology(5.0)),
        turbulence: Some(Turbulence { smagorinsky_constant: 0.2 }),
        gravity: gravity(),
        ..scheme.effects(Property::Uniform(0.01), Walls::Mirrored)
    }
}

#[test]
fn bits_do_not_depend_on_who_computes() {
    for scheme in SCHEMES {
        let parameters = CHANNEL.parameters(STEP_S, everything(scheme));
        let particles = CHANNEL.particles(|y| y * (1.0 - y) + 0.1 * y);
        let mut ends = Vec::new();
        for (preset, storage, threads, schedule) in [
            (Preset::PAPER_LINKED_LIST, Storage::Ell, 1, "static"),
            (Preset::PAPER_AOS_RELOCATION, Storage::Csr, 3, "dynamic:16"),
        ] {
            let options = simulation_options(preset, storage);
            let workers = Workers::new(threads, schedule.parse().unwrap(), &[]).unwrap();
            let start = Start { particles: &particles, steps_done: 0 };
            let mut simulation = simulation::build(&parameters, &options, start, Arc::new(workers)).unwrap();
            channel::advance(simulation.as_mut(), 5).unwrap();
            ends.push(digest(simulation.particles()));
        }
        assert_eq!(ends[0], ends[1], "{}", scheme.name);
    }
}

fn simulation_options(preset: Preset, storage: Storage) -> repro::engine::preset::Options {
    repro::engine::preset::Options { storage, ..preset.options() }
}

#[test]
fn walls_keep_their_own_velocity() {
    for scheme in SCHEMES {
        let particles = after_steps(everything(scheme));
        for (kind, u) in particles.kind.iter().zip(&particles.velocity) {
            assert!(*kind == Kind::Fluid || [0.0, 0.1].contains(&u[0]), "{kind:?} {u:?}");
        }
    }
}

/// Longer than explicit viscosity allows, seconds.
const LONG_S: f64 = 10.0;

fn first_step_s(effects: Effects) -> f64 {
    let rules = AdaptiveTimeStep { courant: 0.2, safety: 0.5, growth: 1.2, shortest_s: 1e-12 };
    let parameters = Parameters { adaptive: Some(rules), ..CHANNEL.parameters(LONG_S, effects) };
    let channel = Channel { upper_wall_m_s: 0.0, ..CHANNEL };
    let mut simulation = channel::build(&parameters, &channel.at_rest()).unwrap();
    simulation.step(&mut NoProbe).unwrap().time_step_s
}

#[test]
fn adaptive_steps_keep_explicit_viscosity_stable_and_are_free_of_it_implicitly() {
    let viscosity = Property::Uniform(0.01);
    let [explicit, angular, implicit, _] =
        SCHEMES.map(|scheme| first_step_s(scheme.effects(viscosity.clone(), Walls::Resting)));
    // lambda / (2 D nu), lambda = 2.4485 l0^2.
    let limit = 2.4485 / (4.0 * 144.0) / 0.01;
    assert!((explicit - 0.5 * limit).abs() < 1e-4 * limit, "{explicit} {limit}");
    assert!(angular > 0.25 * limit && angular < 0.5 * limit, "{angular} {limit}");
    assert_eq!(implicit, LONG_S);
    let stiff = first_step_s(Effects {
        rheology: Some(rheology(90.0)),
        ..SCHEMES[0].effects(viscosity, Walls::Resting)
    });
    assert!((stiff - 0.1 * explicit).abs() < 1e-12, "at rest ten times as viscous: {stiff} {explicit}");
}

fn refused(sets: &[&str], words: &[&str]) {
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    let text = library::load("mud-flow", &sets).unwrap_err().to_string();
    assert!(words.iter().all(|word| text.contains(word)), "{sets:?}: {text}");
}

#[test]
fn scenes_say_what_is_wrong_with_a_viscosity() {
    let nu = "effects.viscosity.kinematic_viscosity_m2_s=1e-6";
    refused(&[nu], &["effects.viscosity", "effects.implicit_viscosity", "once"]);
    refused(&["effects.implicit_viscosity=false"], &["effects.rheology", "`effects.viscosity` or"]);
    refused(&["effects.turbulence.smagorinsky_constant=-1"], &["smagorinsky_constant", "from 0 to 1"]);
    refused(
        &["effects.rheology.exponent=2"],
        &["effects.rheology.exponent", "no such key", "yield_stress_pa"],
    );
    refused(&["effects.rheology.model=\"power_law\""], &["effects.rheology", "consistency_pa_s_n, exponent"]);
    refused(&["effects.rheology.regularisation_s=0"], &["regularisation_s", "above 0"]);
    refused(&["effects.rheology.maximum_viscosity_pa_s=0.01"], &["maximum_viscosity_pa_s", "0.07"]);
    refused(&["effects.rheology.group=\"mud\""], &["effects.rheology.group", "`mud`", "[[group]]"]);
    refused(&["effects.implicit_viscosity.walls=\"slippery\""], &["resting", "mirrored"]);
    refused(&["effects.implicit_viscosity.form=\"none\""], &["laplacian", "angular_momentum"]);
}

/// At a toy's size: the mud comes to a halt where water would not, without a particle lost.
#[test]
fn mud_stops_where_a_liquid_flows_on() {
    let front = |yield_stress: &str| {
        let sets = ["particle_distance_m=0.01", "time_step_s=0.001", yield_stress].map(String::from);
        let scene = library::load("mud-flow", &sets).unwrap();
        let (simulation, report) = run_scene(&scene, &Run { steps: 300, ..Run::default() });
        assert_eq!(report.ghosts, 0, "{yield_stress}");
        assert!(report.viscosity.unwrap().iterations > 0 && report.pressure.is_some());
        FlowState::of(simulation.particles())
    };
    let mud = front("effects.rheology.yield_stress_pa=100.0");
    let liquid = front("effects.rheology.yield_stress_pa=0.0");
    println!("mud {mud:?}\nliquid {liquid:?}");
    assert_eq!(mud.fluid, liquid.fluid);
    assert!(mud.front_p99_m < 0.8 * liquid.front_p99_m, "{mud:?} {liquid:?}");
    assert!(mud.max_speed_m_s < 0.5 * liquid.max_speed_m_s, "{mud:?} {liquid:?}");
}
