//! Two levels by deflation: particles, and boxes of them with one number each.
//!
//! A Krylov method has its trouble with what changes slowly from particle to particle; boxes take that over. With `P` the
//! indicators of boxes (piecewise constant aggregation, Vanek 1992; Braess 1995), `AP` the matrix times them and `E` an
//! approximate inverse of the box matrix `P^T A P`,
//!
//! `z = w P e + D^-1 (r - w AP e)` with `e = E P^T r`:
//!
//! the multiplicative combination A-DEF2 of Tang, Nabben, Vuik & Erlangga (2009). `AP` is kept, so that it takes no second product
//! with the matrix. `w = 1.2` since piecewise constant functions are too stiff (over-correction, Braess 1995; Stueben 1999). `E` is a
//! [W-cycle](level) over boxes of twice, four times ... the side, down to a [dense](dense) system. The result is symmetric only
//! as far as `P^T r` vanishes, which the flexible form of the conjugate gradients allows for.
//!
//! Boxes are cubes of side 2.6 particle distances (squares in two dimensions), about 18 particles each, numbered as rows meet them.
//! They are found by their keys, not in a grid, so a particle that flew far off costs one box. Iterations in
//! the dam break, 1e-8 from zero: 15 with 2,574 unknowns and 18 with 12,396, where plain conjugate gradients take 33 and 56.
//! Parts without a surface have a singular box matrix: their last pivot is left out, and the solver projects.

mod boxes;
mod dense;
mod gather;
pub mod lanes;
mod level;

use crate::base::parallel::{Rows, Team, Workers};
use crate::engine::pressure::conjugate_gradient::CgError;
use crate::engine::pressure::matrix::{SparseMatrix, Storage};
use crate::engine::pressure::preconditioner::jacobi::invert;
use crate::engine::pressure::preconditioner::{Places, Preconditioner};
use crate::engine::pressure::system_matrix::{BLOCK, SystemMatrix};
use crate::engine::search::NONE;
use boxes::{Boxes, NOWHERE, key_of};
use gather::Gather;
use lanes::{ApplyTo, LaneBoxes, RowBoxes};
use level::Levels;

/// Side of a box in particle distances.
const SIDE: f64 = 2.6;
/// `w`.
const OVER_CORRECTION: f64 = 1.2;
/// Boxes that a row's neighbours lie in, to begin with.
const USUAL_WIDTH: usize = 48;

#[derive(Debug)]
pub struct TwoLevel {
    boxes_per_m: f64,
    /// The key of each row's box.
    key: Vec<u64>,
    /// The boxes of rows.
    boxes: Boxes,
    /// `1 / A_ii`.
    inverse: Vec<f64>,
    /// `AP`: of each row the entries of other boxes, and as its diagonal that of its own box.
    times_boxes: SparseMatrix<f32>,
    /// The same of a matrix whose rows share columns in groups, which leaves the other empty.
    lane_boxes: LaneBoxes,
    levels: Levels,
}

impl TwoLevel {
    pub fn new(particle_distance_m: f64) -> Self {
        TwoLevel {
            boxes_per_m: 1.0 / (SIDE * particle_distance_m),
            key: Vec::new(),
            boxes: Boxes::default(),
            inverse: Vec::new(),
            times_boxes: SparseMatrix::new(Storage::Csr, USUAL_WIDTH),
            lane_boxes: LaneBoxes::default(),
            levels: Levels::default(),
        }
    }

    fn find_boxes(&mut self, rows: usize, places: Places<'_>, team: Team<'_>) {
        let per_m = self.boxes_per_m;
        self.key.resize(rows, NOWHERE);
        team.fill(Rows::new(&mut self.key), |rows, key| {
            for (row, key) in rows.zip(key) {
                *key = places.of(row).map_or(NOWHERE, |x| key_of(x, per_m));
            }
        });
        self.boxes.number(self.key.iter().copied());
    }
}

impl Preconditioner for TwoLevel {
    fn set_up<M: SystemMatrix>(
        &mut self,
        matrix: &M,
        places: Places<'_>,
        team: Team<'_>,
        workers: &Workers,
    ) -> Result<(), CgError> {
        self.find_boxes(matrix.rows(), places, team.evenly());
        invert(matrix.diagonal(), &mut self.inverse, team.evenly());
        let (key, of) = (&self.key, &self.boxes.of);
        if M::IN_LANES {
            matrix.add_up_by_box(RowBoxes { of, key }, &mut self.lane_boxes, team);
            self.levels.set_up_lanes(&self.lane_boxes, &self.boxes, team, workers);
            return Ok(());
        }
        self.times_boxes.assemble_by(matrix.rows(), team, workers, |row, entries| {
            if of[row] == NONE {
                return 0.0;
            }
            let mut gather = Gather::new(key[row], entries);
            matrix.for_each_entry(row, |column, value| {
                gather.add(key[column as usize], of[column as usize], value);
            });
            matrix.diagonal()[row] + gather.finish()
        });
        self.levels.set_up(&self.times_boxes, &self.boxes, team, workers);
        Ok(())
    }

    fn apply<M: SystemMatrix>(&mut self, _: &M, residual: &[f64], result: &mut [f64], team: Team<'_>) {
        let TwoLevel { boxes, inverse, times_boxes, lane_boxes, levels, .. } = self;
        let correction = levels.correct(boxes, residual, team);
        if M::IN_LANES {
            let rows = ApplyTo { weight: OVER_CORRECTION, of: &boxes.of, inverse, residual, correction };
            team.fill(Rows::of_width(result, BLOCK), |blocks, result| {
                lane_boxes.apply(blocks.start * BLOCK, &rows, result);
            });
            return;
        }
        team.fill(Rows::of_width(result, BLOCK), |blocks, result| {
            for (row, z) in (blocks.start * BLOCK..).zip(result) {
                let (r, own) = (residual[row], boxes.of[row]);
                *z = inverse[row] * r;
                if own != NONE {
                    let own = correction[own as usize];
                    let answer =
                        times_boxes.diagonal[row] * own + times_boxes.entries_product(row, correction);
                    *z = OVER_CORRECTION * own + inverse[row] * (r - OVER_CORRECTION * answer);
                }
            }
        });
    }

    fn bytes(&self) -> usize {
        self.key.capacity() * size_of::<u64>()
            + self.inverse.capacity() * size_of::<f64>()
            + self.boxes.bytes()
            + self.times_boxes.bytes()
            + self.lane_boxes.bytes()
            + self.levels.bytes()
    }
}
