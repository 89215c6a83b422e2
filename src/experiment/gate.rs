//! The gate: whether a machine is quiet enough to go on measuring.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Result;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::experiment::interrupt;
use crate::experiment::machine::Noise;

/// How much else may go on when a round begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gate {
    /// Most percent of the last ten seconds in which some thread waited for a processor. Where the kernel does not tell,
    /// the gate is open.
    pub cpu_pressure_max: f64,
    pub on_violation: OnViolation,
    /// Most seconds to wait, where waiting is asked for; after them the round begins with a warning.
    #[serde(default = "a_minute")]
    pub wait_s: f64,
}

/// What to do about a machine that is busy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum OnViolation {
    /// Measure all the same, and say so.
    Warn,
    /// Wait until it is quiet.
    Wait,
    /// End the run; it goes on when it is started again.
    Refuse,
}

fn a_minute() -> f64 {
    60.0
}

/// The machine is not fit for what was asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the machine is refused: {0}")]
pub struct MachineRefused(pub String);

impl Gate {
    pub(super) fn check(&self, check: Check<'_>) -> Result<(), InputError> {
        let percent = self.cpu_pressure_max;
        let allowed = "allowed are 0 to 100 percent";
        check.require((0.0..=100.0).contains(&percent), "gate.cpu_pressure_max", percent, allowed)?;
        let hour = (0.0..=3600.0).contains(&self.wait_s);
        check.require(hour, "gate.wait_s", self.wait_s, "allowed are 0 to 3600 seconds")
    }

    /// Passes once the machine is quiet enough; returns a warning where it is not but may go on.
    pub fn pass(&self, pressure: impl Fn() -> Option<f64>) -> Result<Option<String>> {
        let began = Instant::now();
        loop {
            let Some(found) = pressure().filter(|&found| found > self.cpu_pressure_max) else {
                return Ok(None);
            };
            let busy = format!(
                "threads waited for a processor in {found:.1} % of the last ten seconds; the gate allows {} %",
                self.cpu_pressure_max
            );
            match self.on_violation {
                OnViolation::Refuse => return Err(MachineRefused(busy).into()),
                OnViolation::Wait if began.elapsed().as_secs_f64() < self.wait_s => {
                    interrupt::check()?;
                    std::thread::sleep(Duration::from_millis(500));
                }
                OnViolation::Warn | OnViolation::Wait => return Ok(Some(busy)),
            }
        }
    }
}

/// Percent of the last ten seconds in which some thread waited for a processor, where the kernel tells.
pub fn cpu_pressure() -> Option<f64> {
    Noise::sample(Path::new("/")).cpu_pressure_avg10
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    fn gate(on_violation: OnViolation) -> Gate {
        Gate { cpu_pressure_max: 5.0, on_violation, wait_s: 30.0 }
    }

    #[test]
    fn a_quiet_or_silent_machine_passes() {
        for pressure in [None, Some(0.0), Some(5.0)] {
            assert_eq!(gate(OnViolation::Refuse).pass(|| pressure).unwrap(), None);
        }
    }

    #[test]
    fn a_busy_machine_is_warned_about_refused_or_waited_for() {
        assert!(gate(OnViolation::Warn).pass(|| Some(40.0)).unwrap().unwrap().contains("40.0 %"));
        let error = gate(OnViolation::Refuse).pass(|| Some(40.0)).unwrap_err();
        assert!(error.is::<MachineRefused>());
        let calls = Cell::new(0);
        let calming = || {
            calls.set(calls.get() + 1);
            Some(if calls.get() < 3 { 40.0 } else { 1.0 })
        };
        assert_eq!(gate(OnViolation::Wait).pass(calming).unwrap(), None);
        assert_eq!(calls.get(), 3);
        let impatient = Gate { wait_s: 0.0, ..gate(OnViolation::Wait) };
        assert!(impatient.pass(|| Some(40.0)).unwrap().is_some());
    }
}
