use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use crate::base::input::{Check, InputError};
use crate::cli::Exit;
use crate::cli::measure::{ModeFlags, every_experiment, load};
use crate::cli::output::Output;
use crate::experiment::cluster::array::{JobArray, USUAL_MAX_ARRAY_SIZE};
use crate::experiment::cluster::job::{Batch, Options, after, quoted, shell_line};
use crate::experiment::cluster::limits::{Estimate, time_limit};
use crate::experiment::cluster::outstanding::Outstanding;
use crate::experiment::cluster::slurm::{self, Queue};
use crate::experiment::cluster::submission::Submission;
use crate::experiment::spec::Mode;

#[derive(Debug, Args)]
pub struct Submit {
    /// Experiments by name or file, or `all` [default: those that were submitted in the folder before]
    experiments: Vec<String>,
    #[command(flatten)]
    mode: ModeFlags,
    /// Write job scripts for Slurm and print the commands that send them
    #[arg(long)]
    slurm: bool,
    /// The run folder, which all nodes must see. What is missing of an earlier submission in it is submitted again
    #[arg(long, short)]
    output: PathBuf,
    /// Send the jobs
    #[arg(long)]
    now: bool,
    /// A name for the nodes in tables [default: from the processor]
    #[arg(long)]
    alias: Option<String>,
    /// The partition to run in
    #[arg(long)]
    partition: Option<String>,
    /// The account to charge
    #[arg(long)]
    account: Option<String>,
    /// A job's time limit, as Slurm takes it [default: from an estimate with this machine's speed]
    #[arg(long)]
    time: Option<String>,
    /// Share nodes with others, and use so many processors of each [default: whole nodes, `--exclusive`]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    cpus_per_task: Option<u16>,
    /// Run at most this many rounds of an array at once
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    max_parallel: Option<u32>,
    /// The cluster's limit on array indices [default: what `scontrol show config` says, or 1001]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    max_array_size: Option<u32>,
    /// More options for sbatch
    #[arg(last = true, value_name = "SBATCH_OPTIONS")]
    sbatch: Vec<String>,
}

impl Submit {
    pub fn run(self, output: Output) -> Result<Exit> {
        let allowed = "Slurm is the only scheduler that jobs are written for";
        Check { file: "command line" }.require(self.slurm, "--slurm", "not given", allowed)?;
        let submission = self.submission()?;
        let place = fs::canonicalize(&self.output).context("cannot find the run folder")?;
        let program = std::env::current_exe().context("cannot find this program's own file")?;
        let working_folder = std::env::current_dir().context("cannot find the working folder")?;
        let options = self.options();
        let batch = Batch {
            program: utf8(&program)?,
            folder: utf8(&place)?,
            working_folder: utf8(&working_folder)?,
            options: &options,
        };
        // Asked before the folder is read: a block that is recorded in between is neither missing nor sent again.
        let queue = self.asked(Queue::read(&batch.name()))?.unwrap_or_default();
        let outstanding = Outstanding::find(&place, &submission)?;
        if outstanding.is_nothing() {
            eprintln!("nothing is missing: `repro collect {}`", quoted(&self.output.to_string_lossy()));
            output.show(&Vec::<String>::new(), |_| Ok(()))?;
            return Ok(Exit::Done);
        }
        batch.write_scripts()?;
        let limits = self.limits(&place, &submission)?;
        let jobs = self.jobs(queue, outstanding, limits)?;
        let lines = if self.now { jobs.send(&batch)? } else { jobs.commands(&batch) };
        output.show(&lines, |out| lines.iter().try_for_each(|line| writeln!(out, "{line}")))?;
        Ok(Exit::Done)
    }

    /// Time limits of the first job and of a block.
    fn limits(&self, folder: &Path, submission: &Submission) -> Result<[String; 2]> {
        if let Some(time) = &self.time {
            return Ok([time.clone(), time.clone()]);
        }
        let estimate = Estimate::of(folder, submission, self.cpus_per_task.map(usize::from))?;
        let limits = [estimate.first_s, estimate.block_s].map(time_limit);
        eprintln!(
            "time limit {} min a block, from {:.0} s with this machine's speed; `--time` sets another",
            limits[1], estimate.block_s
        );
        Ok(limits)
    }

    /// What is asked for or, without experiments, what was before.
    fn submission(&self) -> Result<Submission> {
        let mode = self.mode.mode();
        if !self.experiments.is_empty() {
            let all = self.experiments == ["all"];
            let names = if all { every_experiment() } else { self.experiments.clone() };
            return Submission::new(load(&names)?, mode, self.alias.clone()).freeze(&self.output);
        }
        let submission = Submission::read(&self.output)?;
        if mode != Mode::Default && mode != submission.mode {
            let (found, there) = (format!("given as `{}`", mode.name()), submission.mode.name());
            let allowed = format!("the folder holds a submission in mode `{there}`");
            return Err(InputError::new("command line", "mode", found, allowed).into());
        }
        Ok(submission)
    }

    fn options(&self) -> Options {
        Options {
            partition: self.partition.clone(),
            account: self.account.clone(),
            cpus_per_task: self.cpus_per_task.map(usize::from),
            max_parallel: self.max_parallel.map(|most| most as usize),
            others: self.sbatch.clone(),
        }
    }

    /// What is missing, but for what waits in the queue already, dealt to jobs.
    fn jobs(&self, queue: Queue, outstanding: Outstanding, limits: [String; 2]) -> Result<Jobs> {
        let limit = match self.max_array_size {
            Some(size) => size as usize,
            None => self.asked(slurm::max_array_size())?.flatten().unwrap_or(USUAL_MAX_ARRAY_SIZE),
        };
        let missing = &outstanding.blocks;
        let blocks: Vec<usize> =
            missing.iter().copied().filter(|number| !queue.blocks.contains(number)).collect();
        eprintln!("{} blocks are missing, {} of them queued", missing.len(), missing.len() - blocks.len());
        let arrays = JobArray::deal(&blocks, limit.max(1));
        let known_first = queue.first.filter(|_| outstanding.first);
        Ok(Jobs { needs_first: outstanding.first, known_first, arrays, limits })
    }

    /// An answer of the cluster. Where jobs are only written, there may be none to ask.
    fn asked<T>(&self, answer: Result<T>) -> Result<Option<T>> {
        if self.now { answer.map(Some) } else { Ok(answer.ok()) }
    }
}

/// What to send.
struct Jobs {
    /// Whether arrays wait for the first job.
    needs_first: bool,
    /// The number of the first job, where it waits or runs already.
    known_first: Option<String>,
    arrays: Vec<JobArray>,
    /// Time limits of the first job and of a block.
    limits: [String; 2],
}

impl Jobs {
    /// Sends them; a line a job that was sent.
    fn send(&self, batch: &Batch<'_>) -> Result<Vec<String>> {
        let mut sent = Vec::new();
        let mut first = self.known_first.clone();
        if self.sends_first() {
            let job = slurm::send(&batch.first(&self.limits[0]))?;
            sent.push(format!("first job: {job}"));
            first = Some(job);
        }
        for array in &self.arrays {
            let mut arguments: Vec<String> = first.iter().flat_map(|first| after(first)).collect();
            arguments.extend(batch.array(array, &self.limits[1]));
            sent.push(format!("blocks {}: job {}", array.blocks(), slurm::send(&arguments)?));
        }
        Ok(sent)
    }

    /// Commands that a shell runs; on standard output there is nothing else.
    fn commands(&self, batch: &Batch<'_>) -> Vec<String> {
        let mut commands = Vec::new();
        if self.sends_first() {
            commands.push(format!("first=$(sbatch {})", shell_line(&batch.first(&self.limits[0]))));
        }
        for array in &self.arrays {
            let dependency = match &self.known_first {
                Some(job) => shell_line(&after(job)),
                // The shell fills in what the first command printed.
                None if self.needs_first => after("\"${first%%;*}\"").join(" "),
                None => String::new(),
            };
            let arguments = batch.array(array, &self.limits[1]);
            commands.push(format!("sbatch {dependency} {}", shell_line(&arguments)));
        }
        commands
    }

    fn sends_first(&self) -> bool {
        self.needs_first && self.known_first.is_none()
    }
}

fn utf8(path: &Path) -> Result<&str, InputError> {
    let allowed = "job scripts need paths in UTF-8";
    path.to_str()
        .ok_or_else(|| InputError::new("command line", "path", format!("`{}`", path.display()), allowed))
}
