use super::measure::*;
use super::*;
use crate::engine::kernel::{Dimensions, Reference};

/// A lattice of spacing `l0` over `from .. to` in lattice units, all of one kind.
fn block(l0: f64, from: [i32; 3], to: [i32; 3], kind: Kind) -> (Vec<Kind>, Vec<Vec3>) {
    let mut position = Vec::new();
    for x in from[0]..to[0] {
        for y in from[1]..to[1] {
            for z in from[2]..to[2] {
                position.push([x, y, z].map(|i| l0 * f64::from(i)));
            }
        }
    }
    (vec![kind; position.len()], position)
}

fn joined(parts: [(Vec<Kind>, Vec<Vec3>); 2]) -> (Vec<Kind>, Vec<Vec3>) {
    let [(mut kind, mut position), (more_kind, more_position)] = parts;
    kind.extend(more_kind);
    position.extend(more_position);
    (kind, position)
}

#[test]
fn the_smooth_kernel_has_the_integral_one() {
    let (l0, kernel) = (0.05, SmoothKernel::new(1.0, false));
    let sum: f64 = block(l0, [-20; 3], [21; 3], Kind::Fluid)
        .1
        .iter()
        .map(|x| kernel.at((x[0] * x[0] + x[1] * x[1] + x[2] * x[2]).sqrt()))
        .sum();
    assert!((sum * l0.powi(3) - 1.0).abs() < 1e-3, "{sum}");
    let flat = SmoothKernel::new(1.0, true);
    let sum: f64 =
        block(l0, [-20, -20, 0], [21, 21, 1], Kind::Fluid).1.iter().map(|x| flat.at(x[0].hypot(x[1]))).sum();
    assert!((sum * l0.powi(2) - 1.0).abs() < 1e-3, "{sum}");
}

#[test]
fn pressure_at_a_point_is_exact_for_a_linear_field_in_the_middle() {
    let (kind, position) = block(0.1, [-5; 3], [6; 3], Kind::Fluid);
    let pressure: Vec<f64> = position.iter().map(|x| 1000.0 - 9.8e3 * x[1]).collect();
    let kernel = SmoothKernel::new(0.3, false);
    let at_center = point_pressure([0.0; 3], kernel, &kind, &position, &pressure).unwrap();
    assert!((at_center - 1000.0).abs() < 1e-9, "{at_center}");
    assert_eq!(point_pressure([9.0; 3], kernel, &kind, &position, &pressure), None);
    let dummies = vec![Kind::DummyWall; kind.len()];
    assert_eq!(point_pressure([0.0; 3], kernel, &dummies, &position, &pressure), None);
}

/// Fluid of `layers` layers from y = l0 up on a floor of four layers; the surface lies half a distance above the last.
fn pool(l0: f64, layers: i32) -> (Vec<Kind>, Vec<Vec3>) {
    let floor = block(l0, [-6, -3, -6], [7, 1, 7], Kind::Wall);
    joined([block(l0, [-6, 1, -6], [7, layers + 1, 7], Kind::Fluid), floor])
}

#[test]
fn a_gauge_finds_a_level_surface_to_a_tenth_of_a_particle_distance() {
    let l0 = 0.1;
    let kernel = SmoothKernel::new(3.0 * l0, false);
    for layers in [3, 6, 10] {
        let (kind, mut position) = pool(l0, layers);
        for x in [0.0, 0.03, 0.05] {
            let expected = l0 * (f64::from(layers) + 0.5);
            let height =
                surface_height([x, 0.02], kernel, l0.powi(3), l0, &kind, &position).expect("a surface");
            assert!((height - expected).abs() < 0.1 * l0, "{layers} layers at {x}: {height}, not {expected}");
        }
        // Sub-particle: a surface that is raised by a third of a distance is found there.
        position.iter_mut().for_each(|x| x[1] += l0 / 3.0);
        let raised = surface_height([0.0, 0.0], kernel, l0.powi(3), l0, &kind, &position).unwrap();
        assert!((raised - l0 * (f64::from(layers) + 0.5 + 1.0 / 3.0)).abs() < 0.1 * l0, "{raised}");
    }
}

#[test]
fn a_gauge_ignores_drops_and_ends_where_there_is_no_fluid() {
    let l0 = 0.1;
    let kernel = SmoothKernel::new(3.0 * l0, false);
    let (mut kind, mut position) = pool(l0, 4);
    let dry = surface_height([5.0, 0.0], kernel, l0.powi(3), l0, &kind, &position);
    assert_eq!(dry, None);
    kind.push(Kind::Fluid);
    position.push([0.0, 2.0, 0.0]);
    let height = surface_height([0.0, 0.0], kernel, l0.powi(3), l0, &kind, &position).unwrap();
    assert!((height - 0.45).abs() < 0.01, "{height}");
}

#[test]
fn a_flux_counts_both_directions_and_only_inside_the_rectangle() {
    let gate = Rectangle { axis: 0, low: [1.0, 0.0, 0.0], high: [1.0, 1.0, 1.0] };
    let from = [[0.9, 0.5, 0.5], [1.1, 0.5, 0.5], [0.9, 0.9, 0.5], [0.9, 0.5, 0.5], [0.9, 0.5, 0.5]];
    // The third passes above the rectangle; the fourth does not reach it; the fifth is a wall.
    let to = [[1.1, 0.5, 0.5], [0.9, 0.5, 0.5], [1.1, 1.2, 0.5], [0.99, 0.5, 0.5], [1.1, 0.5, 0.5]];
    let mut kind = [Kind::Fluid; 5];
    kind[4] = Kind::Wall;
    let net = |some: std::ops::Range<usize>| {
        let kind = &kind[some.clone()];
        crossings(gate, (kind, &from[some.clone()]), (kind, &to[some]))
    };
    assert_eq!((net(0..1), net(1..2), net(0..5)), (1, -1, 0));
    assert_eq!((net(2..3), net(3..4), net(4..5)), (0, 0, 0));
}

/// A flat wall as thick as the radius under fluid of one pressure: the force is the pressure times the area, into the wall.
#[test]
fn the_force_on_a_flat_wall_is_pressure_times_area() {
    let (l0, radius_m): (f64, f64) = (0.1, 0.21);
    let reference = Reference::on_lattice(Dimensions::Three, l0, radius_m).number_density;
    let model = ForceModel { radius_m, reference, dimensions: 3.0, volume: l0.powi(3) };
    // The wall under the middle of a wide block of fluid: ten by ten particles, an area of 1 m2.
    let (kind, position) = joined([
        block(l0, [-3, 1, -3], [13, 4, 13], Kind::Fluid),
        block(l0, [0, -1, 0], [10, 1, 10], Kind::Wall),
    ]);
    let pressure = vec![500.0; kind.len()];
    let force = pressure_force(&model, &kind, &position, &pressure, |_| true);
    assert!((force[1] + 500.0).abs() < 1e-9 && force[0].abs() + force[2].abs() < 1e-9, "{force:?}");
    let half = pressure_force(&model, &kind, &position, &pressure, |i| position[i][0] < 0.45);
    assert!((half[1] + 250.0).abs() < 1e-9, "{half:?}");
}

#[test]
fn centre_and_front_are_those_of_the_fluid() {
    let kind = [Kind::Fluid, Kind::Fluid, Kind::Wall];
    let position = [[0.0, 1.0, 2.0], [2.0, 3.0, 4.0], [50.0; 3]];
    assert_eq!(centre_of_mass(&kind, &position), Some([1.0, 2.0, 3.0]));
    assert_eq!(front(0, &kind, &position), Some([2.0, 1.98]));
    assert_eq!((centre_of_mass(&kind[2..], &position[2..]), front(0, &[], &[])), (None, None));
}

const SCENE: &str = r#"
    schema = 1
    name = "test"
    description = "two particles under a wall"
    particle_distance_m = 0.5
    time_step_s = 0.001
    end_time_s = 0.001
    fluid = { density_kg_m3 = 1000.0 }
    radii = { number_density = 2.1, gradient = 2.1, laplacian = 3.1 }
    domain = { margin_m = 1.0, headroom_m = 0.0 }
    effects.gravity = { acceleration_m_s2 = [0.0, -10.0, 0.0] }
    geometry.lattice = { extent_m = [0.0, 0.0, 0.0], layers = 0 }
    [[geometry.particle]]
    kind = "fluid"
    position_m = [0.0, 1.0, 0.0]
    velocity_m_s = [2.0, 0.0, 0.0]
    [[geometry.particle]]
    kind = "fluid"
    position_m = [0.5, 1.0, 1.0]
"#;

fn probes(text: &str) -> Result<Probes, InputError> {
    let scene = Scene::parse(&format!("{SCENE}{text}"), "test.toml", &[])?;
    let initial = scene.particles("test.toml")?;
    Probes::new(&scene, "test.toml", &initial, &|name| (name == "piston").then_some(3))
}

#[test]
fn rows_hold_what_is_due_and_leave_the_rest_empty() {
    let text = "[[probe]]\nname = \"budget\"\nevery_steps = 2\nmeasure = \"energy\"\n\
                [[probe]]\nname = \"gate\"\nevery_steps = 3\n\
                measure.flux = { from_m = [0.25, 0.0, -0.5], to_m = [0.25, 1.5, 0.5] }\n";
    let mut probes = probes(text).unwrap();
    assert_eq!(probes.columns(), ["budget_kinetic_j", "budget_potential_j", "gate_flux_m3_s"]);
    let mut particles = Particles {
        kind: vec![Kind::Fluid; 2],
        position: vec![[0.0, 1.0, 0.0], [0.5, 1.0, 1.0]],
        velocity: vec![[2.0, 0.0, 0.0], [0.0; 3]],
        ..Particles::default()
    };
    // A particle weighs 1000 kg/m3 0.125 m3 = 125 kg: 125 2^2 / 2 J, and 125 10 (1 + 1) J.
    assert_eq!(probes.look(0, 0.0, &particles), Some(vec![Some(250.0), Some(2500.0), None]));
    particles.position[0][0] = 0.4;
    assert_eq!(probes.look(1, 0.1, &particles), None);
    assert_eq!(probes.look(2, 0.2, &particles), Some(vec![Some(250.0), Some(2500.0), None]));
    // The crossing in step 1 counts at the next row that is due.
    assert_eq!(probes.look(3, 0.25, &particles), Some(vec![None, None, Some(0.125 / 0.25)]));
}

#[test]
fn impossible_probes_are_refused_by_file_key_and_remedy() {
    let refused = |text: &str, words: &[&str]| {
        let error = probes(&format!("[[probe]]\n{text}\n")).unwrap_err().to_string();
        for word in words.iter().chain(&["test.toml"]) {
            assert!(error.contains(word), "`{text}` does not say `{word}`: {error}");
        }
    };
    refused("name = \"a b\"\nmeasure = \"energy\"", &["probe[0].name", "a b", "letters"]);
    refused("name = \"a\"\nevery_steps = 0\nmeasure = \"energy\"", &["every_steps", "from 1 up"]);
    refused(
        "name = \"a\"\nmeasure = \"energy\"\n[[probe]]\nname = \"a\"\nmeasure = \"energy\"",
        &["probe[1].name", "another"],
    );
    refused(
        "name = \"a\"\nmeasure.gauge = { x_m = 9.0, z_m = 0.0 }",
        &["probe[0].measure.gauge", "9.0", "inside", "domain.margin_m"],
    );
    refused(
        "name = \"a\"\nmeasure.flux = { from_m = [0, 0, 0], to_m = [1, 1, 1] }",
        &["measure.flux", "rectangle"],
    );
    refused("name = \"a\"\nmeasure.point_pressure = { at_m = [0, 1, 0] }", &["effects.pressure"]);
    refused("name = \"a\"\nmeasure.group_force = { group = \"lid\" }", &["lid", "groups"]);
    refused("name = \"a\"\nmeasure.group_force = { group = \"piston\" }", &["wall"]);
    refused("name = \"a\"\nmeasure.heat = {}", &["heat", "gauge"]);
}
