//! What a twin trial leaves behind, from either language, and what of it is believed.

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};

use crate::experiment::record::{Status, TrialRecord};

/// The language of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Language {
    Rust,
    C,
}

impl Language {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Language::Rust => "rust",
            Language::C => "c",
        }
    }
}

/// One program with one distance test. It walks both layouts.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TwinCell {
    pub language: Language,
    pub compiler: String,
    /// The processor that it was compiled for: `portable`, `native`, or what the Rust build names.
    pub target_cpu: String,
    pub distance_test: String,
}

impl TwinCell {
    /// The name in messages.
    pub fn label(&self) -> String {
        format!("{}/{}/{}", self.compiler, self.target_cpu, self.distance_test)
    }
}

/// How a C program came about.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TwinBuild {
    /// The first line of what the compiler says about itself.
    pub version: String,
    /// The command that compiled the program, without folders.
    pub command: String,
}

/// One pass over both layouts, seconds of wall time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TwinPass {
    /// Whether the list was walked before the relocated array.
    pub list_first: bool,
    pub list_s: f64,
    /// The copy of all positions, just before the loop that reads it.
    pub relocation_s: f64,
    pub relocated_s: f64,
}

/// What a program says that it measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TwinAnswer {
    pub particles: usize,
    pub threads: usize,
    pub passes: Vec<TwinPass>,
    /// FNV-1a, 64 bits, over the bits of all sums; the program found them the same in both layouts.
    pub digest: String,
}

/// The part of a trial's record that belongs to the twin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TwinOutcome {
    pub cell: TwinCell,
    /// `None` for the Rust loop, whose compiler and flags are facts of the machine.
    pub build: Option<TwinBuild>,
    /// `None` unless the trial's status is `ok`.
    pub answer: Option<TwinAnswer>,
}

/// What an answer must agree with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Asked {
    pub particles: usize,
    pub threads: usize,
    pub passes: usize,
}

impl TwinAnswer {
    /// Reads what a program wrote and refuses what was not asked for.
    pub fn parse(text: &[u8], asked: Asked) -> Result<TwinAnswer> {
        let answer: TwinAnswer = serde_json::from_slice(text).context("its answer cannot be read")?;
        answer.check(asked.threads)?;
        let (particles, passes) = (answer.particles, answer.passes.len());
        ensure!(particles == asked.particles, "it read {particles} particles, not {}", asked.particles);
        ensure!(passes == asked.passes, "it measured {passes} passes, not {}", asked.passes);
        Ok(answer)
    }

    /// Refuses what no clock can have measured, and another number of threads.
    pub fn check(&self, threads: usize) -> Result<()> {
        ensure!(self.threads == threads, "it ran on {} threads, not {threads}", self.threads);
        ensure!(!self.passes.is_empty() && self.particles > 0, "an answer without passes or particles");
        for (k, pass) in self.passes.iter().enumerate() {
            let times = [pass.list_s, pass.relocation_s, pass.relocated_s];
            let valid = times.iter().all(|time| time.is_finite() && *time >= 0.0);
            let walked = pass.list_s > 0.0 && pass.relocated_s > 0.0;
            ensure!(valid && walked, "pass {k}: times {times:?} cannot be");
        }
        let plain = |digit: u8| digit.is_ascii_digit() || (b'a'..=b'f').contains(&digit);
        let digest = &self.digest;
        ensure!(digest.len() == 16 && digest.bytes().all(plain), "{digest:?} is no digest of its sums");
        Ok(())
    }
}

impl TwinOutcome {
    /// Refuses a record of an `ok` trial that has no answer or one that cannot be.
    pub fn check(&self, threads: usize) -> Result<()> {
        self.answer.as_ref().context("an `ok` trial without answer")?.check(threads)
    }
}

/// Turns trials of a round that computed other sums than its Rust loop with the same distance test into failed ones: a
/// time of other work, or of work that nothing vouches for, is no time.
pub fn require_the_sums_of_rust(trials: &mut [TrialRecord]) {
    let answer = |trial: &TrialRecord| -> Option<(Language, String, String)> {
        let twin = trial.twin.as_ref().filter(|_| trial.status == Status::Ok)?;
        let digest = twin.answer.as_ref()?.digest.clone();
        Some((twin.cell.language, twin.cell.distance_test.clone(), digest))
    };
    let in_rust: Vec<(String, String)> = trials
        .iter()
        .filter_map(answer)
        .filter(|(language, ..)| *language == Language::Rust)
        .map(|(_, test, digest)| (test, digest))
        .collect();
    for trial in trials {
        let Some((_, test, digest)) = answer(trial) else {
            continue;
        };
        let expected = in_rust.iter().find(|(of_test, _)| *of_test == test).map(|(_, digest)| digest);
        if expected == Some(&digest) {
            continue;
        }
        trial.status = Status::Failed;
        trial.reason = match expected {
            Some(expected) => {
                format!("its sums are {digest}, expected {expected}: it computed something else")
            }
            None => "the Rust loop of its round failed, so nothing vouches for its sums".to_string(),
        };
        if let Some(twin) = &mut trial.twin {
            twin.answer = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASKED: Asked = Asked { particles: 3, threads: 2, passes: 2 };
    const ANSWER: &str = "{\"particles\":3,\"threads\":2,\"passes\":[\
        {\"list_first\":true,\"list_s\":0.000000031,\"relocation_s\":0.000000000,\"relocated_s\":0.000000020},\
        {\"list_first\":false,\"list_s\":0.000000030,\"relocation_s\":0.000000001,\"relocated_s\":0.000000021}],\
        \"digest\":\"00ff00ff00ff00ff\"}\n";

    #[test]
    fn an_answer_is_read_as_it_was_written() {
        let answer = TwinAnswer::parse(ANSWER.as_bytes(), ASKED).unwrap();
        assert_eq!(answer.passes[1].relocated_s, 21e-9);
        assert!(answer.passes[0].list_first && !answer.passes[1].list_first);
        assert_eq!(answer.digest, "00ff00ff00ff00ff");
    }

    #[test]
    fn doctored_answers_are_refused() {
        for (from, to, word) in [
            ("\"particles\":3", "\"particles\":4", "4 particles"),
            ("\"threads\":2", "\"threads\":1", "1 threads, not 2"),
            ("0.000000031", "-0.000000031", "pass 0"),
            ("0.000000021", "0.0", "pass 1"),
            ("0.000000021", "1e999", "cannot be read"),
            ("0.000000021", "NaN", "cannot be read"),
            ("00ff00ff00ff00ff", "00FF00FF00FF00FF", "no digest"),
            ("00ff00ff00ff00ff", "00ff", "no digest"),
            ("\"digest\"", "\"passes\":[],\"digest\"", "cannot be read"),
            ("\"digest\"", "\"verdict\":\"holds\",\"digest\"", "cannot be read"),
            ("\"list_first\":true,", "", "cannot be read"),
            (
                ",{\"list_first\":false,\"list_s\":0.000000030,\"relocation_s\":0.000000001,\"relocated_s\":0.000000021}",
                "",
                "1 passes, not 2",
            ),
            ("}\n", "} trailing", "cannot be read"),
        ] {
            assert!(ANSWER.contains(from), "{from}");
            let error = TwinAnswer::parse(ANSWER.replace(from, to).as_bytes(), ASKED).unwrap_err();
            assert!(format!("{error:#}").contains(word), "{to}: {error:#}");
        }
        for text in ["", "{", "[]", "\u{0}"] {
            assert!(TwinAnswer::parse(text.as_bytes(), ASKED).is_err(), "{text:?}");
        }
    }

    fn trial(language: Language, test: &str, digest: &str) -> TrialRecord {
        let (compiler, target_cpu) = ("some".to_string(), "portable".to_string());
        let mut answer = TwinAnswer::parse(ANSWER.as_bytes(), ASKED).unwrap();
        answer.digest = digest.to_string();
        let cell = TwinCell { language, compiler, target_cpu, distance_test: test.to_string() };
        TrialRecord {
            position: 0,
            subject: cell.label(),
            threads: 2,
            variants: Vec::new(),
            status: Status::Ok,
            reason: String::new(),
            started_utc: String::new(),
            wall_s: 0.0,
            outcome: None,
            observation: None,
            twin: Some(TwinOutcome { cell, build: None, answer: Some(answer) }),
            validated: None,
            peaks: None,
        }
    }

    #[test]
    fn a_time_of_other_sums_is_no_time() {
        let mut trials = [
            trial(Language::C, "sqrt", "a"),
            trial(Language::Rust, "sqrt", "a"),
            trial(Language::C, "sqrt", "b"),
            trial(Language::C, "squared", "a"),
        ];
        require_the_sums_of_rust(&mut trials);
        let statuses = trials.each_ref().map(|trial| trial.status);
        assert_eq!(statuses, [Status::Ok, Status::Ok, Status::Failed, Status::Failed]);
        assert!(trials[2].reason.contains("expected a"), "{}", trials[2].reason);
        assert!(trials[3].reason.contains("nothing vouches"), "{}", trials[3].reason);
        assert!(trials[2].twin.as_ref().unwrap().answer.is_none());
    }
}
