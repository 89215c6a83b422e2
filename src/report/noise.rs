//! What an experiment's rounds say about the machine's noise: the floor, busy rounds, times that stand apart.

use std::collections::BTreeMap;

use crate::base::statistics::{NoInterval, NoiseFloor, noise_floor, outliers};
use crate::experiment::record::{Stage, TrialRecord, Variant};
use crate::report::measured::{Measured, Pick, Quantity, TimedCell, by_round};

/// A control cell: the second copy of a variant, measured beside it.
struct Control<'a>(&'a TimedCell);

impl Pick for Control<'_> {
    fn fits(&self, trial: &TrialRecord, variant: &Variant) -> bool {
        let of = |variant: &Variant| Variant { control: false, ..variant.clone() };
        variant.control && self.0.fits(trial, &of(variant))
    }
}

/// The noise floor of an experiment: how far two copies of the same cell lie apart, pooled over the cells that have a
/// control. `None` where none has.
pub fn floor(measured: &Measured, experiment: &str, quantity: Quantity) -> Option<NoiseFloor> {
    let (mut cells, mut controls) = (Vec::new(), Vec::new());
    for cell in measured.cells(experiment) {
        let of_cell = measured.per_step(experiment, Stage::Paired, &cell, quantity);
        let of_control = measured.per_step(experiment, Stage::Paired, &Control(&cell), quantity);
        cells.extend(by_round(&of_cell, &of_control, |cell, _| cell));
        controls.extend(by_round(&of_cell, &of_control, |_, control| control));
    }
    noise_floor(&cells, &controls)
}

/// What is to be said about the noise, in sentences.
pub fn findings(measured: &Measured, experiment: &str) -> Vec<String> {
    let floor = floor(measured, experiment, Quantity::NonCg).map(|floor| in_words(&floor));
    let sentences = [floor, busy_rounds(measured, experiment), apart(measured, experiment)];
    sentences.into_iter().flatten().collect()
}

fn in_words(floor: &NoiseFloor) -> String {
    let NoiseFloor { typical, ratio, .. } = floor;
    let interval = ratio.interval.map_or(String::new(), |i| format!(" [{:.3}, {:.3}]", i.low, i.high));
    let verdict = match floor.contains_one() {
        Some(true) => "as it must be".to_string(),
        Some(false) => "which it must not: something that is not its work changes a cell's time".to_string(),
        None if ratio.why_no_interval() == Some(NoInterval::DependentRounds) => {
            "from rounds that depend on one another too much for an interval".to_string()
        }
        None => "from too few rounds for an interval".to_string(),
    };
    format!(
        "Noise floor: two copies of the same cell, measured in the same rounds, typically differ by {:.2} % outside CG; \
         their ratio is {:.3}{interval}, {verdict}. Effects below {:.2} % are not resolved here.",
        100.0 * typical,
        ratio.median,
        100.0 * floor.level().exp_m1()
    )
}

/// Rounds that began although the machine was busier than the gate allows.
fn busy_rounds(measured: &Measured, experiment: &str) -> Option<String> {
    let rounds = || measured.rounds.iter().filter(|round| round.experiment == experiment);
    let busy: Vec<&str> =
        rounds().map(|r| r.warning.as_str()).filter(|warning| !warning.is_empty()).collect();
    let first = busy.first()?;
    let (count, all) = (busy.len(), rounds().count());
    Some(format!("{count} of {all} rounds began on a busy machine; in the first of them {first}."))
}

/// Times that stand apart from the other rounds of their cell; all of them count.
fn apart(measured: &Measured, experiment: &str) -> Option<String> {
    let mut by_cell: BTreeMap<String, usize> = BTreeMap::new();
    let mut times = 0;
    for cell in measured.cells(experiment) {
        let per_step = measured.per_step(experiment, Stage::Paired, &cell, Quantity::Total);
        let seconds: Vec<f64> = per_step.values().copied().collect();
        times += seconds.len();
        let count = outliers(&seconds).len();
        if count > 0 {
            by_cell.insert(format!("{} on {} thread(s)", cell.variant.label(), cell.threads), count);
        }
    }
    let count: usize = by_cell.values().sum();
    let cells: Vec<String> = by_cell.into_keys().collect();
    let share =
        format!("{count} of {times} times of whole steps stand apart from the other rounds of their cell");
    (count > 0).then(|| format!("{share} ({}). They are flagged, and count.", cells.join("; ")))
}
