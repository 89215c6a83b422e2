//! The `[twin]` table of an experiment file: which programs run the loop, and how.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::base::parallel::MAX_THREADS;
use crate::engine::preset::Test;
use crate::experiment::factors::{Threads, Usable};
use crate::experiment::spec::check_list;
use crate::experiment::twin::outcome::{Language, TwinCell};
use crate::experiment::twin::toolchain::{TargetCpu, is_compiler_name, rust_target_cpu};

/// The most passes of one trial.
const MAX_PASSES: usize = 100_000;

/// What the programs are and what they are given. Every C compiler is a cell with every target; the Rust loop is the one
/// in this program, compiled as it was.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TwinFactors {
    /// The state to start from, by the steps that it has behind it.
    pub after_step: usize,
    pub threads: Vec<Threads>,
    pub distance_test: Vec<String>,
    /// C compilers by the names of their commands. Cells of one that is not there are not applicable.
    pub compilers: Vec<String>,
    /// The processors that the C program is compiled for.
    pub target_cpu: Vec<TargetCpu>,
}

/// How often a mode runs every cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TwinMeasurement {
    /// Rounds of all cells, each in a process of its own.
    pub rounds: usize,
    /// Passes over both layouts that a process measures.
    pub passes: usize,
}

impl TwinFactors {
    pub fn check(&self, check: Check<'_>) -> Result<(), InputError> {
        let allowed = "allowed are states after at least 1 step";
        check.require(self.after_step > 0, "twin.after_step", self.after_step, allowed)?;
        check_list(check, "twin.threads", &self.threads, false)?;
        for count in self.threads.iter().map(|threads| threads.count(Usable { threads: 1, cores: 1 })) {
            let allowed = format!("allowed are 1 to {MAX_THREADS}, `cores` or `all`");
            check.require((1..=MAX_THREADS).contains(&count), "twin.threads", count, allowed)?;
        }
        check_list(check, "twin.distance_test", &self.distance_test, false)?;
        for test in &self.distance_test {
            let known: Result<Test, String> = test.parse();
            known.map_err(|error| {
                InputError::new(check.file, "twin.distance_test", format!("`{test}`"), error)
            })?;
        }
        check_list(check, "twin.compilers", &self.compilers, false)?;
        for compiler in &self.compilers {
            let allowed = "allowed are cc, gcc or clang, with a version as in gcc-14; no path";
            check.require(
                is_compiler_name(compiler),
                "twin.compilers",
                format!("`{}`", compiler.escape_debug()),
                allowed,
            )?;
        }
        check_list(check, "twin.target_cpu", &self.target_cpu, false)
    }

    /// The thread counts, each once, with names resolved.
    pub fn thread_counts(&self, usable: Usable) -> Vec<usize> {
        let mut counts: Vec<usize> = self.threads.iter().map(|threads| threads.count(usable)).collect();
        counts.sort_unstable();
        counts.dedup();
        counts
    }

    /// The programs with each distance test, the Rust loop first.
    pub fn cells(&self) -> Vec<TwinCell> {
        let mut cells = Vec::new();
        for distance_test in &self.distance_test {
            cells.push(TwinCell {
                language: Language::Rust,
                compiler: "rustc".to_string(),
                target_cpu: rust_target_cpu().to_string(),
                distance_test: distance_test.clone(),
            });
            for compiler in &self.compilers {
                cells.extend(self.target_cpu.iter().map(|target| TwinCell {
                    language: Language::C,
                    compiler: compiler.clone(),
                    target_cpu: target.name().to_string(),
                    distance_test: distance_test.clone(),
                }));
            }
        }
        cells
    }
}

impl TwinMeasurement {
    pub fn check(self, check: Check<'_>, mode: &str) -> Result<(), InputError> {
        let key = |name: &str| format!("mode.{mode}.twin.{name}");
        let (rounds, passes) = (self.rounds, self.passes);
        check.require((1..=10_000).contains(&rounds), &key("rounds"), rounds, "allowed are 1 to 10000")?;
        let allowed = format!("allowed are 1 to {MAX_PASSES}");
        check.require((1..=MAX_PASSES).contains(&passes), &key("passes"), passes, allowed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = r#"
        after_step = 300
        threads = [1, "all"]
        distance_test = ["sqrt", "squared"]
        compilers = ["gcc", "clang-17"]
        target_cpu = ["portable", "native"]
    "#;

    fn check(text: &str) -> Result<(), InputError> {
        toml::from_str::<TwinFactors>(text).unwrap().check(Check { file: "test.toml" })
    }

    #[test]
    fn every_compiler_meets_every_target_and_test_beside_one_rust_loop() {
        let twin: TwinFactors = toml::from_str(TABLE).unwrap();
        assert_eq!(twin.check(Check { file: "test.toml" }), Ok(()));
        let cells = twin.cells();
        assert_eq!(cells.len(), 2 * (1 + 2 * 2));
        assert_eq!(cells.iter().filter(|cell| cell.language == Language::Rust).count(), 2);
        let last = cells.last().unwrap();
        assert_eq!(
            [&last.compiler, &last.target_cpu, &last.distance_test],
            ["clang-17", "native", "squared"]
        );
        let counts = |threads: usize| twin.thread_counts(Usable { threads, cores: 1 });
        assert_eq!((counts(1), counts(8)), (vec![1], vec![1, 8]));
    }

    /// A name in an experiment file becomes a process: nothing but a compiler may be named.
    #[test]
    fn what_is_no_compiler_or_state_is_refused() {
        for (from, to, words) in [
            ("\"gcc\"", "\"rm\"", ["twin.compilers", "`rm`"]),
            ("\"gcc\"", "\"/tmp/gcc\"", ["twin.compilers", "no path"]),
            ("\"gcc\"", "\"gcc -x\"", ["twin.compilers", "gcc -x"]),
            ("\"gcc\"", "\"gcc;id\"", ["twin.compilers", "gcc;id"]),
            ("\"clang-17\"", "\"gcc\"", ["twin.compilers", "once"]),
            ("after_step = 300", "after_step = 0", ["twin.after_step", "at least 1"]),
            ("[1, \"all\"]", "[0]", ["twin.threads", "1 to 1024"]),
            ("\"sqrt\"", "\"cube\"", ["twin.distance_test", "squared"]),
        ] {
            assert!(TABLE.contains(from));
            let error = check(&TABLE.replace(from, to)).unwrap_err().to_string();
            assert!(words.iter().all(|word| error.contains(word)), "{error}");
        }
        assert!(toml::from_str::<TwinFactors>(&TABLE.replace("native", "huge")).is_err());
    }
}
