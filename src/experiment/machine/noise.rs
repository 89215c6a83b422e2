//! What else went on while a trial ran: a few numbers cheap enough to read before and after it.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::source::{Source, field};

/// The most clock domains whose frequencies are read, to keep a sample cheap on large machines.
const MOST_POLICIES: usize = 16;

/// One sample of the disturbances around a trial. Counters only mean something as differences
/// between two samples; a missing number could not be read.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Share of the last ten seconds in which some thread waited for a CPU, in percent.
    pub cpu_pressure_avg10: Option<f64>,
    /// Mean number of threads that ran or waited during the last minute.
    pub load_1min: Option<f64>,
    /// Time that a hypervisor gave to others since start, over all CPUs, in kernel ticks, which
    /// are hundredths of a second on all usual systems.
    pub steal_ticks: Option<u64>,
    /// Count of times a thread of this process was taken off its CPU. Threads that have ended no
    /// longer count, so a thread pool must outlive both samples.
    pub involuntary_switches: Option<u64>,
    /// Mean current frequency of the first 16 clock domains, in MHz.
    pub frequency_mhz: Option<f64>,
}

impl Noise {
    /// Samples the system whose kernel files lie below `root`, which is `/` or a recorded tree.
    pub fn sample(root: &Path) -> Noise {
        let source = Source::new(root);
        Noise {
            cpu_pressure_avg10: cpu_pressure_avg10(&source),
            load_1min: load_average(&source, 0),
            steal_ticks: steal_ticks(&source),
            involuntary_switches: involuntary_switches(&source),
            frequency_mhz: mean_frequency_mhz(&source),
        }
    }
}

/// The line wanted reads `some avg10=1.25 avg60=0.50 avg300=0.10 total=12345`.
pub(super) fn cpu_pressure_avg10(source: &Source) -> Option<f64> {
    let pressure = source.text("proc/pressure/cpu");
    let some = pressure.value()?.lines().find_map(|line| line.strip_prefix("some "))?;
    let share = some.split_whitespace().find_map(|word| word.strip_prefix("avg10="))?;
    sensible(share)
}

/// The load averages over one, five and fifteen minutes stand in this order.
pub(super) fn load_average(source: &Source, place: usize) -> Option<f64> {
    let loads = source.text("proc/loadavg");
    sensible(loads.value()?.split_whitespace().take(3).nth(place)?)
}

/// Parsing alone would accept `nan` and `inf`, which no later comparison survives.
fn sensible(text: &str) -> Option<f64> {
    let number: f64 = text.parse().ok()?;
    (number.is_finite() && number >= 0.0).then_some(number)
}

/// The first line sums over all CPUs; steal is its eighth number.
fn steal_ticks(source: &Source) -> Option<u64> {
    let text = source.text("proc/stat");
    let total = text.value()?.lines().next()?.strip_prefix("cpu ")?;
    total.split_whitespace().nth(7)?.parse().ok()
}

fn involuntary_switches(source: &Source) -> Option<u64> {
    const TASKS: &str = "proc/self/task";
    source
        .numbered_entries(TASKS, "")
        .into_iter()
        .filter_map(|task| {
            let status = source.text(&format!("{TASKS}/{task}/status"));
            let count = field(status.value()?, "nonvoluntary_ctxt_switches")?;
            count.parse().ok()
        })
        .reduce(u64::saturating_add)
}

fn mean_frequency_mhz(source: &Source) -> Option<f64> {
    const POLICIES: &str = "sys/devices/system/cpu/cpufreq";
    let frequencies: Vec<f64> = source
        .numbered_entries(POLICIES, "policy")
        .into_iter()
        .take(MOST_POLICIES)
        .filter_map(|policy| source.number(&format!("{POLICIES}/policy{policy}/scaling_cur_freq")))
        .map(|kilohertz: u32| f64::from(kilohertz) / 1000.0)
        .collect();
    let sum: f64 = frequencies.iter().sum();
    (!frequencies.is_empty()).then(|| sum / frequencies.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{self, Tree};
    use super::*;

    #[test]
    fn the_server_gives_every_number() {
        let tree = fixture::server();
        let expected = Noise {
            cpu_pressure_avg10: Some(1.25),
            load_1min: Some(3.5),
            steal_ticks: Some(47),
            involuntary_switches: Some(12),
            frequency_mhz: Some(2450.0),
        };
        assert_eq!(Noise::sample(tree.root()), expected);
    }

    #[test]
    fn an_empty_tree_gives_none() {
        assert_eq!(Noise::sample(Tree::new().root()), Noise::default());
    }

    #[test]
    fn broken_files_give_none() {
        let tree = Tree::new();
        tree.write("proc/pressure/cpu", "some avg10=nan\nfull avg10=1\n");
        tree.write("proc/loadavg", "inf 1 2 1/2 3\n");
        tree.write("proc/stat", "cpu 1 2 3\ncpu0 1 2 3 4 5 6 7 8\n");
        tree.write("proc/self/task/7/status", "nonvoluntary_ctxt_switches: many\n");
        let frequency = "sys/devices/system/cpu/cpufreq/policy0/scaling_cur_freq";
        tree.write(frequency, "<unknown>\n");
        assert_eq!(Noise::sample(tree.root()), Noise::default());
    }
}
