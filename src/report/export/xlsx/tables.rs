//! Sheets of tables: typed cells, a header that stays in view, filters, and a note on every column.

use anyhow::{Context, Result};
use rust_xlsxwriter::{Format, FormatAlign, IgnoreError, Note, Workbook, Worksheet};

use super::{excel_time, header_format};
use crate::report::export::column::{Column, Kind};
use crate::report::export::sheet::Sheet;
use crate::report::export::value::Value;

/// UTF-16 units that a cell can hold.
const LONGEST_TEXT: usize = 32_767;

/// Whole numbers up to here are exact in a cell, which holds a double.
const LARGEST_EXACT: u64 = 1 << 53;

/// Widths of columns in characters, and how many rows they are made for.
const WIDTHS: (usize, usize) = (8, 60);
const MEASURED_ROWS: usize = 200;

/// Adds a table; one with more rows than a sheet has goes on in further sheets.
pub fn add(workbook: &mut Workbook, sheet: &Sheet, most_rows: usize) -> Result<()> {
    let mut parts: Vec<&[Vec<Value>]> = sheet.rows.chunks(most_rows - 1).collect();
    if parts.is_empty() {
        parts.push(&[]);
    }
    for (part, rows) in parts.into_iter().enumerate() {
        let name = match part {
            0 => sheet.table.name.to_string(),
            part => format!("{} ({})", sheet.table.name, part + 1),
        };
        let worksheet = workbook.add_worksheet().set_name(&name)?;
        fill(worksheet, sheet, rows).with_context(|| format!("cannot write the sheet {name}"))?;
    }
    Ok(())
}

fn fill(worksheet: &mut Worksheet, sheet: &Sheet, rows: &[Vec<Value>]) -> Result<()> {
    let columns = sheet.table.columns;
    for (place, column) in (0u16..).zip(columns) {
        worksheet.write_string_with_format(0, place, column.name, &header(column))?;
        worksheet.insert_note(0, place, &note(column))?;
        worksheet.set_column_width(place, width(column, rows, usize::from(place)) as f64)?;
    }
    let formats: Vec<Formats> = columns.iter().map(Formats::new).collect();
    for (line, row) in (1u32..).zip(rows) {
        for ((place, value), formats) in (0u16..).zip(row).zip(&formats) {
            write(worksheet, line, place, value, formats)?;
        }
    }
    let (last_row, last_column) = (u32::try_from(rows.len())?, u16::try_from(columns.len())? - 1);
    worksheet.autofilter(0, 0, last_row, last_column)?;
    worksheet.set_freeze_panes(1, 0)?;
    worksheet.ignore_error_range(0, 0, last_row, last_column, IgnoreError::NumberStoredAsText)?;
    worksheet.set_landscape().set_print_fit_to_pages(1, 0).set_repeat_rows(0, 0)?;
    Ok(())
}

/// The header of a column, above its cells: numbers are at the right of theirs.
fn header(column: &Column) -> Format {
    match column.kind {
        Kind::Integer | Kind::Number => header_format().set_align(FormatAlign::Right),
        _ => header_format().set_indent(1),
    }
}

/// How the cells of a column are shown, by what they are.
struct Formats {
    text: Format,
    integer: Format,
    number: Format,
    time: Format,
}

impl Formats {
    fn new(column: &Column) -> Formats {
        let format = |pattern: &str| Format::new().set_num_format(pattern);
        Formats {
            // Text that is edited stays text, too.
            text: format("@").set_indent(1),
            integer: format("0"),
            number: format(number_pattern(column)),
            time: format("yyyy-mm-dd hh:mm:ss").set_align(FormatAlign::Left).set_indent(1),
        }
    }
}

/// Digits that are worth showing; the cell holds all of them.
fn number_pattern(column: &Column) -> &'static str {
    match column.unit {
        "s" => "0.000000",
        "ms/step" | "1" => "0.000",
        "bytes" | "%" | "MHz" => "0.0",
        "relative" => "0.00E+00",
        _ => "General",
    }
}

fn write(worksheet: &mut Worksheet, row: u32, column: u16, value: &Value, formats: &Formats) -> Result<()> {
    let text = |worksheet: &mut Worksheet, text: &str| -> Result<()> {
        worksheet.write_string_with_format(row, column, fitting(text), &formats.text)?;
        Ok(())
    };
    match value {
        Value::Missing => {}
        Value::Text(found) => text(worksheet, found)?,
        Value::Integer(number) if number.unsigned_abs() > LARGEST_EXACT => {
            text(worksheet, &number.to_string())?
        }
        Value::Integer(number) => {
            worksheet.write_number_with_format(row, column, *number as f64, &formats.integer)?;
        }
        Value::Number(number) => {
            worksheet.write_number_with_format(row, column, *number, &formats.number)?;
        }
        Value::Boolean(answer) => {
            worksheet.write_boolean(row, column, *answer)?;
        }
        Value::Time(time) => match excel_time(*time) {
            Some(excel) => {
                worksheet.write_datetime_with_format(row, column, &excel, &formats.time)?;
            }
            None => text(worksheet, &time.to_string())?,
        },
    }
    Ok(())
}

/// The text, cut where a cell ends.
fn fitting(text: &str) -> String {
    let mut units = 0;
    let over = text.char_indices().find(|(_, letter)| {
        units += letter.len_utf16();
        units >= LONGEST_TEXT
    });
    match over {
        Some((end, letter)) if end + letter.len_utf8() < text.len() => format!("{}…", &text[..end]),
        _ => text.to_string(),
    }
}

fn note(column: &Column) -> Note {
    let unit = match (column.unit, column.kind) {
        ("", Kind::Time) => "UTC".to_string(),
        ("", _) => column.kind.name().to_string(),
        (unit, _) => format!("{}, {unit}", column.kind.name()),
    };
    let text = format!("{} ({unit})", column.description);
    let lines = text.len().div_ceil(36) + 1;
    Note::new(text).add_author_prefix(false).set_width(230).set_height(15 * lines as u32)
}

/// Wide enough for the header with its filter and for most cells.
fn width(column: &Column, rows: &[Vec<Value>], place: usize) -> usize {
    let cells = rows.iter().take(MEASURED_ROWS).filter_map(|row| row.get(place));
    let widest = cells.map(|value| shown(value, column)).max().unwrap_or(0);
    (widest + 2).max(column.name.len() + 4).clamp(WIDTHS.0, WIDTHS.1)
}

/// The characters that a cell takes; letters beyond Latin and Greek count double.
fn shown(value: &Value, column: &Column) -> usize {
    match value {
        Value::Missing => 0,
        Value::Text(text) => text.chars().take(WIDTHS.1).map(|c| if c < '\u{1100}' { 1 } else { 2 }).sum(),
        Value::Integer(number) => number.to_string().len(),
        Value::Number(_) if number_pattern(column) == "General" => 12,
        Value::Number(number) => format!("{number:.6}").len().min(14),
        Value::Boolean(_) => 5,
        Value::Time(_) => 19,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::export::dictionary;

    #[test]
    fn a_table_with_more_rows_than_a_sheet_goes_on_in_the_next() {
        let facts = (0..5)
            .map(|number| [Value::Missing, Value::Missing, Value::Integer(number), Value::Missing].to_vec());
        let sheet = Sheet { table: &dictionary::MACHINE, rows: facts.collect() };
        let mut workbook = Workbook::new();
        add(&mut workbook, &sheet, 3).unwrap();
        let names: Vec<String> = workbook.worksheets().iter().map(Worksheet::name).collect();
        assert_eq!(names, ["machine", "machine (2)", "machine (3)"], "two rows below each header");
    }

    #[test]
    fn text_is_cut_where_a_cell_ends_and_says_so() {
        let long = "あ".repeat(LONGEST_TEXT);
        assert_eq!(fitting(&long), long);
        let cut = fitting(&(long + "い"));
        assert!(cut.ends_with("あ…"));
        assert_eq!(cut.encode_utf16().count(), LONGEST_TEXT);
        let pairs = fitting(&"😀".repeat(LONGEST_TEXT));
        assert!(pairs.ends_with('…') && pairs.encode_utf16().count() <= LONGEST_TEXT);
    }
}
