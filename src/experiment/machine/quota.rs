//! The limit on CPU time that control groups set, in CPUs.

use std::path::{Component, Path};

use super::reading::Reading;
use super::source::Source;

/// Where the second version of the interface is mounted, alone or beside the first.
const UNIFIED_MOUNTS: [&str; 2] = ["sys/fs/cgroup", "sys/fs/cgroup/unified"];
/// Where the CPU controller of the first version is mounted.
const CPU_MOUNTS: [&str; 2] = ["sys/fs/cgroup/cpu", "sys/fs/cgroup/cpu,cpuacct"];

/// What the control groups of this process say about CPU time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Quota {
    /// No control group answers.
    Unavailable,
    /// A control group exists whose limit may not be read, and no other gives one.
    Denied,
    /// Control groups answer that there is no limit.
    Unlimited,
    /// The smallest limit among the process's groups, in CPUs.
    Cpus(f64),
}

impl Quota {
    pub(super) fn read(source: &Source) -> Quota {
        let groups = source.text("proc/self/cgroup");
        let text = groups.value().unwrap_or("");
        let unified = own_group(text, |controllers| controllers.is_empty());
        let cpu = own_group(text, |controllers| controllers.split(',').any(|c| c == "cpu"));
        let unified = UNIFIED_MOUNTS
            .iter()
            .flat_map(|mount| self_and_ancestors(mount, unified).map(|group| unified_limit(source, &group)));
        let first = CPU_MOUNTS.iter().flat_map(|mount| {
            self_and_ancestors(mount, cpu).map(|group| first_version_limit(source, &group))
        });
        unified.chain(first).fold(Quota::Unavailable, Quota::tighter)
    }

    /// The limit in CPUs, where there is one.
    pub(super) fn cpus(self) -> Option<f64> {
        match self {
            Quota::Cpus(cpus) => Some(cpus),
            _ => None,
        }
    }

    pub(super) fn reading(self) -> Reading {
        match self {
            Quota::Unavailable => Reading::Unavailable,
            Quota::Denied => Reading::Denied,
            Quota::Unlimited => Reading::known("unlimited"),
            Quota::Cpus(cpus) => Reading::known(cpus),
        }
    }

    /// Nested groups all apply, so the smallest limit holds.
    fn tighter(self, other: Quota) -> Quota {
        match (self, other) {
            (Quota::Cpus(a), Quota::Cpus(b)) => Quota::Cpus(a.min(b)),
            (limit @ Quota::Cpus(_), _) | (_, limit @ Quota::Cpus(_)) => limit,
            (Quota::Denied, _) | (_, Quota::Denied) => Quota::Denied,
            (Quota::Unlimited, _) | (_, Quota::Unlimited) => Quota::Unlimited,
            (Quota::Unavailable, Quota::Unavailable) => Quota::Unavailable,
        }
    }
}

/// The process's group in the hierarchy whose controllers satisfy the condition. Its lines read
/// `number:controllers:path`.
fn own_group(text: &str, wanted: impl Fn(&str) -> bool) -> &str {
    text.lines()
        .filter_map(|line| line.split_once(':')?.1.split_once(':'))
        .find(|(controllers, _)| wanted(controllers))
        .map_or("", |(_, path)| path)
}

/// The mount, and below it each directory on the way to the group. Within a container the path
/// may be the host's, of which only the mount exists; the missing directories then say nothing.
fn self_and_ancestors(mount: &str, group: &str) -> impl Iterator<Item = String> {
    const DEEPEST: usize = 64;
    let mut directory = mount.to_owned();
    let below = Path::new(group).components().filter_map(|part| match part {
        Component::Normal(name) => name.to_str().map(str::to_owned),
        _ => None,
    });
    let below: Vec<String> = below
        .take(DEEPEST)
        .map(move |name| {
            directory.push('/');
            directory.push_str(&name);
            directory.clone()
        })
        .collect();
    std::iter::once(mount.to_owned()).chain(below)
}

/// The file reads `<quota> <period>` in microseconds, with `max` for no quota.
fn unified_limit(source: &Source, group: &str) -> Quota {
    let reading = source.text(&format!("{group}/cpu.max"));
    let Some(text) = reading.value() else {
        return without_value(&reading);
    };
    let mut words = text.split_whitespace();
    match (words.next(), words.next()) {
        (Some("max"), _) => Quota::Unlimited,
        (Some(quota), Some(period)) => limit(quota.parse().ok(), period.parse().ok()),
        _ => Quota::Unavailable,
    }
}

/// Two files hold quota and period in microseconds, with a quota of -1 for none.
fn first_version_limit(source: &Source, group: &str) -> Quota {
    let reading = source.text(&format!("{group}/cpu.cfs_quota_us"));
    match reading.value() {
        None => without_value(&reading),
        Some("-1") => Quota::Unlimited,
        Some(quota) => {
            let period = source.number(&format!("{group}/cpu.cfs_period_us"));
            limit(quota.parse().ok(), period)
        }
    }
}

fn without_value(reading: &Reading) -> Quota {
    match reading {
        Reading::Denied => Quota::Denied,
        _ => Quota::Unavailable,
    }
}

fn limit(quota: Option<u64>, period: Option<u64>) -> Quota {
    match (quota, period) {
        (Some(quota @ 1..), Some(period @ 1..)) => Quota::Cpus(quota as f64 / period as f64),
        _ => Quota::Unavailable,
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture::Tree;
    use super::*;

    #[test]
    fn the_second_version_gives_the_tightest_limit_on_the_way_to_the_group() {
        let tree = Tree::new();
        tree.write("proc/self/cgroup", "0::/system.slice/run\n");
        tree.write("sys/fs/cgroup/system.slice/cpu.max", "150000 100000\n");
        tree.write("sys/fs/cgroup/system.slice/run/cpu.max", "max 100000\n");
        assert_eq!(Quota::read(&tree.source()), Quota::Cpus(1.5));
        tree.write("sys/fs/cgroup/system.slice/run/cpu.max", "50000 100000\n");
        assert_eq!(Quota::read(&tree.source()), Quota::Cpus(0.5));
    }

    #[test]
    fn the_first_version_gives_quota_over_period() {
        let tree = Tree::new();
        tree.write("proc/self/cgroup", "4:cpu,cpuacct:/box\n1:cpuset:/other\n");
        tree.write("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_quota_us", "-1\n");
        assert_eq!(Quota::read(&tree.source()), Quota::Unlimited);
        tree.write("sys/fs/cgroup/cpu,cpuacct/box/cpu.cfs_quota_us", "250000\n");
        tree.write("sys/fs/cgroup/cpu,cpuacct/box/cpu.cfs_period_us", "100000\n");
        assert_eq!(Quota::read(&tree.source()), Quota::Cpus(2.5));
    }

    #[test]
    fn a_container_without_its_host_path_reads_the_mount_itself() {
        let tree = Tree::new();
        tree.write("proc/self/cgroup", "0::/../../docker/0123\n");
        tree.write("sys/fs/cgroup/cpu.max", "300000 100000\n");
        assert_eq!(Quota::read(&tree.source()), Quota::Cpus(3.0));
    }

    #[test]
    fn broken_limits_are_unavailable() {
        for text in ["", "0 100000", "5 0", "-5 7", "nan 1", "100000", "1e9 1e9"] {
            let tree = Tree::new();
            tree.write("sys/fs/cgroup/cpu.max", text);
            assert_eq!(Quota::read(&tree.source()), Quota::Unavailable);
        }
    }
}
