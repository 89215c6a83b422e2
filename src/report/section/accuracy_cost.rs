//! Accuracy against time: every run of a sweep, the runs that none beats, and what halving the error costs.

use anyhow::Result;

use crate::base::statistics::Estimate;
use crate::experiment::quantity::Quantity;
use crate::experiment::record::{FrontSample, Observation};
use crate::experiment::sweep::{ErrorOf, Knob, Setting, Sweep};
use crate::report::chart::{Band, Figure, Line, Marker, Panel, Point, Scale, Series, XyPanel};
use crate::report::measured::Measured;
use crate::report::measured_front::MeasuredFront;
use crate::report::section::{Content, automatic, point};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show};
use crate::report::work_precision::{exponent, pareto};

const ID: &str = "accuracy-cost";
/// A setting that changes the error by less than this factor does not change it.
const LEAST_CHANGE: f64 = 1.05;

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    let sweeps = measured.experiment(ID).map(|e| e.sweep.as_slice()).unwrap_or_default();
    let mode = measured.info.mode;
    let judged: Vec<Judged<'_>> =
        sweeps.iter().filter(|s| s.modes.contains(&mode)).map(|s| Judged::new(measured, s)).collect();
    let front = judged.iter().find(|judged| judged.sweep.error == ErrorOf::Front);
    let measured_front = MeasuredFront::load();
    let mut findings: Vec<String> = judged.iter().flat_map(Judged::findings).collect();
    findings.extend(front.and_then(|judged| judged.against(&measured_front)));
    let mut figures = vec![("accuracy-cost".to_string(), figure(measured, &judged, &measured_front))];
    figures
        .extend(front.map(|judged| ("front".to_string(), front_figure(measured, judged, &measured_front))));
    Ok(Content {
        findings,
        figures,
        tables: judged.iter().map(Judged::table).collect(),
        ..Content::default()
    })
}

/// A sweep with the error and the time of each of its runs.
struct Judged<'a> {
    sweep: &'a Sweep,
    runs: Vec<Run<'a>>,
}

struct Run<'a> {
    setting: Setting,
    observation: &'a Observation,
    time_s: Estimate,
    /// `None` for a run that broke down.
    error: Option<f64>,
}

impl<'a> Judged<'a> {
    fn new(measured: &'a Measured, sweep: &'a Sweep) -> Self {
        let settings = sweep.settings();
        let first = |setting: &Setting| measured.observations(ID, &setting.run_id).into_iter().next();
        let reference = settings.iter().find(|s| s.is_reference).and_then(first);
        let run = |setting: Setting| {
            let observations = measured.observations(ID, &setting.run_id);
            let times: Vec<f64> = observations.iter().map(|o| o.stepping_s).collect();
            let observation = *observations.first()?;
            let completed = observation.ended == Observation::COMPLETED;
            let error = completed.then(|| error_of(sweep.error, observation, reference)).flatten();
            Some(Run { time_s: Estimate::of_times(&times)?, error, observation, setting })
        };
        Judged { sweep, runs: settings.into_iter().filter_map(run).collect() }
    }

    /// The runs with an error, the reference left out: it has none.
    fn points(&self) -> impl Iterator<Item = (&Run<'a>, f64, f64)> {
        let judged = self.runs.iter().filter(|run| !run.setting.is_reference);
        judged.filter_map(|run| Some((run, run.time_s.median, run.error.filter(|error| *error > 0.0)?)))
    }

    /// Time and error of the runs that no other run beats in both, the fastest first.
    fn pareto(&self) -> Vec<(f64, f64)> {
        pareto(self.points().map(|(_, time, error)| (time, error)).collect())
    }

    fn findings(&self) -> Vec<String> {
        let mut findings = Vec::new();
        let (title, front) = (&self.sweep.title, self.pareto());
        if let (Some(exponent), Some(first), Some(last)) = (exponent(&front), front.first(), front.last()) {
            findings.push(format!(
                "{title}: along the {} runs that none beats, from an error of {} in {:.2} s to {} in {:.2} s, halving \
                 the error costs {:.1} times the time (time grows as error to the power -{exponent:.1}).",
                front.len(),
                percent(first.1),
                first.0,
                percent(last.1),
                last.0,
                2f64.powf(exponent)
            ));
        }
        let knobs = [Knob::ParticleDistance, Knob::TimeStep, Knob::CgTolerance];
        let mut alone: Vec<(f64, String)> = knobs.into_iter().filter_map(|knob| self.alone(knob)).collect();
        alone.sort_by(|a, b| a.0.total_cmp(&b.0));
        let texts: Vec<&str> = alone.iter().map(|(_, text)| text.as_str()).collect();
        if !texts.is_empty() {
            let texts = texts.join("; ");
            findings
                .push(format!("{title}, one setting at a time, where accuracy is cheapest first: {texts}."));
        }
        findings.extend(self.loosest_tolerance());
        findings.extend(self.reference_error());
        let broken = self.runs.iter().filter(|run| run.observation.ended != Observation::COMPLETED).count();
        if broken > 0 {
            let all = self.runs.len();
            findings
                .push(format!("{title}: {broken} of {all} settings broke down; they are rows of the table."));
        }
        findings
    }

    /// What one setting alone buys, and its price: the power of the error that time grows with, for the order, and a text.
    fn alone(&self, knob: Knob) -> Option<(f64, String)> {
        let of_knob = || self.points().filter(|(run, ..)| [knob, Knob::Baseline].contains(&run.setting.knob));
        let best = of_knob().min_by(|a, b| a.2.total_cmp(&b.2))?;
        let worst = of_knob().max_by(|a, b| a.2.total_cmp(&b.2))?;
        let power = (best.1 / worst.1).ln() / (worst.2 / best.2).ln();
        let moves = worst.2 / best.2 >= LEAST_CHANGE;
        let price = match (moves, power > 0.0) {
            (false, _) => "the error hardly moves".to_string(),
            (true, false) => "better and no slower".to_string(),
            (true, true) => {
                format!("halving the error by it alone costs {:.1} times the time", 2f64.powf(power))
            }
        };
        let text = format!(
            "{} from {} to {}: error from {} to {}, time from {:.2} to {:.2} s ({price})",
            knob_name(knob),
            knob_value(knob, worst.0),
            knob_value(knob, best.0),
            percent(worst.2),
            percent(best.2),
            worst.1,
            best.1
        );
        Some((if moves { power } else { f64::INFINITY }, text))
    }

    /// How far the finest run is from the next finest: the reference's own error is of that size.
    fn reference_error(&self) -> Option<String> {
        self.runs.iter().find(|run| run.setting.is_reference)?;
        let distance = |run: &Run<'_>| run.setting.settings.particle_distance_m;
        let next =
            self.points().min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)).then(a.2.total_cmp(&b.2)))?;
        Some(format!(
            "{}: the next finest run, at {} m, differs from the finest by {}; errors of that size and below mean little.",
            self.sweep.title,
            distance(next.0),
            percent(next.2)
        ))
    }

    /// The loosest tolerance that loses less than a tenth of the error at the tightest.
    fn loosest_tolerance(&self) -> Option<String> {
        let of_knob = || {
            self.points().filter(|(run, ..)| [Knob::CgTolerance, Knob::Baseline].contains(&run.setting.knob))
        };
        let tolerance = |run: &Run<'_>| run.setting.settings.cg_tolerance;
        let tightest = of_knob().min_by(|a, b| tolerance(a.0).total_cmp(&tolerance(b.0)))?;
        let same = |error: f64| (error / tightest.2 - 1.0).abs() <= 0.1;
        let loosest = of_knob()
            .filter(|(run, _, error)| {
                let tighter = of_knob().filter(|other| tolerance(other.0) <= tolerance(run));
                same(*error) && tighter.into_iter().all(|other| same(other.2))
            })
            .max_by(|a, b| tolerance(a.0).total_cmp(&tolerance(b.0)))?;
        Some(format!(
            "{}: from a tolerance of {:e} on, the error stays within a tenth of that at {:e}, in {:.2} instead of {:.2} s.",
            self.sweep.title,
            tolerance(loosest.0),
            tolerance(tightest.0),
            loosest.1,
            tightest.1
        ))
    }

    /// The finest run's front beside the measured one.
    fn against(&self, measured: &MeasuredFront) -> Option<String> {
        let reference = self.runs.iter().find(|run| run.setting.is_reference)?;
        let ours = measured.scaled(&reference.observation.front);
        let (rms, count) = measured.difference(&ours, 0.0)?;
        let (shift, (shifted, _)) = measured.best_shift(&ours)?;
        let below = self.points().filter(|(.., error)| *error < measured.scatter).count();
        Some(format!(
            "The finest run's front differs from Martin and Moyce's by {} (root mean square over {count} of their points), by \
             {} after the best shift of our time, {shift:+.2} of their units. Experiments scatter by some {}: {below} of the {} runs differ from the finest by less, and the \
             experiment ranks none of those.",
            percent(rms),
            percent(shifted),
            percent(measured.scatter),
            self.points().count()
        ))
    }

    fn panel(&self, measured: &MeasuredFront) -> XyPanel {
        let mut series = Vec::new();
        for (knob, color, marker) in [
            (Knob::Several, 7, Marker::OpenCircle),
            (Knob::ParticleDistance, 5, Marker::Circle),
            (Knob::TimeStep, 6, Marker::Square),
            (Knob::CgTolerance, 3, Marker::Triangle),
            (Knob::Baseline, 0, Marker::Diamond),
        ] {
            let points: Vec<Point> =
                self.points().filter(|(run, ..)| run.setting.knob == knob).map(at_time_and_error).collect();
            let label = match knob {
                Knob::Baseline | Knob::Several => knob_name(knob).to_string(),
                _ => format!("{} alone", knob_name(knob)),
            };
            series.push(Series { label, color, line: Line::None, marker, points });
        }
        let bare = |(x, y): (f64, f64)| Point { x, y, low: None, high: None, label: None };
        series.push(Series {
            label: "no run is better in both".to_string(),
            color: 0,
            line: Line::Dashed,
            marker: Marker::None,
            points: self.pareto().into_iter().map(bare).collect(),
        });
        let least = self.points().map(|(.., error)| error).fold(measured.scatter, f64::min);
        let band = Band {
            label: format!("below the experiments' scatter of {}", percent(measured.scatter)),
            low: 0.7 * least,
            high: measured.scatter,
            color: 2,
        };
        XyPanel {
            title: self.sweep.title.clone(),
            x: automatic("time of the run (s)", Scale::Log10),
            y: automatic(error_name(self.sweep.error), Scale::Log10),
            series,
            marks: Vec::new(),
            bands: if self.sweep.error == ErrorOf::Front { vec![band] } else { Vec::new() },
        }
    }

    fn table(&self) -> TableView {
        let mut view = TableView::new(
            &format!("{}: every run, all cores; time is the median of its rounds.", self.sweep.title),
            &[
                "particle distance, m",
                "time step, s",
                "CG tolerance",
                "time, s",
                "error",
                "CG iterations",
                "run",
            ],
        );
        for run in &self.runs {
            let settings = run.setting.settings;
            let iterations = run.observation.quantities.get(&Quantity::CgIterations);
            view.rows.push(vec![
                settings.particle_distance_m.to_string(),
                settings.time_step_s.to_string(),
                format!("{:e}", settings.cg_tolerance),
                show(&run.time_s, 2),
                match run.error {
                    _ if run.setting.is_reference => "reference".to_string(),
                    error => error.map_or("none".to_string(), percent),
                },
                iterations.map_or("none".to_string(), |i| format!("{i:.1}")),
                run.observation.ended.clone(),
            ]);
        }
        view
    }
}

fn at_time_and_error((run, _, error): (&Run<'_>, f64, f64)) -> Point {
    let time = point(0.0, run.time_s);
    Point { x: time.y, y: error, low: None, high: None, label: None }
}

fn error_of(kind: ErrorOf, run: &Observation, reference: Option<&Observation>) -> Option<f64> {
    match kind {
        ErrorOf::PressureProfile => run.quantities.get(&Quantity::ProfileError).copied(),
        ErrorOf::Front => front_error(&run.front, &reference?.front),
    }
}

/// The root mean square of the front's relative difference over the recorded times.
fn front_error(front: &[FrontSample], reference: &[FrontSample]) -> Option<f64> {
    if front.is_empty() || front.len() != reference.len() {
        return None;
    }
    let square = |(a, b): (&FrontSample, &FrontSample)| (a.front_p99_m / b.front_p99_m - 1.0).powi(2);
    Some((front.iter().zip(reference).map(square).sum::<f64>() / front.len() as f64).sqrt())
}

fn knob_name(knob: Knob) -> &'static str {
    match knob {
        Knob::Baseline => "baseline",
        Knob::ParticleDistance => "particle distance",
        Knob::TimeStep => "time step",
        Knob::CgTolerance => "CG tolerance",
        Knob::Several => "all at random",
    }
}

fn knob_value(knob: Knob, run: &Run<'_>) -> String {
    let settings = run.setting.settings;
    match knob {
        Knob::ParticleDistance => format!("{} m", settings.particle_distance_m),
        Knob::TimeStep => format!("{} s", settings.time_step_s),
        Knob::CgTolerance | Knob::Baseline | Knob::Several => format!("{:e}", settings.cg_tolerance),
    }
}

fn error_name(error: ErrorOf) -> &'static str {
    match error {
        ErrorOf::PressureProfile => "error of the pressure profile",
        ErrorOf::Front => "error of the front",
    }
}

/// With digits behind the point only where there is something behind it.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if (percent - percent.round()).abs() < 1e-9 {
        format!("{percent:.0} %")
    } else {
        format!("{percent:.2} %")
    }
}

fn figure(measured: &Measured, judged: &[Judged<'_>], front: &MeasuredFront) -> Figure {
    Figure {
        title: "What accuracy costs".to_string(),
        description: "Error against time of whole runs on all cores, both logarithmic, with one setting varied at a \
                      time and with all varied at random. The broken line joins the runs that no other run beats in \
                      both error and time."
            .to_string(),
        panels: judged.iter().map(|judged| Panel::Xy(judged.panel(front))).collect(),
        note: measured.stamp(),
    }
}

fn front_figure(measured: &Measured, judged: &Judged<'_>, front: &MeasuredFront) -> Figure {
    let experiment = front.front.iter().map(|at| Point {
        x: at.T,
        y: at.Z,
        low: Some(at.Z * (1.0 - front.scatter)),
        high: Some(at.Z * (1.0 + front.scatter)),
        label: None,
    });
    let ours = |run: &Run<'_>, label: &str, color: usize, line: Line| Series {
        label: format!("{label}, {} m", run.setting.settings.particle_distance_m),
        color,
        line,
        marker: Marker::None,
        points: front
            .scaled(&run.observation.front)
            .into_iter()
            .map(|(x, y)| Point { x, y, low: None, high: None, label: None })
            .collect(),
    };
    let mut series = vec![Series {
        label: format!("Martin and Moyce 1952, with {}", percent(front.scatter)),
        color: 0,
        line: Line::None,
        marker: Marker::Circle,
        points: experiment.collect(),
    }];
    let find = |wanted: fn(&Setting) -> bool| judged.runs.iter().find(|run| wanted(&run.setting));
    series.extend(find(|s| s.knob == Knob::Baseline).map(|run| ours(run, "baseline", 6, Line::Dashed)));
    series.extend(find(|s| s.is_reference).map(|run| ours(run, "finest run", 5, Line::Solid)));
    Figure {
        title: "The front of the dam break and a measured one".to_string(),
        description: "Distance of the front from the column's back wall over the column's base, against dimensionless \
                      time: points as measured in 1952, with the scatter of such experiments; lines are ours, the 99th \
                      percentile of the fluid's positions."
            .to_string(),
        panels: vec![Panel::Xy(XyPanel {
            title: String::new(),
            x: automatic("T = t sqrt(2 g / a)", Scale::Linear),
            y: automatic("Z = front / a", Scale::Linear),
            series,
            marks: Vec::new(),
            bands: Vec::new(),
        })],
        note: measured.stamp(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_error_is_a_relative_root_mean_square() {
        let front = |scale: f64| -> Vec<FrontSample> {
            [1.0, 2.0].map(|t| FrontSample { time_s: t, front_p99_m: scale * t }).into()
        };
        assert!((front_error(&front(1.1), &front(1.0)).unwrap() - 0.1).abs() < 1e-12);
        assert_eq!(front_error(&front(1.0)[..1], &front(1.0)), None);
    }
}
