//! Small trees of kernel files that stand in for machines in the tests.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use super::source::Source;

/// The CPUs of the server's two packages, which are its NUMA nodes as well.
const SERVER_PACKAGES: [&str; 2] = ["0-31,64-95", "32-63,96-127"];

/// A directory of its own that vanishes with the value.
pub(crate) struct Tree {
    root: PathBuf,
}

impl Tree {
    pub(crate) fn new() -> Tree {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("repro-machine-{}-{count}", std::process::id());
        let root = std::env::temp_dir().join(name);
        fs::create_dir_all(&root).unwrap();
        Tree { root }
    }

    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    pub(super) fn source(&self) -> Source {
        Source::new(&self.root)
    }

    pub(crate) fn write(&self, path: &str, text: &str) {
        self.write_bytes(path, text.as_bytes());
    }

    pub(crate) fn write_bytes(&self, path: &str, bytes: &[u8]) {
        let path = self.root.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    /// One logical CPU with its siblings and package.
    fn cpu(&self, id: usize, siblings: &str, package: usize) {
        let directory = format!("sys/devices/system/cpu/cpu{id}/topology");
        self.write(&format!("{directory}/core_cpus_list"), siblings);
        self.write(&format!("{directory}/physical_package_id"), &package.to_string());
    }

    fn cache(&self, id: usize, index: usize, description: [&str; 4]) {
        let directory = format!("sys/devices/system/cpu/cpu{id}/cache/index{index}");
        for (file, text) in ["level", "type", "size", "shared_cpu_list"].iter().zip(description) {
            self.write(&format!("{directory}/{file}"), text);
        }
    }
}

impl Drop for Tree {
    fn drop(&mut self) {
        // A directory left behind is no reason to fail a test.
        let _ = fs::remove_dir_all(&self.root);
    }
}

/// Two packages of 32 cores with two threads each, one NUMA node in each package. Second threads
/// are numbered after all first ones.
pub(crate) fn server() -> Tree {
    let tree = Tree::new();
    tree.write("sys/devices/system/cpu/online", "0-127\n");
    for (node, cpus) in SERVER_PACKAGES.iter().enumerate() {
        tree.write(&format!("sys/devices/system/node/node{node}/cpulist"), cpus);
    }
    for id in 0..128 {
        let core = id % 64;
        tree.cpu(id, &format!("{core},{}", core + 64), core / 32);
    }
    tree.write("sys/devices/system/cpu/smt/active", "1\n");
    tree.write(
        "proc/cpuinfo",
        "processor\t: 0\nvendor_id\t: GenuineExample\n\
         model name\t: Example Xeon(R) Gold 9999 CPU @ 2.40GHz\n\
         flags\t\t: fpu sse2 avx fma avx2 avx512f\n",
    );
    server_system(&tree);
    tree
}

/// The server with its caches, which take many files and which few tests need.
pub(crate) fn server_with_caches() -> Tree {
    let tree = server();
    for id in 0..128 {
        let core = id % 64;
        let siblings = format!("{core},{}", core + 64);
        tree.cache(id, 0, ["1", "Data", "32K", &siblings]);
        tree.cache(id, 1, ["2", "Unified", "1024K", &siblings]);
        tree.cache(id, 2, ["3", "Unified", "32M", SERVER_PACKAGES[core / 32]]);
    }
    tree
}

/// The server with clock control for its first four CPUs.
pub(crate) fn server_with_clocks() -> Tree {
    let tree = server();
    for id in 0..4 {
        let clock = format!("sys/devices/system/cpu/cpu{id}/cpufreq");
        tree.write(&format!("{clock}/base_frequency"), "2400000\n");
        tree.write(&format!("{clock}/scaling_cur_freq"), "2450000\n");
        tree.write(&format!("{clock}/scaling_governor"), "performance\n");
    }
    tree.write("sys/devices/system/cpu/intel_pstate/no_turbo", "0\n");
    tree
}

/// The system around the server's processor, with names in it that no record may hold.
fn server_system(tree: &Tree) {
    let policy = "sys/devices/system/cpu/cpufreq/policy";
    tree.write(&format!("{policy}0/scaling_cur_freq"), "2400000\n");
    tree.write(&format!("{policy}32/scaling_cur_freq"), "2500000\n");
    tree.write("proc/meminfo", "MemTotal: 263846912 kB\nHugePages_Total: 0\n");
    tree.write("proc/loadavg", "3.50 2.00 1.00 2/900 4242\n");
    tree.write("proc/pressure/cpu", "some avg10=1.25 avg60=0.50 total=9\n");
    tree.write("proc/stat", "cpu  9 0 4 1 0 0 3 47 0 0\ncpu0 1 0\n");
    tree.write("proc/self/status", "Name:\trun\nCpus_allowed_list:\t0-7\n");
    for (task, switches) in [(7, 5), (8, 7)] {
        let text = format!("nonvoluntary_ctxt_switches:\t{switches}\n");
        tree.write(&format!("proc/self/task/{task}/status"), &text);
    }
    tree.write("proc/sys/kernel/osrelease", "6.1.0-amd64\n");
    tree.write("proc/sys/kernel/hostname", "hidden-host\n");
    tree.write("proc/version", "Linux version 6.1.0 (hidden-user@hidden-host)\n");
    tree.write("proc/self/cgroup", "0::/user.slice/hidden-user.scope\n");
    tree.write("etc/os-release", "NAME=Example\nPRETTY_NAME=\"Example GNU/Linux 12\"\n");
    tree.write("sys/kernel/mm/transparent_hugepage/enabled", "always [madvise] never\n");
}

/// Four strong cores with two threads each, numbered in pairs, and four weak ones with one.
pub(crate) fn laptop() -> Tree {
    let tree = Tree::new();
    tree.write("sys/devices/system/cpu/online", "0-11\n");
    for id in 0..12 {
        let strong = id < 8;
        let pair = format!("{}-{}", id / 2 * 2, id / 2 * 2 + 1);
        let siblings = if strong { pair.clone() } else { id.to_string() };
        let (capacity, size) = if strong { ("1024", "1280K") } else { ("640", "2M") };
        let shared = if strong { pair.as_str() } else { "8-11" };
        tree.cpu(id, &siblings, 0);
        tree.cache(id, 0, ["2", "Unified", size, shared]);
        tree.write(&format!("sys/devices/system/cpu/cpu{id}/cpu_capacity"), capacity);
    }
    tree
}

/// Four cores with one thread each, without clock control, caches or a processor name.
pub(crate) fn arm_board() -> Tree {
    let tree = Tree::new();
    tree.write("sys/devices/system/cpu/online", "0-3\n");
    for id in 0..4 {
        tree.cpu(id, &id.to_string(), 0);
    }
    tree.write(
        "proc/cpuinfo",
        "processor\t: 0\nBogoMIPS\t: 50.00\nFeatures\t: fp asimd crc32\n\
         CPU implementer\t: 0x41\nCPU part\t: 0xd0c\n",
    );
    tree
}
