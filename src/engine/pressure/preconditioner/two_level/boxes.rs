//! Boxes in space by their keys, and who lies in which.
//!
//! A key holds the box's three whole coordinates in 21 bits each. Boxes are numbered in the order in which their members come,
//! found in a hash table with open addressing; nothing is as large as the space that they span.

use crate::base::vec3::Vec3;
use crate::engine::search::NONE;

/// The key of what lies in no box.
pub const NOWHERE: u64 = u64::MAX;

/// Bits of a coordinate.
const FIELD: u32 = 21;
/// A one in each coordinate.
pub const ONES: u64 = 1 | 1 << FIELD | 1 << (2 * FIELD);
/// The coordinate of the box at the origin; all are kept some boxes away from the ends of their range, where whatever lies
/// further out shares the outermost box.
const ORIGIN: i64 = 1 << (FIELD - 1);
const FARTHEST: f64 = (ORIGIN - 16) as f64;

/// The key of the box around a point, its side being `1 / per_m`.
pub fn key_of(x: Vec3, per_m: f64) -> u64 {
    let [x, y, z] = x.map(|x| ((x * per_m).floor().clamp(-FARTHEST, FARTHEST) as i64 + ORIGIN) as u64);
    x | y << FIELD | z << (2 * FIELD)
}

/// The key of the box of twice the side around a box.
pub fn halved(key: u64) -> u64 {
    const TOPS: u64 = 1 << (FIELD - 1) | 1 << (2 * FIELD - 1);
    (key >> 1) & !TOPS
}

/// Which box each member lies in, and the members of each box.
#[derive(Debug, Default)]
pub struct Boxes {
    /// The box of each member; [`NONE`] for one that is nowhere.
    pub of: Vec<u32>,
    /// The key of each box.
    pub key: Vec<u64>,
    /// Where each box's members begin, and the end of the last.
    start: Vec<u32>,
    /// Ascending in each box.
    members: Vec<u32>,
    /// Boxes by the hash of their key, twice as many places as members at least.
    table: Vec<u32>,
}

impl Boxes {
    /// Numbers the boxes of members with these keys.
    pub fn number(&mut self, keys: impl ExactSizeIterator<Item = u64>) {
        let places = (2 * keys.len()).next_power_of_two().max(2);
        let shift = 64 - places.trailing_zeros();
        self.table.clear();
        self.table.resize(places, NONE);
        self.of.clear();
        self.key.clear();
        let mut last = (NOWHERE, NONE);
        for key in keys {
            if key != last.0 {
                last = (key, if key == NOWHERE { NONE } else { self.box_of(key, shift) });
            }
            self.of.push(last.1);
        }
        self.list_members();
    }

    /// The number of a key's box, a new one where there is none.
    fn box_of(&mut self, key: u64, shift: u32) -> u32 {
        // Fibonacci hashing (Knuth, volume 3).
        let mut place = (key.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> shift) as usize;
        loop {
            match self.table[place] {
                NONE => {
                    let new = self.key.len() as u32;
                    self.table[place] = new;
                    self.key.push(key);
                    return new;
                }
                known if self.key[known as usize] == key => return known,
                _ => place = (place + 1) & (self.table.len() - 1),
            }
        }
    }

    fn list_members(&mut self) {
        let Boxes { of, key, start, members, .. } = self;
        start.clear();
        start.resize(key.len() + 1, 0);
        let placed = || of.iter().enumerate().filter(|&(_, &own)| own != NONE);
        placed().for_each(|(_, &own)| start[own as usize] += 1);
        let mut sum = 0;
        for start in start.iter_mut() {
            (*start, sum) = (sum, sum + *start);
        }
        members.resize(sum as usize, 0);
        for (member, &own) in placed() {
            let next = &mut start[own as usize];
            members[*next as usize] = member as u32;
            *next += 1;
        }
        // Each start has moved on to where the next box begins.
        start.rotate_right(1);
        start[0] = 0;
    }

    pub fn len(&self) -> usize {
        self.key.len()
    }

    /// The members of a box, ascending.
    #[inline]
    pub fn members(&self, of: usize) -> &[u32] {
        &self.members[self.start[of] as usize..self.start[of + 1] as usize]
    }

    pub fn bytes(&self) -> usize {
        let numbers = [&self.of, &self.start, &self.members, &self.table];
        numbers.map(|list| list.capacity() * size_of::<u32>()).iter().sum::<usize>()
            + self.key.capacity() * size_of::<u64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_lie_in_the_boxes_around_them() {
        let points: [Vec3; 6] = [
            [0.1, 0.1, 0.1],
            [-0.1, 0.1, 0.1],
            [0.9, 0.2, 0.3],
            [1e12, -1e12, 0.0],
            [f64::INFINITY, f64::NEG_INFINITY, 0.5],
            [-0.2, 0.4, 0.0],
        ];
        let mut boxes = Boxes::default();
        let keys = points.iter().map(|&x| key_of(x, 1.0)).chain([NOWHERE]);
        boxes.number(keys.collect::<Vec<_>>().into_iter());
        assert_eq!(boxes.of, [0, 1, 0, 2, 2, 1, NONE]);
        assert_eq!([boxes.members(0), boxes.members(1), boxes.members(2)], [[0, 2], [1, 5], [3, 4]]);
        for (x, y) in [(0.3, 1.2), (-0.1, -1.9), (7.9, 6.0)] {
            let [a, b] = [x, y].map(|x| halved(key_of([x, -x, x], 1.0)));
            assert_eq!((a, b), (key_of([x, -x, x], 0.5), key_of([y, -y, y], 0.5)).map_origin());
        }
    }

    trait MapOrigin {
        fn map_origin(self) -> Self;
    }

    /// Halving halves the coordinate of the origin as well.
    impl MapOrigin for (u64, u64) {
        fn map_origin(self) -> Self {
            let moved = (ORIGIN as u64 / 2) * ONES;
            (self.0 - moved, self.1 - moved)
        }
    }
}
