//! The processor's caches: sizes, how many there are, and how many CPUs share each.

use std::collections::{BTreeMap, BTreeSet};

use super::reading::{Fact, Reading};
use super::source::Source;
use super::topology::Topology;

/// The caches reported, which stay in the list where a machine lacks them.
const NAMES: [&str; 4] = ["l1d", "l1i", "l2", "l3"];

/// All caches of one name. Hybrid processors have several sizes under one name.
#[derive(Default)]
struct Cache {
    sizes: BTreeSet<u64>,
    /// The lowest CPU and the number of CPUs of each instance, which tell instances apart.
    instances: BTreeSet<(usize, usize)>,
}

/// The facts about the caches of the CPUs in `whole`.
pub(super) fn facts(source: &Source, whole: &Topology) -> Vec<Fact> {
    let mut caches = BTreeMap::new();
    for cpu in &whole.cpus {
        let directory = format!("sys/devices/system/cpu/cpu{}/cache", cpu.id);
        for index in source.numbered_entries(&directory, "index") {
            add(&mut caches, source, &format!("{directory}/index{index}"));
        }
    }
    let none = Cache::default();
    NAMES.iter().flat_map(|name| facts_of(name, caches.get(*name).unwrap_or(&none))).collect()
}

fn add(caches: &mut BTreeMap<&str, Cache>, source: &Source, directory: &str) {
    let text = |file: &str| source.text(&format!("{directory}/{file}"));
    let Some(name) = name(text("level").value(), text("type").value()) else {
        return;
    };
    let cache = caches.entry(name).or_default();
    cache.sizes.extend(text("size").value().and_then(bytes));
    let shared = source.cpu_list(&format!("{directory}/shared_cpu_list"));
    if let Some(&lowest) = shared.first() {
        cache.instances.insert((lowest, shared.len()));
    }
}

fn name(level: Option<&str>, kind: Option<&str>) -> Option<&'static str> {
    match (level?, kind?) {
        ("1", "Data") => Some("l1d"),
        ("1", "Instruction") => Some("l1i"),
        ("2", "Unified" | "Data") => Some("l2"),
        ("3", "Unified" | "Data") => Some("l3"),
        _ => None,
    }
}

/// The kernel writes sizes such as `48K`; virtual machines may write an untrue `0K`.
fn bytes(text: &str) -> Option<u64> {
    let (digits, unit) = match text.strip_suffix(['K', 'M', 'G']) {
        Some(digits) if text.ends_with('K') => (digits, 1 << 10),
        Some(digits) if text.ends_with('M') => (digits, 1 << 20),
        Some(digits) => (digits, 1 << 30),
        None => (text, 1),
    };
    let size = digits.parse::<u64>().ok()?.checked_mul(unit)?;
    (size > 0).then_some(size)
}

fn facts_of(name: &str, cache: &Cache) -> [Fact; 3] {
    let sharing: BTreeSet<u64> = cache.instances.iter().map(|&(_, n)| n as u64).collect();
    let count = Some(cache.instances.len()).filter(|&count| count > 0);
    let fact = |key: &str, unit, value| Fact::new("cache", &format!("{name}_{key}"), unit, value);
    [
        fact("size_bytes", "bytes", largest_first(&cache.sizes)),
        fact("instances", "", Reading::found(count)),
        fact("sharing_cpus", "CPUs", largest_first(&sharing)),
    ]
}

/// One number, or several joined by `+` where the kinds of core differ.
fn largest_first(numbers: &BTreeSet<u64>) -> Reading {
    let texts: Vec<String> = numbers.iter().rev().map(u64::to_string).collect();
    Reading::found(Some(texts.join("+")).filter(|text| !text.is_empty()))
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{self, Tree};
    use super::*;

    fn facts_in(tree: &Tree, cpus: usize) -> Vec<Fact> {
        let all: Vec<usize> = (0..cpus).collect();
        facts(&tree.source(), &Topology::read(tree.root(), &all))
    }

    fn value(facts: &[Fact], key: &str) -> String {
        let fact = facts.iter().find(|fact| fact.key == key);
        fact.unwrap().value.to_string()
    }

    #[test]
    fn the_server_shares_its_caches_by_core_and_package() {
        let facts = facts_in(&fixture::server_with_caches(), 128);
        for (key, expected) in [
            ("l1d_size_bytes", "32768"),
            ("l1d_instances", "64"),
            ("l1d_sharing_cpus", "2"),
            ("l2_size_bytes", "1048576"),
            ("l3_size_bytes", "33554432"),
            ("l3_instances", "2"),
            ("l3_sharing_cpus", "64"),
        ] {
            assert_eq!(value(&facts, key), expected, "{key}");
        }
    }

    #[test]
    fn the_laptop_has_two_sizes_under_one_name() {
        let facts = facts_in(&fixture::laptop(), 12);
        assert_eq!(value(&facts, "l2_size_bytes"), "2097152+1310720");
        assert_eq!(value(&facts, "l2_instances"), "5");
        assert_eq!(value(&facts, "l2_sharing_cpus"), "4+2");
    }

    #[test]
    fn absent_and_broken_caches_are_unavailable() {
        let tree = fixture::arm_board();
        let directory = "sys/devices/system/cpu/cpu0/cache/index0";
        tree.write(&format!("{directory}/level"), "3");
        tree.write(&format!("{directory}/type"), "Unified");
        tree.write(&format!("{directory}/size"), "99999999999999999999K");
        let facts = facts_in(&tree, 4);
        for key in ["l2_size_bytes", "l3_size_bytes", "l3_instances"] {
            assert_eq!(value(&facts, key), "unavailable");
        }
    }

    #[test]
    fn sizes_are_read_with_and_without_units() {
        assert_eq!(bytes("48K"), Some(49_152));
        assert_eq!(bytes("2M"), Some(2_097_152));
        assert_eq!(bytes("64"), Some(64));
        for text in ["0K", "", "K", "-1K", "1T", "18446744073709551615G"] {
            assert_eq!(bytes(text), None);
        }
    }
}
