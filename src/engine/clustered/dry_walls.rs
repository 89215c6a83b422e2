//! Walls that no fluid comes near: their pressure is that of walls alone, which is worked out once.
//!
//! What walls do to one another never changes while they rest, and what fluid does to their pressures fades from list to list. Rows of
//! clusters more than [`KEPT`] lists away from all fluid and bodies (some ten particle distances) therefore leave the system of
//! equations; in the sources of those that stay they count with the pressure that they have where no fluid is at all.
//! After a step the dam break's particles are then 3e-14 m from where they would be, which the usual tolerance of the solver leaves
//! open as well (`tests/clusters` holds the bound); with one list less it would be 5e-13 m.
//! Without a surface among walls alone, with walls that move or with steps of unequal length all walls stay in.

use super::density::Numbers;
use super::entries::Kept;
use super::matrix::ClusterMatrix;
use super::rows::RowSpace;
use crate::base::parallel::Workers;
use crate::base::simd::LANES;
use crate::engine::pressure::conjugate_gradient::{CgError, CgParams, ConjugateGradient};
use crate::engine::pressure::enclosed::EnclosedParts;
use crate::engine::pressure::matrix::{SparseMatrix, Storage};
use crate::engine::pressure::preconditioner::{Places, Preconditioning};
use crate::engine::pressure::system_matrix::System;
use crate::engine::search::clusters::{Clusters, Lists, with_pressure};

/// How many lists from the fluid walls still have a row.
const KEPT: usize = 2;
/// The tolerance of the solve for walls alone, relative to that of the pressure's: it is done once.
const FINER: f64 = 1e-2;
/// Neighbours of a row, to begin with.
const USUAL_WIDTH: usize = 64;

#[derive(Debug, Default)]
pub struct DryWalls {
    /// Of each row of walls without any fluid, Pa; empty where walls alone do not tell.
    alone: Vec<f64>,
    /// Of each cluster of walls the lanes that have an unknown without any fluid.
    unknown: Vec<u8>,
    /// Whether a cluster of walls is left out.
    left_out: Vec<bool>,
    /// Those that stay in and may be neighbours of others.
    border: Vec<u32>,
    next: Vec<u32>,
    /// Rows that are left out.
    pub rows: usize,
}

impl DryWalls {
    /// Solves for walls alone; `source` is that of their rows, `unknown` says which rows have one.
    pub fn take_up<V: Kept>(
        &mut self,
        matrix: &ClusterMatrix<V>,
        unknown: Vec<u8>,
        source: &[Numbers],
        compressibility: f64,
        cg: CgParams,
        workers: &Workers,
    ) -> Result<(), CgError> {
        self.alone.clear();
        self.unknown = unknown;
        if !self.all_reach_the_surface(matrix) {
            return Ok(());
        }
        let is_unknown = |row: usize| self.unknown[row / LANES] >> (row % LANES) & 1 == 1;
        let mut of_walls = SparseMatrix::<f64>::new(Storage::Csr, USUAL_WIDTH);
        of_walls.assemble(source.len() * LANES, workers, |row, entries| {
            if !is_unknown(row) {
                return 1.0;
            }
            matrix.for_each_resting(row, |column, value| entries.push(column, -value));
            matrix.resting_diagonal(row) + compressibility
        });
        let params =
            CgParams { tolerance: FINER * cg.tolerance, preconditioner: Preconditioning::None, ..cg };
        let mut solver = ConjugateGradient::new(params, 1.0);
        let source = source.as_flattened();
        let quiet = source.iter().all(|&b| b == 0.0);
        let system = System { matrix: &of_walls, source, quiet, places: Places::default() };
        solver.solve(&system, &mut EnclosedParts::default(), workers)?;
        self.alone.extend_from_slice(solver.solution());
        self.border.reserve(self.unknown.len());
        self.next.reserve(self.unknown.len());
        Ok(())
    }

    /// Whether neighbours join every unknown to the surface without any fluid.
    fn all_reach_the_surface<V: Kept>(&self, matrix: &ClusterMatrix<V>) -> bool {
        let rows = || 0..self.unknown.len() * LANES;
        let is_unknown = |row: usize| self.unknown[row / LANES] >> (row % LANES) & 1 == 1;
        let near_surface = |row: usize| matrix.resting_touching(row / LANES) >> (row % LANES) & 1 == 1;
        let mut reached: Vec<bool> = rows().map(|row| !is_unknown(row)).collect();
        let mut front: Vec<usize> = rows().filter(|&row| is_unknown(row) && near_surface(row)).collect();
        front.iter().for_each(|&row| reached[row] = true);
        while let Some(row) = front.pop() {
            matrix.for_each_resting(row, |column, _| {
                if !std::mem::replace(&mut reached[column as usize], true) {
                    front.push(column as usize);
                }
            });
        }
        reached.iter().all(|&reached| reached)
    }

    /// Finds those that no fluid is near, and takes them out of `unknown`.
    pub fn leave_out(&mut self, clusters: &Clusters, rows: &RowSpace, unknown: &mut [u8]) {
        let walls = rows.walls();
        let DryWalls { alone, unknown: alone_unknown, left_out, border, next, rows } = self;
        *rows = 0;
        left_out.clear();
        border.clear();
        if alone.is_empty() {
            return;
        }
        left_out.resize(walls.len(), true);
        for cluster in walls.clone() {
            if clusters.wall_mobile.iter().any(|lists| !lists.of(cluster).all.is_empty()) {
                left_out[cluster - walls.start] = false;
                border.push(cluster as u32);
            }
        }
        for _ in 0..KEPT {
            next.clear();
            for &cluster in border.iter() {
                let mut keep = |neighbor: usize| {
                    if std::mem::replace(&mut left_out[neighbor - walls.start], false) {
                        next.push(neighbor as u32);
                    }
                };
                for lists in with_pressure(&clusters.wall) {
                    show_listed(clusters, lists, cluster as usize, &mut keep);
                }
            }
            std::mem::swap(border, next);
        }
        for (k, unknown) in unknown.iter_mut().take(walls.len()).enumerate().filter(|(k, _)| left_out[*k]) {
            *rows += alone_unknown[k].count_ones() as usize;
            *unknown = 0;
        }
    }

    /// Adds what those that are left out do to the rows that stay.
    pub fn add_to<V: Kept>(&self, matrix: &ClusterMatrix<V>, rows: &RowSpace, source: &mut [Numbers]) {
        for &cluster in &self.border {
            let k = cluster as usize - rows.walls().start;
            for lane in (0..LANES).filter(|lane| matrix.unknown[k] >> lane & 1 == 1) {
                matrix.for_each_resting(k * LANES + lane, |column, value| {
                    if self.left_out[column as usize / LANES] {
                        source[k][lane] += value * self.alone[column as usize];
                    }
                });
            }
        }
    }

    /// The pressure of a row that is left out.
    pub fn pressure(&self, row: usize) -> Option<f64> {
        self.left_out.get(row / LANES)?.then(|| self.alone[row])
    }

    pub fn bytes(&self) -> usize {
        self.alone.capacity() * size_of::<f64>()
            + self.unknown.capacity()
            + self.left_out.capacity()
            + (self.border.capacity() + self.next.capacity()) * size_of::<u32>()
    }
}

/// Shows the clusters of walls that have slots in a cluster's list, or images there.
fn show_listed(clusters: &Clusters, lists: &Lists, cluster: usize, show: &mut impl FnMut(usize)) {
    if lists.over().are_images() {
        lists.of(cluster).all.iter().for_each(|&image| show(clusters.slots.home(image as usize) / LANES));
    } else {
        lists.clusters_of(cluster).iter().for_each(|&listed| show(listed as usize));
    }
}
