//! A table with its rows, every cell typed.

use anyhow::{Context, Result, bail};
use serde::Serialize;
use serde_json::Value as Json;

use crate::report::export::column::{Column, Table};
use crate::report::export::value::Value;

/// A table with rows as long as it has columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    pub table: &'static Table,
    pub rows: Vec<Vec<Value>>,
}

impl Sheet {
    /// The rows of a CSV file of the run folder as a sheet. A field that the table does not describe, or that is not of
    /// its column's kind, is refused.
    pub fn of<R: Serialize>(table: &'static Table, rows: &[R]) -> Result<Sheet> {
        let cells = |(position, row): (usize, &R)| {
            cells(table, row).with_context(|| format!("{}, row {}", table.name, position + 1))
        };
        Ok(Sheet { table, rows: rows.iter().enumerate().map(cells).collect::<Result<_>>()? })
    }

    /// The cell of a row in the column of that name.
    pub fn cell<'a>(&self, row: &'a [Value], column: &str) -> &'a Value {
        let place = self.table.columns.iter().position(|c| c.name == column);
        place.and_then(|place| row.get(place)).unwrap_or(&Value::Missing)
    }

    /// The same as a number, where it is one.
    pub fn number(&self, row: &[Value], column: &str) -> Option<f64> {
        match self.cell(row, column) {
            Value::Number(number) => Some(*number),
            Value::Integer(number) => Some(*number as f64),
            _ => None,
        }
    }

    /// The same as text; empty where it is none.
    pub fn text<'a>(&self, row: &'a [Value], column: &str) -> &'a str {
        match self.cell(row, column) {
            Value::Text(text) => text,
            _ => "",
        }
    }
}

fn cells(table: &Table, row: &impl Serialize) -> Result<Vec<Value>> {
    let Json::Object(mut fields) = serde_json::to_value(row)? else {
        bail!("a row without columns");
    };
    let cell = |column: &Column| {
        let name = column.name;
        let field = fields.remove(name).with_context(|| format!("the column `{name}` is missing"))?;
        let found = field.to_string();
        let kind = column.kind.name();
        column.kind.value(field).with_context(|| format!("`{name}` is {found}; allowed is a {kind}"))
    };
    let cells = table.columns.iter().map(cell).collect::<Result<_>>()?;
    match fields.keys().next() {
        Some(unknown) => bail!("nothing describes the column `{unknown}`"),
        None => Ok(cells),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::export::column::Kind;

    static TABLE: Table = Table {
        name: "times",
        title: "Times",
        description: "A row a time.",
        columns: &[
            Column { name: "phase", kind: Kind::Text, unit: "", description: "Phase." },
            Column { name: "time_s", kind: Kind::Number, unit: "s", description: "Time." },
        ],
    };

    #[derive(Serialize)]
    struct Row<T> {
        time_s: T,
        phase: &'static str,
    }

    #[test]
    fn cells_stand_in_the_order_of_the_table() {
        let sheet = Sheet::of(&TABLE, &[Row { time_s: Some(0.5), phase: "1-2" }]).unwrap();
        assert_eq!(sheet.rows, [[Value::Text("1-2".to_string()), Value::Number(0.5)]]);
        assert_eq!(sheet.number(&sheet.rows[0], "time_s"), Some(0.5));
        assert_eq!(sheet.text(&sheet.rows[0], "phase"), "1-2");
    }

    #[test]
    fn what_is_not_described_or_of_another_kind_is_refused_by_row_and_column() {
        let error = Sheet::of(&TABLE, &[Row { time_s: "soon", phase: "" }]).unwrap_err();
        assert_eq!(format!("{error:#}"), "times, row 1: `time_s` is \"soon\"; allowed is a number");
        let error = Sheet::of(&TABLE, &[std::collections::BTreeMap::from([("phase", "cg")])]).unwrap_err();
        assert!(format!("{error:#}").contains("the column `time_s` is missing"));
        #[derive(Serialize)]
        struct More {
            phase: &'static str,
            time_s: f64,
            calls: usize,
        }
        let error = Sheet::of(&TABLE, &[More { phase: "cg", time_s: 0.5, calls: 1 }]).unwrap_err();
        assert!(format!("{error:#}").contains("nothing describes the column `calls`"));
    }
}
