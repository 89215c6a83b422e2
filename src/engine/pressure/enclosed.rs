//! Parts of the fluid without a free surface, where pressures are determined up to a constant.
//!
//! The rows that no path joins to the surface fall into parts: connected components of the matrix. On each the system
//! without compressibility is singular: it has the constants as its null space and a solution only if the source sums to
//! zero. So source and iterates are projected onto the complement of the constants of each part, `x_i -= mean x`. The mean
//! of the pressures is then zero; where negative ones are clamped, their minimum is made zero instead. No compressibility is
//! needed. Sums run in fixed blocks of members, added in order.

use crate::base::parallel::{Rows, Team};
use crate::engine::pressure::system_matrix::{BLOCK, SystemMatrix};
use crate::engine::search::NONE;

/// Members of one part whose sum is one number.
#[derive(Debug, Clone, Copy)]
struct Block {
    part: usize,
    first: usize,
    end: usize,
}

/// The parts of the present step, and the sums over them.
#[derive(Debug, Default)]
pub struct EnclosedParts {
    /// The part of each row; [`NONE`] for those that reach the surface. Empty while there are no parts.
    part_of: Vec<u32>,
    /// The rows of all parts, part by part, ascending in each.
    members: Vec<u32>,
    /// Where each part's members begin, and the end of the last.
    start: Vec<usize>,
    blocks: Vec<Block>,
    /// A number a block.
    partial: Vec<f64>,
    /// A number a part.
    value: Vec<f64>,
    queue: Vec<u32>,
}

impl EnclosedParts {
    pub fn is_empty(&self) -> bool {
        self.part_of.is_empty()
    }

    pub fn count(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// Sorts the `enclosed` rows, ascending, of a matrix of `rows` rows into parts, numbered by their lowest row.
    pub fn find(&mut self, enclosed: &[u32], rows: usize, matrix: &impl SystemMatrix) {
        for list in [&mut self.part_of, &mut self.members] {
            list.clear();
        }
        self.start.clear();
        self.blocks.clear();
        if enclosed.is_empty() {
            return;
        }
        self.part_of.resize(rows, NONE);
        for &row in enclosed {
            if self.part_of[row as usize] == NONE {
                self.flood(row, self.start.len() as u32, matrix);
                self.start.push(0);
            }
        }
        self.start.push(0);
        self.list_members(enclosed);
        self.cut_into_blocks();
    }

    fn flood(&mut self, from: u32, part: u32, matrix: &impl SystemMatrix) {
        let EnclosedParts { part_of, queue, .. } = self;
        part_of[from as usize] = part;
        queue.push(from);
        while let Some(row) = queue.pop() {
            matrix.for_each_entry(row as usize, |neighbor, _| {
                if part_of[neighbor as usize] == NONE {
                    part_of[neighbor as usize] = part;
                    queue.push(neighbor);
                }
            });
        }
    }

    fn list_members(&mut self, enclosed: &[u32]) {
        let EnclosedParts { part_of, members, start, .. } = self;
        for &row in enclosed {
            start[part_of[row as usize] as usize + 1] += 1;
        }
        for part in 1..start.len() {
            start[part] += start[part - 1];
        }
        members.resize(enclosed.len(), 0);
        for &row in enclosed {
            let next = &mut start[part_of[row as usize] as usize];
            members[*next] = row;
            *next += 1;
        }
        // Each start has moved on to where the next part begins.
        start.rotate_right(1);
        start[0] = 0;
    }

    fn cut_into_blocks(&mut self) {
        for part in 0..self.start.len() - 1 {
            let members = self.start[part]..self.start[part + 1];
            for first in members.clone().step_by(BLOCK) {
                self.blocks.push(Block { part, first, end: members.end.min(first + BLOCK) });
            }
        }
        self.partial.resize(self.blocks.len(), 0.0);
        self.value.resize(self.start.len() - 1, 0.0);
    }

    /// Makes the mean of `x` zero on each part.
    pub fn subtract_means(&mut self, x: &mut [f64], team: Team<'_>) {
        self.fold(x, 0.0, |a, b| a + b, team);
        for (part, value) in self.value.iter_mut().enumerate() {
            *value /= (self.start[part + 1] - self.start[part]) as f64;
        }
        self.subtract_values(x, team);
    }

    /// Makes the minimum of `x` zero on each part.
    pub fn subtract_minima(&mut self, x: &mut [f64], team: Team<'_>) {
        self.fold(x, f64::INFINITY, f64::min, team);
        self.subtract_values(x, team);
    }

    fn fold(&mut self, x: &[f64], start: f64, join: impl Fn(f64, f64) -> f64 + Sync, team: Team<'_>) {
        let EnclosedParts { blocks, members, partial, value, .. } = self;
        team.fill(Rows::new(partial), |range, partial| {
            for (block, partial) in blocks[range].iter().zip(partial) {
                let members = &members[block.first..block.end];
                *partial = members.iter().fold(start, |sum, &row| join(sum, x[row as usize]));
            }
        });
        value.fill(start);
        for (block, &partial) in blocks.iter().zip(partial.iter()) {
            value[block.part] = join(value[block.part], partial);
        }
    }

    fn subtract_values(&self, x: &mut [f64], team: Team<'_>) {
        let (part_of, value) = (&self.part_of, &self.value);
        team.fill(Rows::of_width(x, BLOCK), |blocks, x| {
            let first = blocks.start * BLOCK;
            for (x, &part) in x.iter_mut().zip(&part_of[first..]) {
                if part != NONE {
                    *x -= value[part as usize];
                }
            }
        });
    }

    pub fn bytes(&self) -> usize {
        (self.part_of.capacity() + self.members.capacity() + self.queue.capacity()) * size_of::<u32>()
            + (self.start.capacity() + self.partial.capacity() + self.value.capacity()) * size_of::<f64>()
            + self.blocks.capacity() * size_of::<Block>()
    }
}
