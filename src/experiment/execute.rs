//! Runs the rounds that are missing, each trial in a fresh process.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use indicatif::{ProgressBar, ProgressStyle};

use crate::experiment::child::{self, Ended, Ending};
use crate::experiment::gate::cpu_pressure;
use crate::experiment::interrupt;
use crate::experiment::observe::ObserveRequest;
use crate::experiment::peaks;
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

/// What becomes of recorded rounds in which a trial failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Failed {
    /// They stay as they are.
    Keep,
    /// They are run again as a whole: pairing is within a round.
    Retry,
}

/// Runs every round of `plan` that `folder` does not hold yet, in order.
pub fn execute(plan: &Plan, folder: &Path, failed: Failed) -> Result<()> {
    let mut execution = Execution::new(plan, folder, failed)?;
    for round in &plan.rounds {
        if execution.is_needed(round) {
            execution.complete(round)?;
        } else {
            execution.pass_over(round);
        }
    }
    execution.progress.finish_and_clear();
    Ok(())
}

/// Runs those rounds alone that are `wanted`, whether or not the ones before them would be enough.
pub fn execute_only(plan: &Plan, folder: &Path, wanted: impl Fn(&PlannedRound) -> bool) -> Result<()> {
    let mut execution = Execution::new(plan, folder, Failed::Keep)?;
    for round in plan.rounds.iter().filter(|round| wanted(round)) {
        execution.complete(round)?;
    }
    execution.progress.finish_and_clear();
    Ok(())
}

/// The states, by their place in the plan, from which rounds start that are not recorded or are to run again.
fn needed_states(plan: &Plan, folder: &Path, failed: Failed) -> Result<BTreeSet<usize>> {
    let mut needed = BTreeSet::new();
    for round in &plan.rounds {
        let experiment = &plan.experiments[round.experiment];
        let path = RoundRecord::path(folder, &experiment.spec.id, round.stage, round.round);
        let retried =
            || -> Result<bool> { Ok(failed == Failed::Retry && RoundRecord::read(&path)?.has_failures()) };
        if path.is_file() && !retried()? {
            continue;
        }
        let groups = round.trials.iter().filter_map(|trial| match &trial.work {
            Work::Timed(timed) if round.stage == Stage::Paired => Some(timed.group),
            Work::Twin(work) => Some(work.group),
            Work::Timed(_) | Work::Observed(_) | Work::Validation(_) | Work::Peaks(_) => None,
        });
        needed.extend(groups.map(|group| experiment.groups[group].states));
    }
    Ok(needed)
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
    failed: Failed,
    progress: ProgressBar,
    /// Digests by step, for each of the plan's states.
    known: Vec<BTreeMap<usize, String>>,
    /// What is recorded of each stage, by experiment: what decides whether it needs more rounds.
    done: BTreeMap<(usize, Stage), Vec<RoundRecord>>,
    /// Which of the plan's states a round that is to run starts from.
    needed: BTreeSet<usize>,
    /// The twin's programs in C.
    toolchain: Toolchain,
}

impl<'a> Execution<'a> {
    fn new(plan: &'a Plan, folder: &'a Path, failed: Failed) -> Result<Self> {
        Ok(Execution {
            plan,
            folder,
            failed,
            progress: progress_bar(plan),
            known: plan.states.iter().map(|_| BTreeMap::new()).collect(),
            done: BTreeMap::new(),
            needed: needed_states(plan, folder, failed)?,
            toolchain: Toolchain::default(),
        })
    }

    /// Whether the rounds before this one leave anything to find out.
    fn is_needed(&self, round: &PlannedRound) -> bool {
        let spec = &self.plan.experiments[round.experiment].spec;
        let so_far = self.done.get(&(round.experiment, round.stage)).map_or(&[][..], Vec::as_slice);
        spec.rounds(self.plan.mode, round.stage).is_none_or(|rounds| !rounds.are_enough(so_far))
    }

    /// Runs a round unless it is recorded already.
    fn complete(&mut self, round: &PlannedRound) -> Result<()> {
        let id = &self.plan.experiments[round.experiment].spec.id;
        let path = RoundRecord::path(self.folder, id, round.stage, round.round);
        let recorded = match path.is_file() && self.states_are_there(round) {
            true => Some(RoundRecord::read(&path)?),
            false => None,
        };
        let keep = |record: &RoundRecord| self.failed == Failed::Keep || !record.has_failures();
        let record = match recorded.filter(keep) {
            Some(record) => {
                for (planned, trial) in round.trials.iter().zip(&record.trials) {
                    self.remember(planned, trial, round);
                }
                self.pass_over(round);
                record
            }
            None => {
                let record = self.run_round(round)?;
                require_states(round, &record)?;
                record.write(self.folder)?;
                record
            }
        };
        self.done.entry((round.experiment, round.stage)).or_default().push(record);
        Ok(())
    }

    fn pass_over(&self, round: &PlannedRound) {
        self.progress.inc(milliseconds(round.estimate_s()));
        self.progress.reset_eta();
    }

    /// The states that a timed trial starts from or leaves.
    fn states_of(&self, timed: &TimedWork, round: &PlannedRound) -> (usize, &States) {
        let place = self.plan.experiments[round.experiment].groups[timed.group].states;
        (place, &self.plan.states[place])
    }

    /// Whether a recorded round that left states still has them, or nothing that is to run needs them.
    fn states_are_there(&self, round: &PlannedRound) -> bool {
        round.trials.iter().all(|trial| match &trial.work {
            Work::Timed(timed) if timed.saves_states => {
                let (place, states) = self.states_of(timed, round);
                !self.needed.contains(&place) || states.are_in(self.folder)
            }
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
        let spec = &self.plan.experiments[round.experiment].spec;
        let (id, stage, number) = (&spec.id, round.stage.name(), round.round);
        let gate = spec.gate.filter(|_| round.stage != Stage::States);
        let warning = gate.map(|gate| gate.pass(cpu_pressure)).transpose()?.flatten();
        let (mut trials, mut log) = (Vec::new(), String::new());
        for (position, planned) in round.trials.iter().enumerate() {
            interrupt::check()?;
            let message = format!("{id}: {stage} round {number}, {} thread(s)", planned.threads);
            self.progress.set_message(message);
            let (trial, complaint) = self.run_trial(planned, round, position)?;
            log += &log_entry(&trial, &complaint);
            self.remember(planned, &trial, round);
            trials.push(trial);
        }
        require_the_sums_of_rust(&mut trials);
        let record = RoundRecord {
            schema_version: SCHEMA,
            experiment: id.clone(),
            stage: round.stage,
            round: round.round,
            warning: warning.unwrap_or_default(),
            trials,
        };
        record.write_log(self.folder, &log)?;
        Ok(record)
    }

    fn run_trial(
        &self,
        planned: &PlannedTrial,
        round: &PlannedRound,
        position: usize,
    ) -> Result<(TrialRecord, String)> {
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
            Work::Validation(request) => {
                (request.case.clone(), Vec::new(), Ok(TrialRequest::Validation(request.clone())))
            }
            Work::Peaks(request) => {
                (peaks::SUBJECT.to_string(), Vec::new(), Ok(TrialRequest::Peaks(request.clone())))
            }
        };
        let limit = match experiment.spec.time_limit_s {
            Some(limit_s) => Duration::from_secs_f64(limit_s),
            None => LEAST_LIMIT.max(Duration::from_secs_f64(LIMIT_FACTOR * planned.estimate_s)),
        };
        let (started_utc, began, done) = (now_utc(), Instant::now(), self.progress.position());
        let expected = milliseconds(planned.estimate_s);
        let Ended { ending, complaint } = match &request {
            Ok(request) => child::run(request, limit, |elapsed| {
                let share = (elapsed.as_millis() as u64).min(expected * 95 / 100);
                self.progress.set_position(done + share);
            })?,
            Err(reason) => Ended { ending: Ending::NotApplicable(reason.clone()), complaint: String::new() },
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
            validated: None,
            peaks: None,
        };
        record.take(ending, request.as_ref().ok(), limit);
        Ok((record, complaint))
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

/// What the log says about a trial: how it ended, and what it wrote to standard error.
fn log_entry(trial: &TrialRecord, complaint: &str) -> String {
    let variants: Vec<String> = trial.variants.iter().map(|variant| variant.label()).collect();
    format!(
        "{} trial {} {}{} thread(s) {} [{}] {:.3} s\n{complaint}",
        trial.started_utc,
        trial.position,
        if trial.subject.is_empty() { String::new() } else { format!("{} ", trial.subject) },
        trial.threads,
        trial.status.name(),
        variants.join(", "),
        trial.wall_s,
    )
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
            Ending::OutOfMemory(reason) => {
                (self.status, self.reason) = (Status::OutOfMemory, reason);
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
            TrialRequest::Validation(_) => self.validated = Some(serde_json::from_slice(answer)?),
            TrialRequest::Peaks(_) => self.peaks = Some(serde_json::from_slice(answer)?),
            TrialRequest::Twin(request) => {
                let answer = TwinAnswer::parse(answer, request.asked())?;
                self.twin.as_mut().context("no twin was asked for it")?.answer = Some(answer);
            }
        }
        Ok(())
    }
}
