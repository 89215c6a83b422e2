//! Whether the system runs on a virtual machine or in a container; never under which name.

use super::processor::Processor;
use super::reading::Reading;
use super::source::Source;

/// Words by which virtual machines name their maker or product.
const VIRTUAL_NAMES: [&str; 14] = [
    "qemu",
    "kvm",
    "vmware",
    "virtualbox",
    "innotek",
    "xen",
    "bochs",
    "parallels",
    "bhyve",
    "openstack",
    "hvm domu",
    "virtual machine",
    "google compute engine",
    "firecracker",
];

/// Words in the control groups that containers leave behind, and what they stand for.
const CONTAINER_NAMES: [(&str, &str); 6] = [
    ("kubepods", "kubernetes"),
    ("docker", "docker"),
    ("libpod", "podman"),
    ("lxc", "lxc"),
    ("machine.slice", "nspawn"),
    ("containerd", "containerd"),
];

/// `yes` or `no`, from the strongest evidence down: the processor, the hypervisor's own files, and
/// the names that the firmware gives.
pub(super) fn virtualised(source: &Source, processor: &Processor) -> Reading {
    if source.exists("sys/hypervisor/type") {
        return Reading::yes_or_no(Some(true));
    }
    Reading::yes_or_no(processor.is_virtual()).or_else(|| {
        let vendor = source.text("sys/class/dmi/id/sys_vendor");
        let product = source.text("sys/class/dmi/id/product_name");
        let both = match (&vendor, &product) {
            (Reading::Value(vendor), Reading::Value(product)) => {
                Reading::known(format!("{vendor} {product}"))
            }
            _ => vendor.or_else(|| product),
        };
        both.extract(|names| Some(if is_virtual_name(names) { "yes" } else { "no" }))
    })
}

fn is_virtual_name(names: &str) -> bool {
    let names = names.to_lowercase();
    let rented = names.contains("amazon ec2") && !names.contains("metal");
    rented || VIRTUAL_NAMES.iter().any(|name| names.contains(name))
}

/// The kind of container that left a mark, or `no` where nothing hints at one. A mark is only a
/// hint: system images made for containers keep it elsewhere too.
pub(super) fn container(source: &Source) -> Reading {
    if source.exists("run/.containerenv") {
        return Reading::known("podman");
    }
    if source.exists(".dockerenv") {
        return Reading::known("docker");
    }
    source.text("proc/self/cgroup").extract(|groups| Some(container_name(groups).unwrap_or("no")))
}

fn container_name(groups: &str) -> Option<&'static str> {
    CONTAINER_NAMES.iter().find(|(word, _)| groups.contains(word)).map(|(_, name)| *name)
}

/// The versions of control groups that are mounted: `1`, `2` or `1+2`.
pub(super) fn control_group_version(source: &Source) -> Reading {
    let first = ["cpu", "cpuacct", "memory", "cpuset"]
        .iter()
        .any(|controller| source.exists(&format!("sys/fs/cgroup/{controller}")));
    let second = ["cgroup.procs", "unified/cgroup.procs"]
        .iter()
        .any(|file| source.exists(&format!("sys/fs/cgroup/{file}")));
    match (first, second) {
        (true, true) => Reading::known("1+2"),
        (true, false) => Reading::known("1"),
        (false, true) => Reading::known("2"),
        (false, false) => Reading::Unavailable,
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{self, Tree};
    use super::*;

    fn virtualised_in(tree: &Tree) -> String {
        let source = tree.source();
        virtualised(&source, &Processor::read(&source)).to_string()
    }

    #[test]
    fn the_processor_or_the_firmware_tells_a_virtual_machine() {
        assert_eq!(virtualised_in(&fixture::server()), "no");
        let tree = fixture::arm_board();
        assert_eq!(virtualised_in(&tree), "unavailable");
        tree.write("sys/class/dmi/id/sys_vendor", "Amazon EC2\n");
        tree.write("sys/class/dmi/id/product_name", "c7g.metal\n");
        assert_eq!(virtualised_in(&tree), "no");
        tree.write("sys/class/dmi/id/product_name", "c7g.large\n");
        assert_eq!(virtualised_in(&tree), "yes");
        tree.write("sys/class/dmi/id/sys_vendor", "QEMU\n");
        assert_eq!(virtualised_in(&tree), "yes");
    }

    #[test]
    fn containers_are_told_by_kind_alone() {
        let tree = Tree::new();
        assert_eq!(container(&tree.source()), Reading::Unavailable);
        for (groups, expected) in [
            ("0::/user.slice/user-1000.slice\n", "no"),
            ("4:cpu:/docker/0123abcd\n", "docker"),
            ("0::/kubepods.slice/docker-0123.scope\n", "kubernetes"),
        ] {
            tree.write("proc/self/cgroup", groups);
            assert_eq!(container(&tree.source()), Reading::known(expected));
        }
        tree.write("run/.containerenv", "");
        assert_eq!(container(&tree.source()), Reading::known("podman"));
    }

    #[test]
    fn both_versions_of_control_groups_may_be_mounted() {
        let tree = Tree::new();
        let version = || control_group_version(&tree.source()).to_string();
        assert_eq!(version(), "unavailable");
        tree.write("sys/fs/cgroup/cpu/tasks", "");
        assert_eq!(version(), "1");
        tree.write("sys/fs/cgroup/unified/cgroup.procs", "");
        assert_eq!(version(), "1+2");
    }
}
