//! Solids against a plainer way to the same answer: the solid angle that the surface covers as seen from a point, and the
//! distance to the nearest of many points on it.

use std::f64::consts::PI;
use std::time::Instant;

use proptest::prelude::*;
use repro::base::vec3::{Vec3, dot, sub};
use repro::engine::particles::Kind;
use repro::scene::geometry::Placement;

use crate::support::{Triangles, beside, binary, lattice, place, positions, region, sphere_surface};

/// How often the surface winds around a point (van Oosterom & Strackee 1983); close to a whole number off the surface.
fn winding(point: Vec3, surface: &Triangles) -> f64 {
    let angle = |corners: &[Vec3; 3]| {
        let [a, b, c] = corners.map(|corner| sub(corner, point));
        let length = |v: Vec3| dot(v, v).sqrt();
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        let (la, lb, lc) = (length(a), length(b), length(c));
        let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
        2.0 * dot(a, cross).atan2(below)
    };
    surface.iter().map(angle).sum::<f64>() / (4.0 * PI)
}

/// At most a tenth too far, for triangles of sides up to 2.
fn distance(point: Vec3, surface: &Triangles) -> f64 {
    let steps = 24;
    let nearest = |[a, b, c]: &[Vec3; 3]| {
        let at = |i: usize, j: usize| {
            let (s, t) = (i as f64 / steps as f64, j as f64 / steps as f64);
            let x = [0, 1, 2].map(|d| a[d] + s * (b[d] - a[d]) + t * (c[d] - a[d]));
            dot(sub(x, point), sub(x, point))
        };
        let pairs = (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| (i, j)));
        pairs.map(|(i, j)| at(i, j)).fold(f64::INFINITY, f64::min)
    };
    surface.iter().map(nearest).fold(f64::INFINITY, f64::min).sqrt()
}

/// Where a point of a lattice of spacing 1 is looked at: the hundredth below it that makes faces half open.
fn looked_at(point: Vec3) -> Vec3 {
    sub(point, [0.01, 0.007_548_776_662_466_928, 0.005_698_402_909_980_532])
}

/// A sphere of 32 triangles whose corners are moved so far that they fold over each other.
fn crumpled(shifts: &[Vec3], coarse: bool) -> Triangles {
    let mut surface = sphere_surface([5.0; 3], 3.0, 1);
    let mut corners: Vec<Vec3> = Vec::new();
    for corner in surface.iter_mut().flatten() {
        let known = corners.iter().position(|c| c == corner).unwrap_or_else(|| {
            corners.push(*corner);
            corners.len() - 1
        });
        // Whole and half numbers put corners, edges and faces onto lattice points.
        let moved = [0, 1, 2].map(|d| corner[d] + shifts[known][d]);
        *corner =
            if coarse { moved.map(|x| (2.0 * x).round() / 2.0) } else { moved.map(|x| f64::from(x as f32)) };
    }
    surface
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(24) })]

    #[test]
    fn what_a_crumpled_solid_holds_is_what_its_surface_winds_around(
        shifts in proptest::collection::vec(prop::array::uniform3(-2.0f64..2.0), 18),
        coarse in any::<bool>(),
    ) {
        let surface = crumpled(&shifts, coarse);
        let folder = tempfile::tempdir().unwrap();
        let scene = beside(folder.path(), &binary(&surface));
        let held = |more: &str| {
            let text = lattice(10.0, 0) + &region("fluid", &format!("stl = {{ file = \"solid.stl\" }}\n{more}"));
            place(&text, &Placement::new(&scene, 1.0)).map(|particles| positions(&particles))
        };
        // Corners may have met.
        let (Ok(solid), Ok(shell)) = (held(""), held("layers_outside = 1.5")) else { return Ok(()) };
        let points = (0..11i32.pow(3)).map(|k| [k / 121, k / 11 % 11, k % 11].map(f64::from));
        for point in points {
            let winding = winding(looked_at(point), &surface);
            prop_assert!((winding - winding.round()).abs() < 1e-6, "on the surface: {:?}", point);
            let inside = winding.round() != 0.0;
            prop_assert_eq!(solid.contains(&point), inside, "{:?}", point);
            let distance = distance(looked_at(point), &surface);
            if !inside && !(1.5..=1.6).contains(&distance) {
                prop_assert_eq!(shell.contains(&point), distance < 1.5, "{:?} at {}", point, distance);
            }
        }
    }
}

/// Ten thousand triangles, each as long as the solid: they lie in many bins, whose number must not explode.
#[test]
fn long_thin_triangles_are_feasible() {
    // No lattice point is as close to this radius as the shift of the lattice.
    let (facets, radius) = (2500, 8.015);
    let ring = |k: usize, end: f64| {
        let angle = 2.0 * PI * (k % facets) as f64 / facets as f64;
        let (y, z) = (radius * angle.cos(), radius * angle.sin());
        // A bar along the diagonal of x and y.
        [(end - y) / 2f64.sqrt() + 50.0, (end + y) / 2f64.sqrt() + 50.0, z + 50.0]
    };
    let middle = |end: f64| [end / 2f64.sqrt() + 50.0, end / 2f64.sqrt() + 50.0, 50.0];
    let mut surface = Triangles::new();
    for k in 0..facets {
        let (a, b, c, d) = (ring(k, -40.0), ring(k + 1, -40.0), ring(k, 40.0), ring(k + 1, 40.0));
        surface.extend([[a, b, d], [a, d, c], [middle(-40.0), b, a], [middle(40.0), c, d]]);
    }
    let folder = tempfile::tempdir().unwrap();
    let scene = beside(folder.path(), &binary(&surface));
    let start = Instant::now();
    let fluid = |shapes: &str| {
        let text = lattice(100.0, 0) + shapes;
        let mut particles = place(&text, &Placement::new(&scene, 1.0)).unwrap();
        particles.retain(|particle| particle.kind == Kind::Fluid);
        positions(&particles)
    };
    let stl = "stl = { file = \"solid.stl\" }\n";
    let held = fluid(&(region("wall", &format!("{stl}layers_outside = 2")) + &region("fluid", stl)));
    eprintln!("{} triangles: {:.2} s", surface.len(), start.elapsed().as_secs_f64());
    let [from, to] = [-40.0, 40.0].map(middle);
    let bar = format!("cylinder = {{ from_m = {from:?}, to_m = {to:?}, radius_m = {radius:?} }}");
    assert_eq!(held, fluid(&region("fluid", &bar)));
}
