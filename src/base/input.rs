//! What a user can do wrong, said in one way: file, key, value found, what is allowed.

use std::fmt;

use crate::base::vec3::{Vec3, ZERO, is_finite};

/// An input that cannot be used. Found before any work starts.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}: `{key}` is {found}; {allowed}")]
pub struct InputError {
    /// The file, or the command line.
    pub file: String,
    pub key: String,
    pub found: String,
    /// What is allowed, and the way out where it is not obvious.
    pub allowed: String,
}

impl InputError {
    pub fn new(file: &str, key: &str, found: impl fmt::Display, allowed: impl fmt::Display) -> Self {
        InputError {
            file: file.to_string(),
            key: key.to_string(),
            found: found.to_string(),
            allowed: allowed.to_string(),
        }
    }

    /// The same error of a scene as an experiment changes it: there the user did not write `--set`.
    pub fn in_experiment(mut self, experiment: &str) -> Self {
        self.file = format!("experiment {experiment}, {}", self.file);
        if self.key == "--set" {
            self.key = "a change to the scene".to_string();
        }
        self
    }
}

/// Checks the values of one file.
#[derive(Debug, Clone, Copy)]
pub struct Check<'a> {
    pub file: &'a str,
}

impl Check<'_> {
    /// A finite number above zero.
    pub fn positive(self, key: &str, value: f64) -> Result<(), InputError> {
        self.require(value.is_finite() && value > 0.0, key, value, "allowed are finite numbers above 0")
    }

    /// A finite number, zero or above.
    pub fn not_negative(self, key: &str, value: f64) -> Result<(), InputError> {
        self.require(value.is_finite() && value >= 0.0, key, value, "allowed are finite numbers from 0 up")
    }

    /// A finite number.
    pub fn finite(self, key: &str, value: f64) -> Result<(), InputError> {
        self.require(value.is_finite(), key, value, "allowed are finite numbers")
    }

    /// Three finite numbers.
    pub fn finite_vector(self, key: &str, value: Vec3) -> Result<(), InputError> {
        self.require(is_finite(value), key, format!("{value:?}"), "allowed are three finite numbers")
    }

    /// Three finite numbers that are not all zero.
    pub fn direction(self, key: &str, value: Vec3) -> Result<(), InputError> {
        let allowed = "allowed are three finite numbers that are not all zero";
        self.require(is_finite(value) && value != ZERO, key, format!("{value:?}"), allowed)
    }

    pub fn require(
        self,
        holds: bool,
        key: &str,
        found: impl fmt::Display,
        allowed: impl fmt::Display,
    ) -> Result<(), InputError> {
        if holds { Ok(()) } else { Err(InputError::new(self.file, key, found, allowed)) }
    }
}
