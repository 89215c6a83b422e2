//! How far a simulation is, for who waits for it: a line that is drawn anew on a terminal, a line now and then elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};

use crate::engine::diagnostics::FlowState;
use crate::engine::particles::{Kind, Particles};
use crate::engine::simulation::StepReport;

/// Time between two lines: on a terminal, and elsewhere.
const REDRAWN: Duration = Duration::from_millis(200);
const PRINTED: Duration = Duration::from_secs(10);

#[derive(Debug)]
pub struct Progress {
    steps: usize,
    particle_distance_m: f64,
    began: Instant,
    shown: Instant,
    how: How,
}

#[derive(Debug)]
enum How {
    Drawn(ProgressBar),
    Printed,
    Quiet,
}

/// What the line says about a step.
#[derive(Debug)]
struct Line<'a> {
    report: &'a StepReport,
    steps: usize,
    time_s: f64,
    time_step_s: f64,
    /// `u_max dt / l0`, dimensionless.
    courant: f64,
    particles: usize,
    left: Duration,
}

impl Progress {
    pub fn new(steps: usize, particle_distance_m: f64, quiet: bool) -> Progress {
        let how = match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => How::Quiet,
            (false, true) => {
                let style = ProgressStyle::with_template("{bar:24} {msg}").expect("the template is valid");
                How::Drawn(ProgressBar::new(steps as u64).with_style(style))
            }
            (false, false) => How::Printed,
        };
        let now = Instant::now();
        Progress { steps, particle_distance_m, began: now, shown: now, how }
    }

    /// After a step. What costs time is computed only where a line is due.
    pub fn step(&mut self, report: &StepReport, (time_s, time_step_s): (f64, f64), particles: &Particles) {
        let pause = match self.how {
            How::Drawn(_) => REDRAWN,
            How::Printed => PRINTED,
            How::Quiet => return,
        };
        if self.shown.elapsed() < pause {
            return;
        }
        self.shown = Instant::now();
        let line = Line {
            report,
            steps: self.steps,
            time_s,
            time_step_s,
            courant: FlowState::of(particles).max_speed_m_s * time_step_s / self.particle_distance_m,
            particles: particles.len() - particles.count(Kind::Ghost),
            left: left(self.began.elapsed(), report.step, self.steps),
        };
        match &self.how {
            How::Drawn(bar) => {
                bar.set_position(report.step as u64);
                bar.set_message(line.text());
            }
            How::Printed => eprintln!("{}", line.text()),
            How::Quiet => {}
        }
    }

    /// Leaves the terminal as it was.
    pub fn finish(self) {
        if let How::Drawn(bar) = self.how {
            bar.finish_and_clear();
        }
    }
}

/// The time that the steps to come take if each takes as long as those so far.
fn left(elapsed: Duration, done: usize, steps: usize) -> Duration {
    elapsed.mul_f64(steps.saturating_sub(done) as f64 / done.max(1) as f64)
}

impl Line<'_> {
    fn text(&self) -> String {
        let Line { report, steps, time_s, time_step_s, courant, particles, left } = self;
        let solve = report.pressure.map_or(String::new(), |solve| format!(", CG {}", solve.cg.iterations));
        format!(
            "step {}/{steps}, t {time_s:.4} s, dt {time_step_s:.1e} s, Courant {courant:.3}{solve}, {particles} particles, \
             {} left",
            report.step,
            HumanDuration(*left)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_where_the_simulation_is() {
        let report = StepReport { step: 25, ghosts: 1, pressure: None };
        let left = left(Duration::from_secs(50), 25, 100);
        assert_eq!(left, Duration::from_secs(150));
        let line = Line {
            report: &report,
            steps: 100,
            time_s: 0.075,
            time_step_s: 0.003,
            courant: 0.125,
            particles: 12,
            left,
        };
        let expected = "step 25/100, t 0.0750 s, dt 3.0e-3 s, Courant 0.125, 12 particles, 3 minutes left";
        assert_eq!(line.text(), expected);
    }
}
