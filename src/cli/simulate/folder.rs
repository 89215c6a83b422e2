//! The folder that a simulation writes to.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::base::files::is_leftover;
use crate::base::input::InputError;
use crate::scene::checkpoint;
use crate::scene::output::{probes, pvd};

/// A folder that is there, can be written, and holds nothing but what a former simulation left. One that was created for a
/// simulation that is then refused goes again.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// What was created, the innermost folder first.
    created: Vec<PathBuf>,
    former: Vec<PathBuf>,
}

impl Folder {
    /// Makes sure of all that, and changes nothing but to create a folder that is not there.
    pub fn check(path: &Path) -> Result<Folder> {
        if path.exists() && !path.is_dir() {
            return Err(refused(path, "is a file").into());
        }
        let missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        let created = path.ancestors().take_while(missing).map(Path::to_path_buf).collect();
        let mut folder = Folder { path: path.to_path_buf(), created, former: Vec::new() };
        fs::create_dir_all(path).map_err(|error| refused(path, &format!("cannot be created: {error}")))?;
        let entries =
            fs::read_dir(path).map_err(|error| refused(path, &format!("cannot be read: {error}")))?;
        for entry in entries {
            let entry = entry.context("cannot list the output folder")?;
            let name = entry.file_name().to_string_lossy().into_owned();
            folder.former.push(entry.path());
            if !is_ours(&name) {
                return Err(refused(path, &format!("holds `{name}`")).into());
            }
        }
        let probe = path.join(format!("particles-probe.csv.{}.part", std::process::id()));
        fs::write(&probe, b"").map_err(|error| refused(path, &format!("cannot be written: {error}")))?;
        let _ = fs::remove_file(probe);
        Ok(folder)
    }

    /// Removes what a former simulation left, so that a folder never mixes two.
    pub fn clear(mut self) -> Result<PathBuf> {
        self.created.clear();
        for file in &self.former {
            fs::remove_file(file).map_err(|error| {
                refused(&self.path, &format!("holds files that cannot be removed: {error}"))
            })?;
        }
        Ok(self.path.clone())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        for folder in &self.created {
            // One that is not empty is somebody else's by now, and stays.
            let _ = fs::remove_dir(folder);
        }
    }
}

fn is_ours(name: &str) -> bool {
    let numbered = [("particles-", ".csv"), ("particles-", ".vtu"), ("frame-", ".png")];
    numbered.iter().any(|(begin, end)| name.starts_with(begin) && name.ends_with(end))
        || [pvd::FILE_NAME, probes::FILE_NAME, checkpoint::FILE_NAME].contains(&name)
        || is_leftover(name)
}

fn refused(folder: &Path, found: &str) -> InputError {
    let found = format!("`{}`, which {found}", folder.display());
    let allowed = "allowed is a folder that is new, empty or holds only what `simulate` writes: particles-*.csv, \
                   particles-*.vtu, particles.pvd, frame-*.png, probes.csv, state.checkpoint";
    InputError::new("command line", "--output", found, allowed)
}
