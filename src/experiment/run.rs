//! The life of a run: its folder is opened, the rounds that are missing are run, and it is closed.

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::base::files::{is_leftover, write_whole};
use crate::base::input::InputError;
use crate::experiment::execute::execute;
use crate::experiment::foreign;
use crate::experiment::machine::{Machine, Reading};
use crate::experiment::plan::{Plan, PlannedExperiment};
use crate::experiment::record::SCHEMA;
use crate::experiment::spec::{Experiment, Mode};
use crate::scene::Scene;

/// What a run folder says about itself, in `run.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunInfo {
    pub schema_version: u32,
    pub run_id: String,
    pub mode: Mode,
    /// The command, without paths.
    pub command: String,
    /// Hash of experiments, scenes, mode, thread counts, measured code, compiler and machine: only a run of the same plan
    /// goes on.
    pub plan_id: String,
    pub machine_alias: String,
    pub machine_id: String,
    /// Hardware threads that the run may use.
    pub usable_threads: usize,
    /// Physical cores among them.
    pub usable_cores: usize,
    pub commit: String,
    pub source_hash: String,
    pub created_utc: String,
    /// `None` while rounds are missing.
    pub finished_utc: Option<String>,
    pub experiments: Vec<Experiment>,
}

/// The file that a report writes last: a finished run without it was killed while it was rendered.
pub const LAST_FILE: &str = "manifest.sha256";

/// What becomes of a folder that holds a run already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// An unfinished run of the same plan goes on.
    Resume,
    /// A run that is there is removed first.
    Fresh,
}

/// A run folder under this process's lock.
#[derive(Debug)]
pub struct Run {
    pub folder: PathBuf,
    pub info: RunInfo,
    /// Held as long as the run is; a process that dies gives it back.
    _lock: File,
}

/// The present time, ISO 8601, whole seconds, UTC.
pub fn now_utc() -> String {
    let seconds = jiff::Timestamp::now().as_second();
    jiff::Timestamp::from_second(seconds).map(|t| t.to_string()).unwrap_or_default()
}

/// The folder of a run that was given no other: `results/<UTC time, basic format>-<machine alias>`.
pub fn default_folder(machine: &Machine) -> PathBuf {
    let time: String = now_utc().chars().filter(|c| c.is_ascii_alphanumeric()).collect();
    Path::new("results").join(format!("{time}-{}", machine.alias))
}

impl Run {
    /// Opens `folder` for `plan`: a new or empty folder, or an unfinished run of the same plan.
    pub fn open(
        folder: &Path,
        plan: &Plan,
        machine: &Machine,
        command: &str,
        existing: Existing,
    ) -> Result<Run> {
        refuse_foreign(folder)?;
        if folder.is_dir() {
            foreign::plain_files(folder)
                .map_err(|error| refused(folder, format!("cannot be trusted: {error:#}")))?;
        }
        if folder.join("run.json").exists() {
            // Before anything is created or cleared: a folder with somebody else's `run.json` is not ours.
            RunInfo::read(folder)
                .map_err(|error| refused(folder, format!("holds no run of ours: {error:#}")))?;
        }
        fs::create_dir_all(folder.join("rounds"))
            .map_err(|error| refused(folder, format!("cannot be written: {error}")))?;
        let lock = lock(folder)?;
        let path = folder.join("run.json");
        if existing == Existing::Fresh {
            clear(folder)?;
        }
        let mut info = RunInfo::new(folder, plan, machine, command);
        if path.is_file() {
            let found = RunInfo::read(folder)?;
            if found.plan_id != info.plan_id {
                let what = "holds a run of another plan, build or machine";
                return Err(refused(folder, what.to_string()).into());
            }
            if found.finished_utc.is_some() && folder.join(LAST_FILE).is_file() {
                return Err(refused(folder, "holds a finished run".to_string()).into());
            }
            info = found;
        } else {
            info.write(folder)?;
        }
        remove_leftovers(folder);
        let machine = serde_json::to_vec_pretty(machine)?;
        write_whole(&folder.join("machine.json"), &machine).context("cannot write machine.json")?;
        Ok(Run { folder: folder.to_path_buf(), info, _lock: lock })
    }

    /// Runs what is missing and marks the run as finished. States, which only later rounds needed, are removed.
    pub fn complete(&mut self, plan: &Plan) -> Result<()> {
        if self.info.finished_utc.is_none() {
            execute(plan, &self.folder)?;
            self.info.finished_utc = Some(now_utc());
            self.info.write(&self.folder)?;
        }
        let _ = fs::remove_dir_all(self.folder.join("states"));
        Ok(())
    }
}

impl RunInfo {
    fn new(folder: &Path, plan: &Plan, machine: &Machine, command: &str) -> RunInfo {
        let fact =
            |key: &str| machine.fact(key).and_then(Reading::value).unwrap_or("unavailable").to_string();
        let experiments: Vec<Experiment> = plan.experiments.iter().map(|e| e.spec.clone()).collect();
        let source_hash = fact("source_hash");
        let identity = format!(
            "{experiments:?} {:?} {} {source_hash} {} {} {} {:?}",
            plan.mode,
            plan.usable_threads,
            machine.machine_id,
            fact("compiler"),
            fact("rustflags"),
            plan.experiments.iter().map(|e| (scenes(e), &e.runs)).collect::<Vec<_>>(),
        );
        let plan_id: String =
            Sha256::digest(identity).iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        RunInfo {
            schema_version: SCHEMA,
            run_id: folder.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned()),
            mode: plan.mode,
            command: command.to_string(),
            plan_id,
            machine_alias: machine.alias.clone(),
            machine_id: machine.machine_id.clone(),
            usable_threads: plan.usable_threads,
            usable_cores: plan.usable_cores,
            commit: fact("commit"),
            source_hash,
            created_utc: now_utc(),
            finished_utc: None,
            experiments,
        }
    }

    pub fn read(folder: &Path) -> Result<RunInfo> {
        let path = folder.join("run.json");
        let info: RunInfo = foreign::read_record(&path, "a run's description", SCHEMA)?;
        info.check(&path.display().to_string())?;
        Ok(info)
    }

    fn write(&self, folder: &Path) -> Result<()> {
        let path = folder.join("run.json");
        write_whole(&path, &serde_json::to_vec_pretty(self)?)
            .with_context(|| format!("cannot write {}", path.display()))
    }
}

/// What a plan's identity depends on beside the experiments' own text: scene files, and the machine's thread counts.
fn scenes(experiment: &PlannedExperiment) -> Vec<(&Scene, &[usize])> {
    experiment.groups.iter().map(|group| (&group.scene, &group.threads[..])).collect()
}

fn refused(folder: &Path, found: String) -> InputError {
    let allowed = "allowed are a new or empty folder, or an unfinished run of the same command; \
                   `--fresh` starts a run folder anew, `--output` names another";
    InputError::new("command line", "--output", format!("`{}`, which {found}", folder.display()), allowed)
}

/// A folder with something in it that is no run is nobody's to touch.
fn refuse_foreign(folder: &Path) -> Result<(), InputError> {
    if folder.exists() && !folder.is_dir() {
        return Err(refused(folder, "is a file".to_string()));
    }
    let Ok(entries) = fs::read_dir(folder) else {
        return Ok(());
    };
    let ours = |name: &str| matches!(name, "run.json" | "rounds" | ".lock") || is_leftover(name);
    let foreign = entries.flatten().any(|entry| !ours(&entry.file_name().to_string_lossy()));
    if foreign && !folder.join("run.json").is_file() {
        return Err(refused(folder, "holds files that are no run's".to_string()));
    }
    Ok(())
}

fn lock(folder: &Path) -> Result<File> {
    let lock = File::create(folder.join(".lock"))
        .map_err(|error| refused(folder, format!("cannot be written: {error}")))?;
    match lock.try_lock() {
        Ok(()) => Ok(lock),
        Err(TryLockError::WouldBlock) => {
            Err(refused(folder, "another process is working on".to_string()).into())
        }
        Err(TryLockError::Error(error)) => {
            Err(refused(folder, format!("lies on a file system without locks: {error}")).into())
        }
    }
}

/// Removes what a run leaves in its folder, and nothing else.
fn clear(folder: &Path) -> Result<()> {
    for name in ["run.json", "machine.json", "machine.csv", "samples.csv", "steps.csv", "summary.csv"]
        .into_iter()
        .chain(["observations.csv", "fronts.csv", "claims.csv", "effort.csv", "report.md", "report.html"])
        .chain(["manifest.csv", LAST_FILE])
    {
        let path = folder.join(name);
        if path.is_file() {
            fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))?;
        }
    }
    for name in ["rounds", "states", "tables", "figures"] {
        let path = folder.join(name);
        if path.is_dir() {
            fs::remove_dir_all(&path).with_context(|| format!("cannot remove {}", path.display()))?;
        }
    }
    fs::create_dir_all(folder.join("rounds")).context("cannot create the rounds' folder")
}

/// Removes half files of a killed process.
fn remove_leftovers(folder: &Path) {
    for place in [folder.to_path_buf(), folder.join("rounds")] {
        for entry in fs::read_dir(place).into_iter().flatten().flatten() {
            if is_leftover(&entry.file_name().to_string_lossy()) {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}
