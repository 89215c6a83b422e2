use std::io::{Read, Write};

use anyhow::{Context, Result};
use clap::Args;

use crate::cli::Exit;
use crate::experiment::trial::{self, TrialRequest};

#[derive(Debug, Args)]
pub struct Trial {}

impl Trial {
    pub fn run(self) -> Result<Exit> {
        die_with_parent();
        let mut text = String::new();
        std::io::stdin().read_to_string(&mut text).context("cannot read the trial's description")?;
        let request: TrialRequest =
            serde_json::from_str(&text).context("standard input is no trial's description")?;
        let answer = trial::run(&request)?;
        std::io::stdout().write_all(&answer).context("cannot answer")?;
        Ok(Exit::Done)
    }
}

/// A driver that is killed takes its trial along: a lone trial would disturb whatever is measured next.
fn die_with_parent() {
    #[cfg(target_os = "linux")]
    let _ = rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::KILL));
}
