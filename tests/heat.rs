//! What heat, scalars and buoyancy must do that one can work out by hand, and what scenes may not ask of them.

use std::sync::Arc;

use repro::base::parallel::Workers;
use repro::base::schedule::Schedule;
use repro::engine::effects::buoyancy::Buoyancy;
use repro::engine::effects::collision::Collision;
use repro::engine::effects::diffusion::{Diffusion, Laplacian, WallCondition};
use repro::engine::effects::gravity::Gravity;
use repro::engine::kernel::Dimensions;
use repro::engine::parameters::{AdaptiveTimeStep, Domain, Effects, Parameters, Property, Radii};
use repro::engine::particles::{InitialParticle, Kind};
use repro::engine::phase::NoProbe;
use repro::engine::preset::Preset;
use repro::engine::simulation::{self, Simulation, Start};
use repro::scene::Scene;

const L0: f64 = 0.1;
const DT: f64 = 1e-3;

fn parameters(dimensions: Dimensions, effects: Effects) -> Parameters {
    let depth = if dimensions == Dimensions::Two { 0.0 } else { 3.0 };
    Parameters {
        dimensions,
        particle_distance_m: L0,
        time_step_s: DT,
        adaptive: None,
        groups: Vec::new(),
        density_kg_m3: 1000.0,
        radii: Radii { number_density: 2.1, gradient: 2.1, laplacian: 3.1 },
        domain: Domain::new([-3.0, -3.0, -depth], [3.0, 3.0, depth]),
        effects,
    }
}

fn build(parameters: &Parameters, particles: &[InitialParticle]) -> Box<dyn Simulation> {
    let workers = Arc::new(Workers::new(2, Schedule::Static, &[]).unwrap());
    let options = Preset::PAPER_AOS_RELOCATION.options();
    simulation::build(parameters, &options, Start { particles, steps_done: 0 }, workers).unwrap()
}

fn fluid(position: [f64; 3], temperature: f64) -> InitialParticle {
    InitialParticle {
        temperature,
        concentration: temperature,
        ..InitialParticle::at_rest(Kind::Fluid, position)
    }
}

fn medium(diffusivity: f64, laplacian: Laplacian) -> Option<Diffusion> {
    Some(Diffusion {
        conductivity: Property::Uniform(diffusivity),
        capacity: Property::Uniform(1.0),
        walls: Vec::new(),
        laplacian,
    })
}

const GRAVITY: [f64; 3] = [0.0, -9.8, 0.0];

fn buoyancy(without_weight: bool) -> Option<Buoyancy> {
    Some(Buoyancy { expansion_1_k: 0.01, reference_k: 300.0, gravity_m_s2: GRAVITY, without_weight })
}

#[test]
fn a_warm_particle_rises_by_its_excess() {
    for (without_weight, weight) in [(false, -9.8), (true, 0.0)] {
        let effects = Effects {
            gravity: Some(Gravity { acceleration_m_s2: GRAVITY }),
            buoyancy: buoyancy(without_weight),
            heat: medium(0.0, Laplacian::Lattice),
            ..Effects::default()
        };
        let mut simulation = build(&parameters(Dimensions::Three, effects), &[fluid([0.0; 3], 320.0)]);
        simulation.step(&mut NoProbe).unwrap();
        let rise = simulation.particles().velocity[0][1];
        assert!((rise - DT * (weight + 0.01 * 20.0 * 9.8)).abs() < 1e-15, "{rise}");
    }
}

/// `T = a x^2 + b x y + c y + d z^2`: the rate amid a lattice is `alpha (2 a + 2 d)`, that of the fitted parabola also where
/// particles are anywhere.
#[test]
fn a_parabola_diffuses_at_its_second_derivative() {
    let parabola = |[x, y, z]: [f64; 3]| 1.5 * x * x + 0.7 * x * y - 0.4 * y + 0.25 * z * z;
    for (dimensions, exact) in [(Dimensions::Two, 3.0), (Dimensions::Three, 3.5)] {
        for (laplacian, jitter) in [(Laplacian::Lattice, 0.0), (Laplacian::Corrected, 0.3)] {
            let mut random = fastrand::Rng::with_seed(7);
            let reach_z = if dimensions == Dimensions::Two { 0 } else { 4i32 };
            let mut particles = Vec::new();
            for i in -4i32..=4 {
                for j in -4i32..=4 {
                    for k in -reach_z..=reach_z {
                        let mut at = [i, j, k].map(|i| L0 * (f64::from(i) + jitter * (random.f64() - 0.5)));
                        at[2] = if reach_z == 0 { 0.0 } else { at[2] };
                        let kind = if (i, j, k) == (0, 0, 0) { Kind::Fluid } else { Kind::Body };
                        particles.push(InitialParticle { kind, ..fluid(at, parabola(at)) });
                    }
                }
            }
            let effects = Effects { heat: medium(2.0, laplacian), ..Effects::default() };
            let mut simulation = build(&parameters(dimensions, effects), &particles);
            simulation.step(&mut NoProbe).unwrap();
            let middle = particles.iter().position(|p| p.kind == Kind::Fluid).unwrap();
            let rate = (simulation.particles().temperature[middle] - particles[middle].temperature) / DT;
            assert!((rate - 2.0 * exact).abs() < 1e-9, "{dimensions:?} {laplacian:?}: {rate}");
        }
    }
}

/// A coefficient of zero does what leaving the effect out does, and what is left out has no column.
#[test]
fn nothing_diffuses_and_rises_with_coefficients_of_zero() {
    let particles: Vec<InitialParticle> = (0..64)
        .map(|k| fluid([0.09 * f64::from(k % 8), 0.09 * f64::from(k / 8), 0.0], f64::from(k)))
        .collect();
    let run = |heat: Option<Diffusion>, scalar: Option<Diffusion>, buoyancy: Option<Buoyancy>| {
        let gravity = Some(Gravity { acceleration_m_s2: GRAVITY });
        let collision = Some(Collision { distance: 0.95, restitution: 0.2 });
        let effects = Effects { gravity, collision, heat, scalar, buoyancy, ..Effects::default() };
        let mut simulation = build(&parameters(Dimensions::Two, effects), &particles);
        for _ in 0..20 {
            simulation.step(&mut NoProbe).unwrap();
        }
        simulation.particles().clone()
    };
    let without = run(None, None, None);
    assert!(without.temperature.is_empty() && without.concentration.is_empty());
    let rising = buoyancy(false).map(|buoyancy| Buoyancy { expansion_1_k: 0.0, ..buoyancy });
    for laplacian in [Laplacian::Lattice, Laplacian::Corrected] {
        let with = run(medium(0.0, laplacian), medium(0.0, laplacian), rising);
        assert_eq!(with.position, without.position);
        let same =
            |column: &[f64]| column.iter().zip(&particles).all(|(t, p)| (t - p.temperature).abs() < 1e-14);
        assert!(same(&with.temperature) && same(&with.concentration));
    }
}

/// Half a longest stable step is stable beside walls that hold a value, with either Laplacian; noise dies out.
#[test]
fn the_step_limit_is_one() {
    for laplacian in [Laplacian::Lattice, Laplacian::Corrected] {
        let mut random = fastrand::Rng::with_seed(3);
        let mut particles = Vec::new();
        for i in -4i32..16 {
            for j in -4i32..16 {
                let inside = (0..12).contains(&i) && (0..12).contains(&j);
                let kind = if inside { Kind::Fluid } else { Kind::Wall };
                let at = [L0 * f64::from(i), L0 * f64::from(j), 0.0];
                particles.push(InitialParticle { kind, ..fluid(at, 2.0 * random.f64() - 1.0) });
            }
        }
        let mut heat = medium(1.0, laplacian);
        heat.as_mut().unwrap().walls = vec![WallCondition::Value(0.0)];
        let mut parameters = parameters(Dimensions::Two, Effects { heat, ..Effects::default() });
        let limits = AdaptiveTimeStep { courant: 0.2, safety: 0.9, growth: 2.0, shortest_s: 1e-9 };
        (parameters.adaptive, parameters.time_step_s) = (Some(limits), 1.0);
        let mut simulation = build(&parameters, &particles);
        for _ in 0..400 {
            simulation.step(&mut NoProbe).unwrap();
        }
        let largest = simulation.particles().temperature.iter().fold(0.0, |m: f64, t| m.max(t.abs()));
        assert!(largest < 0.5, "{laplacian:?}: {largest}");
    }
}

const SCENE: &str = r#"
    schema = 1
    name = "test"
    description = "a warm block"
    particle_distance_m = 0.5
    time_step_s = 0.001
    end_time_s = 0.001
    dimensions = 2
    fluid = { density_kg_m3 = 2.0 }
    radii = { number_density = 2.1, gradient = 2.1, laplacian = 3.1 }
    domain = { margin_m = 0.1, headroom_m = 0.0 }
    effects.gravity = { acceleration_m_s2 = [0.0, -9.8, 0.0] }
    effects.heat = { conductivity_w_m_k = 3.0, heat_capacity_j_kg_k = 5.0, initial_k = 290.0 }
    effects.scalar = { diffusivity_m2_s = 0.1, initial = 0.0 }
    effects.buoyancy = { expansion_1_k = 3e-3, reference_k = 290.0 }
    geometry.lattice = { extent_m = [4.0, 1.0, 0.0], layers = 0 }
    [[geometry.region]]
    fill = "fluid"
    from_m = [0.0, -inf, -inf]
    to_m = [3.0, inf, inf]
    group = "warm"
    [[geometry.region]]
    fill = "wall"
    from_m = [3.0, -inf, -inf]
    to_m = [4.0, inf, inf]
    group = "heater"
    [[group]]
    name = "warm"
    temperature_k = 300.0
    conductivity_w_m_k = 4.0
    [[group]]
    name = "heater"
    heat_flux_w_m2 = 7.0
    concentration = 1.0
"#;

fn parse(sets: &[&str]) -> Result<Scene, String> {
    let sets: Vec<String> = sets.iter().map(|set| set.to_string()).collect();
    Scene::parse(SCENE, "test.toml", &sets).map_err(|error| error.to_string())
}

#[test]
fn scenes_name_properties_temperatures_and_walls_by_group() {
    let scene = parse(&[]).unwrap();
    let particles = scene.particles("test.toml").unwrap();
    let parameters = scene.parameters(&particles);
    let of = |kind: Kind| *particles.iter().find(|p| p.kind == kind).unwrap();
    let (warm, heater) = (of(Kind::Fluid), of(Kind::Wall));
    assert_eq!((warm.temperature, warm.concentration), (300.0, 0.0));
    assert_eq!((heater.temperature, heater.concentration), (290.0, 1.0));
    let heat = parameters.effects.heat.unwrap();
    assert_eq!([warm, heater].map(|p| heat.conductivity.of(p.group)), [4.0, 3.0]);
    assert_eq!(heat.capacity, Property::Uniform(10.0));
    assert_eq!(heat.wall(heater.group), WallCondition::Flux(7.0));
    let scalar = parameters.effects.scalar.unwrap();
    assert_eq!(scalar.wall(heater.group), WallCondition::Value(1.0));
    assert_eq!(parameters.effects.buoyancy.unwrap().gravity_m_s2, [0.0, -9.8, 0.0]);
}

#[test]
fn scenes_that_contradict_themselves_about_heat_are_refused() {
    for (sets, words) in [
        (vec!["effects.heat=false"], ["effects.buoyancy", "effects.heat"]),
        (vec!["effects.gravity=false"], ["effects.buoyancy", "effects.gravity"]),
        (
            vec!["effects.heat.thermal_diffusivity_m2_s=1.0"],
            ["effects.heat", "thermal_diffusivity_m2_s` alone"],
        ),
        (vec!["effects.heat.conductivity_w_m_k=-1"], ["effects.heat.conductivity_w_m_k", "-1"]),
        (vec!["effects.scalar.diffusivity_m2_s=-1"], ["effects.scalar.diffusivity_m2_s", "-1"]),
    ] {
        let text = parse(&sets).unwrap_err();
        assert!(words.iter().all(|word| text.contains(word)), "{sets:?}: {text}");
    }
    let change = |from: &str, to: &str| {
        Scene::parse(&SCENE.replace(from, to), "test.toml", &[]).unwrap_err().to_string()
    };
    let both = change("heat_flux_w_m2 = 7.0", "heat_flux_w_m2 = 7.0\ntemperature_k = 310.0");
    assert!(both.contains("group[1].heat_flux_w_m2") && both.contains("leave one"), "{both}");
    let diffusive = "effects.heat = { thermal_diffusivity_m2_s = 0.3, initial_k = 290.0 }";
    let conductive =
        "effects.heat = { conductivity_w_m_k = 3.0, heat_capacity_j_kg_k = 5.0, initial_k = 290.0 }";
    let mixed = change(conductive, diffusive);
    assert!(
        mixed.contains("group[0].conductivity_w_m_k") && mixed.contains("thermal_diffusivity"),
        "{mixed}"
    );
}

/// The scene of the heated cavity at half its resolution: air rises along the warm wall and sinks along the cold one.
#[test]
fn the_heated_cavity_circulates() {
    let sets = ["particle_distance_m=0.0018", "time_step_s=0.006", "end_time_s=0.6"].map(String::from);
    let scene = repro::scene::library::load("heated-cavity", &sets).unwrap();
    let particles = scene.particles("heated-cavity").unwrap();
    assert_eq!(particles.iter().filter(|p| p.kind == Kind::Fluid).count(), 12 * 12);
    let mut simulation = build(&scene.parameters(&particles), &particles);
    for _ in 0..scene.steps() {
        assert_eq!(simulation.step(&mut NoProbe).unwrap().ghosts, 0);
    }
    let after = simulation.particles();
    let rise = |holds: &dyn Fn(f64) -> bool| -> f64 {
        let near = (0..after.len()).filter(|&i| after.kind[i] == Kind::Fluid && holds(after.position[i][0]));
        near.map(|i| after.velocity[i][1]).sum()
    };
    assert!(rise(&|x| x < 0.006) > 0.0 && rise(&|x| x > 0.0174) < 0.0);
    assert!(after.temperature.iter().all(|t| (289.2..298.8).contains(t)));
}
