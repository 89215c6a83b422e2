//! How far a simulation is, for who waits for it: a line that is drawn anew on a terminal, a line now and then elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};

use crate::engine::diagnostics::FlowState;
use crate::engine::particles::{Kind, Particles};
use crate::engine::simulation::StepReport;
use crate::scene::Scene;

/// The bar's length.
const PARTS: u64 = 1000;
/// Time between two lines: on a terminal, and elsewhere.
const REDRAWN: Duration = Duration::from_millis(200);
const PRINTED: Duration = Duration::from_secs(10);

#[derive(Debug)]
pub struct Progress {
    steps: Option<usize>,
    /// Where the simulation ends unless a number of steps was asked for.
    end_s: f64,
    particle_distance_m: f64,
    /// Step and time of the first report: where the simulation began, or a restart.
    first: Option<(usize, f64)>,
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
    /// `u_max dt / l0`, dimensionless.
    courant: f64,
    particles: usize,
    left: Duration,
}

impl Progress {
    /// `steps` are those asked for, if any were.
    pub fn new(scene: &Scene, steps: Option<usize>, quiet: bool) -> Progress {
        let how = match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => How::Quiet,
            (false, true) => {
                let style = ProgressStyle::with_template("{bar:24} {msg}").expect("the template is valid");
                How::Drawn(ProgressBar::new(PARTS).with_style(style))
            }
            (false, false) => How::Printed,
        };
        let now = Instant::now();
        let (end_s, particle_distance_m) = (scene.end_time_s, scene.particle_distance_m);
        Progress { steps, end_s, particle_distance_m, first: None, began: now, shown: now, how }
    }

    /// After a step. What costs time is computed only where a line is due.
    pub fn step(&mut self, report: &StepReport, particles: &Particles) {
        let first = *self.first.get_or_insert((report.step - 1, report.time_s - report.time_step_s));
        let pause = match self.how {
            How::Drawn(_) => REDRAWN,
            How::Printed => PRINTED,
            How::Quiet => return,
        };
        if self.shown.elapsed() < pause {
            return;
        }
        self.shown = Instant::now();
        let share = match self.steps {
            Some(steps) => (report.step - first.0) as f64 / steps as f64,
            None => (report.time_s - first.1) / (self.end_s - first.1),
        };
        let line = Line {
            report,
            courant: FlowState::of(particles).max_speed_m_s * report.time_step_s / self.particle_distance_m,
            particles: particles.len() - particles.count(Kind::Ghost),
            left: left(self.began.elapsed(), share),
        };
        match &self.how {
            How::Drawn(bar) => {
                bar.set_position((share * PARTS as f64) as u64);
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

/// The time that the rest takes if it takes as long as the share that is done.
fn left(elapsed: Duration, share: f64) -> Duration {
    Duration::try_from_secs_f64(elapsed.as_secs_f64() * (1.0 - share).max(0.0) / share)
        .unwrap_or(Duration::MAX)
}

impl Line<'_> {
    fn text(&self) -> String {
        let Line { report, courant, particles, left } = self;
        let StepReport { step, time_s, time_step_s, .. } = report;
        let solve = report.pressure.map_or(String::new(), |solve| format!(", CG {}", solve.cg.iterations));
        format!(
            "step {step}, t {time_s:.4} s, dt {time_step_s:.1e} s, Courant {courant:.3}{solve}, {particles} particles, \
             {} left",
            HumanDuration(*left)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_where_the_simulation_is() {
        let report = StepReport { step: 25, time_s: 0.075, time_step_s: 0.003, ..StepReport::default() };
        let left = left(Duration::from_secs(50), 0.25);
        assert_eq!(left, Duration::from_secs(150));
        let line = Line { report: &report, courant: 0.125, particles: 12, left };
        let expected = "step 25, t 0.0750 s, dt 3.0e-3 s, Courant 0.125, 12 particles, 3 minutes left";
        assert_eq!(line.text(), expected);
    }
}
