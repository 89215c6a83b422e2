//! Particle count: the same flow with more particles.

use anyhow::Result;

use crate::base::statistics::Estimate;
use crate::engine::preset::Preset;
use crate::experiment::record::Stage;
use crate::report::measured::{Measured, Pick, Quantity, TimedCell, by_round, ratio, times};
use crate::report::section::scaling_figure::figure;
use crate::report::section::{Content, how_measured, peaks, roofline};
use crate::report::summary::CellPhase;
use crate::report::table::{TableView, show, show_or_none};

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    Ok(content_of(measured, "scaling-n"))
}

/// The section of runs that were recorded when the experiment had fewer sizes and another name.
pub fn content_of_older(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    Ok(content_of(measured, "particle-count"))
}

fn content_of(measured: &Measured, id: &str) -> Content {
    let costs = costs(measured, id);
    let findings =
        growth(&costs).into_iter().chain(gains(&costs)).chain(beyond(&costs)).chain(dry_walls(&costs));
    let findings = findings.chain(on_more_threads(measured, id));
    let mut content = Content {
        findings: std::iter::once(how_measured(measured, id)).chain(findings).collect(),
        figures: vec![(id.to_string(), figure(measured, &costs))],
        tables: vec![table(&costs)],
        ..Content::default()
    };
    content.append(peaks::content_of(measured, id));
    content.append(roofline::content_of(measured, id));
    content
}

/// What one variant costs in one scene.
pub(super) struct Cost {
    pub particles: usize,
    pub fluid_particles: usize,
    pub preset: String,
    pub test: String,
    /// Seconds a step.
    pub total_s: Estimate,
    pub non_cg_s: Estimate,
    pub cg_s: Estimate,
    pub cg_share: Estimate,
    /// Of CG, a step.
    pub iterations: f64,
    pub bytes_a_particle: f64,
    /// The time of the paper's linked list with the same test over its own, in all; `None` for the list itself.
    pub list_over: Option<Estimate>,
    /// The time of the preset that solves for dry walls too over that of the one that does not, in all.
    pub all_walls_over: Option<Estimate>,
    /// Its time outside CG over that of relocation with the same test; `None` where that was not measured, or is itself.
    pub over_relocated: Option<Estimate>,
}

impl Cost {
    /// In microseconds a fluid particle and step.
    pub fn us_a_fluid_particle(&self, step_s: Estimate) -> Estimate {
        step_s.scaled(1e6 / self.fluid_particles.max(1) as f64)
    }

    pub fn label(&self) -> String {
        format!("{}, {}", self.preset, self.test)
    }
}

fn costs(measured: &Measured, id: &str) -> Vec<Cost> {
    let cells = measured.cells(id);
    cells.iter().filter(|cell| cell.threads == 1).filter_map(|cell| cost(measured, id, cell)).collect()
}

fn cost(measured: &Measured, id: &str, cell: &TimedCell) -> Option<Cost> {
    let outcome = *measured.outcomes(id, cell).first()?;
    let per_step = |cell: &TimedCell, quantity| measured.per_step(id, Stage::Paired, cell, quantity);
    let (total, non_cg, cg) =
        (per_step(cell, Quantity::Total), per_step(cell, Quantity::NonCg), per_step(cell, Quantity::Cg));
    let share = by_round(&cg, &total, |cg, total| cg / total);
    let relocated = cell.with_preset(Preset::PAPER_AOS_RELOCATION);
    let over_relocated = (relocated != *cell).then(|| ratio(&non_cg, &per_step(&relocated, Quantity::NonCg)));
    let list = cell.beside_list();
    let list_over = (list != *cell).then(|| ratio(&per_step(&list, Quantity::Total), &total));
    let all_walls = (cell.variant.preset == Preset::FAST.name())
        .then(|| ratio(&per_step(&cell.with_preset(Preset::FAST_ALL_WALLS), Quantity::Total), &total));
    let windows = measured.windows(id, Stage::Paired, cell);
    let steps = windows.values().next()?.iter().flat_map(|window| &window.steps);
    let iterations: Vec<f64> = steps.map(|step| step.cg_iterations as f64).collect();
    Some(Cost {
        particles: outcome.particles,
        fluid_particles: outcome.fluid_particles,
        preset: cell.variant.preset.clone(),
        test: cell.variant.distance_test.clone(),
        total_s: times(&total)?,
        non_cg_s: times(&non_cg)?,
        cg_s: times(&cg)?,
        cg_share: Estimate::of_rounds(&share)?,
        iterations: iterations.iter().sum::<f64>() / iterations.len() as f64,
        bytes_a_particle: bytes(measured, id, cell)? as f64 / outcome.particles as f64,
        list_over: list_over.flatten(),
        all_walls_over: all_walls.flatten(),
        over_relocated: over_relocated.flatten(),
    })
}

/// Bytes of all columns of a cell's simulation.
fn bytes(measured: &Measured, id: &str, cell: &TimedCell) -> Option<usize> {
    let trials = measured.trials(id, Stage::Paired).map(|(_, trial)| trial);
    let mut found = trials.filter_map(|trial| {
        let place = trial.variants.iter().position(|variant| cell.fits(trial, variant))?;
        trial.outcome.as_ref()?.bytes.get(place).copied()
    });
    found.next()
}

/// The costs of each variant, from the smallest scene to the largest.
pub(super) fn by_variant(costs: &[Cost]) -> Vec<(String, Vec<&Cost>)> {
    let mut variants: Vec<(String, Vec<&Cost>)> = Vec::new();
    for cost in costs {
        let label = cost.label();
        match variants.iter_mut().find(|(known, _)| *known == label) {
            Some((_, of_variant)) => of_variant.push(cost),
            None => variants.push((label, vec![cost])),
        }
    }
    for (_, of_variant) in &mut variants {
        of_variant.sort_by_key(|cost| cost.particles);
    }
    variants
}

/// The power of the count with which a time grows from one size to another: 1 where a particle's cost stays the same.
fn exponent((few, little_s): (f64, f64), (many, much_s): (f64, f64)) -> f64 {
    (much_s / little_s).ln() / (many / few).ln()
}

/// How each variant's step grows from its smallest to its largest scene.
fn growth(costs: &[Cost]) -> Vec<String> {
    let sentence = |(label, of_variant): (String, Vec<&Cost>)| {
        let (small, large) = (*of_variant.first()?, *of_variant.last()?);
        if small.particles == large.particles {
            return None;
        }
        let power = |time: fn(&Cost) -> f64| {
            let at = |cost: &Cost| (cost.particles as f64, time(cost));
            exponent(at(small), at(large))
        };
        Some(format!(
            "{label}, from {} to {} particles: a fluid particle and step cost {} and {} µs outside CG, {} and {} µs in CG, \
             which takes {:.1} and {:.1} iterations, {} and {} of the time. Outside CG a step grows as the particle count \
             to the power {:.2}, as a whole {:.2}.",
            small.particles,
            large.particles,
            show(&small.us_a_fluid_particle(small.non_cg_s), 1),
            show(&large.us_a_fluid_particle(large.non_cg_s), 1),
            show(&small.us_a_fluid_particle(small.cg_s), 1),
            show(&large.us_a_fluid_particle(large.cg_s), 1),
            small.iterations,
            large.iterations,
            show(&small.cg_share, 3),
            show(&large.cg_share, 3),
            power(|cost| cost.non_cg_s.median),
            power(|cost| cost.total_s.median),
        ))
    };
    by_variant(costs).into_iter().filter_map(sentence).collect()
}

/// How the gain of relocation changes with the scene.
fn gains(costs: &[Cost]) -> Vec<String> {
    let list = Preset::PAPER_LINKED_LIST.name();
    let mut findings = Vec::new();
    for (_, of_variant) in by_variant(costs) {
        let with_gain = of_variant.into_iter().filter(|cost| cost.preset == list);
        let gains: Vec<(&Cost, Estimate)> = with_gain.filter_map(|c| Some((c, c.over_relocated?))).collect();
        if let (Some((small, first)), Some((large, last))) = (gains.first(), gains.last()) {
            findings.push(format!(
                "Outside CG and with {}, list over relocation goes from {} at {} to {} at {} particles.",
                small.test,
                show(first, 3),
                small.particles,
                show(last, 3),
                large.particles,
            ));
        }
    }
    findings
}

/// What the preset that goes beyond the paper gains over the list, scene by scene.
fn beyond(costs: &[Cost]) -> Option<String> {
    let gain = |cost: &Cost| {
        let gain = cost.list_over.filter(|_| cost.preset == Preset::FAST.name())?;
        Some(format!("{} at {} ({:.1} iterations)", show(&gain, 2), cost.particles, cost.iterations))
    };
    let gains: Vec<String> = costs.iter().filter_map(gain).collect();
    (!gains.is_empty())
        .then(|| format!("In all and with squared distances, list over fast: {}.", gains.join(", ")))
}

/// What unknowns in walls that no fluid is near would cost, scene by scene.
fn dry_walls(costs: &[Cost]) -> Option<String> {
    let cost = |cost: &Cost| Some(format!("{} at {}", show(&cost.all_walls_over?, 3), cost.particles));
    let costs: Vec<String> = costs.iter().filter_map(cost).collect();
    (!costs.is_empty()).then(|| {
        format!(
            "With unknowns in walls that no fluid is near, a step of fast takes {} of the time.",
            costs.join(", ")
        )
    })
}

/// What further threads gain, and what the machine's bandwidth gains from them.
fn on_more_threads(measured: &Measured, id: &str) -> Vec<String> {
    let sentence = |cell: &TimedCell| {
        let total = |cell: &TimedCell| measured.per_step(id, Stage::Paired, cell, Quantity::Total);
        let gain = ratio(&total(&TimedCell { threads: 1, ..cell.clone() }), &total(cell))?;
        let particles = measured.outcomes(id, cell).first()?.particles;
        let allowed = reading_gain(measured, id, cell.threads).map_or(String::new(), |(array, more)| {
            format!(
                "; the machine reads arrays of {array} a thread {more:.2} times as fast, so that this is {:.2} of what its \
                 bandwidth allows",
                gain.median / more
            )
        });
        Some(format!(
            "At {particles} particles a step of {} is {} times as fast on {} threads as on one{allowed}.",
            cell.variant.preset,
            show(&gain, 3),
            cell.threads
        ))
    };
    let shown = [Preset::PAPER_LINKED_LIST, Preset::FAST].map(Preset::name);
    let cells = measured.cells(id).into_iter();
    let cells = cells.filter(|cell| cell.threads > 1 && shown.contains(&cell.variant.preset.as_str()));
    cells.filter_map(|cell| sentence(&cell)).collect()
}

/// The largest array whose reading was measured, and how much faster so many threads read theirs than one.
fn reading_gain(measured: &Measured, id: &str, threads: usize) -> Option<(String, f64)> {
    let found = crate::report::peaks::of(measured, id);
    let largest = |threads: usize| found.iter().find(|peaks| peaks.threads == threads)?.reading().pop();
    let (one, more) = (largest(1)?, largest(threads)?);
    Some((peaks::size(more.working_set_bytes), more.median_per_s / one.median_per_s))
}

fn table(costs: &[Cost]) -> TableView {
    let mut view = TableView::new(
        "Time of a step, microseconds a fluid particle and step, memory and CG; median (smallest to largest round), ratios [95 % interval].",
        &[
            "particles",
            "of them fluid",
            "preset",
            "distance test",
            "step, ms",
            "µs a fluid particle",
            "outside CG, µs",
            "in CG, µs",
            "CG iterations",
            "over relocation, outside CG",
            "list over it, in all",
            "bytes a particle",
        ],
    );
    for cost in costs {
        let us = |step_s| show(&cost.us_a_fluid_particle(step_s), 1);
        view.rows.push(vec![
            cost.particles.to_string(),
            cost.fluid_particles.to_string(),
            cost.preset.clone(),
            cost.test.clone(),
            show(&cost.total_s.scaled(1e3), 2),
            us(cost.total_s),
            us(cost.non_cg_s),
            us(cost.cg_s),
            format!("{:.1}", cost.iterations),
            show_or_none(cost.over_relocated, 3),
            show_or_none(cost.list_over, 3),
            format!("{:.0}", cost.bytes_a_particle),
        ]);
    }
    view
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cost_that_is_linear_has_the_power_one() {
        assert!((exponent((1e3, 2.0), (1e5, 200.0)) - 1.0).abs() < 1e-12);
        assert!((exponent((1e3, 1.0), (8e3, 16.0)) - 4.0 / 3.0).abs() < 1e-12);
    }
}
