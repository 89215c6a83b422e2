//! The measuring: every loop on every thread at once.

use std::hint::black_box;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::Result;

use crate::base::dispatch::{Level, at_best};
use crate::base::parallel::Workers;
use crate::base::schedule::Schedule;
use crate::experiment::interrupt;
use crate::experiment::memory;
use crate::experiment::peaks::kernels::{MultiplyAdd, Read, Triad};
use crate::experiment::peaks::rate::{Rates, rates};
use crate::experiment::peaks::{Peak, PeakKind, Peaks, PeaksRequest};
use crate::experiment::pinning::pin_order;

/// What a thread goes through: from what its own caches hold to what hardly any cache does.
pub(super) const WORKING_SETS_BYTES: [usize; 5] = [256 << 10, 2 << 20, 8 << 20, 32 << 20, 128 << 20];
const BYTES_A_NUMBER: usize = size_of::<f64>();
/// Rounds of products and sums that count as one pass: enough that a pass is not all overhead.
const ROUNDS_A_PASS: usize = 1000;

/// Measures all peaks of one number of threads. Working sets for which there is no memory are left out.
pub fn measure(request: &PeaksRequest) -> Result<Peaks> {
    let workers = Workers::new(request.threads, Schedule::Static, &pin_order(&request.pin)?)?;
    let bench = Bench { workers: &workers, request };
    let mut peaks = vec![bench.multiply_add()?];
    for bytes in WORKING_SETS_BYTES {
        if fits(bytes, request.threads, memory::available_bytes()) {
            peaks.extend(bench.bandwidths(bytes)?);
        }
    }
    Ok(Peaks {
        threads: workers.threads(),
        instructions: Level::best().name().to_string(),
        repetitions: request.measurement.repetitions,
        peaks,
    })
}

/// Whether the arrays of all threads take no more than half of the memory that is there.
fn fits(bytes: usize, threads: usize, available: u64) -> bool {
    (bytes as u64).saturating_mul(threads as u64) <= available / 2
}

struct Bench<'a> {
    workers: &'a Workers,
    request: &'a PeaksRequest,
}

impl Bench<'_> {
    fn multiply_add(&self) -> Result<Peak> {
        let body = |_: usize, passes: usize| {
            let rounds = passes * ROUNDS_A_PASS;
            black_box(at_best(MultiplyAdd { factor: 0.999, summand: 1e-3, rounds }));
        };
        let operations = ROUNDS_A_PASS * MultiplyAdd::operations_a_round(Level::best());
        self.peak(PeakKind::MultiplyAdd, 0, operations, body)
    }

    /// Reading and triad on arrays that each thread makes itself, so that their pages lie near it.
    fn bandwidths(&self, bytes: usize) -> Result<[Peak; 2]> {
        let arrays: Vec<Mutex<Vec<f64>>> = (0..self.workers.threads()).map(|_| Mutex::default()).collect();
        let of_thread = |k: usize| arrays[k].lock().unwrap_or_else(PoisonError::into_inner);
        self.on_every_thread(|k| *of_thread(k) = vec![1.0; bytes / BYTES_A_NUMBER]);
        let read = |k: usize, passes: usize| {
            black_box(at_best(Read { array: &of_thread(k), passes }));
        };
        let reading = self.peak(PeakKind::Read, bytes, bytes, read)?;
        let part = bytes / BYTES_A_NUMBER / 3;
        let triad = |k: usize, passes: usize| {
            let mut array = of_thread(k);
            let (to, from) = array.split_at_mut(part);
            let (from, scaled) = from.split_at(part);
            at_best(Triad { to, from: [from, &scaled[..part]], factor: 0.5, passes });
        };
        Ok([reading, self.peak(PeakKind::Triad, bytes, 3 * part * BYTES_A_NUMBER, triad)?])
    }

    /// The rate at which all threads together do what counts `work` in a pass of each.
    fn peak(
        &self,
        kind: PeakKind,
        working_set_bytes: usize,
        work: usize,
        body: impl Fn(usize, usize) + Sync,
    ) -> Result<Peak> {
        interrupt::check()?;
        let measurement = self.request.measurement;
        let time = |passes: usize| {
            let began = Instant::now();
            self.on_every_thread(|k| body(k, passes));
            began.elapsed().as_secs_f64()
        };
        let work = (work * self.workers.threads()) as f64;
        let target_s = 1e-3 * measurement.repetition_ms as f64;
        let Rates { median, lowest, highest } = rates(work, target_s, measurement.repetitions, time)?;
        Ok(Peak {
            kind,
            working_set_bytes: working_set_bytes as u64,
            median_per_s: median,
            lowest_per_s: lowest,
            highest_per_s: highest,
        })
    }

    /// Calls `body` once on each thread, always with the same number on the same one.
    fn on_every_thread(&self, body: impl Fn(usize) + Sync) {
        self.workers.shared_evenly().run(self.workers.threads(), |range| range.for_each(&body));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::peaks::PeaksMeasurement;

    /// Nothing is said about how fast: only that every loop ran on every size, and gave a rate that can be.
    #[test]
    fn every_loop_has_a_rate() {
        let measurement = PeaksMeasurement { repetitions: 1, repetition_ms: 1 };
        let peaks = measure(&PeaksRequest { threads: 2, pin: "off".to_string(), measurement }).unwrap();
        peaks.check().unwrap();
        let count = |kind: PeakKind| peaks.peaks.iter().filter(|peak| peak.kind == kind).count();
        assert_eq!((peaks.threads, count(PeakKind::MultiplyAdd)), (2, 1));
        assert!(count(PeakKind::Read) >= 1 && count(PeakKind::Read) == count(PeakKind::Triad));
    }

    #[test]
    fn arrays_for_which_there_is_no_memory_are_left_out() {
        assert!(fits(1 << 20, 2, 4 << 20) && !fits(1 << 20, 3, 4 << 20) && !fits(usize::MAX, 2, u64::MAX));
    }
}
