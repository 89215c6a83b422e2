//! Preconditioners of the pressure's conjugate gradient method, a file each: what they are, where they are from, what they
//! cost.
//!
//! On the systems of this method (a dam break, 1e-8 from zero) a mere diagonal gains nothing, since the rows are alike; SSOR and
//! incomplete Cholesky save two thirds of the iterations and lose more to their substitutions; two levels make the number
//! of iterations independent of that of the particles.

pub mod incomplete_cholesky;
pub mod jacobi;
pub mod ssor;
mod subdomain;
pub mod two_level;

use std::fmt;
use std::str::FromStr;

use crate::base::parallel::{Team, Workers};
use crate::base::vec3::Vec3;
use crate::engine::pressure::conjugate_gradient::CgError;
use crate::engine::pressure::system_matrix::SystemMatrix;
use incomplete_cholesky::IncompleteCholesky;
use jacobi::Jacobi;
use ssor::Ssor;
use two_level::TwoLevel;

/// An approximation `M` of a matrix whose inverse is cheap to apply. The bits of the result depend on no number of threads.
pub trait Preconditioner {
    /// Takes up the matrix of this step.
    fn set_up<M: SystemMatrix>(
        &mut self,
        matrix: &M,
        places: Places<'_>,
        team: Team<'_>,
        workers: &Workers,
    ) -> Result<(), CgError>;

    /// `result = M^-1 residual`.
    fn apply<M: SystemMatrix>(&mut self, matrix: &M, residual: &[f64], result: &mut [f64], team: Team<'_>);

    fn bytes(&self) -> usize;
}

/// Where the rows of a matrix lie.
#[derive(Debug, Clone, Copy, Default)]
pub struct Places<'a> {
    /// The particle of each row, [`NONE`](crate::engine::search::NONE) for a row that counts for nothing.
    pub particle_of: &'a [u32],
    /// The position of each particle, metres.
    pub position: &'a [Vec3],
}

impl Places<'_> {
    /// Where a row lies; `None` for a row of no particle.
    pub fn of(&self, row: usize) -> Option<Vec3> {
        self.position.get(*self.particle_of.get(row)? as usize).copied()
    }
}

/// The preconditioners by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Preconditioning {
    None,
    Jacobi,
    Ssor,
    IncompleteCholesky,
    TwoLevel,
}

impl Preconditioning {
    pub const ALL: [Preconditioning; 5] = [
        Preconditioning::None,
        Preconditioning::Jacobi,
        Preconditioning::Ssor,
        Preconditioning::IncompleteCholesky,
        Preconditioning::TwoLevel,
    ];
    pub const ALLOWED: &'static str = "`none`, `jacobi`, `ssor`, `ic0` or `two-level`";

    pub fn name(self) -> &'static str {
        match self {
            Preconditioning::None => "none",
            Preconditioning::Jacobi => "jacobi",
            Preconditioning::Ssor => "ssor",
            Preconditioning::IncompleteCholesky => "ic0",
            Preconditioning::TwoLevel => "two-level",
        }
    }
}

impl fmt::Display for Preconditioning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Preconditioning {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Preconditioning::ALL
            .into_iter()
            .find(|known| known.name() == text)
            .ok_or_else(|| format!("`{text}` is no preconditioner: allowed are {}", Preconditioning::ALLOWED))
    }
}

/// The preconditioner that was asked for.
#[derive(Debug, Default)]
pub enum AnyPreconditioner {
    /// `z = r`.
    #[default]
    None,
    Jacobi(Jacobi),
    Ssor(Ssor),
    IncompleteCholesky(IncompleteCholesky),
    TwoLevel(Box<TwoLevel>),
}

impl AnyPreconditioner {
    pub fn new(name: Preconditioning, particle_distance_m: f64) -> Self {
        match name {
            Preconditioning::None => AnyPreconditioner::None,
            Preconditioning::Jacobi => AnyPreconditioner::Jacobi(Jacobi::default()),
            Preconditioning::Ssor => AnyPreconditioner::Ssor(Ssor::default()),
            Preconditioning::IncompleteCholesky => {
                AnyPreconditioner::IncompleteCholesky(IncompleteCholesky::default())
            }
            Preconditioning::TwoLevel => {
                AnyPreconditioner::TwoLevel(Box::new(TwoLevel::new(particle_distance_m)))
            }
        }
    }
}

impl Preconditioner for AnyPreconditioner {
    fn set_up<M: SystemMatrix>(
        &mut self,
        matrix: &M,
        places: Places<'_>,
        team: Team<'_>,
        workers: &Workers,
    ) -> Result<(), CgError> {
        match self {
            AnyPreconditioner::None => Ok(()),
            AnyPreconditioner::Jacobi(jacobi) => jacobi.set_up(matrix, places, team, workers),
            AnyPreconditioner::Ssor(ssor) => ssor.set_up(matrix, places, team, workers),
            AnyPreconditioner::IncompleteCholesky(ic) => ic.set_up(matrix, places, team, workers),
            AnyPreconditioner::TwoLevel(levels) => levels.set_up(matrix, places, team, workers),
        }
    }

    fn apply<M: SystemMatrix>(&mut self, matrix: &M, residual: &[f64], result: &mut [f64], team: Team<'_>) {
        match self {
            AnyPreconditioner::None => result.copy_from_slice(residual),
            AnyPreconditioner::Jacobi(jacobi) => jacobi.apply(matrix, residual, result, team),
            AnyPreconditioner::Ssor(ssor) => ssor.apply(matrix, residual, result, team),
            AnyPreconditioner::IncompleteCholesky(ic) => ic.apply(matrix, residual, result, team),
            AnyPreconditioner::TwoLevel(levels) => levels.apply(matrix, residual, result, team),
        }
    }

    fn bytes(&self) -> usize {
        match self {
            AnyPreconditioner::None => 0,
            AnyPreconditioner::Jacobi(jacobi) => jacobi.bytes(),
            AnyPreconditioner::Ssor(ssor) => ssor.bytes(),
            AnyPreconditioner::IncompleteCholesky(ic) => ic.bytes(),
            AnyPreconditioner::TwoLevel(levels) => levels.bytes(),
        }
    }
}
