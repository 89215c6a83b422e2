//! Where lattice points lie: origin, two dimensions, periodic axes, order, jitter.

use repro::base::input::Check;
use repro::base::vec3::Vec3;
use repro::engine::particles::Kind;
use repro::scene::geometry::{Geometry, Placement};

use crate::support::{lattice, place, placed, positions, region};

const ALL: &str = "from_m = [-inf, -inf, -inf]\nto_m = [inf, inf, inf]";

#[test]
fn x_is_outermost_and_z_innermost_and_later_regions_win() {
    let text = lattice(1.0, 0)
        + &region("fluid", ALL)
        + &region("wall", "from_m = [0.5, -1, -1]\nto_m = [1, 1, 1]")
        + &region("empty", "from_m = [0.5, 0.5, -1]\nto_m = [1, 1, 1]")
        + "[[particle]]\nkind = \"fluid\"\nposition_m = [0.5, 0.5, 0.5]\n";
    let found: Vec<_> = placed(&text).iter().map(|p| (p.kind, p.position)).collect();
    let expected = [
        (Kind::Fluid, [0.0, 0.0, 0.0]),
        (Kind::Fluid, [0.0, 0.0, 1.0]),
        (Kind::Fluid, [0.0, 1.0, 0.0]),
        (Kind::Fluid, [0.0, 1.0, 1.0]),
        (Kind::Wall, [1.0, 0.0, 0.0]),
        (Kind::Wall, [1.0, 0.0, 1.0]),
        (Kind::Fluid, [0.5, 0.5, 0.5]),
    ];
    assert_eq!(found, expected);
}

#[test]
fn an_origin_moves_every_lattice_point() {
    let text = "lattice = { extent_m = [1, 0, 0], layers = 1, origin_m = [10, 20, -5] }\n".to_string()
        + &region("fluid", ALL);
    let particles = placed(&text);
    assert_eq!(particles.len(), 4 * 3 * 3);
    assert_eq!((particles[0].position, particles[35].position), ([9.0, 19.0, -6.0], [12.0, 21.0, -4.0]));
    let geometry: Geometry = toml::from_str(&text).unwrap();
    let placement = Placement::new("scene.toml", 1.0);
    assert_eq!(geometry.bounds(&placement), ([9.0, 19.0, -6.0], [12.0, 21.0, -4.0]));
    assert_eq!(geometry.lattice_points(&placement), 36.0);
}

#[test]
fn two_dimensions_have_one_plane_and_boxes_no_third_side() {
    let text = "lattice = { extent_m = [3, 2, 0], layers = 2 }\njitter = { amplitude = 0.3 }\n".to_string()
        + &region("wall", "from_m = [0, 0, 0]\nto_m = [3, 2, 0]\nlayers_below = [2, 2, 0]")
        + &region("fluid", "from_m = [0, 0, 0]\nto_m = [3, 2, 0]");
    let placement = Placement { dimensions: 2, ..Placement::new("scene.toml", 1.0) };
    let particles = place(&text, &placement).unwrap();
    let fluid = particles.iter().filter(|p| p.kind == Kind::Fluid).count();
    assert_eq!((particles.len(), fluid), (5 * 4, 3 * 2));
    assert!(particles.iter().all(|p| p.position[2] == 0.0));
    let geometry: Geometry = toml::from_str(&text).unwrap();
    assert_eq!(geometry.lattice_points(&placement), 8.0 * 7.0);
    assert_eq!(geometry.bounds(&placement), ([-2.3, -2.3, 0.0], [5.3, 4.3, 0.0]));
}

/// 0.3 / 0.1 is a little less than 3: a period is rounded, not cut.
#[test]
fn a_periodic_axis_holds_whole_particle_distances_and_no_layers() {
    let text = "lattice = { extent_m = [0.3, 0.2, 0.2], layers = 2, origin_m = [1, 0, 0] }\n".to_string()
        + &region("wall", "from_m = [1, 0, 0]\nto_m = [1.3, 0.2, 0.2]\nlayers_below = [0, 2, 0]")
        + &region("fluid", "from_m = [1, 0, 0]\nto_m = [1.3, 0.2, 0.2]");
    let placement = Placement { periodic: [true, false, true], ..Placement::new("scene.toml", 0.1) };
    let particles = place(&text, &placement).unwrap();
    // The box reaches from 1 to 1.3 without the lower face; the period's first point is the one at its end.
    assert_eq!(particles.len(), 3 * 4 * 2);
    let x: Vec<f64> = particles.iter().step_by(8).map(|p| p.position[0]).collect();
    assert_eq!(x, [1.0, 1.1, 1.2]);
    assert!(particles.iter().all(|p| (0.0..0.15).contains(&p.position[2])));
    let geometry: Geometry = toml::from_str(&text).unwrap();
    assert_eq!(geometry.lattice_points(&placement), 3.0 * 7.0 * 2.0);
    let [x, y, z] = geometry.periods(&placement);
    assert_eq!((x.unwrap().0, y, z.unwrap()), (1.0, None, (0.0, 0.2)));
    assert!((x.unwrap().1 - 1.3).abs() < 1e-12);
}

#[test]
fn a_period_of_broken_particle_distances_is_refused() {
    let text = "lattice = { extent_m = [0.35, 1, 1], layers = 0 }\n".to_string() + &region("fluid", ALL);
    let refused = |text: &str, l0: f64| {
        let placement = Placement { periodic: [true, false, false], ..Placement::new("scene.toml", l0) };
        place(text, &placement).unwrap_err().to_string()
    };
    let error = refused(&text, 0.1);
    for word in
        ["geometry.lattice.extent_m", "[0.35, 1.0, 1.0]", "periodic axis x", "3 of 0.1 m would be 0.3 m"]
    {
        assert!(error.contains(word), "{error}");
    }
    assert!(refused(&text.replace("0.35", "0.0"), 0.1).contains("1 of 0.1 m would be 0.1 m"));
    let close = text.replace("0.35", "0.3000001");
    let placement = Placement { periodic: [true, false, false], ..Placement::new("scene.toml", 0.1) };
    assert_eq!(place(&close, &placement).unwrap().len(), 3 * 11 * 11);
}

/// A sphere around the corner of the period is one eighth of a sphere in each of its corners.
#[test]
fn shapes_go_on_at_the_other_side_of_a_period() {
    let sphere = |center: f64| {
        let text = lattice(10.0, 0)
            + &region(
                "fluid",
                &format!("sphere = {{ center_m = [{center:?}, 5, {center:?}], radius_m = 3.2 }}"),
            );
        let placement = Placement { periodic: [true, true, true], ..Placement::new("scene.toml", 1.0) };
        place(&text, &placement).unwrap()
    };
    let (middle, corner) = (sphere(5.0), sphere(0.0));
    assert_eq!(middle.len(), corner.len());
    let moved = |x: Vec3| [(x[0] + 5.0) % 10.0, x[1], (x[2] + 5.0) % 10.0].map(f64::to_bits);
    let mut expected: Vec<_> = positions(&middle).into_iter().map(moved).collect();
    let mut found: Vec<_> = positions(&corner).into_iter().map(|x| x.map(f64::to_bits)).collect();
    expected.sort_unstable();
    found.sort_unstable();
    assert_eq!(found, expected);
}

#[test]
fn jitter_moves_fluid_alone_and_the_same_way_whatever_else_there_is() {
    let jitter =
        |amplitude: f64, seed: u64| format!("jitter = {{ amplitude = {amplitude:?}, seed = {seed} }}\n");
    let wall = region("wall", "from_m = [-inf, -inf, -inf]\nto_m = [inf, 0, inf]");
    let text = |start: &str, more: &str| lattice(4.0, 1) + start + &region("fluid", ALL) + more;
    let (plain, moved) = (placed(&text("", &wall)), placed(&text(&jitter(0.1, 1), &wall)));
    for (from, to) in plain.iter().zip(&moved) {
        let apart = [0, 1, 2].map(|d| (to.position[d] - from.position[d]).abs());
        assert!(apart.iter().all(|a| *a <= 0.1 + 1e-12));
        assert_eq!(from.kind == Kind::Fluid, apart.iter().all(|a| *a > 0.0));
    }
    assert_eq!(moved, placed(&text(&jitter(0.1, 1), &wall)), "a seed is a state");
    assert_ne!(moved, placed(&text(&jitter(0.1, 2), &wall)));
    let without_wall = placed(&text(&jitter(0.1, 1), ""));
    let fluid = |p: &&_| matches!(p, repro::engine::particles::InitialParticle { kind: Kind::Fluid, .. });
    assert!(moved.iter().filter(fluid).all(|p| without_wall.contains(p)), "other particles change nothing");
    assert_eq!(positions(&placed(&text(&jitter(0.0, 1), ""))), positions(&placed(&text("", ""))));
}

/// Written down once: any machine and any later version must place the particle there.
#[test]
fn jitter_keeps_its_bits() {
    let text = lattice(0.0, 0) + "jitter = { amplitude = 0.25, seed = 42 }\n" + &region("fluid", ALL);
    assert_eq!(
        placed(&text)[0].position.map(f64::to_bits),
        [13_814_070_780_605_762_328, 13_819_160_521_542_378_188, 13_818_930_727_192_828_756]
    );
}

#[test]
fn jitter_keeps_particles_within_a_period() {
    let text = lattice(6.0, 0) + "jitter = { amplitude = 0.49, seed = 3 }\n" + &region("fluid", ALL);
    let placement = Placement { periodic: [true; 3], ..Placement::new("scene.toml", 1.0) };
    let particles = place(&text, &placement).unwrap();
    assert_eq!(particles.len(), 216);
    assert!(particles.iter().flat_map(|p| p.position).all(|x| (0.0..6.0).contains(&x)));
    assert!(particles.iter().any(|p| p.position[0] > 5.5), "some went around");
    let geometry: Geometry = toml::from_str(&text).unwrap();
    geometry.check(Check { file: "" }, &placement).unwrap();
    assert_eq!(geometry.bounds(&placement), ([0.0; 3], [6.0; 3]));
}
