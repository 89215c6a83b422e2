//! Spheres, cylinders, half spaces and the shells around them.

use std::f64::consts::PI;

use repro::base::vec3::Vec3;
use repro::engine::particles::Kind;
use repro::scene::geometry::Placement;

use crate::support::{lattice, place, placed, positions, region};

/// The volume of what a shape holds on a lattice of spacing `l0`, and its analytic one; it must converge.
fn converges(shape: &str, exact: f64, bounds: [f64; 3]) {
    for (l0, bound) in [0.1, 0.05, 0.025].into_iter().zip(bounds) {
        let text = lattice(2.0, 0) + &region("fluid", shape);
        let count = place(&text, &Placement::new("scene.toml", l0)).unwrap().len();
        let error = (count as f64 * l0 * l0 * l0 / exact - 1.0).abs();
        assert!(error < bound, "{shape}: {error} with l0 = {l0}");
    }
}

#[test]
fn volumes_converge() {
    // Centres off the lattice's symmetry, so that errors do not cancel.
    converges(
        "sphere = { center_m = [1.013, 0.987, 1.021], radius_m = 0.71 }",
        4.0 / 3.0 * PI * 0.71f64.powi(3),
        [0.02, 0.01, 0.005],
    );
    converges(
        "cylinder = { from_m = [0.4, 0.5, 0.6], to_m = [1.4, 1.3, 1.5], radius_m = 0.35 }",
        PI * 0.35 * 0.35 * 2.45f64.sqrt(),
        [0.03, 0.02, 0.01],
    );
    converges(
        "cylinder = { from_m = [1.0, 0.0, 1.0], to_m = [1.0, 2.0, 1.0], radius_m = 0.83 }",
        PI * 0.83 * 0.83 * 2.0,
        [0.03, 0.02, 0.01],
    );
}

#[test]
fn a_circle_keeps_the_symmetry_of_its_lattice() {
    let text = lattice(20.0, 0).replace("20.0]", "0]")
        + &region("fluid", "sphere = { center_m = [10, 10, 0], radius_m = 5 }");
    let placement = Placement { dimensions: 2, ..Placement::new("scene.toml", 1.0) };
    let found = positions(&place(&text, &placement).unwrap());
    // Gauss's circle problem: 81 lattice points within 5 of one of them, those at the distance 5 included.
    assert_eq!(found.len(), 81);
    assert!(
        found.iter().all(|x| found.contains(&[20.0 - x[0], x[1], 0.0]) && found.contains(&[x[1], x[0], 0.0]))
    );
}

/// A cylinder's end is like a box's face: it stands on a wall and takes nothing of it.
#[test]
fn a_cylinder_has_as_many_layers_as_its_length() {
    for (from, to) in [("[5, 0, 5]", "[5, 4, 5]"), ("[5, 4, 5]", "[5, 8, 5]")] {
        let text = lattice(10.0, 0)
            + &region("fluid", &format!("cylinder = {{ from_m = {from}, to_m = {to}, radius_m = 1 }}"));
        assert_eq!(placed(&text).len(), 4 * 5);
    }
}

#[test]
fn a_half_space_is_what_lies_behind_its_normal() {
    let below = |normal: &str| {
        let half = format!("half_space = {{ point_m = [0, 2, 0], normal = {normal} }}");
        placed(&(lattice(4.0, 0) + &region("fluid", &half)))
    };
    let particles = below("[0, 3, 0]");
    assert_eq!(particles.len(), 5 * 3 * 5);
    assert!(particles.iter().all(|p| p.position[1] <= 2.0));
    assert_eq!(below("[0, -1e-3, 0]").len(), 5 * 3 * 5);
    // x + y <= 2 in a square of 5 by 5: a triangle of 3 + 2 + 1 points, the inclined plane's own included.
    assert_eq!(below("[1, 1, 0]").len(), 6 * 5);
}

#[test]
fn shells_lie_outside_and_leave_no_gap() {
    for shape in [
        "sphere = { center_m = [10, 10, 10], radius_m = 5 }",
        "cylinder = { from_m = [10, 6, 10], to_m = [10, 14, 10], radius_m = 4 }",
        "half_space = { point_m = [10, 10, 10], normal = [1, 2, 3] }",
    ] {
        let inside = placed(&(lattice(20.0, 0) + &region("fluid", shape)));
        let both = placed(
            &(lattice(20.0, 0)
                + &region("fluid", shape)
                + &region("wall", &format!("{shape}\nlayers_outside = 2.0"))),
        );
        let fluid: Vec<Vec3> = both.iter().filter(|p| p.kind == Kind::Fluid).map(|p| p.position).collect();
        assert_eq!(fluid, positions(&inside), "the shell takes nothing from the inside");
        // Every neighbour of the inside is inside or in the shell.
        let all = positions(&both);
        for x in &fluid {
            for d in 0..3 {
                for step in [-1.0, 1.0] {
                    let mut next = *x;
                    next[d] += step;
                    assert!(!(0.0..=20.0).contains(&next[d]) || all.contains(&next), "{shape}: {next:?}");
                }
            }
        }
    }
}

/// Two layers of wall on every side: those of a box that is two layers larger, the corners apart.
#[test]
fn the_shell_of_a_cylinder_has_its_layers_at_both_ends() {
    let text = lattice(20.0, 0)
        + &region(
            "wall",
            "cylinder = { from_m = [10, 5, 10], to_m = [10, 10, 10], radius_m = 4 }\nlayers_outside = 2",
        )
        + "[[particle]]\nkind = \"fluid\"\nposition_m = [0, 0, 0]\n";
    let axis: Vec<f64> = positions(&placed(&text))
        .into_iter()
        .filter(|x| x[0] == 10.0 && x[2] == 10.0)
        .map(|x| x[1])
        .collect();
    assert_eq!(axis, [4.0, 5.0, 11.0, 12.0]);
}
