//! STL files that are no solids: what is said about each.

use repro::scene::geometry::Placement;
use repro::scene::geometry::stl::{self, StlError};

use crate::support::{Triangles, ascii, beside, binary, box_surface, lattice, place, region, sphere_surface};

fn cube() -> Triangles {
    box_surface([0.0; 3], [4.0; 3])
}

/// The error, and that a scene which names the file says so with its own key.
#[track_caller]
fn refused(bytes: &[u8], words: &[&str]) -> StlError {
    let error = stl::parse(bytes).expect_err("must be refused");
    let folder = tempfile::tempdir().unwrap();
    let scene = beside(folder.path(), bytes);
    let text = lattice(4.0, 0) + &region("fluid", "stl = { file = \"solid.stl\" }");
    let message = place(&text, &Placement::new(&scene, 1.0)).unwrap_err().to_string();
    for word in words.iter().chain(&["scene.toml", "geometry.region[0].stl.file", "solid.stl"]) {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
    error
}

#[test]
fn both_forms_are_the_same_solid() {
    for surface in [cube(), sphere_surface([0.3, 0.1, 7.7], 1.3, 3)] {
        let (first, second) =
            (stl::parse(&binary(&surface)).unwrap(), stl::parse(ascii(&surface).as_bytes()).unwrap());
        assert_eq!((&first.vertices, &first.triangles), (&second.vertices, &second.triangles));
        assert_eq!(first.vertices.len(), surface.len() / 2 + 2, "Euler: equal corners are one vertex");
    }
}

#[test]
fn forms_are_told_apart_by_their_length() {
    let mut bytes = binary(&cube());
    bytes[..5].copy_from_slice(b"solid");
    assert_eq!(stl::parse(&bytes).unwrap().triangles.len(), 12, "some programs begin binary files like this");
    let text = ascii(&cube());
    for other in [
        text.replace('\n', "\r\n"),
        text.to_uppercase(),
        format!("\n  {text}"),
        text.replace("solid test", "solid"),
    ] {
        assert_eq!(stl::parse(other.as_bytes()).unwrap().triangles.len(), 12);
    }
    let two = ascii(&cube()) + &ascii(&box_surface([9.0; 3], [10.0; 3]));
    assert_eq!(stl::parse(two.as_bytes()).unwrap().triangles.len(), 24, "solids of one file are one");
}

#[test]
fn corners_that_differ_by_rounding_are_one() {
    let mut surface = cube();
    for (k, corner) in surface.iter_mut().flatten().enumerate() {
        corner[k % 3] += if k % 2 == 0 { 1e-6 } else { -1e-6 };
    }
    assert_eq!(stl::parse(&binary(&surface)).unwrap().vertices.len(), 8);
}

#[test]
fn holes_and_flipped_triangles_are_named() {
    let mut open = cube();
    open.remove(6);
    let error = refused(&binary(&open), &["no neighbour", "a hole", "every edge", "mesh tool"]);
    assert!(matches!(error, StlError::Hole { .. }), "{error}");
    let mut flipped = cube();
    flipped[6].swap(0, 1);
    let error = refused(&binary(&flipped), &["both run from", "one of them shows its other side", "repair"]);
    let StlError::Flipped { first, second, .. } = error else { panic!("{error}") };
    assert!(first == 7 || second == 7, "{first} {second}");
}

#[test]
fn an_edge_of_four_triangles_is_named() {
    let touching = [cube(), box_surface([4.0, 4.0, 0.0], [8.0, 8.0, 4.0])].concat();
    let error = refused(&binary(&touching), &["with 3 others", "a file and a region each"]);
    assert!(matches!(error, StlError::Crowded { others: 3, .. }), "{error}");
}

#[test]
fn triangles_without_area_are_named() {
    let mut surface = cube();
    surface[4][1] = surface[4][0];
    assert!(matches!(
        refused(&binary(&surface), &["triangle 5", "thinner than", "millionth"]),
        StlError::Degenerate { triangle: 5, .. }
    ));
    let mut surface = cube();
    surface.push([[0.0; 3], [1.0; 3], [2.0; 3]]);
    assert!(matches!(
        refused(&binary(&surface), &["triangle 13"]),
        StlError::Degenerate { triangle: 13, .. }
    ));
    let point = vec![[[1.0; 3]; 3]; 4];
    assert!(matches!(refused(&binary(&point), &["triangle 1 "]), StlError::Degenerate { triangle: 1, .. }));
    let origin = vec![[[0.0; 3]; 3]; 4];
    assert!(matches!(refused(&binary(&origin), &["triangle 1 "]), StlError::Degenerate { triangle: 1, .. }));
}

#[test]
fn numbers_that_are_none_are_named() {
    for (number, name) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        let mut surface = cube();
        surface[7][2][1] = number;
        for bytes in [binary(&surface), ascii(&surface).into_bytes()] {
            let error = refused(&bytes, &["triangle 8", name, "finite"]);
            assert!(matches!(error, StlError::NotFinite { triangle: 8, .. }), "{error}");
        }
    }
}

#[test]
fn files_that_are_cut_off_are_named() {
    let bytes = binary(&cube());
    let cut = refused(&bytes[..bytes.len() - 1], &["683 bytes", "12 triangles", "take 684", "cut off"]);
    assert_eq!(cut, StlError::WrongSize { bytes: 683, triangles: 12, needed: 684 });
    refused(&[bytes.clone(), vec![0; 3]].concat(), &["687 bytes", "take 684"]);
    refused(&bytes[..83], &["83 bytes", "does not begin with `solid`", "at least 84"]);
    refused(&[], &["0 bytes", "export it anew"]);
    let mut many = bytes.clone();
    many[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    refused(&many, &["4294967295 triangles", "take 214748364834"]);
    refused(&binary(&Vec::new()), &["no triangle", "at least 4"]);
    refused(b"solid nothing\nendsolid nothing\n", &["no triangle"]);
    let text = ascii(&cube());
    let end = text.rfind("endsolid").unwrap();
    refused(&text.as_bytes()[..end], &["ends before `endsolid`", "cut off"]);
    let end = text.rfind("endloop").unwrap();
    refused(&text.as_bytes()[..end], &["ends before `endfacet`", "cut off"]);
}

#[test]
fn text_that_is_no_stl_is_named_with_its_line() {
    let text = ascii(&cube());
    let line = |from: &str, to: &str, words: &[&str]| {
        let error = refused(text.replacen(from, to, 1).as_bytes(), words);
        assert!(matches!(error, StlError::Syntax { .. }), "{error}");
    };
    line("facet normal", "fact normal", &["line 2", "`fact normal 0 0 0`", "`facet` or `endsolid`"]);
    line("vertex 0e0 0e0 0e0", "vertex 0e0 0e0", &["line 4", "`vertex 0e0 0e0`", "three numbers"]);
    line("vertex 0e0 0e0 0e0", "vertex 0e0 0e0 0,5", &["line 4", "three numbers", "export it anew"]);
    line("vertex 0e0 0e0 0e0", "vertex 0e0 0e0 0 0", &["line 4", "three numbers"]);
    line("      vertex 0e0 0e0 0e0\n", "", &["line 7", "`endfacet`", "a third `vertex`"]);
    line("endloop", "facet", &["line 7", "`vertex` or `endfacet`"]);
    line("outer loop", "outer loop\nvertex 0 0 0", &["`endfacet`", "a third `vertex`"]);
}
