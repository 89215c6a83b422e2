//! Named loop schedules, in the meaning that OpenMP gives the names.

use std::fmt;
use std::num::NonZeroUsize;
use std::str::FromStr;

/// The largest chunk that may be asked for.
pub const MAX_CHUNK: usize = 1 << 30;

/// How the iterations of a loop are dealt to the workers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Schedule {
    /// One contiguous share a worker, decided before the loop starts.
    Static,
    /// Chunks of a fixed size dealt out in turn before the loop starts: OpenMP's `schedule(static, chunk)`.
    Dealt(NonZeroUsize),
    /// Chunks of a fixed size from a shared counter: OpenMP's `schedule(dynamic, chunk)`, the paper's with 64.
    Dynamic(NonZeroUsize),
    /// Chunks that shrink with the remaining work, `max(chunk, remaining / threads)`: OpenMP's `schedule(guided, chunk)`.
    Guided(NonZeroUsize),
    /// Work stealing over chunks of a fixed size: what a Rust program would do by default.
    Rayon(NonZeroUsize),
}

impl Schedule {
    /// The forms that [`Schedule::from_str`] reads.
    pub const ALLOWED: &'static str = "`static`, `static:<chunk>`, `dynamic:<chunk>`, `guided:<chunk>` or \
        `rayon:<chunk>` with a chunk of 1 to 1073741824";

    /// The same over pieces of so many rows each: a chunk becomes as many pieces as hold its rows, one at least.
    pub fn over_pieces_of(self, rows: usize) -> Schedule {
        let pieces = |chunk: NonZeroUsize| NonZeroUsize::new(chunk.get() / rows).unwrap_or(NonZeroUsize::MIN);
        match self {
            Schedule::Static => Schedule::Static,
            Schedule::Dealt(chunk) => Schedule::Dealt(pieces(chunk)),
            Schedule::Dynamic(chunk) => Schedule::Dynamic(pieces(chunk)),
            Schedule::Guided(chunk) => Schedule::Guided(pieces(chunk)),
            Schedule::Rayon(chunk) => Schedule::Rayon(pieces(chunk)),
        }
    }
}

impl fmt::Display for Schedule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Schedule::Static => write!(f, "static"),
            Schedule::Dealt(chunk) => write!(f, "static:{chunk}"),
            Schedule::Dynamic(chunk) => write!(f, "dynamic:{chunk}"),
            Schedule::Guided(chunk) => write!(f, "guided:{chunk}"),
            Schedule::Rayon(chunk) => write!(f, "rayon:{chunk}"),
        }
    }
}

/// A schedule's name that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is no loop schedule: allowed are {}", Schedule::ALLOWED)]
pub struct UnknownSchedule {
    pub found: String,
}

impl FromStr for Schedule {
    type Err = UnknownSchedule;

    fn from_str(text: &str) -> Result<Self, UnknownSchedule> {
        let unknown = || UnknownSchedule { found: text.to_string() };
        if text == "static" {
            return Ok(Schedule::Static);
        }
        let (name, chunk) = text.split_once(':').ok_or_else(unknown)?;
        let chunk: NonZeroUsize = chunk.parse().map_err(|_| unknown())?;
        if chunk.get() > MAX_CHUNK {
            return Err(unknown());
        }
        match name {
            "static" => Ok(Schedule::Dealt(chunk)),
            "dynamic" => Ok(Schedule::Dynamic(chunk)),
            "guided" => Ok(Schedule::Guided(chunk)),
            "rayon" => Ok(Schedule::Rayon(chunk)),
            _ => Err(unknown()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schedules_read_back_what_they_print() {
        for name in ["static", "static:5", "dynamic:64", "guided:7", "rayon:1000"] {
            let schedule: Schedule = name.parse().unwrap();
            assert_eq!(schedule.to_string(), name);
        }
        for wrong in [
            "",
            "dynamic",
            "dynamic:0",
            "dynamic:-1",
            "dynamic:1.5",
            "fair:64",
            "static:0",
            "rayon:1073741825",
        ] {
            let error = wrong.parse::<Schedule>().unwrap_err().to_string();
            assert!(error.contains(wrong) && error.contains("dynamic:<chunk>"), "{error}");
        }
    }

    #[test]
    fn chunks_over_pieces_hold_as_many_rows() {
        let over = |name: &str| name.parse::<Schedule>().unwrap().over_pieces_of(64).to_string();
        assert_eq!(
            ["static", "static:200", "dynamic:64", "guided:1"].map(over),
            ["static", "static:3", "dynamic:1", "guided:1"]
        );
    }
}
