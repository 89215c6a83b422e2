//! A run on a real Slurm: an array of blocks, one of them cancelled half-way, submitted again and collected.
//!
//! Skipped with a message where Slurm is not installed.

#![cfg(feature = "driver")]
#![cfg(unix)]

mod support;

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use support::{BLOCKS, collect, essence, plain_run, repro, stderr, stdout, tiny};
use tempfile::TempDir;

/// A cluster of this one machine. Its daemons end with it: when it is dropped, and when this process dies, since the
/// script that keeps them waits for the end of its input.
struct Cluster {
    script: Child,
    place: TempDir,
}

impl Cluster {
    /// `None` where Slurm is not installed.
    fn start(configuration: &str) -> Option<Cluster> {
        let missing =
            ["slurmctld", "slurmd", "sbatch", "squeue", "scancel"].into_iter().find(|p| !installed(p));
        if let Some(program) = missing {
            // Not `eprintln!`, which a test that passes does not show.
            let _ = writeln!(std::io::stderr(), "skipped: Slurm is not installed ({program} is missing)");
            return None;
        }
        let place = tempfile::tempdir().unwrap();
        fs::write(place.path().join("extra.conf"), configuration).unwrap();
        let mut script =
            Command::new(Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/slurm-one-node.sh"))
                .arg(place.path())
                .args(["sh", "-c", "echo ready; cat"])
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .spawn()
                .unwrap();
        let mut line = String::new();
        BufReader::new(script.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let cluster = Cluster { script, place };
        assert_eq!(line, "ready\n", "{}", cluster.logs());
        Some(cluster)
    }

    fn command(&self, mut command: Command) -> Output {
        command.env("SLURM_CONF", self.place.path().join("slurm.conf")).output().unwrap()
    }

    /// What the queue lists, a line a job or task.
    fn queue(&self, options: &[&str]) -> Vec<String> {
        let mut command = Command::new("squeue");
        command.args(["--noheader", "--array"]).args(options);
        let output = self.command(command);
        assert!(output.status.success(), "{}{}", stderr(&output), self.logs());
        stdout(&output).lines().map(|line| line.trim().to_string()).collect()
    }

    fn wait_until_idle(&self) {
        self.wait("the queue is not empty", || self.queue(&[]).is_empty().then_some(()));
    }

    fn wait<T>(&self, otherwise: &str, check: impl Fn() -> Option<T>) -> T {
        let deadline = Instant::now() + Duration::from_secs(120);
        loop {
            if let Some(found) = check() {
                return found;
            }
            assert!(Instant::now() < deadline, "{otherwise}: {:?}{}", self.queue(&[]), self.logs());
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Cancels a task of an array while it runs, before it has recorded its block, and returns the block's number.
    fn cancel_a_block(&self, folder: &Path) -> usize {
        self.wait("no task could be cancelled", || {
            let running = self.queue(&["--states=RUNNING", "--format=%i %j"]);
            let (task, offset, index) = running.iter().find_map(|line| task_of_an_array(line))?;
            let record = record(folder, offset + index);
            let mut command = Command::new("scancel");
            command.arg(&task);
            assert!(self.command(command).status.success());
            self.wait("a cancelled task stays", || {
                (!self.queue(&["--format=%i"]).contains(&task)).then_some(())
            });
            (!record.is_file()).then_some(offset + index)
        })
    }

    fn logs(&self) -> String {
        let log = |name: &str| fs::read_to_string(self.place.path().join(name)).unwrap_or_default();
        format!("\n{}\n{}", log("slurmctld.log"), log("slurmd.log"))
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        drop(self.script.stdin.take());
        let _ = self.script.wait();
    }
}

fn installed(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let more = ["/usr/sbin", "/sbin"].map(PathBuf::from);
    std::env::split_paths(&path).chain(more).any(|folder| folder.join(program).is_file())
}

/// The task `12_3`, its array's offset and its index from a line `12_3 repro-hash-offset`.
fn task_of_an_array(line: &str) -> Option<(String, usize, usize)> {
    let (task, name) = line.split_once(' ')?;
    let index = task.split_once('_')?.1.parse().ok()?;
    Some((task.to_string(), name.rsplit_once('-')?.1.parse().ok()?, index))
}

fn record(folder: &Path, block: usize) -> PathBuf {
    folder.join(format!("rounds/tiny-{}.json", BLOCKS[block]))
}

#[test]
fn a_cancelled_block_is_missing_until_it_is_submitted_again() {
    let Some(cluster) = Cluster::start("MaxArraySize=3\n") else {
        return;
    };
    let place = tempfile::tempdir().unwrap();
    let experiment = tiny(place.path(), "tiny.toml");
    let folder = place.path().join("it's \"a\" $(touch owned) `run`, %j\n<script>;touch owned&");
    let submit = |arguments: &[&str]| {
        let mut command = repro();
        command
            .arg("submit")
            .args(arguments)
            .args(["--slurm", "--now", "--time", "5", "--output"])
            .arg(&folder);
        let output = cluster.command(command);
        assert_eq!(output.status.code(), Some(0), "{}{}", stderr(&output), cluster.logs());
        stdout(&output)
    };
    let sent = submit(&[experiment.to_str().unwrap(), "--quick"]);
    let words = ["first job: ", "blocks 0-2: job ", "blocks 3-4: job "];
    assert!(sent.lines().zip(words).filter(|(line, word)| line.starts_with(word)).count() == 3, "{sent}");
    assert_eq!(submit(&[]), "", "what waits in the queue is not sent twice");

    let cancelled = cluster.cancel_a_block(&folder);
    cluster.wait_until_idle();
    let output = collect(&folder);
    assert_eq!(output.status.code(), Some(3), "{}{}", stderr(&output), logs(&folder));
    let (stage, round) = BLOCKS[cancelled].split_once('-').unwrap();
    let missing = format!("tiny {stage} {}\n", round.parse::<usize>().unwrap());
    assert!(
        stdout(&output).contains(&missing) && stdout(&output).contains("missing are 1 of"),
        "{}",
        stdout(&output)
    );

    assert!(submit(&[]).starts_with(&format!("blocks {cancelled}: job ")), "only what is missing is sent");
    cluster.wait_until_idle();
    let output = collect(&folder);
    assert_eq!(output.status.code(), Some(0), "{}{}{}", stdout(&output), stderr(&output), logs(&folder));
    let plain = place.path().join("plain");
    plain_run(&experiment, &plain);
    assert_eq!(essence(&folder), essence(&plain));
    assert!(!place.path().join("owned").exists());
    assert!(fs::read_dir(folder.join("slurm/logs")).unwrap().count() >= 7, "a log a job and task");
}

/// All that jobs said.
fn logs(folder: &Path) -> String {
    let logs = fs::read_dir(folder.join("slurm/logs")).into_iter().flatten().flatten();
    logs.map(|entry| fs::read_to_string(entry.path()).unwrap_or_default()).collect()
}
