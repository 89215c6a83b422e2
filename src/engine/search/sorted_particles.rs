//! Sorted copies: a cell list, and after each build a copy of the positions in its order.
//!
//! The paper's relocation without its rows: buckets are packed one behind the other, so that nothing is padded, no row is
//! ever too narrow, and the three buckets of a run along z are read from end to end (particles sorted by cell: Green,
//! *Particle Simulation using CUDA*, 2010). Velocities and pressures are read where particles lie, as with relocation.
//!
//! To sort the particles themselves, all columns of particles and stages, would spare those reads as well. It is not done
//! here: a particle's index is its identity in files, events, groups of bodies and waiting places of inflow, and decides the
//! order within a bucket and thereby the bits of every sum. What such an order is worth shows in the experiment
//! `memory-order`, which starts from states that are laid out so.

use std::ops::Range;

use crate::base::parallel::{Rows, Team, Workers};
use crate::base::vec3::{Vec3, ZERO};
use crate::engine::search::cell_list::CellList;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::{CandidateSearch, Lengths, Now};

#[derive(Debug)]
pub struct SortedParticles {
    cells: CellList,
    /// The position of the particle at each place of the cell list.
    position: Vec<Vec3>,
}

impl SortedParticles {
    #[inline(always)]
    fn any_at(&self, places: Range<usize>, mut stop_at: impl FnMut(usize, &Vec3) -> bool) -> bool {
        let (particles, position) = (&self.cells.particles()[places.clone()], &self.position[places]);
        particles.iter().zip(position).any(|(&j, there)| stop_at(j as usize, there))
    }
}

impl CandidateSearch for SortedParticles {
    fn new(grid: &Grid, lengths: Lengths, count: usize) -> Self {
        // Zero pages that nobody has touched: the workers that copy into them are the first.
        SortedParticles { cells: CellList::new(grid, lengths, count), position: vec![ZERO; count] }
    }

    fn build(&mut self, buckets: &Buckets, now: Now<'_>, workers: &Workers) {
        self.cells.build(buckets, now, workers);
    }

    const RELOCATES: bool = true;

    fn relocate(&mut self, _buckets: &Buckets, positions: &[Vec3], team: Team<'_>) {
        let (particles, len) = (self.cells.particles(), self.cells.len());
        team.fill(Rows::new(&mut self.position[..len]), |places, position| {
            for (position, &i) in position.iter_mut().zip(&particles[places]) {
                *position = positions[i as usize];
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

    fn bytes(&self) -> usize {
        self.cells.bytes() + size_of_val(&self.position[..])
    }
}
