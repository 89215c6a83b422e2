//! Timed cells: every combination of the values that a group of factors lists.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::base::input::{Check, InputError};
use crate::base::parallel::MAX_THREADS;
use crate::engine::preset::Search;
use crate::experiment::record::Variant;
use crate::experiment::spec::{Mode, check_list};

/// A group of cells. The variants of a group and thread count run in one process, in lock step. What a list leaves empty
/// is the experiment's fixed setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factors {
    /// Tells the group from others of the same experiment; may be empty.
    #[serde(default)]
    pub name: String,
    #[serde(default = "Mode::every")]
    pub modes: Vec<Mode>,
    /// Changes to keys of the scene for the whole group: it starts from states of its own.
    #[serde(default)]
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
    /// Ids of the experiment's schemes: changes to the scene that variants of one group differ by.
    #[serde(default)]
    pub scheme: Vec<String>,
}

/// A number of threads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a number of threads or \"all\"")]
pub enum Threads {
    Count(usize),
    Named(NamedThreads),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NamedThreads {
    /// As many as hardware threads may be used.
    All,
}

impl Threads {
    pub fn count(self, usable: usize) -> usize {
        match self {
            Threads::Count(count) => count,
            Threads::Named(NamedThreads::All) => usable,
        }
    }
}

impl Factors {
    /// Checks the lists, and `variants`, which are what they come to.
    pub(super) fn check(&self, check: Check<'_>, key: &str, variants: &[Variant]) -> Result<(), InputError> {
        let key = |name: &str| format!("{key}.{name}");
        check_list(check, &key("threads"), &self.threads, false)?;
        for threads in &self.threads {
            let count = threads.count(1);
            let allowed = format!("allowed are 1 to {MAX_THREADS}, or `all`");
            check.require((1..=MAX_THREADS).contains(&count), &key("threads"), count, allowed)?;
        }
        check_list(check, &key("preset"), &self.preset, false)?;
        check_list(check, &key("modes"), &self.modes, false)?;
        let lists = [
            ("distance_test", &self.distance_test),
            ("memory_order", &self.memory_order),
            ("storage", &self.storage),
            ("schedule", &self.schedule),
            ("cg", &self.cg),
            ("scheme", &self.scheme),
        ];
        for (name, list) in lists {
            check_list(check, &key(name), list, true)?;
        }
        check_list(check, &key("buckets_per_radius"), &self.buckets_per_radius, true)?;
        check_list(check, &key("cg_tolerance"), &self.cg_tolerance, true)?;
        for variant in variants {
            let search = variant.options(check.file)?.search;
            let allowed = "its sums run in another order, so its end state differs from the other searches'";
            check.require(search != Search::BruteForce, &key("preset"), &variant.preset, allowed)?;
        }
        Ok(())
    }

    /// The number of variants, without making them.
    pub(super) fn combinations(&self) -> usize {
        let texts = [
            &self.preset,
            &self.distance_test,
            &self.memory_order,
            &self.storage,
            &self.schedule,
            &self.cg,
            &self.scheme,
        ];
        let lengths = texts.map(Vec::len).into_iter();
        let lengths = lengths.chain([self.buckets_per_radius.len(), self.cg_tolerance.len()]);
        lengths.fold(1, |product: usize, length| product.saturating_mul(length.max(1)))
    }

    /// The ways to compute a step that the group compares.
    pub(super) fn variants(&self, fixed: &Variant) -> Vec<Variant> {
        let mut variants = vec![fixed.clone()];
        vary(&mut variants, &self.scheme, |v| &mut v.scheme);
        vary(&mut variants, &self.cg_tolerance, |v| &mut v.cg_tolerance);
        vary(&mut variants, &self.cg, |v| &mut v.cg);
        vary(&mut variants, &self.storage, |v| &mut v.storage);
        vary(&mut variants, &self.schedule, |v| &mut v.schedule);
        vary(&mut variants, &self.memory_order, |v| &mut v.memory_order);
        vary(&mut variants, &self.buckets_per_radius, |v| &mut v.buckets_per_radius);
        vary(&mut variants, &self.distance_test, |v| &mut v.distance_test);
        vary(&mut variants, &self.preset, |v| &mut v.preset);
        variants
    }

    /// The thread counts, each once, with `all` resolved.
    pub fn thread_counts(&self, usable: usize) -> Vec<usize> {
        let mut counts: Vec<usize> = self.threads.iter().map(|threads| threads.count(usable)).collect();
        counts.sort_unstable();
        counts.dedup();
        counts
    }
}

/// Combines every variant with every value of one setting.
fn vary<T: Clone>(variants: &mut Vec<Variant>, values: &[T], setting: impl Fn(&mut Variant) -> &mut T) {
    if values.is_empty() {
        return;
    }
    let mut combined = Vec::with_capacity(variants.len() * values.len());
    for variant in variants.iter() {
        for value in values {
            let mut variant = variant.clone();
            *setting(&mut variant) = value.clone();
            combined.push(variant);
        }
    }
    *variants = combined;
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
        assert_eq!((factors.thread_counts(1), factors.thread_counts(4)), (vec![1], vec![1, 4]));
    }
}
