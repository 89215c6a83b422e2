//! Flat cells in which one section's particles are sorted: those side by side in x lie side by side in memory.

use crate::base::vec3::Vec3;
use crate::engine::parameters::Domain;

/// Length of a cell along x, and across in y and z, in particle distances. Eight particles that follow one another then
/// fill about a cube of two distances, whatever the row.
const LENGTH: f64 = 1.0;
const WIDTH: f64 = 2.0;
/// In a plane, where no particles lie one above the other.
const WIDTH_IN_PLANE: f64 = 2.8;

/// The most cells along each axis: a domain that is far larger than its particles gets longer cells.
const MOST: usize = 512;

#[derive(Debug)]
pub struct Cells {
    low: Vec3,
    side: Vec3,
    count: [usize; 3],
    /// Where each cell's particles begin in the order of [`Cells::sort`]; one entry more than there are cells.
    start: Vec<u32>,
    /// The cell of each particle that is sorted.
    cell: Vec<u32>,
}

impl Cells {
    pub fn new(domain: &Domain, particle_distance_m: f64) -> Self {
        let extent = [0, 1, 2].map(|d| domain.high[d] - domain.low[d]);
        let width = if extent[2] == 0.0 { WIDTH_IN_PLANE } else { WIDTH };
        let wanted = [LENGTH, width, width].map(|side| side * particle_distance_m);
        let side = [0, 1, 2].map(|d| wanted[d].max(extent[d] / MOST as f64));
        let count = [0, 1, 2].map(|d| (extent[d] / side[d]) as usize + 1);
        let cells = count.iter().product::<usize>();
        Cells { low: domain.low, side, count, start: vec![0; cells + 1], cell: Vec::new() }
    }

    /// Along axis `d`, of a coordinate; what lies outside counts to the outermost cells.
    #[inline(always)]
    fn place(&self, d: usize, x: f64) -> usize {
        (((x - self.low[d]) / self.side[d]) as usize).min(self.count[d] - 1)
    }

    /// Sorts `particles` by cell, those of one cell staying in their order, into `sorted`.
    pub fn sort(&mut self, particles: &[u32], positions: &[Vec3], sorted: &mut [u32]) {
        let mut cell = std::mem::take(&mut self.cell);
        cell.clear();
        cell.extend(particles.iter().map(|&i| {
            let [x, y, z] = positions[i as usize];
            let row = self.place(2, z) * self.count[1] + self.place(1, y);
            (row * self.count[0] + self.place(0, x)) as u32
        }));
        self.start.fill(0);
        for &cell in &cell {
            self.start[cell as usize + 1] += 1;
        }
        let mut sum = 0;
        for start in &mut self.start {
            sum += *start;
            *start = sum;
        }
        // `start[c]` is now where cell c begins; it walks to where the next one begins while particles are dealt out.
        for (&i, &cell) in particles.iter().zip(&cell) {
            let next = &mut self.start[cell as usize];
            sorted[*next as usize] = i;
            *next += 1;
        }
        self.start.rotate_right(1);
        self.start[0] = 0;
        self.cell = cell;
    }

    /// The ranges, in the order of the last sort, that hold all particles within `reach` of the box from `low` to `high`.
    #[inline(always)]
    pub fn ranges(&self, low: Vec3, high: Vec3, reach: f64) -> Ranges<'_> {
        let first = [self.place(1, low[1] - reach), self.place(2, low[2] - reach)];
        let last = [self.place(1, high[1] + reach), self.place(2, high[2] + reach)];
        Ranges { cells: self, low, high, reach, first_y: first[0], last, next: first }
    }

    /// How far the row of cells number `k` along `d` is from the box; nothing for the outermost, which hold more.
    #[inline(always)]
    fn off(&self, d: usize, k: usize, low: Vec3, high: Vec3) -> f64 {
        let near = self.low[d] + k as f64 * self.side[d];
        let far = near + self.side[d];
        let rounding = 1e-9 * self.side[d];
        if k == 0 || k + 1 == self.count[d] {
            0.0
        } else {
            (near - high[d]).max(low[d] - far).max(rounding) - rounding
        }
    }

    pub fn bytes(&self) -> usize {
        (self.start.len() + self.cell.capacity()) * size_of::<u32>()
    }
}

/// See [`Cells::ranges`].
pub struct Ranges<'a> {
    cells: &'a Cells,
    low: Vec3,
    high: Vec3,
    reach: f64,
    first_y: usize,
    /// Of y and z.
    last: [usize; 2],
    next: [usize; 2],
}

impl Iterator for Ranges<'_> {
    type Item = std::ops::Range<usize>;

    #[inline(always)]
    fn next(&mut self) -> Option<std::ops::Range<usize>> {
        let Ranges { cells, low, high, reach, .. } = *self;
        loop {
            let [y, z] = self.next;
            if z > self.last[1] {
                return None;
            }
            self.next = if y < self.last[0] { [y + 1, z] } else { [self.first_y, z + 1] };
            let (off_y, off_z) = (cells.off(1, y, low, high), cells.off(2, z, low, high));
            let left = reach * reach - off_y * off_y - off_z * off_z;
            if left <= 0.0 {
                continue;
            }
            let (left, row) = (left.sqrt(), (z * cells.count[1] + y) * cells.count[0]);
            let first = cells.start[row + cells.place(0, low[0] - left)] as usize;
            let end = cells.start[row + cells.place(0, high[0] + left) + 1] as usize;
            if first < end {
                return Some(first..end);
            }
        }
    }
}
