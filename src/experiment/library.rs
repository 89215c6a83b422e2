//! The experiments that come with the program. A new experiment is one new file and one line here.

use std::path::Path;

use crate::base::input::{Check, InputError};
use crate::experiment::spec::Experiment;

/// Name and text of each experiment, in the order of the report.
const EXPERIMENTS: [(&str, &str); 19] = [
    ("table2", include_str!("../../experiments/table2.toml")),
    ("figure4", include_str!("../../experiments/figure4.toml")),
    ("memory-order", include_str!("../../experiments/memory-order.toml")),
    ("scaling-n", include_str!("../../experiments/scaling-n.toml")),
    ("chunks", include_str!("../../experiments/chunks.toml")),
    ("cg", include_str!("../../experiments/cg.toml")),
    ("preconditioners", include_str!("../../experiments/preconditioners.toml")),
    ("bucket-side", include_str!("../../experiments/bucket-side.toml")),
    ("layouts", include_str!("../../experiments/layouts.toml")),
    ("twin", include_str!("../../experiments/twin.toml")),
    ("effects-cost", include_str!("../../experiments/effects-cost.toml")),
    ("unnamed-effects", include_str!("../../experiments/unnamed-effects.toml")),
    ("effects-of-heated-cavity", include_str!("../../experiments/effects-of-heated-cavity.toml")),
    ("effects-of-mud-flow", include_str!("../../experiments/effects-of-mud-flow.toml")),
    ("effects-of-oscillating-drop", include_str!("../../experiments/effects-of-oscillating-drop.toml")),
    ("effects-of-sloshing-tank", include_str!("../../experiments/effects-of-sloshing-tank.toml")),
    ("accuracy-cost", include_str!("../../experiments/accuracy-cost.toml")),
    ("hard-cases", include_str!("../../experiments/hard-cases.toml")),
    ("validation", include_str!("../../experiments/validation.toml")),
];

/// The names of all embedded experiments.
pub fn names() -> impl Iterator<Item = &'static str> {
    EXPERIMENTS.iter().map(|(name, _)| *name)
}

/// The experiment of that name or, where there is such a file, the one it describes: a path given by the user wins.
pub fn load(name_or_path: &str) -> Result<Experiment, InputError> {
    if Path::new(name_or_path).is_file() {
        let text = std::fs::read_to_string(name_or_path)
            .map_err(|error| InputError::new(name_or_path, "experiment", "not readable", error))?;
        let experiment = Experiment::parse(&text, name_or_path)?;
        let taken = names().any(|name| name == experiment.id);
        let same = taken && embedded(&experiment.id)? == experiment;
        let allowed = "an experiment of the program has that id and another content: choose another id";
        Check { file: name_or_path }.require(
            !taken || same,
            "id",
            format!("`{}`", experiment.id),
            allowed,
        )?;
        return Ok(experiment);
    }
    embedded(name_or_path)
}

/// The experiment of that name that comes with the program, whatever files there are.
pub fn embedded(name: &str) -> Result<Experiment, InputError> {
    let text = text(name).ok_or_else(|| {
        let known: Vec<&str> = names().collect();
        let allowed = format!("allowed are the path of an experiment file or one of: {}", known.join(", "));
        InputError::new("command line", "EXPERIMENT", format!("`{name}`"), allowed)
    })?;
    Experiment::parse(text, &format!("experiments/{name}.toml"))
}

/// The file of that experiment.
pub fn text(name: &str) -> Option<&'static str> {
    EXPERIMENTS.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
