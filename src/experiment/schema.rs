//! The JSON Schema of experiment files, made from the types that read them, for editors.

use schemars::generate::SchemaSettings;

use crate::experiment::spec::Experiment;

/// The schema as the repository holds it, in `experiments/experiment.schema.json`.
pub fn experiment() -> String {
    let schema = SchemaSettings::draft07().into_generator().into_root_schema_for::<Experiment>();
    let mut text = serde_json::to_string_pretty(&schema).expect("a schema is valid JSON");
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_committed_schema_is_current() {
        let committed = include_str!("../../experiments/experiment.schema.json");
        assert_eq!(
            committed,
            experiment(),
            "write it anew: repro schema > experiments/experiment.schema.json"
        );
    }
}
