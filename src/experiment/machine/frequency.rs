//! How fast the processor's clock runs and who decides that.

use std::collections::BTreeSet;

use super::processor::Processor;
use super::reading::{Fact, Reading};
use super::source::Source;
use super::topology::Topology;

/// The facts about the clock of the CPUs in `whole`; single values come from the first of them.
pub(super) fn facts(source: &Source, processor: &Processor, whole: &Topology) -> Vec<Fact> {
    let first = whole.cpus.first().map_or(0, |cpu| cpu.id);
    let policy = |file: &str| megahertz(&policy_text(source, first, file));
    let nominal = format!("sys/devices/system/cpu/cpu{first}/acpi_cppc/nominal_freq");
    let base = policy("base_frequency").or_else(|| source.text(&nominal).extract(positive));
    let current = policy("scaling_cur_freq").or_else(|| processor.frequency_mhz());
    let frequency = |key, value| Fact::new("cpu", key, "MHz", value);
    let setting = |key, value| Fact::new("cpu", key, "", value);
    vec![
        frequency("base_frequency_mhz", base),
        frequency("current_frequency_mhz", current),
        frequency("highest_frequency_mhz", policy("cpuinfo_max_freq")),
        setting("frequency_governor", all_of(source, whole, "scaling_governor")),
        setting("frequency_driver", all_of(source, whole, "scaling_driver")),
        setting("boost", boost(source)),
    ]
}

fn policy_text(source: &Source, cpu: usize, file: &str) -> Reading {
    source.text(&format!("sys/devices/system/cpu/cpu{cpu}/cpufreq/{file}"))
}

/// The kernel writes kHz.
fn megahertz(kilohertz: &Reading) -> Reading {
    kilohertz.extract(|text| positive(text).map(|kilohertz| kilohertz / 1000.0))
}

fn positive(text: &str) -> Option<f64> {
    let number: u32 = text.parse().ok()?;
    (number > 0).then_some(f64::from(number))
}

/// The settings of all CPUs, joined by `+` where they differ.
fn all_of(source: &Source, whole: &Topology, file: &str) -> Reading {
    let readings = whole.cpus.iter().map(|cpu| policy_text(source, cpu.id, file));
    let readings: Vec<Reading> = readings.collect();
    let values: BTreeSet<&str> = readings.iter().filter_map(Reading::value).collect();
    if values.is_empty() {
        return readings.into_iter().next().unwrap_or(Reading::Unavailable);
    }
    Reading::known(values.into_iter().collect::<Vec<_>>().join("+"))
}

/// Some drivers tell whether the clock may exceed its base frequency, one tells the opposite.
fn boost(source: &Source) -> Reading {
    source.switch("sys/devices/system/cpu/cpufreq/boost").or_else(|| {
        let forbidden = source.switch("sys/devices/system/cpu/intel_pstate/no_turbo");
        forbidden.extract(|answer| Some(if answer == "yes" { "no" } else { "yes" }))
    })
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{self, Tree};
    use super::*;

    fn value(tree: &Tree, key: &str) -> String {
        let source = tree.source();
        let processor = Processor::read(&source);
        let topology = Topology::read(tree.root(), &[0, 1, 2, 3]);
        let facts = facts(&source, &processor, &topology);
        let fact = facts.into_iter().find(|fact| fact.key == key);
        fact.unwrap().value.to_string()
    }

    #[test]
    fn the_server_tells_its_clock_in_megahertz() {
        let tree = fixture::server_with_clocks();
        assert_eq!(value(&tree, "base_frequency_mhz"), "2400");
        assert_eq!(value(&tree, "current_frequency_mhz"), "2450");
        assert_eq!(value(&tree, "frequency_governor"), "performance");
        assert_eq!(value(&tree, "boost"), "yes");
    }

    #[test]
    fn settings_that_differ_are_all_told() {
        let tree = fixture::server_with_clocks();
        let path = "sys/devices/system/cpu/cpu3/cpufreq/scaling_governor";
        tree.write(path, "powersave\n");
        assert_eq!(value(&tree, "frequency_governor"), "performance+powersave");
        tree.write("sys/devices/system/cpu/intel_pstate/no_turbo", "1\n");
        assert_eq!(value(&tree, "boost"), "no");
    }

    #[test]
    fn a_machine_without_clock_control_has_no_clock_facts() {
        let tree = fixture::arm_board();
        let topology = Topology::read(tree.root(), &[0]);
        let processor = Processor::read(&tree.source());
        let facts = facts(&tree.source(), &processor, &topology);
        assert!(facts.iter().all(|fact| fact.value == Reading::Unavailable));
    }
}
