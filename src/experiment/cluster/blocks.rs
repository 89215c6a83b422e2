//! Blocks: rounds that any node can run in any order once the states are there.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::experiment::cluster::array::ranges;
use crate::experiment::plan::{Plan, PlannedRound};
use crate::experiment::progress::StageProgress;
use crate::experiment::record::{RoundRecord, Stage};
use crate::experiment::spec::{Experiment, Mode};
use crate::experiment::stopping::Rounds;

/// One round of one stage of an experiment.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Block {
    pub experiment: String,
    pub stage: Stage,
    /// Counted from 0, as in files and tables.
    pub round: usize,
}

impl Block {
    /// Whether its stage has cells here, and needs more rounds than it has.
    pub fn is_needed(&self, stages: &[StageProgress]) -> bool {
        let of_block =
            |stage: &&StageProgress| stage.experiment == self.experiment && stage.stage == self.stage;
        stages.iter().find(of_block).is_some_and(|stage| !stage.complete)
    }

    pub fn of(round: &PlannedRound, plan: &Plan) -> Block {
        let experiment = plan.experiments[round.experiment].spec.id.clone();
        Block { experiment, stage: round.stage, round: round.round }
    }

    /// Its record in a run folder.
    pub fn path(&self, folder: &Path) -> PathBuf {
        RoundRecord::path(folder, &self.experiment, self.stage, self.round)
    }
}

impl fmt::Display for Block {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} round {}", self.experiment, self.stage.name(), self.round)
    }
}

/// The blocks of a run, the most that each stage may have, numbered by their place: by what the experiments say alone, so
/// that a machine that only submits numbers them like the nodes that run them. Rounds that do nothing but leave states are
/// the first job's, and no blocks.
pub fn blocks(experiments: &[Experiment], mode: Mode) -> Vec<Block> {
    let mut blocks = Vec::new();
    for experiment in experiments {
        for stage in Stage::ALL {
            let rounds = experiment.rounds(mode, stage).map_or(0, Rounds::most);
            let experiment = &experiment.id;
            blocks.extend((0..rounds).map(|round| Block { experiment: experiment.clone(), stage, round }));
        }
    }
    blocks
}

/// Blocks in words, those of a stage together: `table2 paired 0-3,7`.
pub fn in_words(blocks: &[Block]) -> Vec<String> {
    let stages = blocks.chunk_by(|a, b| (&a.experiment, a.stage) == (&b.experiment, b.stage));
    let words = stages.filter_map(|stage| {
        let Block { experiment, stage: name, .. } = stage.first()?;
        let rounds: Vec<usize> = stage.iter().map(|block| block.round).collect();
        Some(format!("{experiment} {} {}", name.name(), ranges(&rounds)))
    });
    words.collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::experiment::calibration::Calibration;
    use crate::experiment::factors::Usable;
    use crate::experiment::library;

    #[test]
    fn blocks_in_words_are_grouped_by_stage() {
        let block = |stage, round| Block { experiment: "chunks".to_string(), stage, round };
        let rounds = [0, 1, 4].map(|round| block(Stage::Paired, round));
        let blocks = [&rounds[..], &[block(Stage::Observed, 0)]].concat();
        assert_eq!(in_words(&blocks), ["chunks paired 0-1,4", "chunks observed 0"]);
        assert_eq!(in_words(&[]), [""; 0]);
    }

    #[test]
    fn blocks_are_the_rounds_of_every_machine() {
        let experiments: Vec<Experiment> =
            library::names().map(|name| library::load(name).unwrap()).collect();
        for mode in Mode::ALL {
            let blocks: BTreeSet<Block> = blocks(&experiments, mode).into_iter().collect();
            for threads in [1, 64] {
                let timeless = Calibration::TIMELESS;
                let usable = Usable { threads, cores: threads };
                let plan = Plan::on(usable, experiments.clone(), mode, timeless).unwrap();
                let planned = plan.rounds.iter().filter(|round| round.stage != Stage::States);
                assert_eq!(planned.map(|round| Block::of(round, &plan)).collect::<BTreeSet<_>>(), blocks);
            }
        }
    }
}
