//! The clock that listens to a step's phases.

use std::time::Instant;

use crate::engine::phase::{Phase, Probe};

/// Calls and seconds of one phase.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PhaseTime {
    pub calls: u64,
    pub time_s: f64,
}

/// Adds up the time of each phase. Two readings of a monotonic clock a phase: well below a microsecond.
#[derive(Debug, Clone)]
pub struct PhaseClock {
    times: [PhaseTime; Phase::ALL.len()],
    began: Instant,
}

impl Default for PhaseClock {
    fn default() -> Self {
        PhaseClock { times: Default::default(), began: Instant::now() }
    }
}

impl PhaseClock {
    /// The time of one phase so far.
    pub fn time(&self, phase: Phase) -> PhaseTime {
        self.times[phase as usize]
    }

    /// The phases that took place, in the order of a step.
    pub fn phases(&self) -> impl Iterator<Item = (Phase, PhaseTime)> + '_ {
        Phase::ALL.into_iter().map(|phase| (phase, self.time(phase))).filter(|(_, time)| time.calls > 0)
    }
}

impl Probe for PhaseClock {
    fn begin(&mut self, _: Phase) {
        self.began = Instant::now();
    }

    fn end(&mut self, phase: Phase) {
        let time = &mut self.times[phase as usize];
        time.calls += 1;
        time.time_s += self.began.elapsed().as_secs_f64();
    }
}
