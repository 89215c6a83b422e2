//! The course of the front.

use crate::experiment::record::FrontSample;

/// The front is recorded at this many equal parts of the run.
const FRONT_SAMPLES: usize = 10;

/// The front at equal parts of the run, interpolated between steps.
pub struct FrontWatch {
    end_s: f64,
    before: Option<FrontSample>,
    pub samples: Vec<FrontSample>,
}

impl FrontWatch {
    pub fn new(end_s: f64) -> Self {
        FrontWatch { end_s, before: None, samples: Vec::new() }
    }

    pub fn look(&mut self, time_s: f64, front_p99_m: f64) {
        let now = FrontSample { time_s, front_p99_m };
        let before = self.before.unwrap_or(now);
        loop {
            let due_s = self.end_s * (self.samples.len() + 1) as f64 / FRONT_SAMPLES as f64;
            // Rounding may put the last step a hair before the end.
            if self.samples.len() == FRONT_SAMPLES || due_s > time_s + 1e-9 * self.end_s {
                break;
            }
            let span = now.time_s - before.time_s;
            let share = if span > 0.0 { ((due_s - before.time_s) / span).clamp(0.0, 1.0) } else { 1.0 };
            let front_p99_m = before.front_p99_m + share * (now.front_p99_m - before.front_p99_m);
            self.samples.push(FrontSample { time_s: due_s, front_p99_m });
        }
        self.before = Some(now);
    }
}
