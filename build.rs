//! Tells the program which compiler, options and sources it was made of.
//!
//! Nothing here may stop the build: without git or its directory, as in an unpacked archive, the
//! commit is `unavailable`. Only files that decide what the program is are watched, so an unchanged
//! tree is not built again.

use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use sha2::{Digest, Sha256};

#[path = "src/experiment/machine/scrub.rs"]
mod scrub;

/// What the hash of the measured code covers.
const MEASURED: [&str; 12] = [
    "Cargo.lock",
    "Cargo.toml",
    "scripts/twin/twin.c",
    "src/base",
    "src/engine",
    "src/experiment/memory_order.rs",
    "src/experiment/observe",
    "src/experiment/timer.rs",
    "src/experiment/trial.rs",
    "src/experiment/twin/loops.rs",
    "src/experiment/twin/trial.rs",
    "src/scene",
];
/// What decides the program, and therefore whether it differs from its commit.
const DECIDING: [&str; 7] =
    ["src", "scripts/twin/twin.c", "build.rs", "Cargo.toml", "Cargo.lock", "rust-toolchain.toml", ".cargo"];
const UNAVAILABLE: &str = "unavailable";

fn main() {
    let project = PathBuf::from(variable("CARGO_MANIFEST_DIR"));
    let git = Git { project: &project };
    for path in DECIDING {
        watch(&project.join(path));
    }
    git.watch();
    watch_flags();
    tell("REPRO_RUSTC_VERSION", &compiler_version());
    tell("REPRO_TARGET", &variable("TARGET"));
    tell("REPRO_TARGET_FEATURES", &or_none(variable("CARGO_CFG_TARGET_FEATURE")));
    tell("REPRO_OPT_LEVEL", &variable("OPT_LEVEL"));
    tell("REPRO_RUSTFLAGS", &or_none(rust_flags()));
    tell("REPRO_COMMIT", &git.commit().unwrap_or(UNAVAILABLE.into()));
    tell("REPRO_DIRTY", git.dirty().unwrap_or(UNAVAILABLE));
    tell("REPRO_SOURCE_HASH", &source_hash(&project).unwrap_or(UNAVAILABLE.into()));
}

fn variable(name: &str) -> String {
    env::var(name).unwrap_or_default()
}

fn or_none(text: String) -> String {
    if text.is_empty() { "none".into() } else { text }
}

/// A line break in a value would begin another instruction to the build.
fn tell(name: &str, value: &str) {
    let value = value.replace(['\n', '\r'], " ");
    println!("cargo::rustc-env={name}={value}");
}

/// Watching a missing file would run this script at every build.
fn watch(path: &Path) {
    if path.exists() {
        println!("cargo::rerun-if-changed={}", path.display());
    }
}

fn watch_flags() {
    for name in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_BUILD_RUSTFLAGS"] {
        println!("cargo::rerun-if-env-changed={name}");
    }
}

fn compiler_version() -> String {
    let mut command = Command::new(env::var_os("RUSTC").unwrap_or("rustc".into()));
    output(command.arg("--version")).unwrap_or(UNAVAILABLE.into())
}

/// The flags stand apart by a separator of their own, since each may hold blanks.
fn rust_flags() -> String {
    let flags = variable("CARGO_ENCODED_RUSTFLAGS");
    let flags = flags.split('\u{1f}').map(scrub::without_paths);
    flags.collect::<Vec<_>>().join(" ")
}

/// What a command writes, without surrounding blanks, if it succeeds.
fn output(command: &mut Command) -> Option<String> {
    let output = command.output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// The version control around the project, which may be missing.
struct Git<'a> {
    project: &'a Path,
}

impl Git<'_> {
    /// A hook that runs a build hands down variables which point git elsewhere. Optional locks
    /// would let a mere question write the index, which is watched.
    fn ask(&self, arguments: &[&str]) -> Option<String> {
        let mut command = Command::new("git");
        for name in ["GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE", "GIT_PREFIX"] {
            command.env_remove(name);
        }
        command.arg("--no-optional-locks").args(arguments);
        output(command.current_dir(self.project))
    }

    /// An archive may be unpacked inside an unrelated repository, whose commit says nothing.
    fn has_project(&self) -> bool {
        self.ask(&["ls-files", "--error-unmatch", "Cargo.toml"]).is_some()
    }

    fn commit(&self) -> Option<String> {
        let commit = self.has_project().then(|| self.ask(&["rev-parse", "HEAD"]))??;
        let is_hash = commit.len() >= 40 && commit.bytes().all(|digit| digit.is_ascii_hexdigit());
        is_hash.then_some(commit)
    }

    /// Compares only what decides the program, so that written results do not count.
    fn dirty(&self) -> Option<&'static str> {
        self.commit()?;
        let mut arguments = vec!["status", "--porcelain", "--untracked-files=all", "--"];
        arguments.extend(DECIDING);
        let changes = self.ask(&arguments)?;
        Some(if changes.is_empty() { "no" } else { "yes" })
    }

    /// Watches the files that change when a commit is made or another one checked out.
    fn watch(&self) {
        let paths = ["HEAD", "index", "packed-refs"].map(|name| self.path_of(name));
        paths.iter().flatten().for_each(|path| watch(path));
        let branch = self.ask(&["symbolic-ref", "--quiet", "HEAD"]);
        if let Some(branch) = branch.and_then(|name| self.path_of(&name)) {
            watch_nearest(&branch);
        }
    }

    /// Where git keeps one of its files, which differs in linked working trees.
    fn path_of(&self, name: &str) -> Option<PathBuf> {
        let path = self.ask(&["rev-parse", "--git-path", name])?;
        Some(self.project.join(path))
    }
}

/// A branch has no file of its own before its first commit or after packing, but the directory
/// above changes when it gets one.
fn watch_nearest(branch: &Path) {
    let nearest = branch.ancestors().find(|path| path.exists());
    nearest.into_iter().for_each(watch);
}

/// The first 16 digits of what `sha256sum` gives for its own list of the measured files, sorted by
/// path, so that anyone can check it.
fn source_hash(project: &Path) -> Option<String> {
    let mut files = Vec::new();
    for path in MEASURED {
        add_files(project, path, &mut files).ok()?;
    }
    files.sort();
    let mut list = String::new();
    for file in files {
        let contents = fs::read(project.join(&file)).ok()?;
        list += &format!("{}  {file}\n", hexadecimal(&contents));
    }
    Some(hexadecimal(list.as_bytes())[..16].to_owned())
}

/// Adds the regular files at or below a path, relative to the project and with forward slashes.
fn add_files(project: &Path, path: &str, files: &mut Vec<String>) -> io::Result<()> {
    let full = project.join(path);
    let Ok(kind) = fs::symlink_metadata(&full) else {
        return Ok(());
    };
    if kind.is_file() {
        files.push(path.to_owned());
    }
    if kind.is_dir() {
        for entry in fs::read_dir(&full)? {
            let name = entry?.file_name();
            add_files(project, &format!("{path}/{}", name.to_string_lossy()), files)?;
        }
    }
    Ok(())
}

fn hexadecimal(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}
