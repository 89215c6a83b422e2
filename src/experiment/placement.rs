//! Where threads would run: what a plan says about a machine before anything is measured on it.

use std::collections::BTreeSet;

use crate::experiment::machine::{Cpu, Topology};

/// The machine in one sentence: cores, hardware threads, packages, NUMA nodes, kinds of cores and limits.
pub fn describe(topology: &Topology) -> String {
    let cpus: Vec<&Cpu> = topology.cpus.iter().collect();
    let mut text = format!(
        "{}, {}",
        counted(topology.physical_cores(), "core"),
        counted(topology.cpus.len(), "hardware thread")
    );
    let (packages, nodes) = (distinct(&cpus, |cpu| cpu.package), distinct(&cpus, |cpu| cpu.numa_node));
    text += &format!(", {}, {}", counted(packages, "package"), counted(nodes, "NUMA node"));
    if let Some((strong, weak)) = kinds(topology) {
        text += &format!("; hybrid: {strong} strong and {weak} weak cores");
    }
    if let Some(quota) = topology.cpu_quota {
        text += &format!("; a control group limits it to {quota} CPUs' time");
    }
    text
}

/// Where so many threads run if they are pinned as asked; `None` where they are not pinned or do not fit.
pub fn place(topology: &Topology, pin: &str, threads: usize) -> Option<String> {
    let order = match pin {
        "close" => topology.pin_order_close(),
        "spread" => topology.pin_order_spread(),
        _ => return None,
    };
    let taken: BTreeSet<usize> = order.get(..threads)?.iter().copied().collect();
    let cpus: Vec<&Cpu> = topology.cpus.iter().filter(|cpu| taken.contains(&cpu.id)).collect();
    let cores = distinct(&cpus, |cpu| cpu.core);
    let mut text = counted(cores, "core");
    let (packages, nodes) = (distinct(&cpus, |cpu| cpu.package), distinct(&cpus, |cpu| cpu.numa_node));
    if packages > 1 || nodes > 1 {
        text += &format!(" in {}, {}", counted(packages, "package"), counted(nodes, "NUMA node"));
    }
    if threads > cores {
        text += &format!(", {} of them shared by hardware threads", threads - cores);
    }
    let weak: BTreeSet<usize> =
        cpus.iter().filter(|cpu| is_weak(topology, cpu)).map(|cpu| cpu.core).collect();
    if !weak.is_empty() {
        text += &format!(", {} of them weak", weak.len());
    }
    Some(text)
}

/// Strong and weak cores, where there are both.
fn kinds(topology: &Topology) -> Option<(usize, usize)> {
    topology.is_hybrid().filter(|&hybrid| hybrid)?;
    let weak: BTreeSet<usize> =
        topology.cpus.iter().filter(|cpu| is_weak(topology, cpu)).map(|cpu| cpu.core).collect();
    Some((topology.physical_cores() - weak.len(), weak.len()))
}

/// Whether a core has less than nine tenths of the strongest one's capacity.
fn is_weak(topology: &Topology, cpu: &Cpu) -> bool {
    let strongest = topology.cpus.iter().filter_map(|cpu| cpu.capacity).max();
    cpu.capacity.zip(strongest).is_some_and(|(capacity, strongest)| 10 * capacity < 9 * strongest)
}

fn distinct(cpus: &[&Cpu], of: impl Fn(&Cpu) -> usize) -> usize {
    cpus.iter().map(|cpu| of(cpu)).collect::<BTreeSet<usize>>().len()
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::calibration::Calibration;
    use crate::experiment::factors::Usable;
    use crate::experiment::library;
    use crate::experiment::machine::fixture;
    use crate::experiment::plan::Plan;
    use crate::experiment::spec::Mode;

    fn read(tree: &fixture::Tree, cpus: usize) -> Topology {
        Topology::read(tree.root(), &(0..cpus).collect::<Vec<_>>())
    }

    /// Thread counts of Figure 4 as they would be measured on a machine.
    fn planned_threads(topology: &Topology) -> Vec<usize> {
        let figure4 = vec![library::load("figure4").unwrap()];
        let calibration = Calibration { s_per_particle_step: 1e-6 };
        let plan = Plan::on(Usable::of(topology), figure4, Mode::Default, calibration).unwrap();
        plan.experiments[0].groups[0].cells.iter().map(|(threads, _)| *threads).collect()
    }

    #[test]
    fn a_server_fills_its_cores_before_their_siblings() {
        let topology = read(&fixture::server(), 128);
        assert_eq!(describe(&topology), "64 cores, 128 hardware threads, 2 packages, 2 NUMA nodes");
        assert_eq!(planned_threads(&topology), [1, 2, 4, 8, 16, 32, 64, 128]);
        let place = |pin, threads| place(&topology, pin, threads).unwrap();
        assert_eq!(place("close", 32), "32 cores");
        assert_eq!(place("close", 64), "64 cores in 2 packages, 2 NUMA nodes");
        assert_eq!(place("spread", 2), "2 cores in 2 packages, 2 NUMA nodes");
        let all = "64 cores in 2 packages, 2 NUMA nodes, 64 of them shared by hardware threads";
        assert_eq!(place("close", 128), all);
    }

    #[test]
    fn a_hybrid_laptop_uses_weak_cores_after_strong_ones() {
        let topology = read(&fixture::laptop(), 12);
        let expected =
            "8 cores, 12 hardware threads, 1 package, 1 NUMA node; hybrid: 4 strong and 4 weak cores";
        assert_eq!(describe(&topology), expected);
        assert_eq!(planned_threads(&topology), [1, 2, 4, 8, 12]);
        assert_eq!(place(&topology, "close", 4).unwrap(), "4 cores");
        assert_eq!(place(&topology, "close", 8).unwrap(), "8 cores, 4 of them weak");
    }

    #[test]
    fn an_arm_board_has_cores_alone() {
        let topology = read(&fixture::arm_board(), 4);
        assert_eq!(describe(&topology), "4 cores, 4 hardware threads, 1 package, 1 NUMA node");
        assert_eq!(planned_threads(&topology), [1, 2, 4]);
        assert_eq!(place(&topology, "off", 4), None);
        assert_eq!(place(&topology, "close", 5), None);
    }

    #[test]
    fn a_limit_on_cpu_time_limits_the_threads() {
        let tree = fixture::server();
        tree.write("proc/self/cgroup", "0::/box\n");
        tree.write("sys/fs/cgroup/box/cpu.max", "600000 100000\n");
        let topology = read(&tree, 128);
        assert!(describe(&topology).ends_with("; a control group limits it to 6 CPUs' time"));
        assert_eq!(planned_threads(&topology), [1, 2, 4, 6]);
    }
}
