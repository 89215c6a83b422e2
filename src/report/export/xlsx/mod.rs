//! The run as a workbook: a sheet a table with typed cells, charts of Table 2 and Figure 4 with their numbers.

mod block;
mod charts;
mod ordered;
mod plotted;
mod tables;

use anyhow::Result;
use jiff::Timestamp;
use rust_xlsxwriter::{DocProperties, ExcelDateTime, Format, Workbook};

use crate::experiment::run::RunInfo;
use crate::report::export::dictionary;
use crate::report::export::sheet::Sheet;

/// Rows of a sheet in Excel and LibreOffice, the header's included.
const MOST_ROWS: usize = 1_048_576;

/// The workbook. It depends on nothing but the run: written again, it is the same to the last byte.
pub fn bytes(info: &RunInfo, sheets: &[Sheet]) -> Result<Vec<u8>> {
    let mut workbook = Workbook::new();
    workbook.set_properties(&properties(info));
    let (claims, others): (Vec<&Sheet>, Vec<&Sheet>) =
        sheets.iter().partition(|sheet| sheet.table.name == dictionary::CLAIMS.name);
    for sheet in claims {
        tables::add(&mut workbook, sheet, MOST_ROWS)?;
    }
    let charts = plotted::charts(sheets);
    charts::add(&mut workbook, &charts)?;
    for sheet in others {
        tables::add(&mut workbook, sheet, MOST_ROWS)?;
    }
    block::add(&mut workbook, &charts)?;
    ordered::with_ordered_charts(&workbook.save_to_buffer()?)
}

/// The workbook's time is the run's, so that it does not depend on when it was exported.
fn properties(info: &RunInfo) -> DocProperties {
    let created = info.created_utc.parse().ok().and_then(excel_time);
    let properties = DocProperties::new().set_title("Run of repro").set_comment(
        "Cells hold what was recorded; the sheet `dictionary` says what each column means. Times are UTC.",
    );
    match created {
        Some(created) => properties.set_creation_datetime(&created),
        None => properties.set_creation_datetime(&ExcelDateTime::default()),
    }
}

/// A time as a spreadsheet counts it, in whole seconds; `None` outside the years that it knows.
fn excel_time(time: Timestamp) -> Option<ExcelDateTime> {
    ExcelDateTime::from_timestamp(time.as_second()).ok()
}

/// What header cells look like.
fn header_format() -> Format {
    Format::new()
        .set_bold()
        .set_background_color(0xE8_EE_F4)
        .set_border_bottom(rust_xlsxwriter::FormatBorder::Thin)
}
