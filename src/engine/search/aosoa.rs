//! Relocation in blocks: a cell list, and the positions of eight particles at a time as `x x x .. y y y .. z z z ..`.
//!
//! Between arrays of structures and a structure of arrays: vectors are loaded whole and aligned to one another, and all that
//! a candidate is made of lies within 192 bytes, in one stream. The paper's reference [3] compares the three. Blocks do not
//! begin with buckets: the lanes of a block before and behind a run are left out by a mask, which costs less than the
//! padding of every bucket would.

use std::ops::Range;

use crate::base::parallel::{Rows, Team, Workers};
use crate::base::vec3::Vec3;
use crate::engine::search::cell_list::CellList;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::lanes::{self, LANES, Lanes};
use crate::engine::search::{CandidateSearch, Lengths, Now};

/// Eight positions.
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(64))]
struct Block([Lanes; 3]);

impl Block {
    #[inline(always)]
    fn position(&self, lane: usize) -> Vec3 {
        let [x, y, z] = &self.0;
        [x[lane], y[lane], z[lane]]
    }
}

#[derive(Debug)]
pub struct Aosoa {
    cells: CellList,
    /// Place `p` of the cell list is lane `p % 8` of block `p / 8`.
    blocks: Vec<Block>,
}

impl Aosoa {
    #[inline(always)]
    fn any_at(&self, places: Range<usize>, mut stop_at: impl FnMut(usize, &Vec3) -> bool) -> bool {
        let particles = self.cells.particles();
        places.into_iter().any(|place| {
            stop_at(particles[place] as usize, &self.blocks[place / LANES].position(place % LANES))
        })
    }
}

impl CandidateSearch for Aosoa {
    fn new(grid: &Grid, lengths: Lengths, count: usize) -> Self {
        let blocks = vec![Block::default(); count.div_ceil(LANES)];
        Aosoa { cells: CellList::new(grid, lengths, count), blocks }
    }

    fn build(&mut self, buckets: &Buckets, now: Now<'_>, workers: &Workers) {
        self.cells.build(buckets, now, workers);
    }

    const RELOCATES: bool = true;

    fn relocate(&mut self, _buckets: &Buckets, positions: &[Vec3], team: Team<'_>) {
        let particles = &self.cells.particles()[..self.cells.len()];
        let len = particles.len();
        team.fill(Rows::new(&mut self.blocks[..len.div_ceil(LANES)]), |range, blocks| {
            for (k, block) in range.zip(blocks) {
                for (lane, &i) in particles[k * LANES..].iter().take(LANES).enumerate() {
                    let position = positions[i as usize];
                    (0..3).for_each(|d| block.0[d][lane] = position[d]);
                }
            }
        });
    }

    #[inline(always)]
    fn any_in_bucket(
        &self,
        _buckets: &Buckets,
        _positions: &[Vec3],
        bucket: usize,
        stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        self.any_at(self.cells.places(bucket..bucket + 1), stop_at)
    }

    #[inline(always)]
    fn any_candidate(
        &self,
        buckets: &Buckets,
        _positions: &[Vec3],
        i: usize,
        enter: impl Fn(usize) -> bool,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        self.cells.any_run(buckets, i, enter, |places| self.any_at(places, &mut stop_at))
    }

    #[inline(always)]
    fn any_candidate_near(
        &self,
        buckets: &Buckets,
        positions: &[Vec3],
        i: usize,
        radius: f64,
        enter: impl Fn(usize) -> bool,
        mut stop_at: impl FnMut(usize, &Vec3) -> bool,
    ) -> bool {
        let (here, r2, particles) = (positions[i], radius * radius, self.cells.particles());
        self.cells.any_run(buckets, i, enter, |places| {
            let blocks = places.start / LANES..places.end.div_ceil(LANES);
            let first = blocks.start * LANES;
            self.blocks[blocks].iter().zip((first..).step_by(LANES)).any(|(block, first)| {
                let [x, y, z] = &block.0;
                let mine = lanes::among(places.start.saturating_sub(first), places.end - first);
                let inside = lanes::near(x, y, z, &here, r2) & mine;
                lanes::any(inside, |lane| stop_at(particles[first + lane] as usize, &block.position(lane)))
            })
        })
    }

    fn bytes(&self) -> usize {
        self.cells.bytes() + size_of_val(&self.blocks[..])
    }
}
