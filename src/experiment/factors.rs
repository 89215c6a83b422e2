//! Timed cells: every combination of the values that a group of factors lists.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::base::parallel::MAX_THREADS;
use crate::engine::preset::{Options, Search, Test};
use crate::experiment::machine::Topology;
use crate::experiment::record::Variant;
use crate::experiment::selection::Setting;
use crate::experiment::spec::{Mode, check_list};

/// A group of cells. The variants of a group and thread count run in one process, in lock step. What a list leaves empty
/// is the experiment's fixed setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Factors {
    /// Tells the group from others of the same experiment; may be empty.
    #[serde(default)]
    pub name: String,
    #[serde(default = "Mode::every")]
    pub modes: Vec<Mode>,
    /// Changes to keys of the scene for the whole group: it starts from states of its own.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub scene: BTreeMap<String, toml::Value>,
    pub threads: Vec<Threads>,
    pub preset: Vec<String>,
    #[serde(default)]
    pub distance_test: Vec<String>,
    #[serde(default)]
    pub buckets_per_radius: Vec<usize>,
    #[serde(default)]
    pub memory_order: Vec<String>,
    #[serde(default)]
    pub storage: Vec<String>,
    #[serde(default)]
    pub schedule: Vec<String>,
    #[serde(default)]
    pub cg: Vec<String>,
    #[serde(default)]
    pub cg_tolerance: Vec<f64>,
    #[serde(default)]
    pub preconditioner: Vec<String>,
    #[serde(default)]
    pub matrix_values: Vec<String>,
    #[serde(default)]
    pub pair_terms: Vec<String>,
    /// Ids of the experiment's schemes: changes to the scene that variants of one group differ by.
    #[serde(default)]
    pub scheme: Vec<String>,
    /// Lists, by name and of one length, that are gone through together instead of being combined: the first values of
    /// all, then the second ones.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub zip: Vec<Setting>,
}

/// A number of threads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number of threads, \"cores\" or \"all\"")]
pub enum Threads {
    Count(usize),
    Named(NamedThreads),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum NamedThreads {
    /// As many as physical cores may be used: one on each.
    Cores,
    /// As many as hardware threads may be used.
    All,
}

/// What a machine offers to threads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Usable {
    /// Hardware threads.
    pub threads: usize,
    /// Physical cores among them.
    pub cores: usize,
}

impl Usable {
    pub fn of(topology: &Topology) -> Usable {
        let threads = topology.usable_cores();
        Usable { threads, cores: topology.physical_cores().min(threads) }
    }
}

impl Threads {
    pub fn count(self, usable: Usable) -> usize {
        match self {
            Threads::Count(count) => count,
            Threads::Named(NamedThreads::Cores) => usable.cores,
            Threads::Named(NamedThreads::All) => usable.threads,
        }
    }
}

impl Factors {
    /// Checks the lists, and `variants`, which are what they come to.
    pub(super) fn check(&self, check: Check<'_>, key: &str, variants: &[Variant]) -> Result<(), InputError> {
        let key = |name: &str| format!("{key}.{name}");
        check_list(check, &key("threads"), &self.threads, false)?;
        for threads in &self.threads {
            let count = threads.count(Usable { threads: 1, cores: 1 });
            let allowed = format!("allowed are 1 to {MAX_THREADS}, `cores` or `all`");
            check.require((1..=MAX_THREADS).contains(&count), &key("threads"), count, allowed)?;
        }
        check.require(!self.preset.is_empty(), &key("preset"), "empty", "at least one value is needed")?;
        check_list(check, &key("modes"), &self.modes, false)?;
        let lists = [
            ("preset", &self.preset),
            ("distance_test", &self.distance_test),
            ("memory_order", &self.memory_order),
            ("storage", &self.storage),
            ("schedule", &self.schedule),
            ("cg", &self.cg),
            ("preconditioner", &self.preconditioner),
            ("matrix_values", &self.matrix_values),
            ("pair_terms", &self.pair_terms),
            ("scheme", &self.scheme),
        ];
        // Lists that are gone through together may repeat a value.
        let unique = |name: &str| !self.zip.iter().any(|setting| setting.name() == name);
        for (name, list) in lists.into_iter().filter(|(name, _)| unique(name)) {
            check_list(check, &key(name), list, true)?;
        }
        if unique("buckets_per_radius") {
            check_list(check, &key("buckets_per_radius"), &self.buckets_per_radius, true)?;
        }
        if unique("cg_tolerance") {
            check_list(check, &key("cg_tolerance"), &self.cg_tolerance, true)?;
        }
        self.check_zip(check, &key("zip"))?;
        let mut labels = BTreeSet::new();
        for variant in variants {
            let allowed = "each combination may stand there once";
            check.require(labels.insert(variant.label()), &key("zip"), variant.label(), allowed)?;
            let Options { search, distance_test, .. } = variant.options(check.file)?;
            let allowed = "this search compares squares only: `squared`";
            let compiled = distance_test == Test::Squared || search.takes_roots_first();
            check.require(
                compiled || search == Search::BruteForce,
                &key("distance_test"),
                &variant.distance_test,
                allowed,
            )?;
            let allowed = "its sums run in another order, so its end state differs from the other searches'";
            check.require(search != Search::BruteForce, &key("preset"), &variant.preset, allowed)?;
        }
        Ok(())
    }

    /// The number of variants, without making them.
    pub(super) fn combinations(&self) -> usize {
        let zipped = |axis: &&Axis<'_>| self.zip.contains(&axis.setting);
        let axes = self.axes();
        let together = axes.iter().filter(zipped).map(|axis| axis.length).min().unwrap_or(1);
        let apart = axes.iter().filter(|axis| !zipped(axis)).map(|axis| axis.length.max(1));
        apart.fold(together, usize::saturating_mul)
    }

    /// The ways to compute a step that the group compares.
    pub(super) fn variants(&self, fixed: &Variant) -> Vec<Variant> {
        let axes = self.axes();
        let (zipped, apart): (Vec<Axis<'_>>, Vec<Axis<'_>>) =
            axes.into_iter().partition(|axis| self.zip.contains(&axis.setting));
        let together = zipped.iter().map(|axis| axis.length).min().unwrap_or(0);
        let mut variants = combined(vec![fixed.clone()], together, |variant, k| {
            zipped.iter().for_each(|axis| (axis.set)(variant, k));
        });
        for axis in apart {
            variants = combined(variants, axis.length, &axis.set);
        }
        variants
    }

    /// The lists, the one that varies slowest first.
    fn axes(&self) -> Vec<Axis<'_>> {
        vec![
            axis(Setting::Scheme, &self.scheme, |v, scheme| v.scheme = scheme),
            axis(Setting::CgTolerance, &self.cg_tolerance, |v, tolerance| v.cg_tolerance = tolerance),
            axis(Setting::PairTerms, &self.pair_terms, |v, terms| v.pair_terms = terms),
            axis(Setting::MatrixValues, &self.matrix_values, |v, values| v.matrix_values = values),
            axis(Setting::Preconditioner, &self.preconditioner, |v, name| v.preconditioner = name),
            axis(Setting::Cg, &self.cg, |v, cg| v.cg = cg),
            axis(Setting::Storage, &self.storage, |v, storage| v.storage = storage),
            axis(Setting::Schedule, &self.schedule, |v, schedule| v.schedule = schedule),
            axis(Setting::MemoryOrder, &self.memory_order, |v, order| v.memory_order = order),
            axis(Setting::BucketsPerRadius, &self.buckets_per_radius, |v, count| {
                v.buckets_per_radius = count
            }),
            axis(Setting::DistanceTest, &self.distance_test, |v, test| v.distance_test = test),
            axis(Setting::Preset, &self.preset, |v, preset| v.preset = preset),
        ]
    }

    /// Lists that are gone through together must be lists of variants, and of one length.
    fn check_zip(&self, check: Check<'_>, key: &str) -> Result<(), InputError> {
        check_list(check, key, &self.zip, true)?;
        let axes = self.axes();
        let lengths: Vec<usize> = self
            .zip
            .iter()
            .map(|setting| axes.iter().find(|axis| axis.setting == *setting).map_or(0, |axis| axis.length))
            .collect();
        let same = lengths.windows(2).all(|pair| pair[0] == pair[1]) && !lengths.contains(&0);
        let names: Vec<&str> = self.zip.iter().map(|setting| setting.name()).collect();
        let found = format!("{names:?} with {lengths:?} values");
        check.require(same && lengths.len() != 1, key, found, "allowed are two or more lists of one length")
    }

    /// The thread counts, each once, with names resolved.
    pub fn thread_counts(&self, usable: Usable) -> Vec<usize> {
        let mut counts: Vec<usize> = self.threads.iter().map(|threads| threads.count(usable)).collect();
        counts.sort_unstable();
        counts.dedup();
        counts
    }
}

/// One list of a group: how many values it has, and what each does to a variant.
struct Axis<'a> {
    setting: Setting,
    length: usize,
    set: Change<'a>,
}

/// Gives a variant the value of that place in a list.
type Change<'a> = Box<dyn Fn(&mut Variant, usize) + 'a>;

fn axis<'a, T: Clone>(setting: Setting, values: &'a [T], set: impl Fn(&mut Variant, T) + 'a) -> Axis<'a> {
    let set = move |variant: &mut Variant, k: usize| set(variant, values[k].clone());
    Axis { setting, length: values.len(), set: Box::new(set) }
}

/// Every variant with every value of one axis; the variants themselves where it has none.
fn combined(variants: Vec<Variant>, length: usize, set: impl Fn(&mut Variant, usize)) -> Vec<Variant> {
    if length == 0 {
        return variants;
    }
    let with = |(variant, k): (&Variant, usize)| {
        let mut variant = variant.clone();
        set(&mut variant, k);
        variant
    };
    variants.iter().flat_map(|variant| (0..length).map(move |k| (variant, k))).map(with).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variants_are_all_combinations() {
        let text = "threads = [1, \"all\"]\npreset = [\"paper-linked-list\", \"paper-aos-relocation\"]\n\
                    cg_tolerance = [1e-2, 1e-8, 1e-12]";
        let factors: Factors = toml::from_str(text).unwrap();
        let variants = factors.variants(&Variant::default());
        assert_eq!((variants.len(), factors.combinations()), (6, 6));
        assert_eq!((variants[3].cg_tolerance, variants[3].preset.as_str()), (1e-8, "paper-aos-relocation"));
        let counts = |threads: usize| factors.thread_counts(Usable { threads, cores: 1 });
        assert_eq!((counts(1), counts(4)), (vec![1], vec![1, 4]));
    }

    #[test]
    fn zipped_lists_advance_together() {
        let text = "threads = [1]\npreset = [\"paper-linked-list\", \"paper-aos-relocation\"]\n\
                    storage = [\"ell\", \"csr\"]\ncg_tolerance = [1e-2, 1e-8]\nzip = [\"storage\", \"cg_tolerance\"]";
        let factors: Factors = toml::from_str(text).unwrap();
        factors.check_zip(Check { file: "" }, "zip").unwrap();
        assert_eq!(factors.combinations(), 4);
        let found = factors.variants(&Variant::default());
        let found: Vec<_> = found.iter().map(|v| (v.storage.as_str(), v.cg_tolerance)).collect();
        assert_eq!(found, [("ell", 1e-2), ("ell", 1e-2), ("csr", 1e-8), ("csr", 1e-8)]);
        for zip in [vec![Setting::Storage], vec![Setting::Storage, Setting::Schedule]] {
            let uneven = Factors { zip, ..factors.clone() };
            assert!(uneven.check_zip(Check { file: "" }, "zip").is_err());
        }
    }
}
