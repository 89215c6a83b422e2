//! Peaks: the most that this machine moves and computes in a second, for roofs above what phases reach.
//!
//! Each thread reads an array of its own, or computes the triad on three, of a size that caches hold or do not, and
//! multiplies and adds in registers. What counts is wall time from the start of the first thread to the end of the last.

mod kernels;
mod measure;
mod plan;
mod rate;

use anyhow::{Result, ensure};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};

pub use measure::measure;
pub use plan::{SUBJECT, round, thread_counts};

/// How long a mode measures peaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PeaksMeasurement {
    /// Times of each loop, whose median is the peak.
    pub repetitions: usize,
    /// How long one of them takes at least, milliseconds.
    pub repetition_ms: usize,
}

/// What a child process is asked to do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PeaksRequest {
    pub threads: usize,
    pub pin: String,
    pub measurement: PeaksMeasurement,
}

/// What a machine reached on a number of threads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Peaks {
    /// The threads that really ran.
    pub threads: usize,
    /// The instructions that the loops were compiled for: `portable`, `avx2+fma` or `avx512f`.
    pub instructions: String,
    pub repetitions: usize,
    pub peaks: Vec<Peak>,
}

/// One peak, over all threads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Peak {
    pub kind: PeakKind,
    /// What each thread goes through again and again; 0 where it stays in registers.
    pub working_set_bytes: u64,
    /// Bytes or floating-point operations a second: the median of the repetitions.
    pub median_per_s: f64,
    pub lowest_per_s: f64,
    pub highest_per_s: f64,
}

/// What was done as fast as possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PeakKind {
    /// The sum of an array.
    Read,
    /// `a = b + s c`, counted as two arrays read and one written: what a cache reads before it writes is not counted.
    Triad,
    /// A product and a sum a lane, fused where the processor fuses them; each counts.
    MultiplyAdd,
}

impl PeakKind {
    pub fn name(self) -> &'static str {
        match self {
            PeakKind::Read => "read",
            PeakKind::Triad => "triad",
            PeakKind::MultiplyAdd => "multiply_add",
        }
    }

    /// The unit of a billion of what is counted a second.
    pub fn unit(self) -> &'static str {
        match self {
            PeakKind::Read | PeakKind::Triad => "GB/s",
            PeakKind::MultiplyAdd => "GFLOP/s",
        }
    }
}

impl PeaksMeasurement {
    /// What `repro machine --peaks` does.
    pub const USUAL: PeaksMeasurement = PeaksMeasurement { repetitions: 11, repetition_ms: 20 };

    pub fn check(self, check: Check<'_>, mode: &str) -> Result<(), InputError> {
        for (name, value) in [("repetitions", self.repetitions), ("repetition_ms", self.repetition_ms)] {
            let key = format!("mode.{mode}.peaks.{name}");
            check.require((1..=10_000).contains(&value), &key, value, "allowed are 1 to 10000")?;
        }
        Ok(())
    }

    /// About how long all loops take on one number of threads, seconds.
    fn estimate_s(self) -> f64 {
        let loops = (2 * measure::WORKING_SETS_BYTES.len() + 1) as f64;
        0.3 + loops * (self.repetitions + 3) as f64 * 1.2e-3 * self.repetition_ms as f64
    }
}

impl Peaks {
    /// Refuses numbers that no clock can have given.
    pub fn check(&self) -> Result<()> {
        ensure!(self.threads > 0 && self.repetitions > 0, "peaks of nothing cannot be");
        ensure!(!self.peaks.is_empty(), "no peak was measured");
        for peak in &self.peaks {
            let Peak { median_per_s, lowest_per_s, highest_per_s, .. } = *peak;
            let ordered = lowest_per_s <= median_per_s && median_per_s <= highest_per_s;
            let numbers = lowest_per_s > 0.0 && highest_per_s.is_finite();
            ensure!(ordered && numbers, "{}: {peak:?} cannot be", peak.kind.name());
        }
        Ok(())
    }

    /// How fast numbers in registers are multiplied and added.
    pub fn computing(&self) -> Option<&Peak> {
        self.peaks.iter().find(|peak| peak.kind == PeakKind::MultiplyAdd)
    }

    /// How fast arrays are read, the smallest first.
    pub fn reading(&self) -> Vec<&Peak> {
        let mut reading: Vec<&Peak> = self.peaks.iter().filter(|peak| peak.kind == PeakKind::Read).collect();
        reading.sort_by_key(|peak| peak.working_set_bytes);
        reading
    }

    /// The rate of that kind with the working set nearest to `bytes`, in the unit of the kind a second.
    pub fn nearest(&self, kind: PeakKind, bytes: u64) -> Option<&Peak> {
        let of_kind = self.peaks.iter().filter(|peak| peak.kind == kind);
        of_kind.min_by_key(|peak| peak.working_set_bytes.abs_diff(bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peak(kind: PeakKind, working_set_bytes: u64, median_per_s: f64) -> Peak {
        Peak { kind, working_set_bytes, median_per_s, lowest_per_s: 1.0, highest_per_s: 9.0 }
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let good = Peaks {
            threads: 1,
            instructions: "portable".to_string(),
            repetitions: 3,
            peaks: vec![peak(PeakKind::Read, 64, 3.0), peak(PeakKind::Read, 8, 2.0)],
        };
        good.check().unwrap();
        assert_eq!(good.nearest(PeakKind::Read, 60).unwrap().median_per_s, 3.0);
        assert_eq!(good.nearest(PeakKind::Triad, 60), None);
        assert_eq!(good.reading().iter().map(|peak| peak.working_set_bytes).collect::<Vec<_>>(), [8, 64]);
        assert_eq!(good.computing(), None);
        let mut bad = good.clone();
        bad.peaks[0].median_per_s = f64::NAN;
        assert!(bad.check().is_err());
        bad.peaks.clear();
        assert!(bad.check().is_err());
        assert!(Peaks { threads: 0, ..good }.check().is_err());
    }
}
