//! Relocation as a structure of arrays: a cell list, and x, y and z of its particles each in an array of its own.
//!
//! Eight candidates are sifted at a time by vector instructions, and only those within the radius go on. The paper's
//! reference [3] compares this layout with arrays of structures. Three streams instead of one; a run of candidates seldom
//! begins where a vector does, so that loads are unaligned.

use std::ops::Range;

use crate::base::parallel::{Rows, Team, Workers};
use crate::base::vec3::Vec3;
use crate::engine::search::cell_list::CellList;
use crate::engine::search::grid::{Buckets, Grid};
use crate::engine::search::lanes::{self, LANES, Lanes};
use crate::engine::search::{CandidateSearch, Lengths, Now};

#[derive(Debug)]
pub struct Soa {
    cells: CellList,
    /// A coordinate of the particle at each place of the cell list, and a vector's length of zeros behind the last.
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
}

impl Soa {
    /// The eight coordinates from a place on.
    #[inline(always)]
    fn lanes(column: &[f64], place: usize) -> &Lanes {
        column[place..].first_chunk().expect("a vector's length stands behind the last place")
    }

    #[inline(always)]
    fn position(&self, place: usize) -> Vec3 {
        [self.x[place], self.y[place], self.z[place]]
    }

    #[inline(always)]
    fn any_at(&self, places: Range<usize>, mut stop_at: impl FnMut(usize, &Vec3) -> bool) -> bool {
        let particles = self.cells.particles();
        places.into_iter().any(|place| stop_at(particles[place] as usize, &self.position(place)))
    }
}

impl CandidateSearch for Soa {
    fn new(grid: &Grid, lengths: Lengths, count: usize) -> Self {
        let column = || vec![0.0; count + LANES];
        Soa { cells: CellList::new(grid, lengths, count), x: column(), y: column(), z: column() }
    }

    fn build(&mut self, buckets: &Buckets, now: Now<'_>, workers: &Workers) {
        self.cells.build(buckets, now, workers);
    }

    const RELOCATES: bool = true;

    fn relocate(&mut self, _buckets: &Buckets, positions: &[Vec3], team: Team<'_>) {
        let Soa { cells, x, y, z } = self;
        let (particles, len) = (cells.particles(), cells.len());
        let columns = (Rows::new(&mut x[..len]), Rows::new(&mut y[..len]), Rows::new(&mut z[..len]));
        team.fill(columns, |places, (x, y, z)| {
            for (k, &i) in particles[places].iter().enumerate() {
                [x[k], y[k], z[k]] = positions[i as usize];
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
            places.clone().step_by(LANES).any(|first| {
                let [x, y, z] = [&self.x, &self.y, &self.z].map(|column| Self::lanes(column, first));
                let inside = lanes::near(x, y, z, &here, r2) & lanes::among(0, places.end - first);
                lanes::any(inside, |k| stop_at(particles[first + k] as usize, &[x[k], y[k], z[k]]))
            })
        })
    }

    fn bytes(&self) -> usize {
        self.cells.bytes() + [&self.x, &self.y, &self.z].map(|c| size_of_val(&c[..])).iter().sum::<usize>()
    }
}
