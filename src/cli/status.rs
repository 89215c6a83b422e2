use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use crate::cli::Exit;
use crate::cli::output::Output;
use crate::experiment::progress::{StageProgress, progress};
use crate::report::measured::Measured;

#[derive(Debug, Args)]
pub struct Status {
    /// A run folder
    run: PathBuf,
}

/// How far a run is.
#[derive(Debug, Serialize)]
struct Shown<'a> {
    run_id: &'a str,
    command: &'a str,
    finished_utc: Option<&'a str>,
    complete: bool,
    stages: Vec<StageProgress>,
}

impl Status {
    pub fn run(self, output: Output) -> Result<Exit> {
        let measured = Measured::read(&self.run)?;
        let info = &measured.info;
        let stages = progress(info, &measured.rounds);
        let complete = stages.iter().all(|stage| stage.complete && stage.failed_trials == 0);
        let finished_utc = info.finished_utc.as_deref();
        let (run_id, command) = (info.run_id.as_str(), info.command.as_str());
        let shown = Shown { run_id, command, finished_utc, complete, stages };
        output.show(&shown, |out| {
            writeln!(out, "{}: {}", shown.run_id, shown.command)?;
            writeln!(
                out,
                "{:<16} {:<9} {:>8} {:>8} {:>6}  missing",
                "experiment", "stage", "recorded", "at most", "failed"
            )?;
            for stage in &shown.stages {
                writeln!(out, "{}", line(stage))?;
            }
            writeln!(out, "{}", in_words(&shown))
        })?;
        Ok(match (shown.stages.is_empty(), complete) {
            (true, _) => Exit::NothingMeasured,
            (_, true) => Exit::Done,
            _ => Exit::Incomplete,
        })
    }
}

fn line(stage: &StageProgress) -> String {
    let missing: Vec<String> = stage.missing.iter().map(|round| round.to_string()).collect();
    let missing = if stage.complete { "none".to_string() } else { format!("round {}", missing.join(", ")) };
    format!(
        "{:<16} {:<9} {:>8} {:>8} {:>6}  {missing}",
        stage.experiment,
        stage.stage.name(),
        stage.recorded,
        stage.most,
        stage.failed_trials
    )
}

fn in_words(shown: &Shown<'_>) -> &'static str {
    let failed = shown.stages.iter().any(|stage| stage.failed_trials > 0);
    let missing = shown.stages.iter().any(|stage| !stage.complete);
    if shown.stages.is_empty() {
        return "nothing to measure: no cell of the experiments is asked for or can run here";
    }
    match (missing, failed) {
        (true, _) => "incomplete: the same command with this `--output` goes on",
        (false, true) => {
            "complete, with failures: the same command with `--retry-failed` repeats their rounds"
        }
        (false, false) => "complete",
    }
}
