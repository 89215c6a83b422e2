//! Scenes that are files of whoever runs them, and the files that these name: a run keeps copies, so that its archive has them.
//!
//! Each scene has a folder of its own below `scenes/`, called after its file and a digest of its path. In it a file that the
//! scene names in another folder has another name, and the copy of the scene says so.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

use crate::base::files::write_whole;
use crate::experiment::plan::Plan;
use crate::scene::Scene;

/// The folder of all copies below the run folder.
pub const FOLDER: &str = "scenes";

/// Where a run keeps the scene file with that path, below the run folder.
pub fn place(scene: &str) -> String {
    let path = Path::new(scene);
    let part = |part: Option<&std::ffi::OsStr>| {
        let text = part.map(|part| part.to_string_lossy().into_owned()).unwrap_or_default();
        text.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect()
    };
    let (stem, file): (String, String) = (part(path.file_stem()), part(path.file_name()));
    format!("{FOLDER}/{stem}-{}/{file}", digest(scene))
}

/// What a copy of a scene calls a file.
fn name(file: &str) -> String {
    let last = Path::new(file).file_name().map(|name| name.to_string_lossy().into_owned());
    match last {
        Some(last) if last != file => format!("{}-{last}", digest(file)),
        _ => file.to_string(),
    }
}

fn digest(text: &str) -> String {
    Sha256::digest(text).iter().take(4).map(|byte| format!("{byte:02x}")).collect()
}

/// Copies the scene files of a plan into its run folder.
pub fn keep(folder: &Path, plan: &Plan) -> Result<()> {
    let mut files: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
    let mut add = |path, scene: &Scene| files.entry(path).or_default().extend(scene.files());
    for experiment in &plan.experiments {
        experiment.groups.iter().for_each(|group| add(experiment.spec.scene.as_str(), &group.scene));
        experiment.runs.iter().for_each(|run| add(run.run.scene.as_str(), &run.scene));
    }
    files.retain(|path, _| Path::new(path).is_file());
    files.iter().try_for_each(|(path, named)| copy(folder, path, named))
}

fn copy(folder: &Path, path: &str, named: &BTreeSet<String>) -> Result<()> {
    let read = |path: &Path| fs::read(path).with_context(|| format!("cannot read {}", path.display()));
    let target = folder.join(place(path));
    let beside = target.parent().unwrap_or(folder);
    fs::create_dir_all(beside).with_context(|| format!("cannot create {}", beside.display()))?;
    let write = |target: &Path, bytes: &[u8]| {
        write_whole(target, bytes).with_context(|| format!("cannot write {}", target.display()))
    };
    let mut text = String::from_utf8(read(Path::new(path))?).with_context(|| format!("{path}: not text"))?;
    for file in named {
        let source = Path::new(path).parent().unwrap_or(Path::new("")).join(file);
        write(&beside.join(name(file)), &read(&source)?)?;
        for quote in ['"', '\''] {
            text = text.replace(&format!("{quote}{file}{quote}"), &format!("{quote}{}{quote}", name(file)));
        }
    }
    write(&target, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_have_names_of_their_own_and_stay_in_their_folder() {
        let there = place("/somewhere/else/my tank.toml");
        assert!(there.starts_with("scenes/my-tank-") && there.ends_with("/my-tank.toml"), "{there}");
        assert_ne!(place("a/tank.toml"), place("b/tank.toml"));
        assert_eq!(name("hull.stl"), "hull.stl");
        let elsewhere = name("../meshes/hull.stl");
        assert!(elsewhere.ends_with("-hull.stl") && !elsewhere.contains('/'), "{elsewhere}");
        assert!(!name("..").contains('/'));
    }
}
