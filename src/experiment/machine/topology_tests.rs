use super::super::fixture::{self, Tree};
use super::*;

fn read_all(tree: &Tree, cpus: usize) -> Topology {
    Topology::read(tree.root(), &(0..cpus).collect::<Vec<_>>())
}

#[test]
fn the_server_fills_its_cores_package_by_package_and_then_the_siblings() {
    let tree = fixture::server();
    let topology = read_all(&tree, 128);
    assert_eq!(topology.physical_cores(), 64);
    assert_eq!(topology.usable_cores(), 128);
    assert_eq!(topology.pin_order_close(), (0..128).collect::<Vec<_>>());
    assert_eq!(topology.is_hybrid(), None);
}

#[test]
fn the_server_spreads_over_its_two_packages_in_turn() {
    let tree = fixture::server();
    let order = read_all(&tree, 128).pin_order_spread();
    assert_eq!(order[..6], [0, 32, 1, 33, 2, 34]);
    assert_eq!(order[62..68], [31, 63, 64, 96, 65, 97]);
    assert_eq!(order.iter().collect::<BTreeSet<_>>().len(), 128);
}

#[test]
fn packages_take_turns_before_the_nodes_within_them_do() {
    let cpu =
        |id: usize| Cpu { id, core: id, package: id / 4, numa_node: id / 2, sibling_rank: 0, capacity: None };
    let topology = Topology { cpus: (0..8).map(cpu).collect(), cpu_quota: None };
    assert_eq!(topology.pin_order_spread(), [0, 4, 2, 6, 1, 5, 3, 7]);
}

#[test]
fn the_laptop_uses_strong_cores_then_weak_ones_then_siblings() {
    let tree = fixture::laptop();
    let topology = read_all(&tree, 12);
    let expected = [0, 2, 4, 6, 8, 9, 10, 11, 1, 3, 5, 7];
    assert_eq!(topology.physical_cores(), 8);
    assert_eq!(topology.is_hybrid(), Some(true));
    assert_eq!(topology.pin_order_close(), expected);
    assert_eq!(topology.pin_order_spread(), expected);
}

#[test]
fn the_kinds_of_core_are_known_without_capacities_too() {
    let tree = fixture::laptop();
    for id in 0..12 {
        tree.write(&format!("sys/devices/system/cpu/cpu{id}/cpu_capacity"), "?");
    }
    assert_eq!(read_all(&tree, 12).is_hybrid(), None);
    tree.write("sys/devices/cpu_core/cpus", "0-7\n");
    tree.write("sys/devices/cpu_atom/cpus", "8-11\n");
    let topology = read_all(&tree, 12);
    assert_eq!(topology.is_hybrid(), Some(true));
    assert_eq!(topology.pin_order_close()[..5], [0, 2, 4, 6, 8]);
}

#[test]
fn capacities_a_few_percent_apart_are_one_kind() {
    let tree = fixture::server();
    for (id, capacity) in [(0, "980"), (1, "1024"), (32, "1024"), (33, "950")] {
        let path = format!("sys/devices/system/cpu/cpu{id}/cpu_capacity");
        tree.write(&path, capacity);
    }
    let topology = Topology::read(tree.root(), &[0, 1, 32, 33]);
    assert_eq!(topology.is_hybrid(), Some(false));
    assert_eq!(topology.pin_order_close(), [0, 1, 32, 33]);
}

#[test]
fn the_arm_board_has_one_thread_on_each_core() {
    let tree = fixture::arm_board();
    let topology = read_all(&tree, 4);
    assert_eq!(topology.physical_cores(), 4);
    assert!(topology.cpus.iter().all(|cpu| cpu.sibling_rank == 0));
    assert_eq!(topology.pin_order_close(), [0, 1, 2, 3]);
}

#[test]
fn only_allowed_cpus_count_and_a_lone_second_thread_is_a_first_one() {
    let tree = fixture::server();
    let topology = Topology::read(tree.root(), &[96, 65, 1, 64, 64]);
    let ranks: Vec<_> = topology.cpus.iter().map(|cpu| cpu.sibling_rank).collect();
    assert_eq!(ranks, [0, 0, 1, 0]);
    assert_eq!(topology.physical_cores(), 3);
    assert_eq!(topology.pin_order_close(), [64, 1, 96, 65]);
}

#[test]
fn a_quota_rounds_up_the_usable_cores() {
    let tree = fixture::arm_board();
    tree.write("sys/fs/cgroup/cpu.max", "150000 100000\n");
    let topology = read_all(&tree, 4);
    assert_eq!(topology.cpu_quota, Some(1.5));
    assert_eq!(topology.usable_cores(), 2);
    tree.write("sys/fs/cgroup/cpu.max", "1 100000\n");
    assert_eq!(read_all(&tree, 4).usable_cores(), 1);
    tree.write("sys/fs/cgroup/cpu.max", "800000 100000\n");
    assert_eq!(read_all(&tree, 4).usable_cores(), 4);
}

#[test]
fn offline_cpus_are_left_out_unless_the_list_makes_no_sense() {
    let tree = fixture::arm_board();
    tree.write("sys/devices/system/cpu/online", "0,2-3\n");
    assert_eq!(read_all(&tree, 4).pin_order_close(), [0, 2, 3]);
    tree.write("sys/devices/system/cpu/online", "900-7");
    assert_eq!(read_all(&tree, 4).pin_order_close(), [0, 1, 2, 3]);
}

#[test]
fn nothing_known_or_nothing_allowed_still_gives_an_answer() {
    let tree = Tree::new();
    let topology = Topology::read(tree.root(), &[3, 1, usize::MAX]);
    assert_eq!(topology.pin_order_spread(), [1, 3]);
    assert_eq!(topology.physical_cores(), 2);
    let empty = Topology::read(tree.root(), &[]);
    assert_eq!((empty.usable_cores(), empty.physical_cores()), (1, 1));
    assert!(empty.pin_order_close().is_empty());
}

#[test]
fn broken_files_make_separate_cores_of_one_package() {
    let tree = fixture::arm_board();
    let directory = "sys/devices/system/cpu/cpu0";
    tree.write(&format!("{directory}/topology/core_cpus_list"), "2-1,x");
    tree.write(&format!("{directory}/topology/physical_package_id"), "-1");
    tree.write(&format!("{directory}/cpu_capacity"), "99999999999999999999");
    let cpu = &read_all(&tree, 4).cpus[0];
    assert_eq!((cpu.core, cpu.package, cpu.capacity), (0, 0, None));
}

#[test]
fn this_process_may_use_some_cpu() {
    let allowed = allowed_cpus();
    assert!(!allowed.is_empty());
    assert!(allowed.is_sorted());
}
