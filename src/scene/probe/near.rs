//! Which particles lie within a radius of a point: a bucket walk for what is looked at now and then, outside of a step.

use std::collections::HashMap;

use crate::base::vec3::{Vec3, dot, sub};

type Cell = [i64; 3];

/// Some of the particles, sorted into cubes whose side is the radius.
#[derive(Debug)]
pub struct Near<'a> {
    positions: &'a [Vec3],
    radius_m: f64,
    cells: HashMap<Cell, Vec<usize>>,
}

impl<'a> Near<'a> {
    /// The particles of which `holds` is true.
    pub fn new(positions: &'a [Vec3], radius_m: f64, holds: impl Fn(usize) -> bool) -> Self {
        let mut cells: HashMap<Cell, Vec<usize>> = HashMap::new();
        for i in (0..positions.len()).filter(|&i| holds(i)) {
            cells.entry(cell(positions[i], radius_m)).or_default().push(i);
        }
        Near { positions, radius_m, cells }
    }

    /// Calls `visit(j, x_j - point, distance)` for each particle nearer than the radius, cube by cube and by ascending
    /// index within one, so that sums come out the same every time.
    pub fn around(&self, point: Vec3, mut visit: impl FnMut(usize, Vec3, f64)) {
        let [x, y, z] = cell(point, self.radius_m);
        for k in 0..27 {
            let near = [x + k / 9 - 1, y + k / 3 % 3 - 1, z + k % 3 - 1];
            for &j in self.cells.get(&near).map_or(&[][..], Vec::as_slice) {
                let apart = sub(self.positions[j], point);
                let distance = dot(apart, apart).sqrt();
                if distance < self.radius_m {
                    visit(j, apart, distance);
                }
            }
        }
    }
}

fn cell(point: Vec3, side: f64) -> Cell {
    point.map(|x| (x / side).floor() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_walk_meets_whom_the_plain_loop_meets() {
        let mut random = fastrand::Rng::with_seed(7);
        let points: Vec<Vec3> = (0..400).map(|_| [0; 3].map(|_| 4.0 * random.f64() - 2.0)).collect();
        let near = Near::new(&points, 0.7, |i| i % 3 != 0);
        for &point in &points {
            let mut met = Vec::new();
            near.around(point, |j, _, _| met.push(j));
            met.sort_unstable();
            let within = |&j: &usize| {
                let apart = sub(points[j], point);
                j % 3 != 0 && dot(apart, apart).sqrt() < 0.7
            };
            assert_eq!(met, (0..points.len()).filter(within).collect::<Vec<_>>());
        }
    }
}
