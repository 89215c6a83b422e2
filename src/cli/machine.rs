use std::io::{self, Write};
use std::path::Path;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use crate::cli::Exit;
use crate::cli::output::Output;
use crate::experiment::factors::Usable;
use crate::experiment::machine::{Machine, Topology, allowed_cpus};
use crate::experiment::peaks::{self, Peak, Peaks, PeaksMeasurement, PeaksRequest};

#[derive(Debug, Args)]
pub struct MachineVerb {
    /// Measure what it reads, writes and computes at most, on one thread and on all; takes some ten seconds
    #[arg(long)]
    peaks: bool,
}

#[derive(Debug, Serialize)]
struct Shown {
    #[serde(flatten)]
    machine: Machine,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    peaks: Vec<Peaks>,
}

impl MachineVerb {
    pub fn run(self, output: Output) -> Result<Exit> {
        let machine = Machine::observe(Path::new("/"), None);
        let peaks = if self.peaks { measured()? } else { Vec::new() };
        let shown = Shown { machine, peaks };
        output.show(&shown, |out| {
            writeln!(out, "{} ({})", shown.machine.alias, shown.machine.machine_id)?;
            for fact in &shown.machine.facts {
                writeln!(out, "{:<8} {:<28} {} {}", fact.group, fact.key, fact.value, fact.unit)?;
            }
            shown.peaks.iter().try_for_each(|peaks| print(peaks, out))
        })?;
        Ok(Exit::Done)
    }
}

/// One thread, then all.
fn measured() -> Result<Vec<Peaks>> {
    let usable = Usable::of(&Topology::read(Path::new("/"), &allowed_cpus()));
    let measure = |threads: usize| {
        let (pin, measurement) = ("close".to_string(), PeaksMeasurement::USUAL);
        peaks::measure(&PeaksRequest { threads, pin, measurement })
    };
    peaks::thread_counts(usable).into_iter().map(measure).collect()
}

fn print(peaks: &Peaks, out: &mut dyn Write) -> io::Result<()> {
    writeln!(
        out,
        "peaks on {} thread(s), instructions {}: median [lowest, highest] of {} repetitions; working sets are a thread's, \
         rates are of all threads together",
        peaks.threads, peaks.instructions, peaks.repetitions
    )?;
    for Peak { kind, working_set_bytes, median_per_s, lowest_per_s, highest_per_s } in &peaks.peaks {
        let place = match working_set_bytes {
            0 => "registers".to_string(),
            bytes => format!("{} KiB", bytes >> 10),
        };
        let [median, low, high] = [median_per_s, lowest_per_s, highest_per_s].map(|rate| rate / 1e9);
        let (name, unit) = (kind.name(), kind.unit());
        writeln!(out, "{name:<13} {place:<11} {median:8.2} [{low:.2}, {high:.2}] {unit}")?;
    }
    Ok(())
}
