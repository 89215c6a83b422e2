//! The life of a run: its folder is opened, the rounds that are missing are run, and it is closed.

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::base::files::{is_leftover, write_whole};
use crate::base::input::InputError;
use crate::experiment::cluster::SUBMISSION_FILE;
use crate::experiment::execute::{Failed, execute};
use crate::experiment::factors::Usable;
use crate::experiment::foreign;
use crate::experiment::machine::{Machine, Reading};
use crate::experiment::plan::{Group, Plan, PlannedExperiment};
use crate::experiment::record::{RoundRecord, SCHEMA};
use crate::experiment::scene_files;
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
    /// The same, and rounds in which a trial failed are run again, in a finished run too.
    RetryFailed,
    /// An unfinished run of the same plan goes on, and a finished one of which rounds were removed does.
    Reopen,
    /// A run that is there is removed first.
    Fresh,
}

/// A run belongs to one kind of machine and one build of the program; this is another.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{folder}: this machine is refused: {reason}; allowed is a machine of the kind that the run began on, with the same \
     program, scenes and number of processors"
)]
pub struct AnotherMachine {
    folder: String,
    reason: String,
}

/// A run folder under this process's lock.
#[derive(Debug)]
pub struct Run {
    pub folder: PathBuf,
    pub info: RunInfo,
    existing: Existing,
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
        let lock = lock(folder, Hold::Alone)?;
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
            let finished = found.finished_utc.is_some() && folder.join(LAST_FILE).is_file();
            if finished && matches!(existing, Existing::Resume | Existing::Fresh) {
                return Err(refused(folder, "holds a finished run".to_string()).into());
            }
            info = found;
            let reopened = existing == Existing::Reopen;
            if reopened || existing == Existing::RetryFailed && has_failures(folder)? {
                info.finished_utc = None;
                info.write(folder)?;
            }
        } else {
            info.write(folder)?;
            scene_files::keep(folder, plan)?;
        }
        remove_leftovers(folder);
        let machine = serde_json::to_vec_pretty(machine)?;
        write_whole(&folder.join("machine.json"), &machine).context("cannot write machine.json")?;
        Ok(Run { folder: folder.to_path_buf(), info, existing, _lock: lock })
    }

    /// Takes part in a run that another process opened, beside others that do the same. No process can have the folder
    /// for itself as long as one of them does.
    pub fn share(folder: &Path) -> Result<Run> {
        let lock = lock(folder, Hold::Shared)?;
        Ok(Run {
            folder: folder.to_path_buf(),
            info: RunInfo::read(folder)?,
            existing: Existing::Resume,
            _lock: lock,
        })
    }

    /// Runs what is missing and marks the run as finished.
    pub fn complete(&mut self, plan: &Plan) -> Result<()> {
        if self.info.finished_utc.is_none() {
            let retry = self.existing == Existing::RetryFailed;
            execute(plan, &self.folder, if retry { Failed::Retry } else { Failed::Keep })?;
        }
        self.finish()
    }

    /// Marks a run without missing rounds as finished. States, which only later rounds needed, are removed.
    pub fn finish(&mut self) -> Result<()> {
        remove_leftovers(&self.folder);
        if self.info.finished_utc.is_none() {
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
            "{experiments:?} {:?} {:?} {source_hash} {} {} {} {:?}",
            plan.mode,
            plan.usable,
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
            usable_threads: plan.usable.threads,
            usable_cores: plan.usable.cores,
            commit: fact("commit"),
            source_hash,
            created_utc: now_utc(),
            finished_utc: None,
            experiments,
        }
    }

    /// What the machine of the run offered to threads.
    pub fn usable(&self) -> Usable {
        Usable { threads: self.usable_threads, cores: self.usable_cores }
    }

    /// Refuses a machine, build or plan that is not the run's, and says which of them differs.
    pub fn require_same_plan(
        &self,
        folder: &Path,
        plan: &Plan,
        machine: &Machine,
    ) -> Result<(), AnotherMachine> {
        let here = RunInfo::new(folder, plan, machine, &self.command);
        if here.plan_id == self.plan_id {
            return Ok(());
        }
        let reason = if here.machine_id != self.machine_id {
            format!("it is {}, the run's is {}", here.machine_id, self.machine_id)
        } else if here.source_hash != self.source_hash {
            format!("its program is {}, the run's is {}", here.source_hash, self.source_hash)
        } else if here.usable_threads != self.usable_threads {
            let (here, there) = (here.usable_threads, self.usable_threads);
            format!("{here} hardware threads may be used, {there} where the run began")
        } else {
            "compiler, flags, experiments or scenes are others than the run's".to_string()
        };
        Err(AnotherMachine { folder: folder.display().to_string(), reason })
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

/// Whether a trial failed in any recorded round.
fn has_failures(folder: &Path) -> Result<bool> {
    let names = fs::read_dir(folder.join("rounds")).context("cannot list the rounds")?.flatten();
    let paths = names.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "json"));
    for path in paths {
        if RoundRecord::read(&path)?.has_failures() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// What a plan's identity depends on beside the experiments' own text: scene files, and the machine's thread counts.
fn scenes(experiment: &PlannedExperiment) -> Vec<(&Scene, Vec<usize>)> {
    let threads = |group: &Group| group.cells.iter().map(|(threads, _)| *threads).collect();
    experiment.groups.iter().map(|group| (&group.scene, threads(group))).collect()
}

fn refused(folder: &Path, found: String) -> InputError {
    let allowed = "allowed are a new or empty folder, or an unfinished run of the same command; \
                   `--fresh` starts a run folder anew, `--retry-failed` repeats what failed in it, `--output` names another";
    InputError::new("command line", "--output", format!("`{}`, which {found}", folder.display()), allowed)
}

/// A folder with something in it that is no run is nobody's to touch.
pub(super) fn refuse_foreign(folder: &Path) -> Result<(), InputError> {
    if folder.exists() && !folder.is_dir() {
        return Err(refused(folder, "is a file".to_string()));
    }
    let Ok(entries) = fs::read_dir(folder) else {
        return Ok(());
    };
    let ours = |name: &str| matches!(name, "run.json" | "rounds" | ".lock") || is_leftover(name);
    let foreign = entries.flatten().any(|entry| !ours(&entry.file_name().to_string_lossy()));
    let begun = ["run.json", SUBMISSION_FILE].iter().any(|name| folder.join(name).is_file());
    if foreign && !begun {
        return Err(refused(folder, "holds files that are no run's".to_string()));
    }
    Ok(())
}

/// How a process holds a run folder.
#[derive(Debug, Clone, Copy)]
enum Hold {
    Alone,
    Shared,
}

fn lock(folder: &Path, hold: Hold) -> Result<File> {
    // Network file systems share a lock only on files that may be read, and give one alone only on files to write.
    let mut options = File::options();
    let lock = options.read(true).write(true).create(true).truncate(false).open(folder.join(".lock"));
    let lock = lock.map_err(|error| refused(folder, format!("cannot be written: {error}")))?;
    let held = match hold {
        Hold::Alone => lock.try_lock(),
        Hold::Shared => lock.try_lock_shared(),
    };
    match held {
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
        .chain(["observations.csv", "fronts.csv", "twin.csv", "claims.csv", "effort.csv", "report.md"])
        .chain(["report.html", "manifest.csv", LAST_FILE])
    {
        let path = folder.join(name);
        if path.is_file() {
            fs::remove_file(&path).with_context(|| format!("cannot remove {}", path.display()))?;
        }
    }
    for name in ["rounds", "states", "logs", "tables", "figures", "slurm", "export", scene_files::FOLDER] {
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
