//! The JSON Schemas of experiment and scene files, made from the types that read them, for editors.

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;

use crate::experiment::spec::Experiment;
use crate::scene::Scene;

/// The schema as the repository holds it, in `experiments/experiment.schema.json`.
pub fn experiment() -> String {
    text_of::<Experiment>()
}

/// The schema as the repository holds it, in `experiments/scenes/scene.schema.json`.
pub fn scene() -> String {
    text_of::<Scene>()
}

fn text_of<T: JsonSchema>() -> String {
    let schema = SchemaSettings::draft07().into_generator().into_root_schema_for::<T>();
    let mut text = serde_json::to_string_pretty(&schema).expect("a schema is valid JSON");
    text.push('\n');
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_committed_schemas_are_current() {
        let committed = include_str!("../../experiments/scenes/scene.schema.json");
        assert_eq!(
            committed,
            scene(),
            "write it anew: repro schema scene > experiments/scenes/scene.schema.json"
        );
        let committed = include_str!("../../experiments/experiment.schema.json");
        assert_eq!(
            committed,
            experiment(),
            "write it anew: repro schema > experiments/experiment.schema.json"
        );
    }
}
