//! Adds the entries of a row up by the boxes of their columns.
//!
//! The boxes within two of the row's own have a place each, so that an entry costs one addition; the few further away, where
//! an axis is periodic or keys met the end of their range, are searched one by one.

use super::boxes::ONES;
use crate::engine::pressure::matrix::RowWriter;
use crate::engine::pressure::values::Value;
use crate::engine::search::NONE;

/// How many boxes away a box has a place.
const REACH: u64 = 2;
/// Places along an axis.
const SPAN: u64 = 2 * REACH + 1;
/// The place of the row's own box.
const HOME: usize = (REACH * (1 + SPAN + SPAN * SPAN)) as usize;
/// The next power of two above the number of places.
pub const PLACES: usize = 128;
/// Further boxes that are told apart.
const FAR: usize = 64;

/// What a key has to be subtracted from for its coordinates to count from the first place around `home`.
pub fn corner_of(home: u64) -> u64 {
    home.wrapping_sub(REACH * ONES)
}

/// The place of a key, if it has one.
#[inline(always)]
pub fn place_of(corner: u64, key: u64) -> Option<usize> {
    // A coordinate below the first place borrows from the next one, which makes it itself a large number.
    let steps = key.wrapping_sub(corner);
    if (steps | steps.wrapping_add((7 - 2 * REACH) * ONES)) & !(7 * ONES) != 0 {
        return None;
    }
    let place = (steps & 7) + SPAN * ((steps >> 21) & 7) + SPAN * SPAN * ((steps >> 42) & 7);
    Some(place as usize & (PLACES - 1))
}

pub struct Gather<'w, 'a, V> {
    entries: &'w mut RowWriter<'a, V>,
    /// What a key has to be subtracted from for its coordinates to count from the first place.
    corner: u64,
    /// A bit a place that is taken.
    taken: u128,
    boxes: [u32; PLACES],
    sums: [f64; PLACES],
    far: [(u32, f64); FAR],
    far_count: usize,
}

impl<'w, 'a, V: Value> Gather<'w, 'a, V> {
    /// For the row whose own box has that key.
    #[inline]
    pub fn new(home: u64, entries: &'w mut RowWriter<'a, V>) -> Self {
        Gather {
            entries,
            corner: corner_of(home),
            taken: 0,
            boxes: [NONE; PLACES],
            sums: [0.0; PLACES],
            far: [(NONE, 0.0); FAR],
            far_count: 0,
        }
    }

    /// Adds the value of an entry whose column lies in `of`, a box with that key.
    #[inline(always)]
    pub fn add(&mut self, key: u64, of: u32, value: f64) {
        let Some(place) = place_of(self.corner, key) else {
            return self.add_far(of, value);
        };
        self.taken |= 1 << place;
        self.boxes[place] = of;
        self.sums[place] += value;
    }

    #[cold]
    fn add_far(&mut self, of: u32, value: f64) {
        if of == NONE {
            return;
        }
        match self.far[..self.far_count].iter_mut().find(|(known, _)| *known == of) {
            Some((_, sum)) => *sum += value,
            // A row may have several entries of one box: they add up in every product.
            None if self.far_count == FAR => self.entries.push(of, value),
            None => {
                self.far[self.far_count] = (of, value);
                self.far_count += 1;
            }
        }
    }

    /// Writes the sums of other boxes as entries; returns that of the row's own.
    pub fn finish(self) -> f64 {
        let mut left = self.taken & !(1 << HOME);
        while left != 0 {
            let place = left.trailing_zeros() as usize & (PLACES - 1);
            left &= left - 1;
            self.entries.push(self.boxes[place], self.sums[place]);
        }
        for &(of, sum) in &self.far[..self.far_count] {
            self.entries.push(of, sum);
        }
        self.sums[HOME]
    }
}

#[cfg(test)]
mod tests {
    use super::super::boxes::key_of;
    use super::*;
    use crate::base::parallel::Workers;
    use crate::engine::pressure::matrix::{SparseMatrix, Storage};

    #[test]
    fn entries_add_up_by_box_near_and_far() {
        let workers = Workers::new(1, "static".parse().unwrap(), &[]).unwrap();
        let mut matrix = SparseMatrix::<f64>::new(Storage::Csr, 4);
        let offset = |k: usize| [(k % 9) as f64 - 4.0, ((k / 9) % 9) as f64 - 4.0, (k / 81) as f64 - 4.0];
        matrix.assemble(1, &workers, |_, entries| {
            let mut gather = Gather::new(key_of([0.5; 3], 1.0), entries);
            for k in 0..2 * 729 {
                let x = offset(k % 729).map(|x| x + 0.5);
                gather.add(key_of(x, 1.0), (k % 729) as u32, 1.0);
            }
            gather.finish()
        });
        assert_eq!(matrix.diagonal, [2.0]);
        let (columns, values) = matrix.row(0);
        let mut sums = [0.0; 729];
        columns.iter().zip(values).for_each(|(&column, value)| sums[column as usize] += value);
        for (k, sum) in sums.iter().enumerate() {
            assert_eq!(*sum, if offset(k) == [0.0; 3] { 0.0 } else { 2.0 }, "{:?}", offset(k));
        }
    }
}
