//! The CPUs a process may use, how they share cores, packages and memory, and the orders in which
//! threads are pinned to them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::quota::Quota;
use super::source::{MOST_NUMBERS, Source};

/// Stand-ins where the kernel tells the two kinds of core apart without measuring them; only
/// their order means something.
const STRONG_CAPACITY: u64 = 1024;
const WEAK_CAPACITY: u64 = 512;

/// One logical CPU that this process may use.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cpu {
    /// The kernel's number of this logical CPU, which pinning uses.
    pub id: usize,
    /// The physical core, named by the lowest logical CPU on it; unique in the machine.
    pub core: usize,
    /// The kernel's number of the package (socket).
    pub package: usize,
    /// The kernel's number of the NUMA node.
    pub numa_node: usize,
    /// The place among the usable hardware threads of its core; 0 is the first of them.
    pub sibling_rank: usize,
    /// Computing capacity relative to 1024 for the strongest CPU, where the kernel tells it.
    pub capacity: Option<u64>,
}

/// The usable part of a machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Topology {
    /// The logical CPUs this process may use, in ascending order of their numbers.
    pub cpus: Vec<Cpu>,
    /// The limit on CPU time set by control groups, in CPUs, where there is one.
    pub cpu_quota: Option<f64>,
}

impl Topology {
    /// Reads how the allowed logical CPUs hang together from the kernel files below `root`, which
    /// is `/` or a recorded tree. What the files leave out counts as separate cores of one package.
    pub fn read(root: &Path, allowed: &[usize]) -> Topology {
        let source = Source::new(root);
        let allowed = allowed.iter().copied().filter(|&id| id < MOST_NUMBERS);
        let allowed: BTreeSet<usize> = allowed.collect();
        let online = source.cpu_list("sys/devices/system/cpu/online");
        let both: BTreeSet<usize> = allowed.intersection(&online).copied().collect();
        // This process runs on one of its CPUs, so a list that has none of them is the wrong one.
        let usable = if both.is_empty() { allowed } else { both };
        let surroundings = Surroundings::read(&source);
        let mut cpus: Vec<Cpu> = usable.into_iter().map(|id| surroundings.cpu(&source, id)).collect();
        rank_siblings(&mut cpus);
        Topology { cpus, cpu_quota: Quota::read(&source).cpus() }
    }

    /// The logical CPUs in the order that keeps threads together: the cores of one package and
    /// node before those of the next, strong cores before weak ones, and the remaining hardware
    /// threads of each core after every core has one thread.
    pub fn pin_order_close(&self) -> Vec<usize> {
        self.close_order().iter().map(|cpu| cpu.id).collect()
    }

    /// The logical CPUs in the order that keeps threads apart: package by package and node by
    /// node in turn, with strong cores before weak ones and the remaining hardware threads last.
    pub fn pin_order_spread(&self) -> Vec<usize> {
        type Nodes = BTreeMap<usize, Vec<usize>>;
        let tops = self.tier_tops();
        let mut levels: BTreeMap<(usize, usize), BTreeMap<usize, Nodes>> = BTreeMap::new();
        for cpu in self.close_order() {
            let level = levels.entry((cpu.sibling_rank, tier(cpu, &tops)));
            let nodes = level.or_default().entry(cpu.package).or_default();
            nodes.entry(cpu.numa_node).or_default().push(cpu.id);
        }
        let in_turn = |nodes: Nodes| interleave(nodes.into_values().collect());
        levels
            .into_values()
            .flat_map(|packages| interleave(packages.into_values().map(in_turn).collect()))
            .collect()
    }

    /// The number of physical cores with a usable logical CPU, at least 1.
    pub fn physical_cores(&self) -> usize {
        let cores: BTreeSet<usize> = self.cpus.iter().map(|cpu| cpu.core).collect();
        cores.len().max(1)
    }

    /// The number of threads that can run at once: the usable logical CPUs, but no more than the
    /// limit on CPU time rounded up, and at least 1.
    pub fn usable_cores(&self) -> usize {
        let quota = self.cpu_quota.map_or(usize::MAX, |cpus| cpus.ceil() as usize);
        self.cpus.len().min(quota).max(1)
    }

    /// Whether some cores are clearly weaker than others; none where the capacities are unknown.
    pub fn is_hybrid(&self) -> Option<bool> {
        let tops = self.tier_tops();
        (!tops.is_empty()).then_some(tops.len() > 1)
    }

    fn close_order(&self) -> Vec<&Cpu> {
        let tops = self.tier_tops();
        let mut order: Vec<&Cpu> = self.cpus.iter().collect();
        order.sort_by_key(|cpu| {
            let place = (cpu.package, cpu.numa_node, cpu.core, cpu.id);
            (cpu.sibling_rank, tier(cpu, &tops), place)
        });
        order
    }

    /// The highest capacity of each kind of core, strongest first. Cores of one kind may differ
    /// by a few percent, which must not tear a package apart.
    fn tier_tops(&self) -> Vec<u64> {
        let capacities: BTreeSet<u64> = self.cpus.iter().filter_map(|cpu| cpu.capacity).collect();
        let mut tops: Vec<u64> = Vec::new();
        for capacity in capacities.into_iter().rev() {
            if tops.last().is_none_or(|&top| !is_near(capacity, top)) {
                tops.push(capacity);
            }
        }
        tops
    }
}

/// The logical CPUs that the calling thread may run on, in ascending order.
#[cfg(target_os = "linux")]
pub fn allowed_cpus() -> Vec<usize> {
    use rustix::thread::{CpuSet, sched_getaffinity};
    // The call fails on machines with more CPUs than the set holds.
    let Ok(set) = sched_getaffinity(None) else {
        return as_many_as_available();
    };
    (0..CpuSet::MAX_CPU).filter(|&id| set.is_set(id)).collect()
}

/// The logical CPUs that the process may run on, counted from 0, in ascending order.
#[cfg(not(target_os = "linux"))]
pub fn allowed_cpus() -> Vec<usize> {
    as_many_as_available()
}

fn as_many_as_available() -> Vec<usize> {
    (0..std::thread::available_parallelism().map_or(1, usize::from)).collect()
}

/// What is known about all CPUs before any one of them is looked at.
struct Surroundings {
    nodes: BTreeMap<usize, usize>,
    strong: BTreeSet<usize>,
    weak: BTreeSet<usize>,
}

impl Surroundings {
    fn read(source: &Source) -> Surroundings {
        const NODES: &str = "sys/devices/system/node";
        let mut nodes = BTreeMap::new();
        for node in source.numbered_entries(NODES, "node") {
            let cpus = source.cpu_list(&format!("{NODES}/node{node}/cpulist"));
            nodes.extend(cpus.into_iter().map(|cpu| (cpu, node)));
        }
        Surroundings {
            nodes,
            strong: source.cpu_list("sys/devices/cpu_core/cpus"),
            weak: source.cpu_list("sys/devices/cpu_atom/cpus"),
        }
    }

    fn cpu(&self, source: &Source, id: usize) -> Cpu {
        let directory = format!("sys/devices/system/cpu/cpu{id}");
        let package = source.number(&format!("{directory}/topology/physical_package_id"));
        let capacity = source.number(&format!("{directory}/cpu_capacity"));
        Cpu {
            id,
            core: lowest_sibling(source, id),
            // The kernel writes -1 where it does not know the package.
            package: package.unwrap_or(0),
            numa_node: self.nodes.get(&id).copied().unwrap_or(0),
            sibling_rank: 0,
            capacity: capacity.or_else(|| self.nominal_capacity(id)),
        }
    }

    fn nominal_capacity(&self, id: usize) -> Option<u64> {
        let strong = self.strong.contains(&id).then_some(STRONG_CAPACITY);
        strong.or_else(|| self.weak.contains(&id).then_some(WEAK_CAPACITY))
    }
}

/// Cores are told apart by the CPUs on them, since core numbers repeat from package to package.
fn lowest_sibling(source: &Source, id: usize) -> usize {
    let directory = format!("sys/devices/system/cpu/cpu{id}/topology");
    // Kernels before 5.3 know only the second name.
    ["core_cpus_list", "thread_siblings_list"]
        .iter()
        .map(|name| source.cpu_list(&format!("{directory}/{name}")))
        .find(|siblings| siblings.contains(&id))
        .and_then(|siblings| siblings.first().copied())
        .unwrap_or(id)
}

/// Ranks count usable threads only: where a process may use just the second thread of a core, that
/// thread is as good as a first one.
fn rank_siblings(cpus: &mut [Cpu]) {
    let mut met: BTreeMap<usize, usize> = BTreeMap::new();
    for cpu in cpus {
        let rank = met.entry(cpu.core).or_default();
        cpu.sibling_rank = *rank;
        *rank += 1;
    }
}

/// The kind of core a CPU belongs to, 0 for the strongest; unknown ones come last.
fn tier(cpu: &Cpu, tops: &[u64]) -> usize {
    cpu.capacity
        .and_then(|capacity| tops.iter().position(|&top| is_near(capacity, top)))
        .unwrap_or(tops.len())
}

fn is_near(capacity: u64, top: u64) -> bool {
    u128::from(capacity) * 10 >= u128::from(top) * 9
}

/// Takes the first of each list, then the second of each, until all are used up.
fn interleave(lists: Vec<Vec<usize>>) -> Vec<usize> {
    let longest = lists.iter().map(Vec::len).max().unwrap_or(0);
    (0..longest).flat_map(|turn| lists.iter().filter_map(move |list| list.get(turn))).copied().collect()
}

#[cfg(test)]
#[path = "topology_tests.rs"]
mod tests;
