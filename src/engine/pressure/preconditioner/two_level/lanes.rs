//! The matrix times boxes where eight rows at a time share their columns: of each group of rows the boxes, and for each box
//! eight values, one a row.
//!
//! The values of a row's own box hold its diagonal. All are `f32`: they belong to a preconditioner.

use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

use super::gather::{PLACES, corner_of, place_of};
use crate::base::large_pages::with_large_pages;
use crate::base::parallel::{Rows, Shares, Spares, Team};
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

/// Where the boxes of a block's first group begin, and where those of each group end, counted from there.
#[derive(Debug, Default)]
struct Block {
    first: usize,
    ends: Vec<u32>,
}

#[derive(Debug, Default)]
pub struct LaneBoxes {
    blocks: Vec<Block>,
    /// Of all blocks; gone through in every iteration of the solver, and in large pages for it.
    boxes: Vec<u32>,
    values: Vec<[f32; LANES]>,
    /// Where blocks are worked out; lent to the workers.
    spare: Spares<Box<Gathering>>,
}

/// A block of rows that is being worked out.
#[derive(Debug)]
struct Gathering {
    gather: LaneGather,
    boxes: Vec<u32>,
    values: Vec<[f32; LANES]>,
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

    /// Begins a group of rows around the box with that key.
    fn begin(&mut self, home: u64) {
        self.corner = corner_of(home);
        self.taken = 0;
        self.far.clear();
    }

    /// Shows the boxes that were met and their sums.
    fn for_each_sum(&self, mut visit: impl FnMut(u32, &[f64; LANES])) {
        let mut left = self.taken;
        while left != 0 {
            let place = left.trailing_zeros() as usize;
            left &= left - 1;
            visit(self.boxes[place], &self.sums[place]);
        }
        self.far.iter().for_each(|(of, sum)| visit(*of, sum));
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
        self.blocks.resize_with(rows.div_ceil(BLOCK), Block::default);
        while let Err(wanted) = self.take_up_into_room(rows, boxes, team, &add) {
            let room = wanted + wanted / 8;
            (self.boxes, self.values) = (with_large_pages(room), with_large_pages(room));
            self.boxes.resize(room, 0);
            self.values.resize(room, [0.0; LANES]);
        }
    }

    /// The same as far as there is room; tells how many boxes of groups there are where there is less.
    fn take_up_into_room(
        &mut self,
        rows: usize,
        of_rows: RowBoxes<'_>,
        team: Team<'_>,
        add: &(impl Fn(usize, &mut LaneGather) + Sync),
    ) -> Result<(), usize> {
        let LaneBoxes { blocks, boxes, values, spare } = self;
        let (shares, full) = (Shares::new((Rows::new(boxes), Rows::new(values))), AtomicBool::new(false));
        team.fill(Rows::new(blocks), |range, blocks| {
            let mut gathering = spare.borrow();
            for (block, Block { first, ends }) in range.zip(blocks) {
                gathering.take_up(
                    block * GROUPS..(rows / LANES).min((block + 1) * GROUPS),
                    of_rows,
                    ends,
                    add,
                );
                match shares.take(gathering.boxes.len()) {
                    Some((place, (boxes, values))) => {
                        *first = place;
                        boxes.copy_from_slice(&gathering.boxes);
                        values.copy_from_slice(&gathering.values);
                    }
                    None => full.store(true, Relaxed),
                }
            }
            spare.give_back(gathering);
        });
        if full.into_inner() { Err(shares.wanted()) } else { Ok(()) }
    }

    /// The boxes of a group of rows, and the values of all its rows.
    fn of(&self, group: usize) -> (&[u32], &[[f32; LANES]]) {
        let Block { first, ends } = &self.blocks[group / GROUPS];
        let k = group % GROUPS;
        let start = if k == 0 { 0 } else { ends[k - 1] as usize };
        let range = first + start..first + ends[k] as usize;
        (&self.boxes[range.clone()], &self.values[range])
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
        let values = size_of::<u32>() + size_of::<[f32; LANES]>();
        let ends = |block: &Block| block.ends.capacity() * size_of::<u32>();
        self.boxes.capacity() * values
            + self.blocks.iter().map(ends).sum::<usize>()
            + self.spare.bytes(|spare| size_of::<Gathering>() + spare.boxes.capacity() * values)
    }
}

impl Default for Gathering {
    fn default() -> Self {
        Gathering { gather: LaneGather::new(), boxes: Vec::new(), values: Vec::new() }
    }
}

impl Gathering {
    /// Adds up some groups of rows; `ends` becomes where the boxes of each end.
    fn take_up(
        &mut self,
        groups: Range<usize>,
        of_rows: RowBoxes<'_>,
        ends: &mut Vec<u32>,
        add: &impl Fn(usize, &mut LaneGather),
    ) {
        let Gathering { gather, boxes, values } = self;
        boxes.clear();
        values.clear();
        ends.clear();
        for group in groups {
            let rows = group * LANES..(group + 1) * LANES;
            if let Some(first) = rows.clone().find(|&row| of_rows.of[row] != NONE) {
                gather.begin(of_rows.key[first]);
                add(group, gather);
                let counts: [f64; LANES] =
                    std::array::from_fn(|lane| f64::from(u8::from(of_rows.of[rows.start + lane] != NONE)));
                gather.for_each_sum(|of, sum| {
                    boxes.push(of);
                    values.push(std::array::from_fn(|lane| (sum[lane] * counts[lane]) as f32));
                });
            }
            ends.push(boxes.len() as u32);
        }
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
