//! Asks a cluster: what it takes, what is queued, and to run a job.

use std::collections::BTreeSet;
use std::io::ErrorKind;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};

use crate::base::input::InputError;

/// What one of Slurm's commands prints.
pub fn ask<S: AsRef<str>>(program: &str, arguments: &[S]) -> Result<String> {
    let arguments = arguments.iter().map(AsRef::as_ref);
    let output = match Command::new(program).args(arguments).stdin(Stdio::null()).output() {
        Ok(output) => output,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let found = format!("not possible here: `{program}` is not installed");
            let allowed =
                "use it where the cluster takes jobs; without it, the commands to run there are printed";
            return Err(InputError::new("command line", "--now", found, allowed).into());
        }
        Err(error) => return Err(error).with_context(|| format!("cannot start {program}")),
    };
    let complaint = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{program} ({}): {}", output.status, complaint.trim());
    String::from_utf8(output.stdout).with_context(|| format!("{program} does not answer in UTF-8"))
}

/// Hands a job over and returns its number.
pub fn send(arguments: &[String]) -> Result<String> {
    let answer = ask("sbatch", arguments)?;
    // Where there are several clusters, the name of one follows.
    let number = answer.trim().split(';').next().unwrap_or_default();
    if number.is_empty() || !number.bytes().all(|byte| byte.is_ascii_digit()) {
        bail!("sbatch answers `{}`, which is no job's number", answer.trim());
    }
    Ok(number.to_string())
}

/// The number below which the cluster's array indices stay, where it tells.
pub fn max_array_size() -> Result<Option<usize>> {
    Ok(parse_max_array_size(&ask("scontrol", &["show", "config"])?))
}

fn parse_max_array_size(config: &str) -> Option<usize> {
    let mut lines = config.lines().filter_map(|line| line.split_once('='));
    lines.find(|(key, _)| key.trim() == "MaxArraySize")?.1.trim().parse().ok()
}

/// The jobs of a run that wait or run.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Queue {
    /// The first job's number.
    pub first: Option<String>,
    /// Numbers of blocks.
    pub blocks: BTreeSet<usize>,
}

impl Queue {
    /// This user's jobs whose names begin with `name`.
    pub fn read(name: &str) -> Result<Queue> {
        let states = "--states=PENDING,CONFIGURING,RUNNING,SUSPENDED";
        let arguments = ["--me", "--noheader", "--array", states, "--format=%j %A %K"];
        Ok(Queue::parse(&ask("squeue", &arguments)?, name))
    }

    fn parse(listed: &str, name: &str) -> Queue {
        let mut queue = Queue::default();
        for line in listed.lines() {
            let mut words = line.split_whitespace();
            let (Some(job), Some(number), Some(index)) = (words.next(), words.next(), words.next()) else {
                continue;
            };
            match job.strip_prefix(name) {
                Some("first") => queue.first = Some(number.to_string()),
                Some(offset) => {
                    let place = offset.parse::<usize>().ok().zip(index.parse::<usize>().ok());
                    queue.blocks.extend(place.map(|(offset, index)| offset + index));
                }
                None => {}
            }
        }
        queue
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_found_in_the_configuration() {
        let text =
            "Configuration data as of now\nMaxArraySize            = 1001\nMaxJobCount             = 10000\n";
        assert_eq!(parse_max_array_size(text), Some(1001));
        assert_eq!(parse_max_array_size("MaxJobCount = 5\n"), None);
    }

    #[test]
    fn only_the_jobs_of_a_run_are_its_queue() {
        let listed = "repro-1a-first 7 N/A\nrepro-1a-0 8 3\nrepro-1a-1000 9 2\nrepro-1b-0 10 5\nother 11 N/A\nrepro-1a-x 1 1\n";
        let queue = Queue::parse(listed, "repro-1a-");
        assert_eq!(queue.first.as_deref(), Some("7"));
        assert_eq!(queue.blocks, BTreeSet::from([3, 1002]));
        assert_eq!(Queue::parse(listed, "repro-1c-"), Queue::default());
    }

    #[test]
    fn a_command_that_is_not_there_is_named() {
        let error = ask("no-such-command-of-slurm", &["x"]).unwrap_err();
        assert!(
            error.is::<InputError>() && error.to_string().contains("no-such-command-of-slurm"),
            "{error}"
        );
    }
}
