//! An effect takes the memory that it declares, and one that is not named takes none and no time.

#[path = "common/toy.rs"]
mod toy;

use std::collections::BTreeSet;
use std::sync::Arc;

use repro::base::parallel::Workers;
use repro::base::schedule::Schedule;
use repro::engine::particles::{InitialParticle, Kind};
use repro::engine::phase::{Phase, Probe};
use repro::engine::preset::Preset;
use repro::engine::search::grid::Grid;
use repro::engine::simulation::{self, Simulation, Start};
use repro::scene::Scene;
use repro::scene::spec::effects::EffectsSpec;
use repro::scene::spec::effects::columns::{Counted, INDEX, VECTOR};
use toy::{TOYS, Toy};

/// The phases of an effect in a preset that keeps effects apart.
fn phases(effect: &str) -> &'static [Phase] {
    match effect {
        "gravity" => &[Phase::Gravity],
        "buoyancy" => &[Phase::Buoyancy],
        "viscosity" => &[Phase::Viscosity],
        "heat" => &[Phase::Heat],
        "scalar" => &[Phase::Scalar],
        "implicit_viscosity" => &[Phase::ImplicitViscosity],
        "rheology" | "turbulence" => &[Phase::StrainRate],
        "potential_tension" => &[Phase::PotentialTension],
        "collision" => &[Phase::Collision],
        "wall_contact" => &[Phase::WallContact],
        "surface_tension" => &[Phase::SurfaceTension],
        "pressure" => &[
            Phase::NumberDensity,
            Phase::BoundaryCondition,
            Phase::Source,
            Phase::Matrix,
            Phase::Connectivity,
            Phase::Cg,
            Phase::Clamp,
            Phase::MinimumPressure,
            Phase::PressureGradient,
            Phase::Correction,
        ],
        "frame" => &[Phase::Frame],
        "wall_motion" => &[Phase::WallMotion],
        "flow_boundaries" => &[Phase::FlowBoundaries],
        "rigid_bodies" => &[Phase::RigidBodies],
        "shifting" => &[Phase::Shifting],
        other => panic!("which phases has `{other}`?"),
    }
}

/// Keeps the grid, and with it the search, the same whichever effect is there: it reaches as far as the widest one.
const SAME_GRID: &str = "radii.laplacian=4.2";

fn build(scene: &Scene, particles: &[InitialParticle]) -> Box<dyn Simulation> {
    let workers = Arc::new(Workers::new(1, Schedule::Static, &[]).unwrap());
    let options = Preset::PAPER_LINKED_LIST.options();
    let start = Start { particles, steps_done: 0 };
    simulation::build(&scene.parameters(particles), &options, start, workers).unwrap()
}

/// What a simulation of the scene takes before its first step, if the effects declare it rightly.
fn declared(scene: &Scene, initial: &[InitialParticle]) -> usize {
    let parameters = scene.parameters(initial);
    let grid = Grid::new(parameters.domain, parameters.largest_radius_m(), 1).unwrap();
    let of = Counted {
        scene,
        particles: initial.len(),
        bodies: initial.iter().filter(|particle| particle.kind == Kind::Body).count(),
        buckets: grid.len(),
    };
    // Kind, group, position, velocity and acceleration; the bucket of a particle, and the linked list.
    let group = usize::from(!parameters.groups.is_empty());
    let bare = of.particles * (1 + group + 3 * VECTOR + 2 * INDEX) + of.buckets * 2 * INDEX;
    bare + scene.effects.column_bytes(&of)
}

/// The scene as it is, and without each of its effects and what cannot be without that.
fn with_and_without(toy: Toy) -> Vec<(String, Scene)> {
    let whole = toy::load(toy, &[SAME_GRID]);
    let named = whole.effects.named();
    let mut scenes = vec![(toy.0.to_string(), whole)];
    for effect in &named {
        // Walls that move and bodies are regions and groups as well: a scene cannot be had without their effects.
        if ["wall_motion", "rigid_bodies"].contains(effect) {
            continue;
        }
        let gone: Vec<String> = EffectsSpec::with_dependents(effect, &named)
            .iter()
            .map(|name| format!("effects.{name}=false"))
            .collect();
        let sets: Vec<&str> = std::iter::once(SAME_GRID).chain(gone.iter().map(String::as_str)).collect();
        scenes.push((format!("{} without {effect}", toy.0), toy::load(toy, &sets)));
    }
    scenes
}

#[test]
fn bytes_are_the_sum_of_what_the_named_effects_declare() {
    let mut seen = BTreeSet::new();
    for (what, scene) in TOYS.iter().flat_map(|&toy| with_and_without(toy)) {
        let initial = scene.particles("test").unwrap();
        assert_eq!(build(&scene, &initial).bytes(), declared(&scene, &initial), "{what}");
        seen.extend(scene.effects.named());
    }
    assert_eq!(seen.len(), EffectsSpec::NAMES.len(), "{seen:?}");
}

/// Notes which phases begin.
#[derive(Default)]
struct Seen(BTreeSet<&'static str>);

impl Probe for Seen {
    fn begin(&mut self, phase: Phase) {
        self.0.insert(phase.name());
    }

    fn end(&mut self, _: Phase) {}
}

#[test]
fn only_named_effects_have_phases() {
    for (what, scene) in TOYS.iter().flat_map(|&toy| with_and_without(toy)) {
        let initial = scene.particles("test").unwrap();
        let (mut seen, mut simulation) = (Seen::default(), build(&scene, &initial));
        simulation.step(&mut seen).unwrap_or_else(|error| panic!("{what}: {error}"));
        let mut named = scene.effects.named();
        // Its weight is left out, and buoyancy alone acts along it.
        if scene.effects.buoyancy.as_ref().is_some_and(|buoyancy| buoyancy.without_weight) {
            named.retain(|effect| *effect != "gravity");
        }
        let expected: BTreeSet<&str> =
            named.iter().flat_map(|effect| phases(effect)).map(|phase| phase.name()).collect();
        let of_effects =
            EffectsSpec::NAMES.iter().flat_map(|effect| phases(effect)).map(|phase| phase.name());
        let found: BTreeSet<&str> = of_effects.filter(|phase| seen.0.contains(phase)).collect();
        assert_eq!(found, expected, "{what}");
    }
}
