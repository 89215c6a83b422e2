//! What verbs print: text for people or, with `--json`, one JSON document.

use std::io::{self, Write};

use anyhow::{Context, Result};
use serde::Serialize;

/// How the command was asked to print.
#[derive(Debug, Clone, Copy)]
pub struct Output {
    pub json: bool,
}

impl Output {
    /// Prints `value` as JSON where that was asked for, and `text` otherwise.
    pub fn show(
        self,
        value: &impl Serialize,
        text: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<()> {
        let mut out = io::stdout().lock();
        if self.json {
            let document = serde_json::to_string_pretty(value)?;
            writeln!(out, "{document}").context("cannot print")
        } else {
            text(&mut out).context("cannot print")
        }
    }
}
