//! The paper's method: linked lists, and after each build a copy of the positions bucket by bucket (its Figures 2, 3).
//!
//! A walk reads each bucket's row of `x y z` triples from end to end and follows no list. The price is the copy itself
//! and the padding of all rows to the width of the fullest bucket.

use crate::base::parallel::{FirstIndex, Rows, Team, Workers};
use crate::base::vec3::{Vec3, ZERO};
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::linked_list::LinkedList;
use crate::engine::search::{CandidateSearch, Lengths, Now};

/// The lists and the relocated copy. The width of a row, a constant in the paper, is that of the fullest bucket met so
/// far, checked at every build: it never drops a particle, and it does not shrink, so that rows stay where they are
/// while the fullest bucket gains and loses particles.
#[derive(Debug)]
pub struct AosRelocation {
    lists: LinkedList,
    /// `RELOCATE_ARRAY_WIDTH`.
    width: usize,
    /// `RelocatePosition`: `width` positions a bucket, zero beyond the readable range.
    position: Vec<Vec3>,
    /// The index of each relocated particle, for its velocity, pressure and label.
    index: Vec<u32>,
    /// `RelocateReadableRange`: the number of particles in each bucket.
    readable: Vec<u32>,
}

impl CandidateSearch for AosRelocation {
    fn new(grid: &Grid, lengths: Lengths, count: usize) -> Self {
        AosRelocation {
            lists: LinkedList::new(grid, lengths, count),
            width: 0,
            position: Vec::new(),
            index: Vec::new(),
            readable: vec![0; grid.len()],
        }
    }

    fn build(&mut self, buckets: &Buckets, now: Now<'_>, workers: &Workers) {
        self.lists.build(buckets, now, workers);
    }

    const RELOCATES: bool = true;

    fn relocate(&mut self, _buckets: &Buckets, positions: &[Vec3], team: Team<'_>) {
        if !self.copy_rows(positions, team) {
            self.widen();
            let fits = self.copy_rows(positions, team);
            assert!(fits, "a row as wide as the fullest bucket holds every bucket");
        }
    }

    #[inline(always)]
    fn any_in_bucket(
        &self,
        _buckets: &Buckets,
        _positions: &[Vec3],
        bucket: usize,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        let start = bucket * self.width;
        let row = start..start + self.readable[bucket] as usize;
        let (index, position) = (&self.index[row.clone()], &self.position[row]);
        index.iter().zip(position).any(|(&j, there)| stop_at(j as usize, there))
    }

    fn bytes(&self) -> usize {
        self.lists.bytes()
            + size_of_val(&self.position[..])
            + size_of_val(&self.index[..])
            + size_of_val(&self.readable[..])
    }
}

impl AosRelocation {
    /// Copies every bucket's positions into its row and pads what the row held before with zeros. Tells whether all
    /// rows were wide enough; `readable` holds the true counts either way.
    fn copy_rows(&mut self, positions: &[Vec3], team: Team<'_>) -> bool {
        let (lists, width, too_full) = (&self.lists, self.width, FirstIndex::default());
        if width == 0 {
            for (bucket, readable) in self.readable.iter_mut().enumerate() {
                *readable = 0;
                lists.any_in_list(bucket, |_| {
                    *readable += 1;
                    false
                });
            }
            return false;
        }
        let columns = (
            Rows::of_width(&mut self.position, width),
            Rows::of_width(&mut self.index, width),
            Rows::new(&mut self.readable),
        );
        team.fill(columns, |range, (position, index, readable)| {
            let rows = position.chunks_exact_mut(width).zip(index.chunks_exact_mut(width)).zip(readable);
            for (bucket, ((position, index), readable)) in range.zip(rows) {
                let mut count = 0;
                lists.any_in_list(bucket, |j| {
                    if count < width {
                        (position[count], index[count]) = (positions[j], j as u32);
                    }
                    count += 1;
                    false
                });
                if count > width {
                    too_full.record(bucket);
                }
                let before = (*readable as usize).min(width);
                if count < before {
                    position[count..before].fill(ZERO);
                }
                *readable = count as u32;
            }
        });
        too_full.get().is_none()
    }

    /// Makes all rows as wide as the fullest bucket.
    fn widen(&mut self) {
        self.width = self.readable.iter().copied().max().unwrap_or(0).max(1) as usize;
        // Zero pages that nobody has touched: the workers that copy into them are the first.
        self.position = vec![ZERO; self.readable.len() * self.width];
        self.index = vec![0; self.readable.len() * self.width];
        self.readable.fill(0);
    }
}
