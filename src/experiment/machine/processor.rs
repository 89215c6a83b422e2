//! The name and abilities of the processor, from the kernel's list of CPUs.

use std::collections::BTreeSet;

use super::reading::Reading;
use super::source::{Source, field, fields};

/// Instruction sets that change how fast numerical code can be, in the kernel's spelling.
const INSTRUCTION_SETS: [&str; 20] = [
    "sse2", "ssse3", "sse4_1", "sse4_2", "avx", "f16c", "fma", "avx2", "bmi1", "bmi2", "avx_vnni", "avx512f",
    "avx512dq", "avx512bw", "avx512vl", "neon", "asimd", "sve", "sve2", "v",
];

/// The companies behind the implementer codes of Arm processors.
const IMPLEMENTERS: [(&str, &str); 10] = [
    ("0x41", "Arm"),
    ("0x42", "Broadcom"),
    ("0x43", "Cavium"),
    ("0x46", "Fujitsu"),
    ("0x48", "HiSilicon"),
    ("0x4e", "NVIDIA"),
    ("0x51", "Qualcomm"),
    ("0x53", "Samsung"),
    ("0x61", "Apple"),
    ("0xc0", "Ampere"),
];

/// The start of the kernel's list of CPUs; the first entries are enough.
pub(super) struct Processor {
    text: Reading,
}

impl Processor {
    pub(super) fn read(source: &Source) -> Processor {
        Processor { text: source.text("proc/cpuinfo") }
    }

    /// The name under which the processor is sold or, on Arm, the codes of its designs.
    pub(super) fn model_name(&self) -> Reading {
        self.first_of(&["model name", "cpu model", "uarch", "cpu"]).or_else(|| self.text.extract(arm_design))
    }

    pub(super) fn vendor(&self) -> Reading {
        self.first_of(&["vendor_id"]).or_else(|| self.text.extract(arm_implementer))
    }

    /// Family, model and stepping of an x86 processor: under a hypervisor different ones may be sold under one name.
    pub(super) fn generation(&self) -> Reading {
        self.text.extract(|text| {
            let [family, model] = [field(text, "cpu family")?, field(text, "model")?];
            let stepping = field(text, "stepping").map_or(String::new(), |step| format!(" stepping {step}"));
            Some(format!("family {family} model {model}{stepping}"))
        })
    }

    /// The instruction sets that matter here, separated by blanks.
    pub(super) fn instruction_sets(&self) -> Reading {
        self.flags().extract(|flags| {
            let present: BTreeSet<&str> = flags.split_whitespace().collect();
            let known = INSTRUCTION_SETS.into_iter();
            let relevant: Vec<&str> = known.filter(|set| present.contains(set)).collect();
            Some(relevant.join(" ")).filter(|text| !text.is_empty())
        })
    }

    /// Frequency of the first CPU in MHz, as far as this list tells it.
    pub(super) fn frequency_mhz(&self) -> Reading {
        self.first_of(&["cpu MHz", "clock"]).extract(|text| {
            let megahertz: f64 = text.trim_end_matches("MHz").parse().ok()?;
            (megahertz.is_finite() && megahertz > 0.0).then_some(megahertz)
        })
    }

    /// Whether the processor says that it runs under a hypervisor, which only x86 can say.
    pub(super) fn is_virtual(&self) -> Option<bool> {
        let flags = field(self.text.value()?, "flags")?;
        Some(flags.split_whitespace().any(|flag| flag == "hypervisor"))
    }

    fn flags(&self) -> Reading {
        self.first_of(&["flags", "Features"])
    }

    fn first_of(&self, keys: &[&str]) -> Reading {
        self.text.extract(|text| keys.iter().find_map(move |key| field(text, key)))
    }
}

fn arm_implementer(text: &str) -> Option<String> {
    let code = field(text, "CPU implementer")?;
    let named = IMPLEMENTERS.iter().find(|(known, _)| *known == code);
    Some(named.map_or_else(|| format!("implementer {code}"), |(_, name)| (*name).to_owned()))
}

/// Processors with several kinds of core list several designs.
fn arm_design(text: &str) -> Option<String> {
    let implementer = arm_implementer(text)?;
    let parts: BTreeSet<&str> = fields(text, "CPU part").take(1024).collect();
    let parts: Vec<&str> = parts.into_iter().collect();
    (!parts.is_empty()).then(|| format!("{implementer} part {}", parts.join("+")))
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{self, Tree};
    use super::*;

    #[test]
    fn the_server_tells_name_vendor_and_instruction_sets() {
        let processor = Processor::read(&fixture::server().source());
        assert_eq!(processor.model_name(), Reading::known("Example Xeon(R) Gold 9999 CPU @ 2.40GHz"));
        assert_eq!(processor.vendor(), Reading::known("GenuineExample"));
        assert_eq!(processor.instruction_sets(), Reading::known("sse2 avx fma avx2 avx512f"));
        assert_eq!(processor.is_virtual(), Some(false));
    }

    #[test]
    fn an_arm_processor_is_named_by_its_codes() {
        let processor = Processor::read(&fixture::arm_board().source());
        assert_eq!(processor.model_name(), Reading::known("Arm part 0xd0c"));
        assert_eq!(processor.vendor(), Reading::known("Arm"));
        assert_eq!(processor.instruction_sets(), Reading::known("asimd"));
        assert_eq!(processor.is_virtual(), None);
    }

    #[test]
    fn several_designs_and_unknown_implementers_are_told_as_codes() {
        let tree = Tree::new();
        tree.write(
            "proc/cpuinfo",
            "CPU implementer: 0x99\nCPU part: 0xd05\nCPU part: 0xd0b\nCPU part: 0xd05\n",
        );
        let name = Processor::read(&tree.source()).model_name();
        assert_eq!(name, Reading::known("implementer 0x99 part 0xd05+0xd0b"));
    }

    #[test]
    fn the_generation_is_told_beside_the_name() {
        let tree = Tree::new();
        let stepping = "cpu family\t: 25\nmodel\t\t: 17\nmodel name\t: Example\nstepping\t: 1\n";
        for (text, expected) in
            [(stepping, "family 25 model 17 stepping 1"), (&stepping[..45], "family 25 model 17")]
        {
            tree.write("proc/cpuinfo", text);
            assert_eq!(Processor::read(&tree.source()).generation(), Reading::known(expected));
        }
        assert_eq!(Processor::read(&fixture::arm_board().source()).generation(), Reading::Unavailable);
    }

    #[test]
    fn a_list_without_sense_tells_nothing() {
        let tree = Tree::new();
        tree.write("proc/cpuinfo", "model name\ncpu MHz : nan\nflags : \n:::\n");
        let processor = Processor::read(&tree.source());
        assert_eq!(processor.model_name(), Reading::Unavailable);
        assert_eq!(processor.frequency_mhz(), Reading::Unavailable);
        assert_eq!(processor.instruction_sets(), Reading::Unavailable);
        assert_eq!(processor.is_virtual(), None);
    }
}
