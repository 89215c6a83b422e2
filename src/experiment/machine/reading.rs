//! One recorded property of a machine, and the three answers a look-up can give.

use std::fmt;
use std::io;

use serde::{Deserialize, Serialize};

use super::scrub::without_paths;

/// The longest value kept, in characters; a broken system file may hold far more.
const LONGEST_VALUE: usize = 2048;

/// The answer to one look-up: a value, or the reason there is none.
///
/// It is written as a plain string: the value itself, `unavailable` or `denied`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum Reading {
    /// What the system answered, in the unit its [`Fact`] names.
    Value(String),
    /// The property does not exist on this machine, or its text makes no sense.
    Unavailable,
    /// The property exists, but this process may not read it.
    Denied,
}

impl Reading {
    /// The value, where there is one, in the unit its [`Fact`] names.
    pub fn value(&self) -> Option<&str> {
        match self {
            Reading::Value(text) => Some(text),
            Reading::Unavailable | Reading::Denied => None,
        }
    }

    pub(super) fn known(value: impl ToString) -> Reading {
        Reading::Value(value.to_string())
    }

    pub(super) fn found(value: Option<impl ToString>) -> Reading {
        value.map_or(Reading::Unavailable, Reading::known)
    }

    pub(super) fn yes_or_no(answer: Option<bool>) -> Reading {
        Reading::found(answer.map(|yes| if yes { "yes" } else { "no" }))
    }

    /// Only a refusal counts as denied: every other failure means that the kernel has nothing to
    /// say, such as a frequency file of a CPU that has just gone offline.
    pub(super) fn from_error(error: &io::Error) -> Reading {
        match error.kind() {
            io::ErrorKind::PermissionDenied => Reading::Denied,
            _ => Reading::Unavailable,
        }
    }

    /// Extracts a value from the text read; text without one makes the reading unavailable.
    pub(super) fn extract<'a, T: ToString>(&'a self, pick: impl FnOnce(&'a str) -> Option<T>) -> Reading {
        match self {
            Reading::Value(text) => Reading::found(pick(text)),
            other => other.clone(),
        }
    }

    /// Asks another source where this one gave no value; a refusal by either remains visible.
    pub(super) fn or_else(self, other: impl FnOnce() -> Reading) -> Reading {
        match self {
            Reading::Value(_) => self,
            Reading::Unavailable => other(),
            Reading::Denied => match other() {
                Reading::Unavailable => Reading::Denied,
                answer => answer,
            },
        }
    }
}

impl From<String> for Reading {
    fn from(text: String) -> Reading {
        match text.as_str() {
            "unavailable" => Reading::Unavailable,
            "denied" => Reading::Denied,
            _ => Reading::Value(text),
        }
    }
}

impl From<Reading> for String {
    fn from(reading: Reading) -> String {
        reading.to_string()
    }
}

impl fmt::Display for Reading {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Reading::Value(text) => text,
            Reading::Unavailable => "unavailable",
            Reading::Denied => "denied",
        })
    }
}

/// One recorded property of the machine, its system or the program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fact {
    /// The subject: `cpu`, `cache`, `memory`, `os` or `build`.
    pub group: String,
    /// The property's name, unique among all the facts of a machine.
    pub key: String,
    /// What was found, in `unit`.
    pub value: Reading,
    /// The unit of the value, empty where it has none.
    pub unit: String,
}

impl Fact {
    /// Every recorded value passes here, so that none holds a path, a line break or a flood.
    pub(super) fn new(group: &str, key: &str, unit: &str, value: Reading) -> Fact {
        Fact {
            group: group.to_owned(),
            key: key.to_owned(),
            value: value.extract(|text| Some(presentable(text)).filter(|text| !text.is_empty())),
            unit: unit.to_owned(),
        }
    }
}

fn presentable(text: &str) -> String {
    let one_line: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let without_paths = without_paths(one_line.trim());
    without_paths.chars().take(LONGEST_VALUE).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_is_written_as_a_plain_string_and_read_back() {
        for (reading, text) in [
            (Reading::known("tsc"), "\"tsc\""),
            (Reading::Unavailable, "\"unavailable\""),
            (Reading::Denied, "\"denied\""),
        ] {
            assert_eq!(serde_json::to_string(&reading).unwrap(), text);
            assert_eq!(serde_json::from_str::<Reading>(text).unwrap(), reading);
        }
    }

    #[test]
    fn only_a_refusal_is_denied() {
        let refused = io::Error::from(io::ErrorKind::PermissionDenied);
        let missing = io::Error::from(io::ErrorKind::NotFound);
        assert_eq!(Reading::from_error(&refused), Reading::Denied);
        assert_eq!(Reading::from_error(&missing), Reading::Unavailable);
    }

    #[test]
    fn a_refusal_stays_visible_unless_another_source_answers() {
        let denied = || Reading::Denied;
        assert_eq!(denied().or_else(|| Reading::Unavailable), Reading::Denied);
        assert_eq!(Reading::Unavailable.or_else(denied), Reading::Denied);
        assert_eq!(denied().or_else(|| Reading::known(1)), Reading::known("1"));
    }

    #[test]
    fn values_become_short_single_lines_without_paths() {
        let value = |text: &str| Fact::new("os", "kernel", "", Reading::known(text)).value;
        assert_eq!(value("a\nb\0c"), Reading::known("a b c"));
        assert_eq!(value("at /srv/data/tool"), Reading::known("at tool"));
        assert_eq!(value("\n \t"), Reading::Unavailable);
        let flood = value(&"x".repeat(60_000));
        assert_eq!(flood.value().map(str::len), Some(LONGEST_VALUE));
    }
}
