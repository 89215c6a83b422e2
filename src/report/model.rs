//! Models of scaling, fitted to what was measured and always labelled as models.

use crate::base::statistics::Estimate;
use crate::report::measured::ByRound;

/// Thread counts from which a model may be drawn beyond the measured ones.
pub const ENOUGH_THREAD_COUNTS: usize = 4;

/// The serial share `f` of Amdahl's law, `T(t) / T(1) = f + (1 - f) / t`, by least squares in each round; `times` holds
/// the thread counts with their times by round. `None` below [`ENOUGH_THREAD_COUNTS`] thread counts.
pub fn serial_share(times: &[(usize, ByRound)]) -> Option<Estimate> {
    if times.len() < ENOUGH_THREAD_COUNTS {
        return None;
    }
    let (_, one_thread) = times.iter().find(|(threads, _)| *threads == 1)?;
    let shares: Vec<f64> = one_thread
        .iter()
        .filter_map(|(round, one)| {
            let (mut above, mut below) = (0.0, 0.0);
            for (threads, by_round) in times {
                let parallel = 1.0 / *threads as f64;
                let relative = by_round.get(round)? / one;
                above += (relative - parallel) * (1.0 - parallel);
                below += (1.0 - parallel) * (1.0 - parallel);
            }
            Some(above / below)
        })
        .collect();
    Estimate::of_rounds(&shares)
}

/// `T(t) / T(1)` of Amdahl's law.
pub fn relative_time(serial_share: f64, threads: usize) -> f64 {
    serial_share + (1.0 - serial_share) / threads as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fit_gives_the_share_that_made_the_times() {
        let rounds = |threads: usize| -> ByRound {
            (0..9).map(|round| (round, (1.0 + round as f64) * relative_time(0.07, threads))).collect()
        };
        let times: Vec<_> = [1, 2, 4, 8].map(|t| (t, rounds(t))).to_vec();
        let share = serial_share(&times).unwrap();
        assert!((share.median - 0.07).abs() < 1e-12, "{share:?}");
        assert_eq!(share.samples, 9);
        assert_eq!(serial_share(&times[..3]), None);
    }
}
