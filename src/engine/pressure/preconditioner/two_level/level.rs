//! The levels of boxes, each of twice the side of the one below, and the W-cycle over them.
//!
//! A visit smooths by damped Jacobi, corrects twice from the level above and smooths again: symmetric. The weight of the
//! smoother stays below one, since the largest eigenvalue of `D^-1 A` comes near two on boxes. The coarsest level is
//! solved exactly. Small levels are not worth waking threads for; who computes does not change the bits.

use super::OVER_CORRECTION;
use super::boxes::{Boxes, halved};
use super::dense::Dense;
use super::gather::Gather;
use super::lanes::LaneBoxes;
use crate::base::parallel::{Rows, Team, Workers};
use crate::engine::pressure::matrix::{SparseMatrix, Storage};
use crate::engine::pressure::preconditioner::jacobi::invert;
use crate::engine::pressure::values::Value;

/// The most boxes of the coarsest level.
const COARSEST: usize = 100;
/// Boxes of a level from which on several threads share it.
const SHARED: usize = 1024;
/// Weight of the smoother.
const DAMPING: f64 = 0.85;
/// Corrections that a visit takes from the next level: two make the cycle a W.
const CORRECTIONS: usize = 2;
/// Entries of a row, to begin with.
const USUAL_WIDTH: usize = 64;

/// The equations of one level's boxes.
#[derive(Debug)]
struct Level {
    matrix: SparseMatrix,
    /// `1 / A_ii`.
    inverse: Vec<f64>,
    /// The boxes of the next level around this one's; unused on the coarsest.
    boxes: Boxes,
    right: Vec<f64>,
    solution: Vec<f64>,
    residual: Vec<f64>,
}

impl Level {
    fn new() -> Self {
        Level {
            matrix: SparseMatrix::new(Storage::Csr, USUAL_WIDTH),
            inverse: Vec::new(),
            boxes: Boxes::default(),
            right: Vec::new(),
            solution: Vec::new(),
            residual: Vec::new(),
        }
    }

    /// Takes up the sum of a matrix over the members of each box, rows and columns: `add(own, gather)` adds the entries of
    /// the members of box `own` and returns what belongs to its diagonal beside them.
    fn take_up(
        &mut self,
        boxes: &Boxes,
        team: Team<'_>,
        workers: &Workers,
        add: impl Fn(usize, &mut Gather<'_, '_, f64>) -> f64 + Sync,
    ) {
        let team = worth(boxes.len(), team);
        self.matrix.assemble_by(boxes.len(), team, workers, |own, entries| {
            let mut gather = Gather::new(boxes.key[own], entries);
            let diagonal = add(own, &mut gather);
            diagonal + gather.finish()
        });
        invert(&self.matrix.diagonal, &mut self.inverse, team);
        for vector in [&mut self.right, &mut self.solution, &mut self.residual] {
            vector.resize(boxes.len(), 0.0);
        }
    }

    fn len(&self) -> usize {
        self.right.len()
    }

    /// `right_I = sum of x over the members of I`.
    fn gather(&mut self, boxes: &Boxes, x: &[f64], team: Team<'_>) {
        team.fill(Rows::new(&mut self.right), |range, right| {
            for (own, right) in range.zip(right) {
                *right = boxes.members(own).iter().map(|&member| x[member as usize]).sum();
            }
        });
    }

    /// Smooths from zero.
    fn begin(&mut self, team: Team<'_>) {
        let (right, inverse) = (&self.right, &self.inverse);
        team.fill(Rows::new(&mut self.solution), |range, solution| {
            for (x, (r, inverse)) in solution.iter_mut().zip(right[range.clone()].iter().zip(&inverse[range]))
            {
                *x = DAMPING * inverse * r;
            }
        });
    }

    /// `residual = right - A solution`.
    fn find_residual(&mut self, team: Team<'_>) {
        let Level { matrix, right, solution, residual, .. } = self;
        team.fill(Rows::new(residual), |range, residual| {
            for (row, residual) in range.zip(residual) {
                *residual = right[row] - matrix.row_product(row, solution);
            }
        });
    }

    /// Adds the next level's correction.
    fn correct(&mut self, coarse: &[f64], team: Team<'_>) {
        let of = &self.boxes.of;
        team.fill(Rows::new(&mut self.solution), |range, solution| {
            for (x, &own) in solution.iter_mut().zip(&of[range]) {
                *x += OVER_CORRECTION * coarse[own as usize];
            }
        });
    }

    /// Adds the smoother's answer to the residual.
    fn smooth(&mut self, team: Team<'_>) {
        let (residual, inverse) = (&self.residual, &self.inverse);
        team.fill(Rows::new(&mut self.solution), |range, solution| {
            for (x, (r, inverse)) in
                solution.iter_mut().zip(residual[range.clone()].iter().zip(&inverse[range]))
            {
                *x += DAMPING * inverse * r;
            }
        });
    }

    fn bytes(&self) -> usize {
        let vectors = [&self.inverse, &self.right, &self.solution, &self.residual];
        vectors.map(|vector| vector.capacity() * size_of::<f64>()).iter().sum::<usize>()
            + self.matrix.bytes()
            + self.boxes.bytes()
    }
}

/// All levels, the finest first.
#[derive(Debug, Default)]
pub struct Levels {
    levels: Vec<Level>,
    /// How many of them the present step has.
    count: usize,
    dense: Dense,
}

impl Levels {
    /// Takes up `times_boxes`, the matrix times the indicators of `boxes`, and all coarser levels.
    pub fn set_up(
        &mut self,
        times_boxes: &SparseMatrix<f32>,
        boxes: &Boxes,
        team: Team<'_>,
        workers: &Workers,
    ) {
        self.make_room(1);
        self.levels[0].take_up(boxes, team, workers, add_members(times_boxes, boxes, |column| column));
        self.set_up_coarser(boxes, team, workers);
    }

    /// The same of a matrix whose rows share columns in groups.
    pub fn set_up_lanes(&mut self, lane_boxes: &LaneBoxes, boxes: &Boxes, team: Team<'_>, workers: &Workers) {
        self.make_room(1);
        self.levels[0].take_up(boxes, team, workers, |own, gather| {
            lane_boxes.for_each_entry(boxes.members(own), |of, value| {
                gather.add(boxes.key[of as usize], of, value)
            });
            0.0
        });
        self.set_up_coarser(boxes, team, workers);
    }

    fn set_up_coarser(&mut self, boxes: &Boxes, team: Team<'_>, workers: &Workers) {
        self.count = 1;
        while self.levels[self.count - 1].len() > COARSEST {
            self.make_room(self.count + 1);
            let (finer, coarser) = self.levels.split_at_mut(self.count);
            let (here, below) = finer.split_last_mut().expect("the first level is there");
            let Level { matrix, boxes: larger, .. } = here;
            enlarge(below.last().map_or(&boxes.key, |level| &level.boxes.key), larger);
            let add = add_members(matrix, larger, |column| larger.of[column as usize]);
            coarser[0].take_up(larger, team, workers, add);
            self.count += 1;
        }
        self.dense.factorise(&self.levels[self.count - 1].matrix);
    }

    fn make_room(&mut self, levels: usize) {
        while self.levels.len() < levels {
            self.levels.push(Level::new());
        }
    }

    /// `E P^T r`: a number a box.
    pub fn correct(&mut self, boxes: &Boxes, residual: &[f64], team: Team<'_>) -> &[f64] {
        let levels = &mut self.levels[..self.count];
        levels[0].gather(boxes, residual, team.evenly());
        visit(levels, &self.dense, team);
        &levels[0].solution
    }

    pub fn bytes(&self) -> usize {
        self.levels.iter().map(Level::bytes).sum::<usize>() + self.dense.bytes()
    }
}

/// Adds the rows of `fine` that are members of a box; `column_box` tells the box of a column.
fn add_members<V: Value>(
    fine: &SparseMatrix<V>,
    boxes: &Boxes,
    column_box: impl Fn(u32) -> u32 + Sync,
) -> impl Fn(usize, &mut Gather<'_, '_, f64>) -> f64 + Sync {
    move |own, gather| {
        let mut diagonal = 0.0;
        for &member in boxes.members(own) {
            diagonal += fine.diagonal[member as usize];
            let (columns, values) = fine.row(member as usize);
            for (&column, value) in columns.iter().zip(values) {
                let of = column_box(column);
                gather.add(boxes.key[of as usize], of, value.widened());
            }
        }
        diagonal
    }
}

/// Finds boxes around those with the keys `key`: of twice the side or, where few of them share one, of more.
fn enlarge(key: &[u64], larger: &mut Boxes) {
    for halvings in 1.. {
        larger.number(key.iter().map(|&key| (0..halvings).fold(key, |key, _| halved(key))));
        // All keys are the same when nothing of them is left.
        if 3 * larger.len() <= 2 * key.len() {
            return;
        }
    }
}

/// Solves `A solution = right` approximately on the first of these levels.
fn visit(levels: &mut [Level], dense: &Dense, team: Team<'_>) {
    let Some((level, coarser)) = levels.split_first_mut() else { return };
    let Some(next) = coarser.first() else {
        level.solution.copy_from_slice(&level.right);
        return dense.solve(&mut level.solution);
    };
    let (team, next_team) = (worth(level.len(), team), worth(next.len(), team));
    level.begin(team);
    for _ in 0..CORRECTIONS {
        level.find_residual(team);
        coarser[0].gather(&level.boxes, &level.residual, next_team);
        visit(coarser, dense, team);
        level.correct(&coarser[0].solution, team);
    }
    level.find_residual(team);
    level.smooth(team);
}

/// The team, if so many boxes are worth waking it for.
fn worth(boxes: usize, team: Team<'_>) -> Team<'_> {
    if boxes < SHARED { Team::SERIAL } else { team.evenly() }
}
