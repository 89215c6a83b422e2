//! Flat cells in which one section's particles are sorted: those side by side in x lie side by side in memory.

use crate::base::parallel::{Rows, Team};
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

/// How the domain is cut into cells.
#[derive(Debug)]
pub struct Grid {
    low: Vec3,
    side: Vec3,
    per_m: Vec3,
    count: [usize; 3],
}

/// One section's particles in the cells.
#[derive(Debug, Default)]
pub struct Cells {
    /// Where each cell's particles begin in the order of [`Cells::sort`]; one entry more than there are cells.
    start: Vec<u32>,
    /// The cell of each particle that is sorted.
    cell: Vec<u32>,
}

impl Grid {
    pub fn new(domain: &Domain, particle_distance_m: f64) -> Self {
        let extent = [0, 1, 2].map(|d| domain.high[d] - domain.low[d]);
        let width = if extent[2] == 0.0 { WIDTH_IN_PLANE } else { WIDTH };
        let wanted = [LENGTH, width, width].map(|side| side * particle_distance_m);
        let side = [0, 1, 2].map(|d| wanted[d].max(extent[d] / MOST as f64));
        let count = [0, 1, 2].map(|d| (extent[d] / side[d]) as usize + 1);
        Grid { low: domain.low, side, per_m: side.map(|side| 1.0 / side), count }
    }

    /// The number of cells.
    fn len(&self) -> usize {
        self.count.iter().product()
    }

    /// Along axis `d`, of a coordinate; what lies outside counts to the outermost cells.
    #[inline(always)]
    fn place(&self, d: usize, x: f64) -> usize {
        (((x - self.low[d]) * self.per_m[d]) as usize).min(self.count[d] - 1)
    }

    fn cell_of(&self, [x, y, z]: Vec3) -> u32 {
        let row = self.row(self.place(1, y), self.place(2, z));
        (row * self.count[0] + self.along(row, self.place(0, x))) as u32
    }

    /// The number of a row of cells. Rows are gone through as one ploughs a field, back and forth in each layer and layers back
    /// and forth, so that eight particles that go on from one row to the next still lie together.
    #[inline(always)]
    fn row(&self, y: usize, z: usize) -> usize {
        z * self.count[1] + if z.is_multiple_of(2) { y } else { self.count[1] - 1 - y }
    }

    /// The place in a row of the cell number `x`.
    #[inline(always)]
    fn along(&self, row: usize, x: usize) -> usize {
        if row.is_multiple_of(2) { x } else { self.count[0] - 1 - x }
    }

    /// Appends the runs of cells, from the first to before the last, that hold all places within `reach` of the box from
    /// `low` to `high`.
    pub fn runs(&self, low: Vec3, high: Vec3, reach: f64, runs: &mut Vec<(u32, u32)>) {
        for z in self.place(2, low[2] - reach)..=self.place(2, high[2] + reach) {
            let off_z = self.off(2, z, low, high);
            let [first, last] = [self.place(1, low[1] - reach), self.place(1, high[1] + reach)];
            for k in 0..=last - first {
                let y = if z.is_multiple_of(2) { first + k } else { last - k };
                let off_y = self.off(1, y, low, high);
                let left = reach * reach - off_y * off_y - off_z * off_z;
                if left > 0.0 {
                    let (left, row) = (left.sqrt(), self.row(y, z));
                    let ends = [self.place(0, low[0] - left), self.place(0, high[0] + left)];
                    let [a, b] = ends.map(|x| self.along(row, x));
                    let start = row * self.count[0];
                    runs.push(((start + a.min(b)) as u32, (start + a.max(b) + 1) as u32));
                }
            }
        }
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
}

impl Cells {
    pub fn new(grid: &Grid) -> Self {
        Cells { start: vec![0; grid.len() + 1], cell: Vec::new() }
    }

    /// The places, in the order of the last sort, of the particles in a run of cells.
    #[inline(always)]
    pub fn in_run(&self, run: (u32, u32)) -> std::ops::Range<usize> {
        self.start[run.0 as usize] as usize..self.start[run.1 as usize] as usize
    }

    /// Sorts `particles` by cell, those of one cell staying in their order, into `sorted`.
    pub fn sort(
        &mut self,
        grid: &Grid,
        particles: &[u32],
        positions: &[Vec3],
        sorted: &mut [u32],
        team: Team<'_>,
    ) {
        self.cell.resize(particles.len(), 0);
        team.evenly().fill(Rows::new(&mut self.cell), |range, cell| {
            for (cell, &i) in cell.iter_mut().zip(&particles[range]) {
                *cell = grid.cell_of(positions[i as usize]);
            }
        });
        self.start.fill(0);
        for &cell in &self.cell {
            self.start[cell as usize + 1] += 1;
        }
        let mut sum = 0;
        for start in &mut self.start {
            sum += *start;
            *start = sum;
        }
        // `start[c]` is now where cell c begins; it walks to where the next one begins while particles are dealt out.
        for (&i, &cell) in particles.iter().zip(&self.cell) {
            let next = &mut self.start[cell as usize];
            sorted[*next as usize] = i;
            *next += 1;
        }
        self.start.rotate_right(1);
        self.start[0] = 0;
    }

    pub fn bytes(&self) -> usize {
        (self.start.len() + self.cell.capacity()) * size_of::<u32>()
    }
}
