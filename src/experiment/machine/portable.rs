//! The few facts that systems without Linux's kernel files tell through a common library.

use sysinfo::{CpuRefreshKind, MemoryRefreshKind, RefreshKind, System};

use super::reading::{Fact, Reading};

/// Fills facts that no kernel file gave; where the library knows nothing either, they stay as
/// they are.
pub(super) fn fill(facts: &mut [Fact]) {
    let wanted = RefreshKind::nothing()
        .with_cpu(CpuRefreshKind::nothing())
        .with_memory(MemoryRefreshKind::nothing().with_ram());
    let system = System::new_with_specifics(wanted);
    for fact in facts {
        if fact.value == Reading::Unavailable {
            let value = Reading::found(look_up(&system, &fact.key));
            *fact = Fact::new(&fact.group, &fact.key, &fact.unit, value);
        }
    }
}

/// The library answers 0 or nothing for what it does not know.
fn look_up(system: &System, key: &str) -> Option<String> {
    let positive = |number: u64| (number > 0).then(|| number.to_string());
    let first = system.cpus().first();
    match key {
        "model_name" => first.map(|cpu| cpu.brand().to_owned()),
        "vendor" => first.map(|cpu| cpu.vendor_id().to_owned()),
        "online_logical_cpus" => positive(system.cpus().len() as u64),
        "physical_cores" => System::physical_core_count().map(|count| count.to_string()),
        "total_bytes" => positive(system.total_memory()),
        "available_bytes" => positive(system.available_memory()),
        "kernel" => System::kernel_version(),
        "distribution" => System::long_os_version(),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_unavailable_facts_are_filled() {
        let fact = |key, value| Fact::new("memory", key, "bytes", value);
        let mut facts = [
            fact("total_bytes", Reading::Unavailable),
            fact("available_bytes", Reading::Denied),
            fact("huge_pages_total", Reading::Unavailable),
        ];
        fill(&mut facts);
        let total = facts[0].value.value().and_then(|text| text.parse().ok());
        assert!(total.is_some_and(|bytes: u64| bytes > 0));
        assert_eq!(facts[1].value, Reading::Denied);
        assert_eq!(facts[2].value, Reading::Unavailable);
    }
}
