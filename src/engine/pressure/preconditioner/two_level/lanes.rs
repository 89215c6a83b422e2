//! The matrix times boxes where eight rows at a time share their columns: of each group of rows the boxes, and for each box
//! eight values, one a row.
//!
//! The values of a row's own box hold its diagonal. All are `f32`: they belong to a preconditioner.

use super::gather::{PLACES, place_of};
use crate::base::parallel::{Rows, Team};
use crate::base::simd::{Kernel, LANES, Simd, dispatch};
use crate::engine::pressure::system_matrix::BLOCK;
use crate::engine::search::NONE;

/// Groups of rows of a block.
const GROUPS: usize = BLOCK / LANES;

/// Which boxes rows lie in.
#[derive(Debug, Clone, Copy)]
pub struct RowBoxes<'a> {
    /// The box of each row; [`NONE`] for one that counts for nothing.
    pub of: &'a [u32],
    /// The key of each row's box.
    pub key: &'a [u64],
}

#[derive(Debug, Default)]
struct Block {
    boxes: Vec<u32>,
    values: Vec<[f32; LANES]>,
    ends: Vec<u32>,
    /// Lent to the gathering.
    far: Vec<(u32, [f64; LANES])>,
}

#[derive(Debug, Default)]
pub struct LaneBoxes {
    blocks: Vec<Block>,
}

/// Adds the columns of one group of rows up by box.
#[derive(Debug)]
pub struct LaneGather {
    corner: u64,
    taken: u128,
    boxes: [u32; PLACES],
    sums: [[f64; LANES]; PLACES],
    far: Vec<(u32, [f64; LANES])>,
}

impl LaneGather {
    fn new() -> Self {
        LaneGather {
            corner: 0,
            taken: 0,
            boxes: [NONE; PLACES],
            sums: [[0.0; LANES]; PLACES],
            far: Vec::new(),
        }
    }

    /// Where the values of a box add up.
    #[inline(always)]
    pub fn sum_of(&mut self, key: u64, of: u32) -> &mut [f64; LANES] {
        match place_of(self.corner, key) {
            Some(place) => {
                if self.taken >> place & 1 == 0 {
                    self.taken |= 1 << place;
                    self.boxes[place] = of;
                    self.sums[place] = [0.0; LANES];
                }
                &mut self.sums[place]
            }
            None => self.far_sum_of(of),
        }
    }

    #[cold]
    fn far_sum_of(&mut self, of: u32) -> &mut [f64; LANES] {
        let known = self.far.iter().position(|(known, _)| *known == of).unwrap_or_else(|| {
            self.far.push((of, [0.0; LANES]));
            self.far.len() - 1
        });
        &mut self.far[known].1
    }
}

impl LaneBoxes {
    /// Takes up the groups of `rows` rows: `add(group, gather)` adds the columns of a group, its diagonal among them.
    pub fn take_up(
        &mut self,
        rows: usize,
        boxes: RowBoxes<'_>,
        team: Team<'_>,
        add: impl Fn(usize, &mut LaneGather) + Sync,
    ) {
        let groups = rows / LANES;
        self.blocks.resize_with(groups.div_ceil(GROUPS), Block::default);
        team.fill(Rows::new(&mut self.blocks), |range, blocks| {
            let mut gather = LaneGather::new();
            for (block, Block { boxes: names, values, ends, far }) in range.zip(blocks) {
                gather.far = std::mem::take(far);
                names.clear();
                values.clear();
                ends.clear();
                for group in block * GROUPS..groups.min((block + 1) * GROUPS) {
                    let rows = group * LANES..(group + 1) * LANES;
                    if let Some(first) = rows.clone().find(|&row| boxes.of[row] != NONE) {
                        gather.corner = super::gather::corner_of(boxes.key[first]);
                        gather.taken = 0;
                        gather.far.clear();
                        add(group, &mut gather);
                        let counts: [f64; LANES] = std::array::from_fn(|lane| {
                            f64::from(u8::from(boxes.of[rows.start + lane] != NONE))
                        });
                        let mut keep = |of: u32, sum: &[f64; LANES]| {
                            names.push(of);
                            values.push(std::array::from_fn(|lane| (sum[lane] * counts[lane]) as f32));
                        };
                        let mut left = gather.taken;
                        while left != 0 {
                            let place = left.trailing_zeros() as usize;
                            left &= left - 1;
                            keep(gather.boxes[place], &gather.sums[place]);
                        }
                        gather.far.iter().for_each(|(of, sum)| keep(*of, sum));
                    }
                    ends.push(names.len() as u32);
                }
                *far = std::mem::take(&mut gather.far);
            }
        });
    }

    /// The boxes of a group of rows, and the values of all its rows.
    fn of(&self, group: usize) -> (&[u32], &[[f32; LANES]]) {
        let Block { boxes, values, ends, .. } = &self.blocks[group / GROUPS];
        let k = group % GROUPS;
        let range = if k == 0 { 0 } else { ends[k - 1] as usize }..ends[k] as usize;
        (&boxes[range.clone()], &values[range])
    }

    /// Shows the boxes of some rows, ascending, and their values, those of rows in one group added up.
    pub fn for_each_entry(&self, members: &[u32], mut visit: impl FnMut(u32, f64)) {
        for members in members.chunk_by(|a, b| *a as usize / LANES == *b as usize / LANES) {
            let mut chosen = [0.0_f32; LANES];
            members.iter().for_each(|&member| chosen[member as usize % LANES] = 1.0);
            let (boxes, values) = self.of(members[0] as usize / LANES);
            for (&of, values) in boxes.iter().zip(values) {
                let products: [f32; LANES] = std::array::from_fn(|lane| values[lane] * chosen[lane]);
                let [a, b, c, d, e, f, g, h] = products.map(f64::from);
                visit(of, ((a + b) + (c + d)) + ((e + f) + (g + h)));
            }
        }
    }

    /// `result = w P e + D^-1 (r - w AP e)` for the rows of a block from `first` on.
    pub fn apply(&self, first: usize, rows: &ApplyTo<'_>, result: &mut [f64]) {
        dispatch(Apply { boxes: self, first, rows, result });
    }

    pub fn bytes(&self) -> usize {
        let bytes = |block: &Block| {
            (block.boxes.capacity() + block.ends.capacity()) * size_of::<u32>()
                + block.values.capacity() * size_of::<[f32; LANES]>()
        };
        self.blocks.iter().map(bytes).sum()
    }
}

/// What a correction is applied to, a number a row or, `correction`, a box.
pub struct ApplyTo<'a> {
    pub weight: f64,
    pub of: &'a [u32],
    pub inverse: &'a [f64],
    pub residual: &'a [f64],
    pub correction: &'a [f64],
}

struct Apply<'a> {
    boxes: &'a LaneBoxes,
    first: usize,
    rows: &'a ApplyTo<'a>,
    result: &'a mut [f64],
}

impl Kernel for Apply<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let ApplyTo { weight, of, inverse, residual, correction } = *self.rows;
        let weight = s.splat(weight);
        let (result, _) = self.result.as_chunks_mut::<LANES>();
        let (inverse, _) = inverse.as_chunks::<LANES>();
        let (residual, _) = residual.as_chunks::<LANES>();
        let (of, _) = of.as_chunks::<LANES>();
        for (group, z) in (self.first / LANES..).zip(result) {
            let (boxes, values) = self.boxes.of(group);
            let mut sum = s.splat(0.0);
            for (&of, values) in boxes.iter().zip(values) {
                sum = s.mul_add(s.load_narrow(values), s.splat(correction[of as usize]), sum);
            }
            let mut own = [0.0; LANES];
            for (own, &of) in own.iter_mut().zip(&of[group]) {
                *own = if of == NONE { 0.0 } else { correction[of as usize] };
            }
            let left = s.neg_mul_add(weight, sum, s.load(&residual[group]));
            let smoothed = s.mul(s.load(&inverse[group]), left);
            s.store(s.mul_add(weight, s.load(&own), smoothed), z);
        }
    }
}
