use std::collections::BTreeSet;

use super::fixture::{self, Tree};
use super::*;

fn fact(machine: &Machine, key: &str) -> String {
    machine.fact(key).expect(key).to_string()
}

#[test]
fn the_server_is_told_whole_and_in_its_usable_part() {
    let machine = Machine::observe(fixture::server().root(), None);
    assert_eq!(machine.alias, "example-xeon-gold-9999-64c");
    assert_eq!((machine.physical_cores, machine.usable_cores), (64, 8));
    for (key, expected) in [
        ("online_logical_cpus", "128"),
        ("usable_logical_cpus", "8"),
        ("physical_cores", "64"),
        ("usable_physical_cores", "8"),
        ("sockets", "2"),
        ("threads_per_core", "2"),
        ("smt_active", "yes"),
        ("numa_nodes", "2"),
        ("hybrid", "unavailable"),
        ("cgroup_cpu_quota", "unavailable"),
        ("total_bytes", "270179237888"),
        ("available_bytes", "unavailable"),
        ("transparent_huge_pages", "madvise"),
        ("distribution", "Example GNU/Linux 12"),
        ("kernel", "6.1.0-amd64"),
        ("load_15min", "1"),
        ("cpu_pressure_avg10", "1.25"),
    ] {
        assert_eq!(fact(&machine, key), expected, "{key}");
    }
}

#[test]
fn no_record_holds_a_user_a_host_or_a_path() {
    let tree = fixture::server();
    tree.write("proc/sys/kernel/osrelease", "6.1.0 /home/hidden-user/linux");
    let machine = Machine::observe(tree.root(), None);
    let record = serde_json::to_string(&machine).unwrap();
    assert!(!record.contains("hidden"), "{record}");
    assert!(!record.contains("/home"), "{record}");
    assert!(!record.contains(tree.root().to_str().unwrap()), "{record}");
}

#[test]
fn a_record_is_read_back_as_it_was_written() {
    let machine = Machine::observe(fixture::laptop().root(), Some("My Laptop"));
    let record = serde_json::to_string(&machine).unwrap();
    assert_eq!(serde_json::from_str::<Machine>(&record).unwrap(), machine);
    assert_eq!(machine.alias, "my-laptop");
}

#[test]
fn keys_are_unique_on_every_machine() {
    for tree in [fixture::server(), fixture::arm_board(), Tree::new()] {
        let machine = Machine::observe(tree.root(), None);
        let keys: BTreeSet<&str> = machine.facts.iter().map(|fact| fact.key.as_str()).collect();
        assert_eq!(keys.len(), machine.facts.len());
    }
}

#[test]
fn the_identity_ignores_kernel_load_affinity_and_little_memory() {
    let tree = fixture::server();
    let identity = || Machine::observe(tree.root(), None).machine_id;
    let before = identity();
    assert_eq!(before.len(), 12);
    tree.write("proc/sys/kernel/osrelease", "7.0.0\n");
    tree.write("proc/loadavg", "0 0 0 1/1 1\n");
    tree.write("proc/self/status", "Cpus_allowed_list:\t5\n");
    tree.write("proc/sys/kernel/hostname", "other\n");
    tree.write("proc/meminfo", "MemTotal: 263840000 kB\n");
    tree.write("sys/devices/system/cpu/cpu0/cpu_capacity", "1024\n");
    assert_eq!(identity(), before);
    tree.write("proc/meminfo", "MemTotal: 131923456 kB\n");
    assert_ne!(identity(), before);
}

#[test]
fn the_arm_board_has_what_it_has_and_lacks_the_rest() {
    let machine = Machine::observe(fixture::arm_board().root(), None);
    assert_eq!(machine.alias, "arm-part-0xd0c-4c");
    assert_eq!(machine.usable_cores, 4);
    assert_eq!(fact(&machine, "threads_per_core"), "1");
    for key in ["frequency_governor", "smt_active", "l3_size_bytes", "virtualised"] {
        assert_eq!(machine.fact(key), Some(&Reading::Unavailable), "{key}");
    }
    assert_eq!(machine.fact("no such key"), None);
}

#[test]
fn an_empty_tree_is_a_machine_of_one_unknown_core() {
    let machine = Machine::observe(Tree::new().root(), None);
    assert_eq!((machine.usable_cores, machine.physical_cores), (1, 1));
    assert_eq!(fact(&machine, "usable_logical_cpus"), "1");
}

#[test]
fn files_of_noise_do_no_harm() {
    let noise: Vec<u8> = (0..200_000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let tree = fixture::arm_board();
    for path in [
        "proc/cpuinfo",
        "proc/meminfo",
        "proc/loadavg",
        "proc/self/cgroup",
        "proc/self/status",
        "etc/os-release",
        "sys/devices/system/cpu/online",
        "sys/devices/system/cpu/cpu0/topology/core_cpus_list",
        "sys/devices/system/node/node0/cpulist",
        "sys/fs/cgroup/cpu.max",
        "proc/sys/kernel/osrelease",
    ] {
        tree.write_bytes(path, &noise);
    }
    let machine = Machine::observe(tree.root(), None);
    assert_eq!(machine.usable_cores, 1);
    let longest = machine.facts.iter().filter_map(|fact| fact.value.value());
    assert!(longest.map(str::len).max() < Some(10_000));
}

#[test]
fn this_machine_is_told_the_same_way_twice() {
    let root = Path::new("/");
    let machine = Machine::observe(root, None);
    assert_eq!(machine.machine_id, Machine::observe(root, None).machine_id);
    assert!(machine.usable_cores <= allowed_cpus().len().max(1));
}
