//! Gathers the blocks of a run: each record is checked against the plan, and a run that lacks none is finished.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Result, bail, ensure};

use crate::experiment::calibration::Calibration;
use crate::experiment::cluster::blocks::Block;
use crate::experiment::cluster::submission::plan_of;
use crate::experiment::peaks;
use crate::experiment::plan::{Plan, PlannedRound, PlannedTrial, TimedWork, Work};
use crate::experiment::progress::progress;
use crate::experiment::record::{RoundRecord, Stage, StateDigest, Status, TrialRecord};
use crate::experiment::run::{Run, RunInfo};

/// What is there of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gathered {
    pub recorded: usize,
    pub missing: Vec<Block>,
}

/// Reads what jobs have recorded in `folder`. A run without missing rounds is marked as finished.
pub fn gather(folder: &Path) -> Result<Gathered> {
    let info = RunInfo::read(folder)?;
    let plan = plan_of(&info, Calibration::TIMELESS)?;
    let (mut gathered, records) = verify(&plan, folder)?;
    let stages = progress(&info, &records);
    gathered.missing.retain(|block| block.stage == Stage::States || block.is_needed(&stages));
    if gathered.missing.is_empty() && info.finished_utc.is_none() {
        Run::share(folder)?.finish()?;
        // Nobody takes blocks any more.
        let _ = fs::remove_dir_all(folder.join("slurm").join("locks"));
    }
    Ok(gathered)
}

/// Checks every record of `plan` in `folder`. One that is damaged, or computed something else than the others, is refused.
fn verify(plan: &Plan, folder: &Path) -> Result<(Gathered, Vec<RoundRecord>)> {
    let mut known = Known::new(plan);
    let mut records = Vec::new();
    let mut gathered = Gathered { recorded: 0, missing: Vec::new() };
    for round in &plan.rounds {
        let block = Block::of(round, plan);
        let path = block.path(folder);
        if !path.is_file() {
            gathered.missing.push(block);
            continue;
        }
        let checked = RoundRecord::read(&path)
            .and_then(|record| check(plan, round, &record, &mut known).map(|()| record));
        match checked {
            Ok(record) => records.push(record),
            Err(error) => bail!("{}: {error:#}; remove the file and submit the run again", path.display()),
        }
        gathered.recorded += 1;
    }
    Ok((gathered, records))
}

fn check(plan: &Plan, round: &PlannedRound, record: &RoundRecord, known: &mut Known<'_>) -> Result<()> {
    let (found, planned) = (record.trials.len(), round.trials.len());
    ensure!(found == planned, "it holds {found} trials, the plan has {planned}");
    for (position, (planned, trial)) in round.trials.iter().zip(&record.trials).enumerate() {
        ensure!(is_of(plan, round, planned, trial, position), "trial {position} is not the plan's");
        if let Work::Timed(timed) = &planned.work {
            known.check(round, timed, trial)?;
        }
    }
    Ok(())
}

/// Whether a record is of this trial of the plan.
fn is_of(
    plan: &Plan,
    round: &PlannedRound,
    planned: &PlannedTrial,
    trial: &TrialRecord,
    position: usize,
) -> bool {
    let experiment = &plan.experiments[round.experiment];
    let same = match &planned.work {
        Work::Timed(timed) => {
            trial.subject == experiment.groups[timed.group].name && trial.variants == timed.variants
        }
        Work::Observed(run) => {
            let run = &experiment.runs[*run].run;
            trial.subject == run.id && trial.variants == [run.variant.clone()]
        }
        Work::Twin(work) => trial.subject == work.cell.label() && trial.variants.is_empty(),
        Work::Validation(request) => trial.subject == request.case && trial.variants.is_empty(),
        Work::Peaks(_) => trial.subject == peaks::SUBJECT && trial.variants.is_empty(),
    };
    same && trial.position == position && trial.threads == planned.threads
}

/// Digests of states by step, for each of the plan's states: blocks did not see one another while they ran.
struct Known<'a> {
    plan: &'a Plan,
    digests: Vec<BTreeMap<usize, String>>,
}

impl Known<'_> {
    fn new(plan: &Plan) -> Known<'_> {
        let of =
            |known: Vec<_>| known.into_iter().map(|known: StateDigest| (known.step, known.digest)).collect();
        Known { plan, digests: plan.states.iter().map(|states| of(states.known_digests())).collect() }
    }

    /// Every state that the trial ended a window in or passed, where it must be that of the run that left the states.
    fn check(&mut self, round: &PlannedRound, timed: &TimedWork, trial: &TrialRecord) -> Result<()> {
        let Some(outcome) = trial.outcome.as_ref().filter(|_| trial.status == Status::Ok) else {
            return Ok(());
        };
        let place = self.plan.experiments[round.experiment].groups[timed.group].states;
        let answer = self.plan.states[place].variant();
        let mut found: Vec<(usize, &str)> = Vec::new();
        for (variant, samples) in timed.variants.iter().zip(&outcome.samples) {
            if variant.has_answer_of(&answer) {
                found.extend(samples.iter().map(|s| (s.window.end_step(), s.digest.as_str())));
            }
        }
        if timed.variants.iter().all(|variant| variant.has_answer_of(&answer)) {
            found.extend(outcome.passed.iter().map(|passed| (passed.step, passed.digest.as_str())));
        }
        for (step, digest) in found {
            let expected = self.digests[place].entry(step).or_insert_with(|| digest.to_string());
            ensure!(
                expected == digest,
                "after step {step} a trial was in the state {digest}, expected {expected}: it computed something else"
            );
        }
        Ok(())
    }
}
