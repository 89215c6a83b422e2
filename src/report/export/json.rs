//! The run as one JSON document: what it is, what its columns mean, and every table as a list of objects.

use anyhow::Result;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

use crate::report::export::column::{Column, Table};
use crate::report::export::dictionary;
use crate::report::export::sheet::Sheet;
use crate::report::export::value::Value;

/// The version of the document's form, to be raised when the meaning of a key changes.
const SCHEMA_VERSION: u32 = 1;

#[derive(Serialize)]
struct Document<'a> {
    schema_version: u32,
    run: Properties<'a>,
    dictionary: Tables<'a, Described>,
    tables: Tables<'a, Rows<'a>>,
}

/// The document. Tables that it has under other keys, the run and the dictionary, are not repeated.
pub fn bytes(sheets: &[Sheet]) -> Result<Vec<u8>> {
    let of_run = |sheet: &&Sheet| sheet.table.name == dictionary::RUN.name;
    let named = |sheet: &&Sheet| !of_run(sheet) && sheet.table.name != dictionary::DICTIONARY.name;
    let tables = || sheets.iter().filter(named);
    let document = Document {
        schema_version: SCHEMA_VERSION,
        run: Properties(sheets.iter().find(of_run)),
        dictionary: Tables(tables().map(|sheet| (sheet.table.name, Described(sheet.table))).collect()),
        tables: Tables(tables().map(|sheet| (sheet.table.name, Rows(sheet))).collect()),
    };
    Ok(serde_json::to_vec(&document)?)
}

/// Tables by name, in the order of the sheets.
struct Tables<'a, T>(Vec<(&'a str, T)>);

impl<T: Serialize> Serialize for Tables<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, table)| (name, table)))
    }
}

/// The table of the run as an object.
struct Properties<'a>(Option<&'a Sheet>);

impl Serialize for Properties<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let properties = self.0.into_iter().flat_map(|sheet| {
            sheet.rows.iter().map(|row| (sheet.text(row, "key"), sheet.cell(row, "value")))
        });
        serializer.collect_map(properties)
    }
}

/// What a table and its columns mean.
struct Described(&'static Table);

#[derive(Serialize)]
struct DescribedColumn {
    name: &'static str,
    r#type: &'static str,
    unit: &'static str,
    description: &'static str,
}

impl Serialize for Described {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let described = |column: &Column| DescribedColumn {
            name: column.name,
            r#type: column.kind.name(),
            unit: column.unit,
            description: column.description,
        };
        let columns: Vec<DescribedColumn> = self.0.columns.iter().map(described).collect();
        let mut map = serializer.serialize_map(Some(3))?;
        map.serialize_entry("title", self.0.title)?;
        map.serialize_entry("description", self.0.description)?;
        map.serialize_entry("columns", &columns)?;
        map.end()
    }
}

/// A list of objects, whose keys are the columns in their order.
struct Rows<'a>(&'a Sheet);

struct Row<'a>(&'static [Column], &'a [Value]);

impl Serialize for Rows<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.rows.iter().map(|row| Row(self.0.table.columns, row)))
    }
}

impl Serialize for Row<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|column| column.name).zip(self.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_values_are_null_and_times_are_text() {
        let value = |key: &str, value: Value| vec![Value::text(key), value, Value::text("A property.")];
        let run = Sheet {
            table: &dictionary::RUN,
            rows: vec![
                value("commit", Value::text("12345e67")),
                value("created_utc", Value::time("2026-11-23T01:55:18Z")),
            ],
        };
        let fact = ["cpu", "", "", ""].map(Value::text).to_vec();
        let machine = Sheet { table: &dictionary::MACHINE, rows: vec![fact] };
        let text = String::from_utf8(bytes(&[machine, run]).unwrap()).unwrap();
        let start = r#"{"schema_version":1,"run":{"commit":"12345e67","created_utc":"2026-11-23T01:55:18Z"},"dictionary":{"machine":"#;
        assert!(text.starts_with(start), "{text}");
        let end = r#""tables":{"machine":[{"group":"cpu","key":null,"value":null,"unit":null}]}}"#;
        assert!(text.ends_with(end), "{text}");
    }
}
