//! Solids from STL files: what they hold, and the shells around them.

use std::f64::consts::PI;
use std::time::Instant;

use repro::engine::particles::{InitialParticle, Kind};
use repro::scene::geometry::Placement;

use crate::support::{Triangles, ascii, beside, binary, box_surface, lattice, place, positions, region};
use crate::support::{sphere_surface, volume};

/// The particles of a region with the surface in a file; the lattice has the spacing `l0`.
fn solid(triangles: &Triangles, lattice: &str, l0: f64, more: &str) -> Vec<InitialParticle> {
    let folder = tempfile::tempdir().unwrap();
    let scene = beside(folder.path(), &binary(triangles));
    let text = format!("{lattice}{}", region("fluid", &format!("stl = {{ file = \"solid.stl\" }}\n{more}")));
    place(&text, &Placement::new(&scene, l0)).unwrap_or_else(|error| panic!("{error}"))
}

/// Its faces lie on lattice planes, and diagonals of faces on lattice points.
#[test]
fn a_cube_holds_what_the_same_box_holds() {
    for (l0, low, high) in [(1.0, [0.0; 3], [6.0; 3]), (0.1, [0.2, 0.1, 0.3], [0.9, 0.6, 0.7])] {
        let lattice = lattice(7.0 * l0 + 0.3, 2);
        let text = format!("from_m = {low:?}\nto_m = {high:?}");
        let expected = place(&(lattice.clone() + &region("fluid", &text)), &Placement::new("", l0)).unwrap();
        assert_eq!(solid(&box_surface(low, high), &lattice, l0, ""), expected);
    }
}

#[test]
fn volumes_converge() {
    let surface = sphere_surface([1.013, 0.987, 1.021], 0.71, 4);
    let faceted = volume(&surface);
    assert!((faceted / (4.0 / 3.0 * PI * 0.71f64.powi(3)) - 1.0).abs() < 0.01);
    for (l0, bound) in [(0.1, 0.02), (0.05, 0.01), (0.025, 0.005)] {
        let count = solid(&surface, &lattice(2.0, 0), l0, "").len();
        let error = (count as f64 * l0 * l0 * l0 / faceted - 1.0).abs();
        assert!(error < bound, "{error} with l0 = {l0}");
    }
}

/// Vertices, edges and inclined faces of an octahedron pass through lattice points: the worst case for rays.
#[test]
fn an_octahedron_on_lattice_points_has_no_holes_and_no_spikes() {
    let particles = solid(&sphere_surface([8.0; 3], 6.0, 0), &lattice(16.0, 0), 1.0, "");
    let l1 = |p: &InitialParticle| p.position.iter().map(|x| (x - 8.0).abs()).sum::<f64>();
    let within = particles.iter().filter(|p| l1(p) < 6.0).count();
    // 1 + 6 + 18 + ... : the lattice points at less than 6 in the sum of coordinates.
    let exact = (-5i64..=5).flat_map(|x| (-5i64..=5).flat_map(move |y| (-5i64..=5).map(move |z| (x, y, z))));
    assert_eq!(within, exact.filter(|(x, y, z)| x.abs() + y.abs() + z.abs() < 6).count());
    assert!(particles.iter().all(|p| l1(p) <= 6.0), "nothing outside");
}

#[test]
fn turned_inside_out_it_is_a_cavity_and_overlapping_bodies_are_one() {
    let (outer, inner) = (box_surface([0.0; 3], [8.0; 3]), box_surface([2.0; 3], [5.0; 3]));
    let turned = |surface: &Triangles| surface.iter().map(|[a, b, c]| [*a, *c, *b]).collect::<Triangles>();
    let count = |parts: &[Triangles]| solid(&parts.concat(), &lattice(12.0, 0), 1.0, "").len();
    assert_eq!(count(&[outer.clone(), turned(&inner)]), 512 - 27);
    assert_eq!(count(&[outer.clone(), inner.clone()]), 512);
    assert_eq!(count(&[outer.clone(), box_surface([5.0; 3], [10.0; 3])]), 512 + 125 - 27);
    assert_eq!(count(&[turned(&outer)]), 512, "a file may be inside out as a whole");
}

#[test]
fn a_shell_has_its_layers_on_every_side() {
    let surface = box_surface([4.0; 3], [9.0; 3]);
    let particles = solid(&surface, &lattice(14.0, 0), 1.0, "layers_outside = 2");
    let along: Vec<f64> =
        positions(&particles).into_iter().filter(|x| x[1] == 6.0 && x[2] == 6.0).map(|x| x[0]).collect();
    assert_eq!(along, [3.0, 4.0, 10.0, 11.0]);
    let inside = solid(&surface, &lattice(14.0, 0), 1.0, "");
    assert!(inside.iter().all(|p| !particles.contains(p)));
    // Around the cube of 5 points a side two layers, round at edges and corners.
    assert!(particles.len() < 9 * 9 * 9 - 125 && particles.len() > 6 * 2 * 25);
}

#[test]
fn the_shell_of_a_sphere_is_that_of_the_same_shape() {
    let surface = sphere_surface([10.02, 9.97, 10.01], 6.0, 5);
    let shell = solid(&surface, &lattice(20.0, 0), 1.0, "layers_outside = 3").len() as f64;
    let exact = 4.0 / 3.0 * PI * (9.0f64.powi(3) - 6.0f64.powi(3));
    assert!((shell / exact - 1.0).abs() < 0.02, "{shell} of {exact}");
}

#[test]
fn a_file_is_scaled_then_moved_and_its_form_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let millimetres = box_surface([0.0; 3], [3000.0, 2000.0, 1000.0]);
    let text = lattice(8.0, 0)
        + &region("fluid", "stl = { file = \"solid.stl\", scale = 0.001, translate_m = [1, 2, 3] }");
    let in_form = |bytes: &[u8]| {
        let scene = beside(folder.path(), bytes);
        place(&text, &Placement::new(&scene, 1.0)).unwrap()
    };
    let (first, second) = (in_form(&binary(&millimetres)), in_form(ascii(&millimetres).as_bytes()));
    assert_eq!(first, second);
    assert_eq!((first.len(), first[0].position, first[5].position), (6, [2.0, 3.0, 4.0], [4.0, 4.0, 4.0]));
}

#[test]
fn a_plane_scene_has_the_section_at_z_zero() {
    let folder = tempfile::tempdir().unwrap();
    let scene = beside(folder.path(), &binary(&box_surface([1.0, 1.0, -1.0], [4.0, 3.0, 1.0])));
    let text = "lattice = { extent_m = [9, 9, 0], layers = 0 }\n".to_string()
        + &region("fluid", "stl = { file = \"solid.stl\" }");
    let placement = Placement { dimensions: 2, ..Placement::new(&scene, 1.0) };
    assert_eq!(place(&text, &placement).unwrap().len(), 3 * 2);
}

#[test]
fn a_solid_goes_on_at_the_other_side_of_a_period() {
    let folder = tempfile::tempdir().unwrap();
    let scene = beside(folder.path(), &binary(&box_surface([-2.0, 1.0, 1.0], [3.0, 4.0, 4.0])));
    let text = lattice(8.0, 0) + &region("fluid", "stl = { file = \"solid.stl\" }");
    let placement = Placement { periodic: [true, false, false], ..Placement::new(&scene, 1.0) };
    let mut x: Vec<f64> = place(&text, &placement).unwrap().iter().map(|p| p.position[0]).collect();
    x.dedup();
    assert_eq!(x, [0.0, 1.0, 2.0, 3.0, 7.0]);
}

/// Prints how long a large surface on a large lattice takes; that it ends at all is the test.
#[test]
fn a_hundred_thousand_triangles_on_a_million_points_are_feasible() {
    let surface = sphere_surface([50.0; 3], 40.0, 7);
    let start = Instant::now();
    let inside = solid(&surface, &lattice(100.0, 0), 1.0, "");
    let filled = start.elapsed();
    let shell = solid(&surface, &lattice(100.0, 0), 1.0, "layers_outside = 4");
    eprintln!(
        "{} triangles: inside {:.2} s, shell {:.2} s",
        surface.len(),
        filled.as_secs_f64(),
        (start.elapsed() - filled).as_secs_f64()
    );
    assert!(inside.iter().all(|p| p.kind == Kind::Fluid) && shell.len() > 80_000);
}
