//! The hardware and software that a measurement ran on, and the order of CPUs for its threads.
//!
//! Everything is read below a root directory, so that recorded trees can stand in for machines.
//! Each fact is a value, or says that it does not exist or may not be read. No fact holds a user
//! name, a host name or an absolute path. Outside Linux most facts are unavailable.

mod cache;
mod facts;
#[cfg(test)]
pub(crate) mod fixture;
mod frequency;
mod identity;
mod noise;
mod portable;
mod processor;
mod quota;
mod reading;
mod scrub;
mod source;
mod surroundings;
mod topology;

use std::path::Path;

use serde::{Deserialize, Serialize};

pub use noise::Noise;
pub use reading::{Fact, Reading};
pub use scrub::without_paths;
pub use topology::{Cpu, Topology, allowed_cpus};

use source::{Source, field, parse_cpu_list};

/// The version of the recorded form, to be raised when the meaning of a field changes.
pub const SCHEMA_VERSION: u32 = 1;

/// What was recorded about one machine at one time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// The version of this record's form; 1 is the only one so far.
    pub schema_version: u32,
    /// A short name for readers: lower-case letters, digits and dashes, at most 40.
    pub alias: String,
    /// Twelve hexadecimal digits that stay the same as long as the hardware does.
    pub machine_id: String,
    /// The number of threads that this process can run at once, at least 1.
    pub usable_cores: usize,
    /// The number of physical cores in the whole machine, at least 1; where the system does not
    /// tell, every logical CPU counts as one.
    pub physical_cores: usize,
    /// Everything found, grouped by subject, with a unit each.
    pub facts: Vec<Fact>,
}

impl Machine {
    /// Records the machine whose kernel files lie below `root`, which is `/` or a recorded tree,
    /// under the given alias or one derived from the processor.
    pub fn observe(root: &Path, alias: Option<&str>) -> Machine {
        let source = Source::new(root);
        let allowed = allowed_below(root, &source);
        let usable = Topology::read(root, &allowed);
        let whole = Topology::read(root, &online_or(&source, allowed));
        let mut facts = facts::collect(&source, &whole, &usable);
        if !cfg!(target_os = "linux") && is_running_system(root) {
            portable::fill(&mut facts);
        }
        let physical_cores = physical_cores(&facts, &whole);
        Machine {
            schema_version: SCHEMA_VERSION,
            alias: identity::alias(alias, &facts, physical_cores),
            machine_id: identity::machine_id(&facts, &whole),
            usable_cores: usable.usable_cores(),
            physical_cores,
            facts,
        }
    }

    /// The fact with this key, in the unit that the fact names.
    pub fn fact(&self, key: &str) -> Option<&Reading> {
        let fact = self.facts.iter().find(|fact| fact.key == key)?;
        Some(&fact.value)
    }
}

fn is_running_system(root: &Path) -> bool {
    root == Path::new("/")
}

/// The running system is asked itself. A recorded tree has its own answer, since the CPUs granted
/// to the reader of a record say nothing about the recorded process.
fn allowed_below(root: &Path, source: &Source) -> Vec<usize> {
    if is_running_system(root) {
        return allowed_cpus();
    }
    let status = source.text("proc/self/status");
    let listed = status.value().and_then(|text| field(text, "Cpus_allowed_list"));
    match listed.map(parse_cpu_list) {
        Some(cpus) if !cpus.is_empty() => cpus.into_iter().collect(),
        _ => online_or(source, vec![0]),
    }
}

fn online_or(source: &Source, otherwise: Vec<usize>) -> Vec<usize> {
    let online = source.cpu_list("sys/devices/system/cpu/online");
    if online.is_empty() {
        return otherwise;
    }
    online.into_iter().collect()
}

fn physical_cores(facts: &[Fact], whole: &Topology) -> usize {
    let fact = facts.iter().find(|fact| fact.key == "physical_cores");
    let told = fact.and_then(|fact| fact.value.value()?.parse().ok());
    told.unwrap_or_else(|| whole.physical_cores())
}

#[cfg(test)]
mod tests;
