//! A run for other programs: spreadsheets, statistics, notebooks.
//!
//! Every format holds the same tables, which [`dictionary`] describes, made of the same rows as the run folder's own files.

pub mod column;
pub mod contents;
pub mod csv;
pub mod datapackage;
pub mod dictionary;
pub mod figure4;
pub mod json;
pub mod neutral;
pub mod sheet;
pub mod value;
pub mod xlsx;

use anyhow::Result;

use crate::experiment::run::RunInfo;
use crate::report::export::csv::Dialect;
use crate::report::export::datapackage::Resource;
use crate::report::export::sheet::Sheet;

/// The longest name of a file that is made of a run's.
const LONGEST_NAME: usize = 80;

/// One way to write a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// A folder of CSV files that say exactly what was recorded.
    Csv,
    /// A folder of CSV files that a spreadsheet opens without misreading them.
    ExcelCsv,
    /// One workbook.
    Xlsx,
    /// One document.
    Json,
}

/// A file below the folder that an export is written to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportedFile {
    /// The folder of a format that has many files.
    pub folder: Option<&'static str>,
    pub name: String,
    pub bytes: Vec<u8>,
}

impl Format {
    /// The files of a run in this format; one, unless it is a kind of CSV.
    pub fn files(self, info: &RunInfo, sheets: &[Sheet], decimal_comma: bool) -> Result<Vec<ExportedFile>> {
        let one = |extension: &str, bytes: Vec<u8>| {
            let name = format!("{}.{extension}", plain_name(&info.run_id));
            vec![ExportedFile { folder: None, name, bytes }]
        };
        Ok(match self {
            Format::Csv => csv_files("csv", info, sheets, Dialect { spreadsheet: false, decimal_comma })?,
            Format::ExcelCsv => {
                csv_files("excel-csv", info, sheets, Dialect { spreadsheet: true, decimal_comma })?
            }
            Format::Xlsx => one("xlsx", xlsx::bytes(info, sheets)?),
            Format::Json => one("json", json::bytes(sheets)?),
        })
    }

    /// The ending of the name of its only file, where it has one.
    pub fn extension(self) -> Option<&'static str> {
        match self {
            Format::Csv | Format::ExcelCsv => None,
            Format::Xlsx => Some("xlsx"),
            Format::Json => Some("json"),
        }
    }
}

/// A file a table, and what describes them.
fn csv_files(
    folder: &'static str,
    info: &RunInfo,
    sheets: &[Sheet],
    dialect: Dialect,
) -> Result<Vec<ExportedFile>> {
    let file = |name: String, bytes: Vec<u8>| ExportedFile { folder: Some(folder), name, bytes };
    let mut files = Vec::with_capacity(sheets.len() + 1);
    for sheet in sheets {
        files.push(file(format!("{}.csv", sheet.table.name), csv::bytes(sheet, dialect)?));
    }
    let resources: Vec<Resource<'_>> = sheets
        .iter()
        .zip(&files)
        .map(|(sheet, file)| Resource { sheet, file: &file.name, bytes: &file.bytes })
        .collect();
    let package = datapackage::bytes(info, &resources, dialect)?;
    files.push(file("datapackage.json".to_string(), package));
    Ok(files)
}

/// The name of a run as part of a file's name: a run folder may come from anywhere and call itself anything.
pub fn plain_name(run_id: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '-' };
    let name: String = run_id.chars().map(plain).take(LONGEST_NAME).collect();
    let name = name.trim_start_matches(['.', '-']);
    if name.is_empty() { "run".to_string() } else { name.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_runs_name_leads_nowhere() {
        assert_eq!(plain_name("20261123T015518Z-amd-epyc-2c"), "20261123T015518Z-amd-epyc-2c");
        assert_eq!(plain_name("../../etc/passwd"), "etc-passwd");
        assert_eq!(plain_name("a\\b:c\nd"), "a-b-c-d");
        assert_eq!(plain_name("測定"), "run");
        assert_eq!(plain_name(""), "run");
        assert_eq!(plain_name(&"x".repeat(500)).len(), LONGEST_NAME);
    }
}
