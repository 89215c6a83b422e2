//! What the tests of geometry share: placing a `[geometry]` table, and making STL files.

use std::collections::BTreeMap;
use std::path::Path;

use repro::base::input::{Check, InputError};
use repro::base::vec3::{Vec3, sub};
use repro::engine::particles::InitialParticle;
use repro::scene::geometry::{Geometry, Placement};

/// Reads, checks and fills the keys of a `[geometry]` table.
pub fn place(text: &str, placement: &Placement<'_>) -> Result<Vec<InitialParticle>, InputError> {
    let geometry: Geometry = toml::from_str(text).unwrap_or_else(|error| panic!("{error}"));
    geometry.check(Check { file: placement.file }, placement)?;
    geometry.fill(placement)
}

/// In three dimensions with the particle distance 1.
pub fn placed(text: &str) -> Vec<InitialParticle> {
    place(text, &Placement::new("scene.toml", 1.0)).unwrap_or_else(|error| panic!("{error}"))
}

pub fn positions(particles: &[InitialParticle]) -> Vec<Vec3> {
    particles.iter().map(|particle| particle.position).collect()
}

/// A lattice of whole numbers from `-layers` to `extent + layers`.
pub fn lattice(extent: f64, layers: u32) -> String {
    format!("lattice = {{ extent_m = [{extent:?}, {extent:?}, {extent:?}], layers = {layers} }}\n")
}

pub fn region(fill: &str, rest: &str) -> String {
    format!("[[region]]\nfill = \"{fill}\"\n{rest}\n")
}

pub type Triangles = Vec<[Vec3; 3]>;

/// The twelve triangles of a box.
pub fn box_surface(low: Vec3, high: Vec3) -> Triangles {
    let corner = |k: usize| [0, 1, 2].map(|d| if k >> d & 1 == 0 { low[d] } else { high[d] });
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).map(|corners| corners.map(corner)).collect()
}

/// An octahedron whose triangles are split in four `levels` times, all corners on the sphere.
pub fn sphere_surface(center: Vec3, radius: f64, levels: usize) -> Triangles {
    let axis = |d: usize, sign: f64| {
        let mut v = [0.0; 3];
        v[d] = sign;
        v
    };
    let mut triangles = Triangles::new();
    for octant in 0..8 {
        let sign = |d: usize| if octant >> d & 1 == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = [0, 1, 2].map(|d| axis(d, sign(d)));
        triangles.push(if sign(0) * sign(1) * sign(2) > 0.0 { [x, y, z] } else { [x, z, y] });
    }
    let middle = |a: Vec3, b: Vec3| {
        let sum = [0, 1, 2].map(|d| a[d] + b[d]);
        let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
        sum.map(|x| x / length)
    };
    for _ in 0..levels {
        let split = |&[a, b, c]: &[Vec3; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.iter().flat_map(split).collect();
    }
    let put = |corner: Vec3| [0, 1, 2].map(|d| center[d] + radius * corner[d]);
    triangles.into_iter().map(|corners| corners.map(put)).collect()
}

/// The volume that a closed surface encloses.
pub fn volume(triangles: &Triangles) -> f64 {
    let origin = triangles[0][0];
    let six = |corners: &[Vec3; 3]| {
        let [a, b, c] = corners.map(|corner| sub(corner, origin));
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    triangles.iter().map(six).sum::<f64>() / 6.0
}

pub fn binary(triangles: &Triangles) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for corners in triangles {
        bytes.extend([0u8; 12]);
        for number in corners.iter().flatten() {
            bytes.extend((*number as f32).to_le_bytes());
        }
        bytes.extend([0u8; 2]);
    }
    bytes
}

pub fn ascii(triangles: &Triangles) -> String {
    let mut text = "solid test\n".to_string();
    for corners in triangles {
        text += "  facet normal 0 0 0\n    outer loop\n";
        for [x, y, z] in corners.map(|corner| corner.map(|number| number as f32)) {
            text += &format!("      vertex {x:e} {y:e} {z:e}\n");
        }
        text += "    endloop\n  endfacet\n";
    }
    text + "endsolid test\n"
}

/// Writes `solid.stl` beside a scene file of that folder; returns the scene file's path.
pub fn beside(folder: &Path, bytes: &[u8]) -> String {
    std::fs::write(folder.join("solid.stl"), bytes).unwrap();
    folder.join("scene.toml").to_str().unwrap().to_string()
}

/// How many particles lie in each group.
pub fn by_group(particles: &[InitialParticle]) -> BTreeMap<u8, usize> {
    let mut counts = BTreeMap::new();
    for particle in particles {
        *counts.entry(particle.group).or_default() += 1;
    }
    counts
}
