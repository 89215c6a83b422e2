//! The C compilers of a machine, and the program that they make of the twin's source.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use anyhow::{Context, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::files::write_whole;
use crate::experiment::machine::without_paths;
use crate::experiment::twin::outcome::TwinBuild;

/// The program in C.
pub const SOURCE: &str = include_str!("../../../scripts/twin/twin.c");
/// The flags beside those of the target: sums may not be fused or reordered, and a root needs no error number, as in Rust.
const FLAGS: [&str; 5] = ["-std=c11", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fopenmp"];
/// The compilers that understand them.
const COMPILERS: [&str; 3] = ["cc", "gcc", "clang"];

/// The processor that the C program is compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum TargetCpu {
    /// Any of this architecture, as programs are distributed: x86-64, or the compiler's default elsewhere.
    Portable,
    /// The one of this machine.
    Native,
}

impl TargetCpu {
    pub fn name(self) -> &'static str {
        match self {
            TargetCpu::Portable => "portable",
            TargetCpu::Native => "native",
        }
    }

    /// The flag that selects it, where there is one.
    fn flag(self) -> Option<&'static str> {
        let x86_64 = cfg!(target_arch = "x86_64");
        match self {
            TargetCpu::Portable => x86_64.then_some("-march=x86-64"),
            TargetCpu::Native => Some(if x86_64 { "-march=native" } else { "-mcpu=native" }),
        }
    }
}

/// The processor that this program was compiled for, as far as its flags name one.
pub fn rust_target_cpu() -> &'static str {
    target_cpu_of(env!("REPRO_RUSTFLAGS"))
}

fn target_cpu_of(flags: &str) -> &str {
    let named = flags.rsplit_once("target-cpu=").map(|(_, rest)| rest);
    named.and_then(|rest| rest.split_whitespace().next()).unwrap_or(TargetCpu::Portable.name())
}

/// Whether a name is that of a C compiler that knows our flags, perhaps with a version: `gcc`, `clang-17`.
pub fn is_compiler_name(name: &str) -> bool {
    let version = |text: &str| !text.is_empty() && text.bytes().all(|c| c.is_ascii_digit() || c == b'.');
    let (family, rest) = name.split_once('-').map_or((name, None), |(family, rest)| (family, Some(rest)));
    COMPILERS.contains(&family) && rest.is_none_or(version)
}

/// Whether a command of that name is likely to be there: for estimates only.
pub fn is_there(compiler: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(compiler).is_file())
}

/// A program that was compiled.
#[derive(Debug, Clone, PartialEq)]
pub struct Compiled {
    pub program: PathBuf,
    pub build: TwinBuild,
}

/// The programs that were asked for so far: each is compiled when it is first needed, or found to be impossible.
#[derive(Debug, Default)]
pub struct Toolchain {
    tried: RefCell<BTreeMap<(String, String), Result<Compiled, String>>>,
}

impl Toolchain {
    /// The program of a compiler for a target, in `folder`; otherwise the reason why there is none.
    pub fn compiled(
        &self,
        folder: &Path,
        compiler: &str,
        target_cpu: &str,
    ) -> Result<Result<Compiled, String>> {
        let key = (compiler.to_string(), target_cpu.to_string());
        if let Some(tried) = self.tried.borrow().get(&key) {
            return Ok(tried.clone());
        }
        let targets = [TargetCpu::Portable, TargetCpu::Native];
        let target = targets.into_iter().find(|target| target.name() == target_cpu);
        let target = target.with_context(|| format!("`{target_cpu}` is no target of the C program"))?;
        let compiled = compile(folder, compiler, target)?;
        self.tried.borrow_mut().insert(key, compiled.clone());
        Ok(compiled)
    }
}

/// Compiles the source in `folder`. The outer error is the folder's, the inner one the compiler's.
pub fn compile(folder: &Path, compiler: &str, target: TargetCpu) -> Result<Result<Compiled, String>> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
    write_whole(&folder.join("twin.c"), SOURCE.as_bytes()).context("cannot write the twin's source")?;
    let name = format!("twin-{compiler}-{}{}", target.name(), std::env::consts::EXE_SUFFIX);
    let arguments: Vec<&str> =
        FLAGS.into_iter().chain(target.flag()).chain(["-o", &name, "twin.c", "-lm"]).collect();
    let built = run(folder, compiler, &["--version"]).and_then(|version| {
        run(folder, compiler, &arguments)?;
        Ok(TwinBuild {
            version: first_line(&version),
            command: format!("{compiler} {}", arguments.join(" ")),
        })
    });
    // A program is found by a path, not by a search for its name, wherever the run folder lies.
    let program = std::path::absolute(folder.join(&name)).context("cannot find the twin's folder")?;
    Ok(built.map(|build| Compiled { program, build }))
}

/// What a compiler writes, or why it did not succeed.
fn run(folder: &Path, compiler: &str, arguments: &[&str]) -> Result<String, String> {
    let mut command = Command::new(compiler);
    command.args(arguments).current_dir(folder).stdin(Stdio::null()).env("LC_ALL", "C");
    match command.output() {
        Ok(Output { status, stdout, .. }) if status.success() => {
            Ok(String::from_utf8_lossy(&stdout).into_owned())
        }
        Ok(Output { stderr, .. }) => Err(complaint(compiler, &String::from_utf8_lossy(&stderr))),
        Err(error) if error.kind() == ErrorKind::NotFound => Err(format!("there is no {compiler} here")),
        Err(error) => Err(format!("{compiler} cannot be started: {}", error.kind())),
    }
}

/// The line with which a compiler says what is wrong.
fn complaint(compiler: &str, errors: &str) -> String {
    let wrong = errors.lines().find(|line| line.contains("error"));
    let text = without_paths(wrong.or(errors.lines().next()).unwrap_or("no reason given").trim());
    format!("{compiler} cannot compile the twin: {text}")
}

fn first_line(text: &str) -> String {
    without_paths(text.lines().next().unwrap_or("unavailable").trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_name_the_processor_that_rust_compiles_for() {
        for (flags, expected) in [
            ("none", "portable"),
            ("-C target-cpu=native", "native"),
            ("-Ctarget-cpu=x86-64-v3 -C opt-level=3", "x86-64-v3"),
            ("-C target-cpu=native -C target-cpu=znver4", "znver4"),
        ] {
            assert_eq!(target_cpu_of(flags), expected);
        }
    }

    #[test]
    fn reasons_name_the_compiler_and_no_folder() {
        let errors =
            "In file included from /home/ada/x.c:1:\n/home/ada/x.c:3:10: fatal error: omp.h: No such file\n";
        let text = complaint("clang", errors);
        assert!(text.starts_with("clang cannot compile") && text.contains("omp.h"), "{text}");
        assert!(!text.contains("ada"), "{text}");
        assert!(complaint("cc", "").contains("no reason given"));
    }

    #[test]
    fn a_compiler_that_is_missing_is_a_reason_and_not_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let toolchain = Toolchain::default();
        for _ in 0..2 {
            let reason = toolchain.compiled(folder.path(), "gcc-999.9", "native").unwrap().unwrap_err();
            assert_eq!(reason, "there is no gcc-999.9 here");
        }
        assert!(!is_there("gcc-999.9"));
    }
}
