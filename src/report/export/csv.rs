//! CSV: RFC 4180 in UTF-8, for programs as the data is, for spreadsheets so that they misread nothing.

use std::borrow::Cow;

use anyhow::Result;

use crate::report::export::neutral::neutral;
use crate::report::export::sheet::Sheet;
use crate::report::export::value::Value;

/// By which Excel tells UTF-8 from the system's old character set.
const BYTE_ORDER_MARK: &[u8] = "\u{FEFF}".as_bytes();

/// What separates cells and decimals, and who reads the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dialect {
    /// Whether a spreadsheet opens the file: it then begins with a byte-order mark, has times as spreadsheets read them,
    /// and no text that they would take for anything else.
    pub spreadsheet: bool,
    /// Decimal commas between semicolons, as in much of Europe; points between commas otherwise.
    pub decimal_comma: bool,
}

impl Dialect {
    pub fn delimiter(self) -> char {
        if self.decimal_comma { ';' } else { ',' }
    }

    pub fn decimal(self) -> char {
        if self.decimal_comma { ',' } else { '.' }
    }

    /// A cell as it stands in the file, before quotes.
    fn text(self, value: &Value) -> Cow<'_, str> {
        match value {
            Value::Missing => Cow::Borrowed(""),
            Value::Text(text) if self.spreadsheet => neutral(text),
            Value::Text(text) => Cow::Borrowed(text),
            Value::Integer(number) => Cow::Owned(number.to_string()),
            // The shortest digits that give back the same bits.
            Value::Number(number) if self.decimal_comma => {
                Cow::Owned(format!("{number:?}").replace('.', ","))
            }
            Value::Number(number) => Cow::Owned(format!("{number:?}")),
            Value::Boolean(answer) => Cow::Borrowed(if *answer { "true" } else { "false" }),
            Value::Time(time) if self.spreadsheet => {
                Cow::Owned(time.strftime("%Y-%m-%d %H:%M:%S%.f").to_string())
            }
            Value::Time(time) => Cow::Owned(time.to_string()),
        }
    }
}

/// A table as a CSV file.
pub fn bytes(sheet: &Sheet, dialect: Dialect) -> Result<Vec<u8>> {
    let start = if dialect.spreadsheet { BYTE_ORDER_MARK.to_vec() } else { Vec::new() };
    let mut writer = csv::WriterBuilder::new()
        .delimiter(dialect.delimiter() as u8)
        .terminator(csv::Terminator::CRLF)
        .from_writer(start);
    writer.write_record(sheet.table.columns.iter().map(|column| column.name))?;
    for row in &sheet.rows {
        writer.write_record(row.iter().map(|value| dialect.text(value).into_owned()))?;
    }
    Ok(writer.into_inner()?)
}

#[cfg(test)]
mod tests {
    use jiff::Timestamp;

    use super::*;
    use crate::report::export::column::{Column, Kind, Table};

    static TABLE: Table = Table {
        name: "all",
        title: "All",
        description: "A row a kind.",
        columns: &[
            Column { name: "name", kind: Kind::Text, unit: "", description: "Name." },
            Column { name: "value", kind: Kind::Any, unit: "", description: "Value." },
        ],
    };

    fn written(spreadsheet: bool, decimal_comma: bool) -> String {
        let values = [
            ("=1+1", Value::Number(1e-8)),
            ("say \"あ\",\nb;c", Value::Number(0.1)),
            ("", Value::Integer(-7)),
            ("12345e67", Value::Boolean(true)),
            ("時間", Value::Time(Timestamp::from_second(1_795_398_918).unwrap())),
            ("none", Value::Missing),
        ];
        let rows = values.into_iter().map(|(name, value)| vec![Value::text(name), value]).collect();
        let sheet = Sheet { table: &TABLE, rows };
        String::from_utf8(bytes(&sheet, Dialect { spreadsheet, decimal_comma }).unwrap()).unwrap()
    }

    #[test]
    fn for_programs_every_cell_is_what_it_is() {
        let expected = "name,value\r\n=1+1,1e-8\r\n\"say \"\"あ\"\",\nb;c\",0.1\r\n,-7\r\n12345e67,true\r\n\
                        時間,2026-11-23T01:55:18Z\r\nnone,\r\n";
        assert_eq!(written(false, false), expected);
    }

    #[test]
    fn for_spreadsheets_text_stays_text_and_times_are_read() {
        let expected = "\u{FEFF}name,value\r\n'=1+1,1e-8\r\n\"say \"\"あ\"\",\nb;c\",0.1\r\n,-7\r\n'12345e67,true\r\n\
                        時間,2026-11-23 01:55:18\r\nnone,\r\n";
        assert_eq!(written(true, false), expected);
    }

    #[test]
    fn decimal_commas_stand_between_semicolons() {
        let expected = "name;value\r\n=1+1;1e-8\r\n\"say \"\"あ\"\",\nb;c\";0,1\r\n;-7\r\n12345e67;true\r\n\
                        時間;2026-11-23T01:55:18Z\r\nnone;\r\n";
        assert_eq!(written(false, true), expected);
    }
}
