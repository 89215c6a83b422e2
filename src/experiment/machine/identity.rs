//! The names under which results of one machine are kept: one for readers and one for programs.

use std::env::consts;
use std::fmt::Write;

use sha2::{Digest, Sha256};

use super::reading::{Fact, Reading};
use super::topology::Topology;

/// The longest alias, in characters.
const LONGEST_ALIAS: usize = 40;

/// Words in processor names that every processor could carry.
const EMPTY_WORDS: [&str; 6] = ["cpu", "processor", "r", "tm", "core", "with"];

/// A short name made of the user's wish or, without a usable one, of the processor's name and its
/// number of physical cores.
pub(super) fn alias(wish: Option<&str>, facts: &[Fact], physical_cores: usize) -> String {
    let wished = shorten(&words(wish.unwrap_or("")).join("-"), LONGEST_ALIAS);
    if !wished.is_empty() {
        return wished;
    }
    let ending = format!("-{physical_cores}c");
    let room = LONGEST_ALIAS.saturating_sub(ending.len());
    let model = value(facts, "model_name").map(model_words);
    let model = model.filter(|name| !name.is_empty());
    let name = model.unwrap_or_else(|| words(consts::ARCH).join("-"));
    shorten(&name, room) + &ending
}

/// Names such as `X(R) Y(TM) 7 CPU @ 2.00GHz` or `X Y 64-Core Processor`, without what does not
/// tell processors apart.
fn model_words(model: &str) -> String {
    let name = model.split('@').next().unwrap_or("");
    let telling = name.split_whitespace().filter(|word| !word.to_ascii_lowercase().ends_with("-core"));
    telling.flat_map(words).filter(|word| !EMPTY_WORDS.contains(&word.as_str())).collect::<Vec<_>>().join("-")
}

/// The runs of letters a-z and digits, in lower case.
fn words(text: &str) -> Vec<String> {
    text.to_ascii_lowercase()
        .split(|letter: char| !letter.is_ascii_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_owned)
        .collect()
}

fn shorten(name: &str, longest: usize) -> String {
    let kept = &name[..name.len().min(longest)];
    kept.trim_matches('-').to_owned()
}

/// Twelve hexadecimal digits that stay the same as long as the hardware does. Kernel, clock, host
/// name and the CPUs granted to this process have no part in them.
pub(super) fn machine_id(facts: &[Fact], whole: &Topology) -> String {
    let mut text = format!("machine 1\n{}\n{}\n", consts::OS, consts::ARCH);
    let memory = value(facts, "total_bytes").and_then(|bytes| bytes.parse().ok());
    add(&mut text, "memory GiB", &memory.map_or(0, whole_gibibytes).to_string());
    add(&mut text, "model", value(facts, "model_name").unwrap_or(""));
    for key in ["l1d_size_bytes", "l1i_size_bytes", "l2_size_bytes", "l3_size_bytes"] {
        add(&mut text, key, value(facts, key).unwrap_or(""));
    }
    for cpu in &whole.cpus {
        let place = format!("{} {} {}", cpu.core, cpu.package, cpu.numa_node);
        add(&mut text, &cpu.id.to_string(), &place);
    }
    let digest = Sha256::digest(text.as_bytes());
    digest.iter().take(6).fold(String::new(), |mut digits, byte| {
        // Writing to a string cannot fail.
        let _ = write!(digits, "{byte:02x}");
        digits
    })
}

fn add(text: &mut String, key: &str, value: &str) {
    text.push_str(key);
    text.push('=');
    text.push_str(value);
    text.push('\n');
}

/// Kernels keep a few megabytes back, each version some others, so only the nearest GiB is stable.
fn whole_gibibytes(bytes: u64) -> u64 {
    const GIBIBYTE: u64 = 1 << 30;
    bytes / GIBIBYTE + (bytes % GIBIBYTE) / (GIBIBYTE / 2)
}

fn value<'a>(facts: &'a [Fact], key: &str) -> Option<&'a str> {
    let fact = facts.iter().find(|fact| fact.key == key)?;
    Reading::value(&fact.value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn alias_of(model: &str, cores: usize) -> String {
        let fact = Fact::new("cpu", "model_name", "", Reading::known(model));
        alias(None, &[fact], cores)
    }

    #[test]
    fn an_alias_tells_the_processor_and_its_cores() {
        assert_eq!(alias_of("AMD EPYC", 2), "amd-epyc-2c");
        assert_eq!(alias_of("AMD EPYC 7763 64-Core Processor", 64), "amd-epyc-7763-64c");
        assert_eq!(alias_of("Intel(R) Xeon(R) Platinum 8480+ @ 2.00GHz", 56), "intel-xeon-platinum-8480-56c");
        assert_eq!(alias_of("Arm part 0xd0c", 4), "arm-part-0xd0c-4c");
    }

    #[test]
    fn a_wish_is_made_harmless() {
        let wished = |wish: &str| alias(Some(wish), &[], 4);
        assert_eq!(wished("Lab Server #3"), "lab-server-3");
        assert_eq!(wished("../../etc/x"), "etc-x");
        assert_eq!(wished(&"a-".repeat(60)).len(), 39);
        let without_wish = alias(None, &[], 4);
        assert_eq!(wished("§§"), without_wish);
        assert!(without_wish.ends_with("-4c"));
    }

    #[test]
    fn a_long_model_name_keeps_its_core_count() {
        let alias = alias_of(&"Very Long Name ".repeat(9), 128);
        assert!(alias.len() <= LONGEST_ALIAS);
        assert!(alias.ends_with("-128c"));
    }

    #[test]
    fn memory_is_rounded_to_the_nearest_gibibyte() {
        assert_eq!(whole_gibibytes((15 << 30) + (3 << 28)), 16);
        assert_eq!(whole_gibibytes((16 << 30) + (1 << 28)), 16);
        assert_eq!(whole_gibibytes(u64::MAX), 1 << 34);
    }
}
