//! The jobs of a run as `sbatch` takes them.
//!
//! The two scripts are fixed texts: paths and names reach them as arguments, so that nothing in a name is ever read as
//! shell, and a run folder does not record where it lies.

use std::path::Path;

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

use crate::base::files::write_whole;
use crate::experiment::cluster::array::JobArray;

const FIRST_SCRIPT: &str = r#"#!/bin/sh
# The first job of a run: opens it on this node and leaves the states that blocks start from.
# arguments: PROGRAM RUN
# The program runs directly: srun inside a batch job would give it one processor.
exec "$1" task "$2"
"#;

const BLOCK_SCRIPT: &str = r#"#!/bin/sh
# One task of a job array: runs one whole randomised block of a run on this node.
# arguments: PROGRAM RUN OFFSET
# The program runs directly: srun inside a batch job would give it one processor.
exec "$1" task "$2" "$(($3 + SLURM_ARRAY_TASK_ID))"
"#;

/// What a user may ask of the cluster.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Options {
    pub partition: Option<String>,
    pub account: Option<String>,
    /// A part of a node; whole nodes where it is left out.
    pub cpus_per_task: Option<usize>,
    /// As many tasks of an array run at once.
    pub max_parallel: Option<usize>,
    /// Passed on as they are.
    pub others: Vec<String>,
}

/// Makes the arguments of `sbatch`.
#[derive(Debug)]
pub struct Batch<'a> {
    /// This program's file, which nodes start.
    pub program: &'a str,
    /// The run folder, absolute.
    pub folder: &'a str,
    /// Where paths in the experiments start from, absolute.
    pub working_folder: &'a str,
    pub options: &'a Options,
}

impl Batch<'_> {
    /// Writes the scripts into the run folder, and makes room for the jobs' logs.
    pub fn write_scripts(&self) -> Result<()> {
        let folder = Path::new(self.folder);
        for name in ["slurm", "slurm/logs"] {
            std::fs::create_dir_all(folder.join(name)).with_context(|| format!("cannot create {name}"))?;
        }
        for (name, text) in [("first.sh", FIRST_SCRIPT), ("block.sh", BLOCK_SCRIPT)] {
            write_whole(&folder.join("slurm").join(name), text.as_bytes())
                .with_context(|| format!("cannot write slurm/{name}"))?;
        }
        Ok(())
    }

    /// The first job, with a time limit in Slurm's words.
    pub fn first(&self, time: &str) -> Vec<String> {
        let mut arguments = self.common("first", "slurm-%j.log", time);
        arguments.extend([self.script("first.sh"), self.program.to_string(), self.folder.to_string()]);
        arguments
    }

    /// One array of blocks, with a time limit for each.
    pub fn array(&self, array: &JobArray, time: &str) -> Vec<String> {
        let mut arguments = self.common(&array.offset.to_string(), "slurm-%A_%a.log", time);
        let parallel = self.options.max_parallel.map(|most| format!("%{most}"));
        arguments.push(format!("--array={}{}", array.list(), parallel.unwrap_or_default()));
        arguments.extend([self.script("block.sh"), self.program.to_string(), self.folder.to_string()]);
        arguments.push(array.offset.to_string());
        arguments
    }

    /// The beginning of the names of the run's jobs: another folder's have another.
    pub fn name(&self) -> String {
        let hash = Sha256::digest(self.folder);
        let hash: String = hash.iter().take(6).map(|byte| format!("{byte:02x}")).collect();
        format!("repro-{hash}-")
    }

    fn common(&self, name: &str, log: &str, time: &str) -> Vec<String> {
        let options = self.options;
        let mut arguments = options.others.clone();
        arguments.push("--parsable".to_string());
        arguments.push(format!("--job-name={}{name}", self.name()));
        arguments.extend(["--nodes=1", "--ntasks=1"].map(String::from));
        arguments.push(match options.cpus_per_task {
            Some(count) => format!("--cpus-per-task={count}"),
            None => "--exclusive".to_string(),
        });
        arguments.push(format!("--time={time}"));
        arguments.extend(options.partition.iter().map(|name| format!("--partition={name}")));
        arguments.extend(options.account.iter().map(|name| format!("--account={name}")));
        arguments.push(format!("--chdir={}", self.working_folder));
        // Slurm would take `%j` in the folder's own name for a job's number.
        arguments.push(format!("--output={}/slurm/logs/{log}", self.folder.replace('%', "%%")));
        arguments
    }

    fn script(&self, name: &str) -> String {
        format!("{}/slurm/{name}", self.folder)
    }
}

/// What makes a job wait for the first one. Where that fails, it is taken off the queue, in which it would stay for ever.
pub fn after(first: &str) -> [String; 2] {
    [format!("--dependency=afterok:{first}"), "--kill-on-invalid-dep=yes".to_string()]
}

/// Words as a line for a shell.
pub fn shell_line<'a>(words: impl IntoIterator<Item = &'a String>) -> String {
    words.into_iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// A word that a shell takes as it is.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=+./:,%@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_string()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOSTILE: &str = "a b'c\"$(touch owned)`x`\n<script>;&|*?~#\\ %j é";

    fn batch<'a>(options: &'a Options, folder: &'a str) -> Batch<'a> {
        Batch { program: "/p/repro", folder, working_folder: "/w", options }
    }

    #[cfg(unix)]
    #[test]
    fn a_shell_gives_quoted_words_back() {
        for word in [HOSTILE, "", "'", "plain-word.1", "%j", "a\nb\n", "--array=0-3%2"] {
            let script = format!("printf %s {}", quoted(word));
            let output = std::process::Command::new("sh").arg("-c").arg(script).output().unwrap();
            assert_eq!(String::from_utf8(output.stdout).unwrap(), word);
        }
    }

    #[test]
    fn scripts_hold_nothing_of_the_user() {
        let place = std::env::temp_dir().join(format!("repro-job-{}", std::process::id()));
        let folder = place.join("it's $(here)");
        batch(&Options::default(), folder.to_str().unwrap()).write_scripts().unwrap();
        for name in ["first.sh", "block.sh"] {
            let text = std::fs::read_to_string(folder.join("slurm").join(name)).unwrap();
            assert!(text.starts_with("#!/bin/sh\n") && !text.contains("here)"), "{text}");
        }
        std::fs::remove_dir_all(place).unwrap();
    }

    #[test]
    fn an_array_is_asked_for_as_the_user_wants_it() {
        let options = Options {
            partition: Some("short".to_string()),
            account: Some("lab $(x)".to_string()),
            max_parallel: Some(4),
            others: vec!["--constraint=epyc".to_string()],
            ..Options::default()
        };
        let array = JobArray { offset: 1000, indices: vec![2, 5, 6, 7] };
        let arguments = batch(&options, "/r/a%jb").array(&array, "9");
        let expected =
            ["--array=2,5-7%4", "--exclusive", "--time=9", "--partition=short", "--account=lab $(x)"];
        for word in expected.into_iter().chain(["--nodes=1", "--output=/r/a%%jb/slurm/logs/slurm-%A_%a.log"])
        {
            assert!(arguments.iter().any(|argument| argument == word), "{word} is not among {arguments:?}");
        }
        assert_eq!(arguments[0], "--constraint=epyc", "what the program needs comes later and wins");
        assert_eq!(
            arguments[arguments.len() - 4..],
            ["/r/a%jb/slurm/block.sh", "/p/repro", "/r/a%jb", "1000"]
        );
        let shared = Options { cpus_per_task: Some(8), ..Options::default() };
        let arguments = batch(&shared, "/r").first("1-0");
        assert!(arguments.contains(&"--cpus-per-task=8".to_string()), "{arguments:?}");
        assert!(arguments.contains(&"--time=1-0".to_string()) && !arguments.contains(&"--exclusive".into()));
    }

    #[test]
    fn folders_have_jobs_of_their_own_names() {
        let options = Options::default();
        let (a, b) = (batch(&options, "/a").name(), batch(&options, "/b").name());
        assert_ne!(a, b);
        assert!(a.starts_with("repro-") && a.ends_with('-') && a.len() == 19, "{a}");
    }
}
