//! The list of everything recorded about a machine, its system and the program.

use std::collections::{BTreeMap, BTreeSet};
use std::env::consts;

use super::noise::{cpu_pressure_avg10, load_average};
use super::processor::Processor;
use super::quota::Quota;
use super::reading::{Fact, Reading};
use super::source::{Source, field};
use super::surroundings::{container, control_group_version, virtualised};
use super::topology::Topology;
use super::{cache, frequency};

/// All facts: `whole` are the CPUs of the machine, `usable` those that this process may use.
pub(super) fn collect(source: &Source, whole: &Topology, usable: &Topology) -> Vec<Fact> {
    let processor = Processor::read(source);
    let mut facts = identity_facts(source, &processor);
    facts.extend(count_facts(source, whole, usable));
    facts.extend(frequency::facts(source, &processor, whole));
    facts.extend(cache::facts(source, whole));
    facts.extend(memory_facts(source));
    facts.extend(system_facts(source));
    facts.extend(build_facts());
    facts
}

fn identity_facts(source: &Source, processor: &Processor) -> Vec<Fact> {
    let fact = |key, value| Fact::new("cpu", key, "", value);
    vec![
        fact("model_name", processor.model_name()),
        fact("vendor", processor.vendor()),
        fact("generation", processor.generation()),
        fact("architecture", Reading::known(consts::ARCH)),
        fact("instruction_sets", processor.instruction_sets()),
        fact("virtualised", virtualised(source, processor)),
    ]
}

fn count_facts(source: &Source, whole: &Topology, usable: &Topology) -> Vec<Fact> {
    let fact = |key, value| Fact::new("cpu", key, "", value);
    let online = source.cpu_list("sys/devices/system/cpu/online").len();
    let nodes = source.numbered_entries("sys/devices/system/node", "node").len();
    let present = |count: usize| Reading::found(Some(count).filter(|&count| count > 0));
    let described = |count: usize| Reading::found(is_described(source, whole).then_some(count));
    vec![
        fact("online_logical_cpus", present(online)),
        fact("usable_logical_cpus", present(usable.cpus.len())),
        fact("physical_cores", described(whole.physical_cores())),
        fact("usable_physical_cores", described(usable.physical_cores())),
        fact("sockets", described(sockets(whole))),
        fact("threads_per_core", described(threads_per_core(whole))),
        fact("smt_active", source.switch("sys/devices/system/cpu/smt/active")),
        fact("numa_nodes", present(nodes)),
        fact("hybrid", hybrid(source, whole)),
        Fact::new("cpu", "cgroup_cpu_quota", "CPUs", Quota::read(source).reading()),
    ]
}

/// Without the kernel's description every CPU would pass for a core, which is no fact.
fn is_described(source: &Source, whole: &Topology) -> bool {
    whole
        .cpus
        .first()
        .is_some_and(|cpu| source.exists(&format!("sys/devices/system/cpu/cpu{}/topology", cpu.id)))
}

fn sockets(topology: &Topology) -> usize {
    let packages: BTreeSet<usize> = topology.cpus.iter().map(|cpu| cpu.package).collect();
    packages.len()
}

/// The most hardware threads on any core.
fn threads_per_core(topology: &Topology) -> usize {
    let mut threads: BTreeMap<usize, usize> = BTreeMap::new();
    for cpu in &topology.cpus {
        *threads.entry(cpu.core).or_default() += 1;
    }
    threads.into_values().max().unwrap_or(0)
}

/// The kernel counts the events of all CPUs as one device `cpu` only where all are of one kind.
fn hybrid(source: &Source, whole: &Topology) -> Reading {
    Reading::yes_or_no(whole.is_hybrid())
        .or_else(|| Reading::yes_or_no(source.exists("sys/devices/cpu/type").then_some(false)))
}

fn memory_facts(source: &Source) -> Vec<Fact> {
    let fact = |key, unit, value| Fact::new("memory", key, unit, value);
    let memory = source.text("proc/meminfo");
    let entry = |key: &str| memory.extract(|text| field(text, key));
    let huge = source.text("sys/kernel/mm/transparent_hugepage/enabled");
    let balancing = source.text("proc/sys/kernel/numa_balancing");
    vec![
        fact("total_bytes", "bytes", entry("MemTotal").extract(kibibytes)),
        fact("available_bytes", "bytes", entry("MemAvailable").extract(kibibytes)),
        fact("transparent_huge_pages", "", huge.extract(chosen)),
        fact("huge_pages_total", "pages", entry("HugePages_Total").extract(count)),
        fact("numa_balancing", "", balancing),
    ]
}

/// The kernel writes `kB` and means units of 1024 bytes.
fn kibibytes(text: &str) -> Option<u64> {
    let number: u64 = text.strip_suffix("kB")?.trim().parse().ok()?;
    number.checked_mul(1024)
}

fn count(text: &str) -> Option<u64> {
    text.parse().ok()
}

/// The word in brackets among the choices of a setting, as in `always [madvise] never`.
fn chosen(text: &str) -> Option<String> {
    let (_, rest) = text.split_once('[')?;
    let (word, _) = rest.split_once(']')?;
    Some(word.to_owned()).filter(|word| !word.is_empty())
}

fn system_facts(source: &Source) -> Vec<Fact> {
    let fact = |key, unit, value| Fact::new("os", key, unit, value);
    let load = |place| {
        let loads = source.text("proc/loadavg");
        loads.extract(|_| load_average(source, place))
    };
    let pressure = source.text("proc/pressure/cpu");
    let clock = "sys/devices/system/clocksource/clocksource0/current_clocksource";
    let layout = source.text("proc/sys/kernel/randomize_va_space");
    let counters = source.text("proc/sys/kernel/perf_event_paranoid");
    vec![
        fact("os_kind", "", Reading::known(consts::OS)),
        fact("kernel", "", source.text("proc/sys/kernel/osrelease")),
        fact("distribution", "", distribution(source)),
        fact("load_1min", "threads", load(0)),
        fact("load_5min", "threads", load(1)),
        fact("load_15min", "threads", load(2)),
        fact("cpu_pressure_avg10", "%", pressure.extract(|_| cpu_pressure_avg10(source))),
        fact("clock_source", "", source.text(clock)),
        fact("address_space_randomisation", "", layout),
        fact("perf_event_paranoid", "", counters),
        fact("cgroup_version", "", control_group_version(source)),
        fact("container_hint", "", container(source)),
    ]
}

fn distribution(source: &Source) -> Reading {
    let release = source.text("etc/os-release");
    let release = release.or_else(|| source.text("usr/lib/os-release"));
    release.extract(|text| {
        let name = text.lines().find_map(|line| line.strip_prefix("PRETTY_NAME="))?;
        Some(name.trim_matches(['"', '\'']).to_owned())
    })
}

/// What the build script found out about this program.
fn build_facts() -> Vec<Fact> {
    let checks = Reading::yes_or_no(Some(cfg!(debug_assertions)));
    let recorded = [
        ("compiler", env!("REPRO_RUSTC_VERSION")),
        ("target", env!("REPRO_TARGET")),
        ("target_features", env!("REPRO_TARGET_FEATURES")),
        ("opt_level", env!("REPRO_OPT_LEVEL")),
        ("rustflags", env!("REPRO_RUSTFLAGS")),
        ("commit", env!("REPRO_COMMIT")),
        ("dirty", env!("REPRO_DIRTY")),
        ("source_hash", env!("REPRO_SOURCE_HASH")),
    ];
    recorded
        .into_iter()
        .map(|(key, text)| (key, Reading::from(text.to_owned())))
        .chain([("debug_assertions", checks)])
        .map(|(key, value)| Fact::new("build", key, "", value))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_and_amounts_are_read_strictly() {
        assert_eq!(chosen("always [madvise] never").as_deref(), Some("madvise"));
        for text in ["always madvise", "[]", "]x[", "["] {
            assert_eq!(chosen(text), None);
        }
        assert_eq!(kibibytes("24 kB"), Some(24_576));
        for text in ["24", "kB", "-1 kB", "18446744073709551615 kB"] {
            assert_eq!(kibibytes(text), None);
        }
    }
}
