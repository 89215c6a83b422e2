//! A trial's process: started, watched, stopped at its limit, and what it said.

use std::io::{Read, Write};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use serde::Serialize;

use crate::experiment::interrupt;
use crate::experiment::machine::without_paths;

/// How a child ended, if there was one.
pub enum Ending {
    /// None was started: what it should do cannot be done here.
    NotApplicable(String),
    Answer(Vec<u8>),
    Failed(String),
    OutOfMemory(String),
    Timeout,
}

/// A child that has ended, with what it wrote to standard error, without paths.
pub struct Ended {
    pub ending: Ending,
    pub complaint: String,
}

/// Kills and reaps the child on every way out, so that nothing goes on computing beside the next trial.
struct Reaped(Child);

impl Drop for Reaped {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Runs this program as a child that does what `request` says; `tick` is called now and then with the time since its start.
pub fn run(request: &impl Serialize, limit: Duration, tick: impl Fn(Duration)) -> Result<Ended> {
    let program = std::env::current_exe().context("cannot find this program's own file")?;
    let killed_before = killed_for_memory();
    let child = Command::new(program)
        .arg("trial")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .context("cannot start a trial's process")?;
    let mut child = Reaped(child);
    let (mut input, mut output, mut errors) =
        match (child.0.stdin.take(), child.0.stdout.take(), child.0.stderr.take()) {
            (Some(input), Some(output), Some(errors)) => (input, output, errors),
            _ => anyhow::bail!("a trial's process has no pipes"),
        };
    let text = serde_json::to_vec(request)?;
    // A child that died before it read its request shows in its exit status.
    let _ = input.write_all(&text);
    drop(input);
    let (sender, receiver) = channel();
    // Both at once: a child that fills one pipe waits until it is emptied.
    let listener = std::thread::spawn(move || {
        let mut complaint = Vec::new();
        let _ = errors.read_to_end(&mut complaint);
        String::from_utf8_lossy(&complaint).into_owned()
    });
    let reader = std::thread::spawn(move || {
        let mut answer = Vec::new();
        let read = output.read_to_end(&mut answer).is_ok();
        let _ = sender.send((read, answer, listener.join().unwrap_or_default()));
    });
    let began = Instant::now();
    let (read, answer, complaint) = loop {
        match receiver.recv_timeout(Duration::from_millis(500)) {
            Ok(result) => break result,
            Err(RecvTimeoutError::Disconnected) => anyhow::bail!("a trial's pipes broke"),
            Err(RecvTimeoutError::Timeout) => {
                interrupt::check()?;
                tick(began.elapsed());
                if began.elapsed() > limit {
                    return Ok(Ended { ending: Ending::Timeout, complaint: String::new() });
                }
            }
        }
    };
    let _ = reader.join();
    let status = child.0.wait().context("cannot wait for a trial's process")?;
    interrupt::check()?;
    let complaint: String = complaint.lines().map(|line| without_paths(line) + "\n").collect();
    let ending = match status.success() && read {
        true => Ending::Answer(answer),
        false => failure(status, &complaint, killed_for_memory() > killed_before),
    };
    Ok(Ended { ending, complaint })
}

/// Why a child that did not answer ended.
fn failure(status: ExitStatus, complaint: &str, killed_for_memory: bool) -> Ending {
    if complaint.contains("memory allocation of") {
        return Ending::OutOfMemory("the system had no memory left".to_string());
    }
    if was_killed(status) && killed_for_memory {
        return Ending::OutOfMemory("the system killed it for lack of memory".to_string());
    }
    Ending::Failed(format!("{} ({status})", reason(complaint)))
}

#[cfg(unix)]
fn was_killed(status: ExitStatus) -> bool {
    use std::os::unix::process::ExitStatusExt;
    status.signal() == Some(9)
}

#[cfg(not(unix))]
fn was_killed(_: ExitStatus) -> bool {
    false
}

/// How many processes the kernel has killed for lack of memory since it started; 0 where it does not tell.
fn killed_for_memory() -> u64 {
    let text = std::fs::read_to_string("/proc/vmstat").unwrap_or_default();
    let count = text.lines().find_map(|line| line.strip_prefix("oom_kill "));
    count.and_then(|count| count.trim().parse().ok()).unwrap_or(0)
}

/// What a child that failed said about it: its own error, or else the message of its panic.
fn reason(complaint: &str) -> &str {
    let mut lines = complaint.lines();
    let own = complaint.lines().find_map(|line| line.strip_prefix("repro: "));
    let panic = lines.find(|line| line.contains("panicked at")).and_then(|_| lines.next());
    own.or(panic).unwrap_or("no reason given").trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_are_what_went_wrong_and_nothing_else() {
        let panic = "\nthread 'main' panicked at src/a.rs:1:2:\nindex out of bounds\nnote: run with ...\n";
        assert_eq!(reason(panic), "index out of bounds");
        assert_eq!(reason("warning: x\nrepro: step 3, phase cg: no\n"), "step 3, phase cg: no");
        assert_eq!(reason(""), "no reason given");
    }

    #[cfg(unix)]
    #[test]
    fn lack_of_memory_is_told_from_other_failures() {
        use std::os::unix::process::ExitStatusExt;
        let (killed, aborted) = (ExitStatus::from_raw(9), ExitStatus::from_raw(6));
        assert!(matches!(failure(killed, "", true), Ending::OutOfMemory(_)));
        assert!(matches!(failure(killed, "", false), Ending::Failed(_)));
        let allocation = "memory allocation of 99 bytes failed";
        assert!(matches!(failure(aborted, allocation, false), Ending::OutOfMemory(_)));
        assert!(matches!(failure(aborted, "repro: no", true), Ending::Failed(_)));
    }
}
