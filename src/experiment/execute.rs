//! Runs the rounds that are missing, each trial in a fresh process.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use indicatif::{ProgressBar, ProgressStyle};

use crate::experiment::interrupt;
use crate::experiment::machine::without_paths;
use crate::experiment::plan::{Plan, PlannedExperiment, PlannedRound, PlannedTrial};
use crate::experiment::record::{Outcome, RoundRecord, SCHEMA, Stage, StateDigest, Status, TrialRecord};
use crate::experiment::run::now_utc;
use crate::experiment::trial::TrialRequest;

/// A trial that takes this many times its estimate, and at least [`LEAST_LIMIT`], is stopped.
const LIMIT_FACTOR: f64 = 8.0;
const LEAST_LIMIT: Duration = Duration::from_secs(120);

/// Digests of states, by the folder that holds the states of a scene, then by step.
type Known = BTreeMap<std::path::PathBuf, BTreeMap<usize, String>>;

/// Runs every round of `plan` that `folder` does not hold yet, in order.
pub fn execute(plan: &Plan, folder: &Path) -> Result<()> {
    let progress = progress_bar(plan);
    let mut known = Known::new();
    for round in &plan.rounds {
        let experiment = &plan.experiments[round.experiment];
        let path = RoundRecord::path(folder, &experiment.spec.id, round.stage, round.round);
        let record = if path.is_file() && states_are_there(round, experiment, folder) {
            let record = RoundRecord::read(&path)?;
            progress.inc(milliseconds(round.estimate_s()));
            progress.reset_eta();
            record
        } else {
            let record = run_round(round, experiment, folder, &mut known, &progress)?;
            require_states(round, &record)?;
            record.write(folder)?;
            record
        };
        remember(&record, experiment, folder, &mut known);
    }
    progress.finish_and_clear();
    Ok(())
}

/// A bar over the plan's estimate, on standard error and only where that is a terminal.
fn progress_bar(plan: &Plan) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {percent:>3} %, {eta} left  {msg}")
        .expect("the template is valid");
    ProgressBar::new(milliseconds(plan.estimate_s())).with_style(style)
}

fn milliseconds(seconds: f64) -> u64 {
    (seconds * 1e3) as u64
}

/// Whether a recorded round that left states still has them, if later rounds need any.
fn states_are_there(round: &PlannedRound, experiment: &PlannedExperiment, folder: &Path) -> bool {
    let saves = round.trials.iter().any(|trial| trial.saves_states);
    let states = experiment.states_folder(folder);
    let file = |step: usize| states.join(crate::scene::snapshot::file_name(step));
    !saves || state_steps(experiment).iter().all(|&step| file(step).is_file())
}

/// Without the states that one trial leaves, no later trial can start: its failure ends the run before it is recorded,
/// so that the same command tries again.
fn require_states(round: &PlannedRound, record: &RoundRecord) -> Result<()> {
    for (planned, trial) in round.trials.iter().zip(&record.trials) {
        ensure!(
            !planned.saves_states || trial.status == Status::Ok,
            "the whole run whose states later trials start from failed: {}",
            trial.reason
        );
    }
    Ok(())
}

/// The steps whose states windows start from.
fn state_steps(experiment: &PlannedExperiment) -> Vec<usize> {
    experiment.windows.iter().map(|w| w.start_step).filter(|&step| step > 0).collect()
}

/// Takes the digests of whole runs as known for everything that follows.
fn remember(record: &RoundRecord, experiment: &PlannedExperiment, folder: &Path, known: &mut Known) {
    let digests = known.entry(experiment.states_folder(folder)).or_default();
    let passed = record.trials.iter().filter_map(|trial| trial.outcome.as_ref()).flat_map(|o| &o.passed);
    for StateDigest { step, digest } in passed {
        digests.entry(*step).or_insert_with(|| digest.clone());
    }
}

fn run_round(
    round: &PlannedRound,
    experiment: &PlannedExperiment,
    folder: &Path,
    known: &mut Known,
    progress: &ProgressBar,
) -> Result<RoundRecord> {
    let mut record = RoundRecord {
        schema_version: SCHEMA,
        experiment: experiment.spec.id.clone(),
        stage: round.stage,
        round: round.round,
        trials: Vec::new(),
    };
    for (position, trial) in round.trials.iter().enumerate() {
        interrupt::check()?;
        let (id, stage, number) = (&experiment.spec.id, round.stage.name(), round.round + 1);
        progress.set_message(format!("{id}: {stage} round {number}, {} thread(s)", trial.threads));
        let request = request(trial, round.stage, experiment, folder, known);
        std::fs::create_dir_all(&request.states)
            .with_context(|| format!("cannot create {}", request.states.display()))?;
        let limit = LEAST_LIMIT.max(Duration::from_secs_f64(LIMIT_FACTOR * trial.estimate_s));
        let (started_utc, began, done) = (now_utc(), Instant::now(), progress.position());
        let expected = milliseconds(trial.estimate_s);
        let ending = run_child(&request, limit, |elapsed| {
            let share = (elapsed.as_millis() as u64).min(expected * 95 / 100);
            progress.set_position(done + share);
        })?;
        progress.set_position(done + expected);
        let (status, reason, outcome) = match ending {
            Ending::Outcome(outcome) => (Status::Ok, String::new(), Some(*outcome)),
            Ending::Failed(reason) => (Status::Failed, reason, None),
            Ending::Timeout => {
                let reason = format!("took longer than its limit of {:.0} s", limit.as_secs_f64());
                (Status::Timeout, reason, None)
            }
        };
        record.trials.push(TrialRecord {
            position,
            threads: trial.threads,
            variants: trial.variants.clone(),
            status,
            reason,
            started_utc,
            wall_s: began.elapsed().as_secs_f64(),
            outcome,
        });
        remember(&record, experiment, folder, known);
    }
    Ok(record)
}

fn request(
    trial: &PlannedTrial,
    stage: Stage,
    experiment: &PlannedExperiment,
    folder: &Path,
    known: &Known,
) -> TrialRequest {
    let states = experiment.states_folder(folder);
    let mut digests = experiment.known_digests();
    if let Some(found) = known.get(&states) {
        digests.extend(found.iter().map(|(&step, digest)| StateDigest { step, digest: digest.clone() }));
    }
    let mut name_at: Vec<usize> = match stage {
        Stage::Paired => Vec::new(),
        Stage::Whole | Stage::States => {
            experiment.windows.iter().map(|w| w.end_step()).chain([experiment.scene.steps()]).collect()
        }
    };
    name_at.sort_unstable();
    name_at.dedup();
    TrialRequest {
        scene: experiment.spec.scene.clone(),
        sets: experiment.sets.clone(),
        variants: trial.variants.clone(),
        threads: trial.threads,
        pin: experiment.spec.fixed.pin.clone(),
        windows: trial.windows.clone(),
        states,
        save_at: if trial.saves_states { state_steps(experiment) } else { Vec::new() },
        name_at,
        known: digests,
        seed: trial.seed,
    }
}

/// How a child ended.
enum Ending {
    Outcome(Box<Outcome>),
    Failed(String),
    Timeout,
}

/// Kills and reaps the child on every way out, so that nothing goes on computing beside the next trial.
struct Reaped(Child);

impl Drop for Reaped {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn run_child(request: &TrialRequest, limit: Duration, tick: impl Fn(Duration)) -> Result<Ending> {
    let program = std::env::current_exe().context("cannot find this program's own file")?;
    let child = Command::new(program)
        .arg("trial")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .context("cannot start a trial's process")?;
    let mut child = Reaped(child);
    let (mut input, mut output, mut errors) =
        match (child.0.stdin.take(), child.0.stdout.take(), child.0.stderr.take()) {
            (Some(input), Some(output), Some(errors)) => (input, output, errors),
            _ => anyhow::bail!("a trial's process has no pipes"),
        };
    let text = serde_json::to_vec(request)?;
    // A child that died before it read its request shows in its exit status.
    let _ = input.write_all(&text);
    drop(input);
    let (sender, receiver) = channel();
    let reader = std::thread::spawn(move || {
        let (mut answer, mut complaint) = (Vec::new(), String::new());
        let read = output.read_to_end(&mut answer).is_ok();
        let _ = errors.read_to_string(&mut complaint);
        let _ = sender.send((read, answer, complaint));
    });
    let began = Instant::now();
    let (read, answer, complaint) = loop {
        match receiver.recv_timeout(Duration::from_millis(500)) {
            Ok(result) => break result,
            Err(RecvTimeoutError::Disconnected) => anyhow::bail!("a trial's pipes broke"),
            Err(RecvTimeoutError::Timeout) => {
                interrupt::check()?;
                tick(began.elapsed());
                if began.elapsed() > limit {
                    return Ok(Ending::Timeout);
                }
            }
        }
    };
    let _ = reader.join();
    let status = child.0.wait().context("cannot wait for a trial's process")?;
    interrupt::check()?;
    if !status.success() || !read {
        return Ok(Ending::Failed(format!("{} ({status})", reason(&complaint))));
    }
    match serde_json::from_slice(&answer) {
        Ok(outcome) => Ok(Ending::Outcome(Box::new(outcome))),
        Err(error) => Ok(Ending::Failed(format!("its answer cannot be read: {error}"))),
    }
}

/// What a child that failed said about it: its own error, or else the message of its panic, without paths.
fn reason(complaint: &str) -> String {
    let mut lines = complaint.lines();
    let own = complaint.lines().find_map(|line| line.strip_prefix("repro: "));
    let panic = lines.find(|line| line.contains("panicked at")).and_then(|_| lines.next());
    without_paths(own.or(panic).unwrap_or("no reason given").trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_are_what_went_wrong_and_nothing_else() {
        let panic = "\nthread 'main' panicked at src/a.rs:1:2:\nindex out of bounds\nnote: run with ...\n";
        assert_eq!(reason(panic), "index out of bounds");
        assert_eq!(reason("warning: x\nrepro: step 3, phase cg: no\n"), "step 3, phase cg: no");
        assert!(!reason("repro: cannot read /home/someone/states/particles.csv").contains("someone"));
        assert_eq!(reason(""), "no reason given");
    }
}
