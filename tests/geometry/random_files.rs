//! STL files of any bytes: refused or read, never a panic; and what is read is closed.

use proptest::prelude::*;
use repro::base::vec3::Vec3;
use repro::scene::geometry::Placement;
use repro::scene::geometry::stl;

use crate::support::{ascii, beside, binary, box_surface, lattice, place, positions, region, sphere_surface};

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(512) })]

    #[test]
    fn any_bytes_are_refused_or_read(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = stl::parse(&bytes);
    }

    #[test]
    fn any_triangles_are_refused_or_read(numbers in proptest::collection::vec(any::<f32>(), 0..20 * 9)) {
        let triangles = numbers.chunks_exact(9).map(|n| [0, 3, 6].map(|k| [k, k + 1, k + 2].map(|i| f64::from(n[i]))));
        let triangles: Vec<[Vec3; 3]> = triangles.collect();
        let _ = (stl::parse(&binary(&triangles)), stl::parse(ascii(&triangles).as_bytes()));
    }

    #[test]
    fn any_words_are_refused_or_read(text in "(solid|facet|vertex|endfacet|endsolid|outer| |\n|1|nan|-|e9){0,60}") {
        let _ = stl::parse(format!("solid {text}").as_bytes());
    }

    #[test]
    fn changed_files_are_refused_or_read(
        changes in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<proptest::sample::Index>(),
        text in any::<bool>(),
    ) {
        let surface = box_surface([0.0; 3], [4.0; 3]);
        let mut bytes = if text { ascii(&surface).into_bytes() } else { binary(&surface) };
        for (index, value) in changes {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        let _ = stl::parse(&bytes);
        bytes.truncate(cut.index(bytes.len()));
        let _ = stl::parse(&bytes);
    }

    /// Whatever the coordinates, a closed surface that is accepted can be placed, and holds nothing beyond its bounds.
    #[test]
    fn a_solid_with_shaken_corners_holds_only_what_is_within_its_bounds(
        shifts in proptest::collection::vec(prop::array::uniform3(-0.4f64..0.4), 18),
        coarse in any::<bool>(),
    ) {
        let mut surface = sphere_surface([5.0; 3], 3.0, 1);
        let mut corners: Vec<Vec3> = Vec::new();
        for corner in surface.iter_mut().flatten() {
            let known = corners.iter().position(|c| c == corner).unwrap_or_else(|| {
                corners.push(*corner);
                corners.len() - 1
            });
            // Whole and half numbers put corners, edges and faces onto lattice points.
            let moved = [0, 1, 2].map(|d| corner[d] + shifts[known][d]);
            *corner = if coarse { moved.map(|x| (2.0 * x).round() / 2.0) } else { moved };
        }
        let folder = tempfile::tempdir().unwrap();
        let scene = beside(folder.path(), &binary(&surface));
        let text = lattice(10.0, 0) + &region("fluid", "stl = { file = \"solid.stl\" }");
        if let Ok(particles) = place(&text, &Placement::new(&scene, 1.0)) {
            let held = positions(&particles);
            prop_assert!(held.iter().flatten().all(|x| (1.0..=9.0).contains(x)));
            prop_assert!(held.contains(&[5.0; 3]));
        }
    }
}
