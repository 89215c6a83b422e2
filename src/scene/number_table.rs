//! Numbers over time from a CSV file that a scene names: read once, when the scene is checked.

use std::path::Path;
use std::sync::OnceLock;

use serde::Deserialize;

use crate::base::input::{Check, InputError};
use crate::engine::curve::Curve;

/// The path of a CSV file, from the folder of the scene file. Its first line names the columns.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(from = "String")]
pub struct TableFile {
    file: String,
    /// Its rows, once they are read.
    rows: OnceLock<Vec<Vec<f64>>>,
}

impl From<String> for TableFile {
    fn from(file: String) -> Self {
        TableFile { file, rows: OnceLock::new() }
    }
}

#[cfg(feature = "driver")]
impl schemars::JsonSchema for TableFile {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "TableFile".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        String::json_schema(generator)
    }
}

impl TableFile {
    /// The path as the scene has it.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// Reads the file: `columns` in its first line, then finite numbers, the first column ascending.
    pub fn read(&self, check: Check<'_>, key: &str, columns: &[&str]) -> Result<(), InputError> {
        let folder = Path::new(check.file).parent().unwrap_or(Path::new(""));
        let refused = |why: String| {
            let allowed = format!("allowed is a CSV file with the columns {} {why}", columns.join(", "));
            InputError::new(check.file, key, format!("`{}`", self.file), allowed)
        };
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_path(folder.join(&self.file))
            .map_err(|error| refused(format!("that can be read: {error}")))?;
        let header = reader.headers().map_err(|error| refused(format!("that can be read: {error}")))?;
        if !header.iter().eq(columns.iter().copied()) {
            let found = header.iter().collect::<Vec<_>>().join(", ");
            return Err(refused(format!("and not {found}")));
        }
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for row in reader.deserialize() {
            let line = rows.len() + 2;
            let row: Vec<f64> = row.map_err(|error| refused(format!("and numbers below: {error}")))?;
            if !row.iter().all(|value| value.is_finite()) {
                return Err(refused(format!("and finite numbers below; see line {line}")));
            }
            if rows.last().is_some_and(|before| before[0] >= row[0]) {
                return Err(refused(format!("and times that ascend; see line {line}")));
            }
            rows.push(row);
        }
        if rows.is_empty() {
            return Err(refused("and at least one row".to_string()));
        }
        // A scene that is checked twice keeps what it read first.
        let _ = self.rows.set(rows);
        Ok(())
    }

    /// The columns after the first over the first. A file that was not read is a point at zero.
    pub fn curve<const N: usize>(&self) -> Curve<N> {
        let Some(rows) = self.rows.get() else {
            return Curve { time_s: vec![0.0], value: vec![[0.0; N]] };
        };
        let value = |row: &Vec<f64>| std::array::from_fn(|k| row[k + 1]);
        Curve { time_s: rows.iter().map(|row| row[0]).collect(), value: rows.iter().map(value).collect() }
    }
}
