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
use crate::experiment::observe::ObserveRequest;
use crate::experiment::plan::{Plan, PlannedRound, PlannedTrial, TimedWork, Work};
use crate::experiment::record::{RoundRecord, SCHEMA, Stage, StateDigest, Status, TrialRecord};
use crate::experiment::run::now_utc;
use crate::experiment::states::States;
use crate::experiment::trial::{TimedRequest, TrialRequest};
use crate::experiment::twin::outcome::{TwinAnswer, require_the_sums_of_rust};
use crate::experiment::twin::prepare::prepare;
use crate::experiment::twin::toolchain::Toolchain;

/// A trial that takes this many times its estimate, and at least [`LEAST_LIMIT`], is stopped.
const LIMIT_FACTOR: f64 = 8.0;
const LEAST_LIMIT: Duration = Duration::from_secs(120);

/// Runs every round of `plan` that `folder` does not hold yet, in order.
pub fn execute(plan: &Plan, folder: &Path) -> Result<()> {
    let mut execution = Execution {
        plan,
        folder,
        progress: progress_bar(plan),
        known: plan.states.iter().map(|_| BTreeMap::new()).collect(),
        toolchain: Toolchain::default(),
    };
    for round in &plan.rounds {
        execution.complete(round)?;
    }
    execution.progress.finish_and_clear();
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

/// A plan on its way.
struct Execution<'a> {
    plan: &'a Plan,
    folder: &'a Path,
    progress: ProgressBar,
    /// Digests by step, for each of the plan's states.
    known: Vec<BTreeMap<usize, String>>,
    /// The twin's programs in C.
    toolchain: Toolchain,
}

impl Execution<'_> {
    /// Runs a round unless it is recorded already.
    fn complete(&mut self, round: &PlannedRound) -> Result<()> {
        let id = &self.plan.experiments[round.experiment].spec.id;
        let path = RoundRecord::path(self.folder, id, round.stage, round.round);
        if path.is_file() && self.states_are_there(round) {
            let record = RoundRecord::read(&path)?;
            for (planned, trial) in round.trials.iter().zip(&record.trials) {
                self.remember(planned, trial, round);
            }
            self.progress.inc(milliseconds(round.estimate_s()));
            self.progress.reset_eta();
            return Ok(());
        }
        let record = self.run_round(round)?;
        require_states(round, &record)?;
        record.write(self.folder)
    }

    /// The states that a timed trial starts from or leaves.
    fn states_of(&self, timed: &TimedWork, round: &PlannedRound) -> (usize, &States) {
        let place = self.plan.experiments[round.experiment].groups[timed.group].states;
        (place, &self.plan.states[place])
    }

    /// Whether a recorded round that left states still has them.
    fn states_are_there(&self, round: &PlannedRound) -> bool {
        round.trials.iter().all(|trial| match &trial.work {
            Work::Timed(timed) if timed.saves_states => self.states_of(timed, round).1.are_in(self.folder),
            _ => true,
        })
    }

    /// Takes the digests of whole runs as known for everything that follows, if they are of the states' own answer.
    fn remember(&mut self, planned: &PlannedTrial, trial: &TrialRecord, round: &PlannedRound) {
        let Work::Timed(timed) = &planned.work else {
            return;
        };
        let (place, states) = self.states_of(timed, round);
        if !timed.variants.iter().all(|variant| variant.has_answer_of(&states.variant())) {
            return;
        }
        for StateDigest { step, digest } in trial.outcome.iter().flat_map(|outcome| &outcome.passed) {
            self.known[place].entry(*step).or_insert_with(|| digest.clone());
        }
    }

    fn run_round(&mut self, round: &PlannedRound) -> Result<RoundRecord> {
        let experiment = &self.plan.experiments[round.experiment];
        let (id, stage, number) = (&experiment.spec.id, round.stage.name(), round.round + 1);
        let mut trials = Vec::new();
        for (position, planned) in round.trials.iter().enumerate() {
            interrupt::check()?;
            let message = format!("{id}: {stage} round {number}, {} thread(s)", planned.threads);
            self.progress.set_message(message);
            let trial = self.run_trial(planned, round, position)?;
            self.remember(planned, &trial, round);
            trials.push(trial);
        }
        require_the_sums_of_rust(&mut trials);
        Ok(RoundRecord {
            schema_version: SCHEMA,
            experiment: id.clone(),
            stage: round.stage,
            round: round.round,
            trials,
        })
    }

    fn run_trial(
        &self,
        planned: &PlannedTrial,
        round: &PlannedRound,
        position: usize,
    ) -> Result<TrialRecord> {
        let experiment = &self.plan.experiments[round.experiment];
        let mut twin = None;
        let (subject, variants, request) = match &planned.work {
            Work::Timed(timed) => {
                let request = self.timed_request(planned.threads, timed, round)?;
                let subject = experiment.groups[timed.group].name.clone();
                (subject, timed.variants.clone(), Ok(TrialRequest::Timed(request)))
            }
            Work::Observed(run) => {
                let run = &experiment.runs[*run].run;
                let request = ObserveRequest {
                    scene: run.scene.clone(),
                    sets: run.sets.clone(),
                    variant: run.variant.clone(),
                    threads: planned.threads,
                    pin: experiment.spec.pin.clone(),
                };
                (run.id.clone(), vec![run.variant.clone()], Ok(TrialRequest::Observed(request)))
            }
            Work::Twin(work) => {
                let (plan, threads, toolchain) = (self.plan, planned.threads, &self.toolchain);
                let (outcome, request) = prepare(plan, experiment, work, threads, self.folder, toolchain)?;
                twin = Some(outcome);
                (work.cell.label(), Vec::new(), request.map(TrialRequest::Twin))
            }
        };
        let limit = LEAST_LIMIT.max(Duration::from_secs_f64(LIMIT_FACTOR * planned.estimate_s));
        let (started_utc, began, done) = (now_utc(), Instant::now(), self.progress.position());
        let expected = milliseconds(planned.estimate_s);
        let ending = match &request {
            Ok(request) => run_child(request, limit, |elapsed| {
                let share = (elapsed.as_millis() as u64).min(expected * 95 / 100);
                self.progress.set_position(done + share);
            })?,
            Err(reason) => Ending::NotApplicable(reason.clone()),
        };
        self.progress.set_position(done + expected);
        let mut record = TrialRecord {
            position,
            subject,
            threads: planned.threads,
            variants,
            status: Status::Failed,
            reason: String::new(),
            started_utc,
            wall_s: began.elapsed().as_secs_f64(),
            outcome: None,
            observation: None,
            twin,
        };
        record.take(ending, request.as_ref().ok(), limit);
        Ok(record)
    }

    fn timed_request(&self, threads: usize, timed: &TimedWork, round: &PlannedRound) -> Result<TimedRequest> {
        let experiment = &self.plan.experiments[round.experiment];
        let group = &experiment.groups[timed.group];
        let (place, states) = self.states_of(timed, round);
        let folder = states.folder(self.folder);
        std::fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
        let mut known = states.known_digests();
        let passed = self.known[place].iter();
        known.extend(passed.map(|(&step, digest)| StateDigest { step, digest: digest.clone() }));
        let mut name_at = states.end_steps.clone();
        name_at.insert(group.scene.steps());
        Ok(TimedRequest {
            scene: experiment.spec.scene.clone(),
            sets: group.sets.clone(),
            variants: timed.variants.clone(),
            states_of: states.variant(),
            threads,
            pin: experiment.spec.pin.clone(),
            windows: timed.windows.clone(),
            states: folder,
            save_at: if timed.saves_states {
                states.start_steps.iter().copied().collect()
            } else {
                Vec::new()
            },
            name_at: if round.stage == Stage::Paired { Vec::new() } else { name_at.into_iter().collect() },
            known,
            seed: timed.seed,
        })
    }
}

/// Without the states that one trial leaves, no later trial can start: its failure ends the run before it is recorded,
/// so that the same command tries again.
fn require_states(round: &PlannedRound, record: &RoundRecord) -> Result<()> {
    for (planned, trial) in round.trials.iter().zip(&record.trials) {
        ensure!(
            !planned.saves_states() || trial.status == Status::Ok,
            "the run whose states later trials start from failed: {}",
            trial.reason
        );
    }
    Ok(())
}

impl TrialRecord {
    /// Takes up how the trial's process ended.
    fn take(&mut self, ending: Ending, request: Option<&TrialRequest>, limit: Duration) {
        self.status = Status::Ok;
        let answer = match ending {
            Ending::Answer(answer) => answer,
            Ending::Failed(reason) => {
                (self.status, self.reason) = (Status::Failed, reason);
                return;
            }
            Ending::NotApplicable(reason) => {
                (self.status, self.reason) = (Status::NotApplicable, reason);
                return;
            }
            Ending::Timeout => {
                self.status = Status::Timeout;
                self.reason = format!("took longer than its limit of {:.0} s", limit.as_secs_f64());
                return;
            }
        };
        if let Err(error) = self.take_answer(&answer, request) {
            (self.status, self.reason) = (Status::Failed, format!("its answer cannot be taken: {error:#}"));
        }
    }

    /// Reads what the trial's process wrote as that which it was asked for.
    fn take_answer(&mut self, answer: &[u8], request: Option<&TrialRequest>) -> Result<()> {
        match request.context("nobody asked for it")? {
            TrialRequest::Timed(_) => self.outcome = Some(serde_json::from_slice(answer)?),
            TrialRequest::Observed(_) => self.observation = Some(serde_json::from_slice(answer)?),
            TrialRequest::Twin(request) => {
                let answer = TwinAnswer::parse(answer, request.asked())?;
                self.twin.as_mut().context("no twin was asked for it")?.answer = Some(answer);
            }
        }
        Ok(())
    }
}

/// How a child ended, if there was one.
enum Ending {
    NotApplicable(String),
    Answer(Vec<u8>),
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
    Ok(Ending::Answer(answer))
}

/// What a child that failed said about it: its own error, or else the message of its panic, without paths.
fn reason(complaint: &str) -> String {
    let mut lines = complaint.lines();
    let own = complaint
        .lines()
        .find_map(|line| line.strip_prefix("repro: ").or_else(|| line.strip_prefix("twin: ")));
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
