//! What was asked for when a run was submitted, frozen in its folder for all of its jobs.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};

use crate::base::files::write_whole;
use crate::base::input::InputError;
use crate::experiment::calibration::Calibration;
use crate::experiment::cluster::SUBMISSION_FILE;
use crate::experiment::cluster::blocks::{Block, blocks};
use crate::experiment::factors::{Threads, Usable};
use crate::experiment::machine::{Machine, Topology, allowed_cpus};
use crate::experiment::plan::Plan;
use crate::experiment::record::SCHEMA;
use crate::experiment::run::{RunInfo, refuse_foreign};
use crate::experiment::spec::{Experiment, Mode};

/// A request for a run on a cluster.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Submission {
    pub schema_version: u32,
    pub mode: Mode,
    /// The command, without paths.
    pub command: String,
    /// The user's name for the nodes.
    pub alias: Option<String>,
    pub experiments: Vec<Experiment>,
}

impl Submission {
    pub fn new(experiments: Vec<Experiment>, mode: Mode, alias: Option<String>) -> Submission {
        let ids: Vec<&str> = experiments.iter().map(|experiment| experiment.id.as_str()).collect();
        let mut command = format!("repro submit {} --slurm", ids.join(" "));
        if mode != Mode::Default {
            command += &format!(" --{}", mode.name());
        }
        Submission { schema_version: SCHEMA, mode, command, alias, experiments }
    }

    /// What was submitted in `folder`.
    pub fn read(folder: &Path) -> Result<Submission> {
        let path = folder.join(SUBMISSION_FILE);
        if !path.is_file() {
            let found = format!("`{}`, in which nothing was submitted", folder.display());
            let allowed =
                "allowed are folders that `repro submit` was given; `repro report` renders any other run";
            return Err(InputError::new("command line", "RUN", found, allowed).into());
        }
        let name = path.display();
        let text = fs::read_to_string(&path).with_context(|| format!("cannot read {name}"))?;
        let submission: Submission =
            serde_json::from_str(&text).with_context(|| format!("{name} is no submission"))?;
        let found = submission.schema_version;
        ensure!(found == SCHEMA, "{name}: schema_version is {found}; this program reads {SCHEMA}");
        Ok(submission)
    }

    /// Freezes the request in `folder`, or takes up the one that is frozen there if it asks for the same.
    pub fn freeze(self, folder: &Path) -> Result<Submission> {
        refuse_foreign(folder)?;
        let path = folder.join(SUBMISSION_FILE);
        if path.is_file() {
            let frozen = Submission::read(folder)?;
            return if (frozen.mode, &frozen.experiments) == (self.mode, &self.experiments) {
                Ok(frozen)
            } else {
                Err(refused(folder, "which holds a submission of other experiments or another mode").into())
            };
        }
        if folder.join("run.json").exists() {
            return Err(refused(folder, "which holds a run that was not submitted").into());
        }
        fs::create_dir_all(folder.join("slurm"))
            .map_err(|error| refused(folder, &format!("which cannot be written: {error}")))?;
        let text = serde_json::to_vec_pretty(&self)?;
        write_whole(&path, &text).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(self)
    }

    pub fn blocks(&self) -> Vec<Block> {
        blocks(&self.experiments, self.mode)
    }

    /// This machine, and the plan for it.
    pub fn here(&self) -> Result<(Machine, Plan)> {
        let machine = Machine::observe(Path::new("/"), self.alias.as_deref());
        let plan = Plan::new(self.experiments.clone(), self.mode, Calibration::measure()?)?;
        Ok((machine, plan))
    }

    /// The plan for nodes that nobody has seen yet: for the processors that are asked for or else for as many as any cell
    /// wants.
    pub fn ahead(&self, processors: Option<usize>, calibration: Calibration) -> Result<Plan> {
        let here = Topology::read(Path::new("/"), &allowed_cpus()).usable_cores();
        let wanted = self.thread_counts().last().copied().unwrap_or(1).max(here);
        let threads = processors.unwrap_or(wanted);
        Plan::on(Usable { threads, cores: threads }, self.experiments.clone(), self.mode, calibration)
    }

    /// The numbers of threads that the experiments name.
    fn thread_counts(&self) -> BTreeSet<usize> {
        let groups = self.experiments.iter().flat_map(|experiment| experiment.groups(self.mode));
        let named = groups.flat_map(|group| &group.threads).filter_map(|threads| match threads {
            Threads::Count(count) => Some(*count),
            Threads::Named(_) => None,
        });
        named.collect()
    }
}

/// The plan of a run as the node that began it made it.
pub fn plan_of(info: &RunInfo, calibration: Calibration) -> Result<Plan> {
    Plan::on(info.usable(), info.experiments.clone(), info.mode, calibration)
}

fn refused(folder: &Path, found: &str) -> InputError {
    let allowed = "allowed are a new or empty folder, or that of an earlier submission of the same";
    InputError::new("command line", "--output", format!("`{}`, {found}", folder.display()), allowed)
}
