//! The rows of the probes as a CSV file that grows while a simulation runs.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// The file's name in the output folder.
pub const FILE_NAME: &str = "probes.csv";

/// The open file. Each row goes to the system in one piece as soon as it is known, so that a run that is stopped, however it
/// is stopped, keeps all rows up to there.
#[derive(Debug)]
pub struct ProbeFile {
    path: PathBuf,
    file: File,
}

impl ProbeFile {
    /// Begins the file with the names of its columns: `step`, `time_s` and those of the probes.
    pub fn create(folder: &Path, columns: &[String]) -> Result<ProbeFile> {
        let path = folder.join(FILE_NAME);
        let file = File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
        let mut probes = ProbeFile { path, file };
        let names = ["step", "time_s"].into_iter().chain(columns.iter().map(String::as_str));
        probes.append(&names.collect::<Vec<_>>().join(","))?;
        Ok(probes)
    }

    /// Adds a row. A value that there is not, such as the height of a surface where no fluid is, is an empty cell.
    pub fn add(&mut self, step: usize, time_s: f64, values: &[Option<f64>]) -> Result<()> {
        let mut line = format!("{step},{time_s}");
        for value in values {
            line.push(',');
            if let Some(value) = value {
                // Minus zero, which sums of nothing may be, would be written with its sign.
                line.push_str(&(value + 0.0).to_string());
            }
        }
        self.append(&line)
    }

    /// Makes sure that the rows outlive a failure of power.
    pub fn finish(self) -> Result<()> {
        self.file.sync_all().with_context(|| format!("cannot write {}", self.path.display()))
    }

    fn append(&mut self, line: &str) -> Result<()> {
        let row = format!("{line}\n");
        self.file.write_all(row.as_bytes()).with_context(|| format!("cannot write {}", self.path.display()))
    }
}
