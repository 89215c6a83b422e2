//! `datapackage.json`: a Frictionless Data Package, which tells programs the types, units and meaning of all columns.

use anyhow::Result;
use serde::Serialize;
use serde_json::{Value as Json, json};
use sha2::{Digest, Sha256};

use crate::experiment::run::RunInfo;
use crate::report::export::column::{Column, Kind};
use crate::report::export::csv::Dialect;
use crate::report::export::plain_name;
use crate::report::export::sheet::Sheet;

/// A table that was written as a CSV file.
pub struct Resource<'a> {
    pub sheet: &'a Sheet,
    pub file: &'a str,
    pub bytes: &'a [u8],
}

#[derive(Serialize)]
struct Package<'a> {
    profile: &'static str,
    name: String,
    title: String,
    description: String,
    created: &'a str,
    resources: Vec<Json>,
}

/// The package of a run's CSV files, which lie beside it.
pub fn bytes(info: &RunInfo, resources: &[Resource<'_>], dialect: Dialect) -> Result<Vec<u8>> {
    let package = Package {
        profile: "tabular-data-package",
        name: plain_name(&info.run_id).to_ascii_lowercase(),
        title: format!("Run {}", info.run_id),
        description: description(info, dialect),
        created: &info.created_utc,
        resources: resources.iter().map(|resource| described(resource, dialect)).collect(),
    };
    Ok(serde_json::to_vec_pretty(&package)?)
}

fn description(info: &RunInfo, dialect: Dialect) -> String {
    let start = format!("`{}` at commit {} on {}.", info.command, info.commit, info.machine_alias);
    if !dialect.spreadsheet {
        return start;
    }
    format!(
        "{start} For spreadsheets: text that they would take for a formula, a number or a date begins with an apostrophe \
         that is not part of it."
    )
}

fn described(resource: &Resource<'_>, dialect: Dialect) -> Json {
    let table = resource.sheet.table;
    let hash: String = Sha256::digest(resource.bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    let fields: Vec<Json> = table.columns.iter().map(|column| field(column, dialect)).collect();
    json!({
        "profile": "tabular-data-resource",
        "name": table.name,
        "path": resource.file,
        "title": table.title,
        "description": table.description,
        "format": "csv",
        "mediatype": "text/csv",
        "encoding": "utf-8",
        "bytes": resource.bytes.len(),
        "hash": format!("sha256:{hash}"),
        "dialect": {
            "delimiter": dialect.delimiter().to_string(),
            "lineTerminator": "\r\n",
            "quoteChar": "\"",
            "doubleQuote": true,
            "skipInitialSpace": false,
            "header": true,
        },
        "schema": { "fields": fields, "missingValues": [""] },
    })
}

fn field(column: &Column, dialect: Dialect) -> Json {
    let mut field = json!({
        "name": column.name,
        "type": column.kind.name(),
        "description": column.description,
    });
    if !column.unit.is_empty() {
        field["unit"] = json!(column.unit);
    }
    match column.kind {
        Kind::Number => field["decimalChar"] = json!(dialect.decimal().to_string()),
        Kind::Time if dialect.spreadsheet => field["format"] = json!("%Y-%m-%d %H:%M:%S"),
        _ => {}
    }
    field
}
