//! A closed surface: triangles whose equal corners are one vertex, each edge shared by exactly two of them.

use std::collections::HashMap;

use super::error::StlError;
use crate::base::vec3::{Vec3, ZERO, add_scaled, dot, scale, sub};

/// Corners closer than this part of the solid's size are one vertex.
const WELD: f64 = 1e-6;

/// A closed surface whose triangles run anticlockwise as seen from outside.
#[derive(Debug, Clone)]
pub struct Mesh {
    pub vertices: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Welds the corners and checks that the surface is closed.
    pub fn new(corners: &[[Vec3; 3]]) -> Result<Mesh, StlError> {
        let tolerance = WELD * size(corners);
        let mesh = weld(corners, tolerance);
        mesh.check_areas(tolerance)?;
        mesh.check_edges()?;
        Ok(mesh)
    }

    /// The surface in metres.
    pub fn placed(mut self, metres_per_unit: f64, translate_m: Vec3) -> Mesh {
        for vertex in &mut self.vertices {
            *vertex = [0, 1, 2].map(|d| metres_per_unit * vertex[d] + translate_m[d]);
        }
        self
    }

    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|vertex| self.vertices[vertex as usize])
    }

    /// The corners of the smallest box that holds the surface.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        bounds(self.vertices.iter().copied())
    }

    fn check_areas(&self, tolerance: f64) -> Result<(), StlError> {
        for k in 0..self.triangles.len() {
            let corners @ [a, b, c] = self.corners(k);
            let sides = [sub(b, a), sub(c, b), sub(a, c)];
            let longest = sides.iter().map(|s| dot(*s, *s)).fold(0.0, f64::max).sqrt();
            let normal = cross(sides[0], sides[1]);
            let height = dot(normal, normal).sqrt() / longest;
            // Not a number where all corners are one point.
            if height.is_nan() || height <= tolerance {
                return Err(StlError::Degenerate { triangle: k + 1, corners, tolerance });
            }
        }
        Ok(())
    }

    /// Names the first triangle with an edge that has not one neighbour on its other side.
    fn check_edges(&self) -> Result<(), StlError> {
        let mut runs: HashMap<(u32, u32), Runs> = HashMap::with_capacity(2 * self.triangles.len());
        for (k, edge) in self.edges() {
            let run = runs.entry((edge.0.min(edge.1), edge.0.max(edge.1))).or_default();
            run.add(k, edge.0 < edge.1);
        }
        for (k, (a, b)) in self.edges() {
            let run = &runs[&(a.min(b), a.max(b))];
            let (from, to) = (self.vertices[a as usize], self.vertices[b as usize]);
            match (run.same(a < b), run.same(a > b)) {
                (1, 1) => {}
                (1, 0) => return Err(StlError::Hole { triangle: k + 1, from, to }),
                (2, 0) => {
                    return Err(StlError::Flipped { first: k + 1, second: run.last + 1, from, to });
                }
                (ours, theirs) => {
                    let others = ours + theirs - 1;
                    return Err(StlError::Crowded { triangle: k + 1, from, to, others });
                }
            }
        }
        Ok(())
    }

    /// The directed edges with their triangles.
    fn edges(&self) -> impl Iterator<Item = (usize, (u32, u32))> {
        self.triangles
            .iter()
            .enumerate()
            .flat_map(|(k, &[a, b, c])| [(a, b), (b, c), (c, a)].map(|edge| (k, edge)))
    }
}

/// How many triangles run along an edge in either direction, and the last of them.
#[derive(Default)]
struct Runs {
    up: usize,
    down: usize,
    last: usize,
}

impl Runs {
    fn add(&mut self, triangle: usize, up: bool) {
        if up {
            self.up += 1
        } else {
            self.down += 1
        }
        self.last = triangle;
    }

    fn same(&self, up: bool) -> usize {
        if up { self.up } else { self.down }
    }
}

/// The longest side of the box that holds the corners, or their largest coordinate where that is longer: single precision
/// resolves no more.
fn size(corners: &[[Vec3; 3]]) -> f64 {
    let (low, high) = bounds(corners.iter().flatten().copied());
    (0..3).flat_map(|d| [high[d] - low[d], high[d].abs(), low[d].abs()]).fold(0.0, f64::max)
}

fn bounds(points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    points.fold(([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]), |(low, high), point| {
        ([0, 1, 2].map(|d| low[d].min(point[d])), [0, 1, 2].map(|d| high[d].max(point[d])))
    })
}

/// Corners within `tolerance` of an earlier one become that one: a hash of cells of twice the tolerance finds it.
fn weld(corners: &[[Vec3; 3]], tolerance: f64) -> Mesh {
    let mut vertices: Vec<Vec3> = Vec::with_capacity(corners.len() / 2);
    let mut equal: HashMap<[u64; 3], u32> = HashMap::with_capacity(corners.len() / 2);
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(corners.len() / 2);
    let side = 2.0 * tolerance;
    let cell = |point: Vec3, shift: Vec3| [0, 1, 2].map(|d| ((point[d] + shift[d]) / side).floor() as i64);
    let mut vertex = |corner: Vec3| {
        // Adding zero makes one number of both zeros.
        *equal.entry(corner.map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
            let near = |other: &u32| {
                let apart = sub(vertices[*other as usize], corner);
                dot(apart, apart) <= tolerance * tolerance
            };
            let around = (0..8).map(|k| {
                cell(corner, [0, 1, 2].map(|d| if k >> d & 1 == 0 { -tolerance } else { tolerance }))
            });
            let found = around.filter_map(|at| cells.get(&at)?.iter().copied().find(near)).min();
            found.unwrap_or_else(|| {
                let new = vertices.len() as u32;
                vertices.push(corner);
                cells.entry(cell(corner, [0.0; 3])).or_default().push(new);
                new
            })
        })
    };
    let triangles = corners.iter().map(|corners| corners.map(&mut vertex)).collect();
    Mesh { vertices, triangles }
}

/// `a x b`.
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The square of the distance from `p` to the nearest point of a triangle (Ericson, Real-Time Collision Detection, 5.1.5).
pub fn distance_squared(p: Vec3, [a, b, c]: [Vec3; 3]) -> f64 {
    let (ab, ac) = (sub(b, a), sub(c, a));
    let to = |corner: Vec3| (dot(ab, sub(p, corner)), dot(ac, sub(p, corner)));
    let ((a1, a2), (b1, b2), (c1, c2)) = (to(a), to(b), to(c));
    let (va, vb, vc) = (b1 * c2 - c1 * b2, c1 * a2 - a1 * c2, a1 * b2 - b1 * a2);
    let nearest = if a1 <= 0.0 && a2 <= 0.0 {
        ZERO
    } else if b1 >= 0.0 && b2 <= b1 {
        ab
    } else if c2 >= 0.0 && c1 <= c2 {
        ac
    } else if vc <= 0.0 && a1 >= 0.0 && b1 <= 0.0 {
        scale(a1 / (a1 - b1), ab)
    } else if vb <= 0.0 && a2 >= 0.0 && c2 <= 0.0 {
        scale(a2 / (a2 - c2), ac)
    } else if va <= 0.0 && b2 - b1 >= 0.0 && c1 - c2 >= 0.0 {
        add_scaled(ab, (b2 - b1) / ((b2 - b1) + (c1 - c2)), sub(c, b))
    } else {
        let sum = va + vb + vc;
        add_scaled(scale(vb / sum, ab), vc / sum, ac)
    };
    let apart = sub(sub(p, a), nearest);
    dot(apart, apart)
}
