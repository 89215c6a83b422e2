//! Which points of a column of the lattice a closed surface holds, and which lie close to it.
//!
//! A point is inside where the surface winds around it: a ray upwards (+z) leaves the solid once more often than it enters.
//! Winding numbers instead of parity let bodies of one file overlap, and cavities be bodies turned inside out. One ray is
//! enough, because what it hits is decided edge by edge, from the same numbers for both triangles of an edge: what rounding
//! does to one triangle it does to its neighbour, and no ray slips between them or hits both. Points so close to the surface
//! that rounding decides are rare, because the whole lattice is looked at a little beside where it is (`Columns::new`).

use super::mesh::{Mesh, cross, distance_squared};
use crate::base::vec3::{Vec3, dot, sub};

/// Where the points are looked at, in hundredths of a particle distance below where they are: as in a box, a point on an
/// upper face is inside and one on a lower face is not. The ratios are those of no plane that a drawing has.
const SHIFT: Vec3 = [1.0, 0.754_877_666_246_692_8, 0.569_840_290_998_053_2];
/// Bins may hold this many entries a triangle.
const ENTRIES_PER_TRIANGLE: usize = 16;

/// A closed surface, its triangles sorted into bins over x and y.
#[derive(Debug)]
pub struct Columns {
    mesh: Mesh,
    shift: Vec3,
    /// How far from the surface `near` looks, metres.
    reach: f64,
    low: Vec3,
    side: [f64; 2],
    count: [usize; 2],
    /// Where the entries of each bin begin, and the triangles in all bins.
    start: Vec<u32>,
    entry: Vec<u32>,
}

impl Columns {
    /// `reach_m` is the largest distance from the surface that will be asked for.
    pub fn new(mesh: Mesh, particle_distance_m: f64, reach_m: f64) -> Columns {
        let (low, high) = mesh.bounds();
        let low = low.map(|x| x - reach_m);
        let width = [0, 1].map(|d| high[d] + reach_m - low[d]);
        let shift = SHIFT.map(|s| 0.01 * s * particle_distance_m);
        let mut columns = Columns {
            mesh,
            shift,
            reach: reach_m,
            low,
            side: width,
            count: [1, 1],
            start: Vec::new(),
            entry: Vec::new(),
        };
        let triangles = columns.mesh.triangles.len();
        let mut bins = (triangles as f64).sqrt().ceil() as usize;
        // Long triangles lie in many bins: larger bins bound the memory.
        while bins > 1 && columns.entries(width, bins) > ENTRIES_PER_TRIANGLE * triangles {
            bins /= 2;
        }
        columns.entries(width, bins);
        columns.sort();
        columns
    }

    /// Corners of a box that holds all points that the surface could hold or be near to.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let (low, high) = self.mesh.bounds();
        ([0, 1, 2].map(|d| low[d] - self.reach), [0, 1, 2].map(|d| high[d] + self.reach + self.shift[d]))
    }

    /// Chooses the number of bins a side; returns how many entries they will have.
    fn entries(&mut self, width: [f64; 2], bins: usize) -> usize {
        self.count = [bins, bins];
        self.side = width.map(|w| w / bins as f64);
        (0..self.mesh.triangles.len())
            .map(|k| self.bins_of(k).map(|(first, last)| last - first + 1).iter().product::<usize>())
            .fold(0, usize::saturating_add)
    }

    /// The bin that holds a coordinate, the outermost for those outside.
    fn bin(&self, d: usize, x: f64) -> usize {
        (((x - self.low[d]) / self.side[d]) as usize).min(self.count[d] - 1)
    }

    /// The first and the last bin in x and in y that a triangle reaches.
    fn bins_of(&self, triangle: usize) -> [(usize, usize); 2] {
        let (low, high) = extent(self.mesh.corners(triangle));
        [0, 1].map(|d| (self.bin(d, low[d] - self.reach), self.bin(d, high[d] + self.reach)))
    }

    /// Fills the bins by counting.
    fn sort(&mut self) {
        let mut start = vec![0u32; self.count[0] * self.count[1] + 1];
        let triangles = 0..self.mesh.triangles.len();
        let bins = |columns: &Columns, k: usize| {
            let [(x0, x1), (y0, y1)] = columns.bins_of(k);
            let across = columns.count[1];
            (x0..=x1).flat_map(move |x| (y0..=y1).map(move |y| x * across + y))
        };
        for k in triangles.clone() {
            bins(self, k).for_each(|bin| start[bin + 1] += 1);
        }
        for bin in 1..start.len() {
            start[bin] += start[bin - 1];
        }
        let mut next = start.clone();
        let mut entry = vec![0u32; start[start.len() - 1] as usize];
        for k in triangles {
            bins(self, k).for_each(|bin| {
                entry[next[bin] as usize] = k as u32;
                next[bin] += 1;
            });
        }
        (self.start, self.entry) = (start, entry);
    }

    /// The triangles that may matter to a column, in the order of the file.
    fn candidates(&self, x: f64, y: f64) -> &[u32] {
        let beyond = |d: usize, q: f64| {
            let right = self.low[d] + self.side[d] * self.count[d] as f64;
            q < self.low[d] || q > right + self.shift[d]
        };
        if beyond(0, x) || beyond(1, y) {
            return &[];
        }
        let bin = self.bin(0, x) * self.count[1] + self.bin(1, y);
        &self.entry[self.start[bin] as usize..self.start[bin + 1] as usize]
    }

    /// Says for each of the ascending heights `z` whether the point is inside or, where there is a shell, outside and no
    /// farther from the surface than the reach.
    pub fn look(&self, x: f64, y: f64, z: &[f64], shell: bool, held: &mut Vec<bool>) {
        let (qx, qy) = (x - self.shift[0], y - self.shift[1]);
        held.clear();
        held.resize(z.len(), false);
        let candidates = self.candidates(qx, qy);
        if candidates.is_empty() {
            return;
        }
        let mut inside = vec![false; z.len()];
        self.inside(candidates, [qx, qy], z, &mut inside);
        if shell {
            self.near(candidates, [qx, qy], z, &inside, held);
        } else {
            *held = inside;
        }
    }

    fn inside(&self, candidates: &[u32], q: [f64; 2], z: &[f64], inside: &mut [bool]) {
        let mut hits: Vec<(f64, i32)> =
            candidates.iter().filter_map(|k| self.hit(self.mesh.triangles[*k as usize], q)).collect();
        hits.sort_by(|a, b| a.0.total_cmp(&b.0));
        // All hits of a closed surface add up to zero, so those above are the opposite of those below.
        let (mut below, mut next) = (0, 0);
        for (inside, z) in inside.iter_mut().zip(z) {
            while next < hits.len() && hits[next].0 <= z - self.shift[2] {
                below += hits[next].1;
                next += 1;
            }
            *inside = below != 0;
        }
    }

    /// Where the vertical line through `q` meets a triangle, and 1 where it leaves the solid upwards there, -1 where it
    /// enters.
    fn hit(&self, triangle: [u32; 3], q: [f64; 2]) -> Option<(f64, i32)> {
        let [i, j, k] = triangle;
        let sign = self.crossing(i, j, q) + self.crossing(j, k, q) + self.crossing(k, i, q);
        if sign == 0 {
            return None;
        }
        let [a, b, c] = triangle.map(|vertex| self.mesh.vertices[vertex as usize]);
        let normal = cross(sub(b, a), sub(c, a));
        let z = a[2] - (normal[0] * (q[0] - a[0]) + normal[1] * (q[1] - a[1])) / normal[2];
        let (low, high) = extent([a, b, c]);
        // A triangle that is all but upright may put the plane's point anywhere; it is not beyond the corners.
        Some((if z.is_nan() { high[2] } else { z.clamp(low[2], high[2]) }, sign))
    }

    /// Seen from above: 1 where the edge passes to the right of `q` upwards (+y), -1 where it does downwards, else 0. The
    /// place is computed from the vertex with the lower index, so that both triangles of an edge get the same.
    fn crossing(&self, from: u32, to: u32, q: [f64; 2]) -> i32 {
        let [a, b] = [from.min(to), from.max(to)].map(|vertex| self.mesh.vertices[vertex as usize]);
        if (a[1] > q[1]) == (b[1] > q[1]) {
            return 0;
        }
        let x = a[0] + (q[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
        let upwards = (b[1] > a[1]) == (from < to);
        match (x > q[0], upwards) {
            (false, _) => 0,
            (true, true) => 1,
            (true, false) => -1,
        }
    }

    fn near(&self, candidates: &[u32], q: [f64; 2], z: &[f64], inside: &[bool], near: &mut [bool]) {
        for k in candidates {
            let corners = self.mesh.corners(*k as usize);
            let (low, high) = extent(corners);
            if (0..2).any(|d| q[d] < low[d] - self.reach || q[d] > high[d] + self.reach) {
                continue;
            }
            let normal = cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]));
            let far = self.reach * self.reach * dot(normal, normal);
            let first = z.partition_point(|z| z - self.shift[2] < low[2] - self.reach);
            let last = z.partition_point(|z| z - self.shift[2] <= high[2] + self.reach);
            for k in first..last {
                if inside[k] || near[k] {
                    continue;
                }
                let point = [q[0], q[1], z[k] - self.shift[2]];
                let height = dot(normal, sub(point, corners[0]));
                // The plane is no farther than the triangle and quicker to ask.
                near[k] =
                    height * height <= far && distance_squared(point, corners) <= self.reach * self.reach;
            }
        }
    }
}

/// The corners of the smallest box that holds a triangle.
fn extent(corners: [Vec3; 3]) -> (Vec3, Vec3) {
    let [a, b, c] = corners;
    ([0, 1, 2].map(|d| a[d].min(b[d]).min(c[d])), [0, 1, 2].map(|d| a[d].max(b[d]).max(c[d])))
}
