//! The conjugate gradient method (Hestenes & Stiefel 1952), preconditioned by the diagonal, for the velocities of implicit
//! viscosity.
//!
//! It starts from zero and stops when the residual is at most `tolerance` times the smaller of `|b|`, what viscosity does,
//! and `|u*|`, the velocities themselves: in a step far above the explicit limit the first is huge and means little. The
//! true residual is computed at the end. Dot products run in the fixed blocks of the pressure's solver.

use crate::base::parallel::{Rows, Team, Workers};
use crate::base::vec3::{Vec3, ZERO, add, add_scaled, sub};
use crate::engine::effects::implicit_viscosity::system::System;
use crate::engine::pressure::conjugate_gradient::{BLOCK, CgError, CgInfo, CgMode, CgParams, dot};

#[derive(Debug)]
pub struct Solver {
    params: CgParams,
    solution: Vec<Vec3>,
    residual: Vec<Vec3>,
    preconditioned: Vec<Vec3>,
    direction: Vec<Vec3>,
    product: Vec<Vec3>,
    partial: Vec<[f64; 3]>,
}

impl Solver {
    pub fn new(params: CgParams) -> Self {
        Solver {
            params,
            solution: Vec::new(),
            residual: Vec::new(),
            preconditioned: Vec::new(),
            direction: Vec::new(),
            product: Vec::new(),
            partial: Vec::new(),
        }
    }

    /// The changes of the velocities found last, metres per second.
    pub fn solution(&self) -> &[Vec3] {
        &self.solution
    }

    /// Solves the system of this step.
    pub fn solve(&mut self, system: &System, workers: &Workers) -> Result<CgInfo, CgError> {
        let team = match self.params.mode {
            CgMode::Serial => Team::SERIAL,
            CgMode::Parallel => workers.shared_evenly(),
        };
        let [mut norm2, before2, mut slope] = self.start(system, team, workers);
        if norm2 == 0.0 {
            return Ok(CgInfo::default());
        }
        let scale = norm2.sqrt().min(before2.sqrt());
        let (target, mut iterations) = (self.params.tolerance * scale, 0);
        while norm2.sqrt() > target {
            if iterations == self.params.max_iterations || !norm2.is_finite() {
                return Err(CgError::NotConverged { residual: norm2.sqrt() / scale, iterations });
            }
            iterations += 1;
            let curvature = self.multiply(system, team);
            if !(curvature > 0.0 && curvature.is_finite()) {
                let residual = norm2.sqrt() / scale;
                return Err(CgError::NotPositiveDefinite { curvature, iteration: iterations, residual });
            }
            let before = slope;
            [norm2, _, slope] = self.advance(before / curvature, system, team);
            self.turn(slope / before, team);
        }
        let residual = self.true_residual(system, team) / scale;
        if residual > 10.0 * self.params.tolerance + 1e-12 || !residual.is_finite() {
            return Err(CgError::NotConverged { residual, iterations });
        }
        Ok(CgInfo { iterations, residual })
    }

    /// `solution = 0`, `residual = b = L u*`, `direction = preconditioned`; returns the squares of `b` and `u*`, and
    /// `residual . preconditioned`.
    fn start(&mut self, system: &System, team: Team<'_>, workers: &Workers) -> [f64; 3] {
        let rows = system.rows();
        for vector in [
            &mut self.solution,
            &mut self.residual,
            &mut self.preconditioned,
            &mut self.direction,
            &mut self.product,
        ] {
            if vector.len() != rows {
                *vector = workers.column(rows, ZERO);
            }
        }
        self.partial.resize(rows.div_ceil(BLOCK), [0.0; 3]);
        let columns = (
            Rows::of_width(&mut self.solution, BLOCK),
            Rows::of_width(&mut self.residual, BLOCK),
            Rows::of_width(&mut self.direction, BLOCK),
            Rows::new(&mut self.partial),
        );
        team.fill(columns, |blocks, (solution, residual, direction, partial)| {
            solution.fill(ZERO);
            let vectors = residual.chunks_mut(BLOCK).zip(direction.chunks_mut(BLOCK)).zip(partial);
            for (block, ((residual, direction), partial)) in blocks.zip(vectors) {
                let rows = block * BLOCK..block * BLOCK + residual.len();
                for (k, i) in rows.clone().enumerate() {
                    residual[k] = system.pull(i, &system.before);
                    direction[k] = system.precondition(i, residual[k]);
                }
                *partial = [square(residual), square(&system.before[rows]), product(residual, direction)];
            }
        });
        self.sum()
    }

    /// `direction = preconditioned + beta direction`.
    fn turn(&mut self, beta: f64, team: Team<'_>) {
        let preconditioned = &self.preconditioned;
        team.fill(Rows::of_width(&mut self.direction, BLOCK), |blocks, direction| {
            let z = &preconditioned[blocks.start * BLOCK..];
            for (direction, &z) in direction.iter_mut().zip(z) {
                *direction = add_scaled(z, beta, *direction);
            }
        });
    }

    /// `product = A direction`; returns `direction . product`.
    fn multiply(&mut self, system: &System, team: Team<'_>) -> f64 {
        let direction = &self.direction;
        let columns = (Rows::of_width(&mut self.product, BLOCK), Rows::new(&mut self.partial));
        team.fill(columns, |blocks, (products, partial)| {
            for ((block, products), partial) in blocks.zip(products.chunks_mut(BLOCK)).zip(partial) {
                for (k, product) in products.iter_mut().enumerate() {
                    *product = system.product(block * BLOCK + k, direction);
                }
                *partial = [product(products, &direction[block * BLOCK..][..products.len()]), 0.0, 0.0];
            }
        });
        self.sum()[0]
    }

    /// `solution += alpha direction`, `residual -= alpha product`; returns the residual's square and
    /// `residual . preconditioned`.
    fn advance(&mut self, alpha: f64, system: &System, team: Team<'_>) -> [f64; 3] {
        let (direction, products) = (&self.direction, &self.product);
        let columns = (
            Rows::of_width(&mut self.solution, BLOCK),
            Rows::of_width(&mut self.residual, BLOCK),
            Rows::of_width(&mut self.preconditioned, BLOCK),
            Rows::new(&mut self.partial),
        );
        team.fill(columns, |blocks, (solution, residual, preconditioned, partial)| {
            let vectors = solution
                .chunks_mut(BLOCK)
                .zip(residual.chunks_mut(BLOCK))
                .zip(preconditioned.chunks_mut(BLOCK))
                .zip(partial);
            for (block, (((solution, residual), z), partial)) in blocks.zip(vectors) {
                for k in 0..solution.len() {
                    let i = block * BLOCK + k;
                    solution[k] = add_scaled(solution[k], alpha, direction[i]);
                    residual[k] = add_scaled(residual[k], -alpha, products[i]);
                    z[k] = system.precondition(i, residual[k]);
                }
                *partial = [square(residual), 0.0, product(residual, z)];
            }
        });
        self.sum()
    }

    /// `|A solution - b|`.
    fn true_residual(&mut self, system: &System, team: Team<'_>) -> f64 {
        let solution = &self.solution;
        let columns = (Rows::of_width(&mut self.residual, BLOCK), Rows::new(&mut self.partial));
        team.fill(columns, |blocks, (residual, partial)| {
            for ((block, residual), partial) in blocks.zip(residual.chunks_mut(BLOCK)).zip(partial) {
                for (k, residual) in residual.iter_mut().enumerate() {
                    let i = block * BLOCK + k;
                    *residual = sub(system.product(i, solution), system.pull(i, &system.before));
                }
                *partial = [square(residual), 0.0, 0.0];
            }
        });
        self.sum()[0].sqrt()
    }

    /// The blocks' sums, added in order.
    fn sum(&self) -> [f64; 3] {
        self.partial.iter().fold([0.0; 3], |sum, partial| add(sum, *partial))
    }

    pub fn bytes(&self) -> usize {
        let vectors = [&self.solution, &self.residual, &self.preconditioned, &self.direction, &self.product];
        vectors.map(|vector| size_of_val(&vector[..])).iter().sum::<usize>() + size_of_val(&self.partial[..])
    }
}

fn product(a: &[Vec3], b: &[Vec3]) -> f64 {
    dot(a.as_flattened(), b.as_flattened())
}

fn square(a: &[Vec3]) -> f64 {
    product(a, a)
}
