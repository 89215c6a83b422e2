//! Charts as their schema wants them: the library writes the marker of a scatter series before the line's format, where
//! Excel, which insists on the order, takes the chart for damaged.

use std::io::{Cursor, Read, Write};

use anyhow::{Context, Result};
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

/// The workbook with the parts of its charts in order; all other parts are copied as they are.
pub fn with_ordered_charts(workbook: &[u8]) -> Result<Vec<u8>> {
    let mut archive = ZipArchive::new(Cursor::new(workbook)).context("the workbook is no archive")?;
    let mut ordered = ZipWriter::new(Cursor::new(Vec::with_capacity(workbook.len())));
    for place in 0..archive.len() {
        let mut part = archive.by_index(place)?;
        let name = part.name()?.into_owned();
        if !name.starts_with("xl/charts/chart") {
            ordered.raw_copy_file(part)?;
            continue;
        }
        let mut chart = String::new();
        part.read_to_string(&mut chart)?;
        ordered.start_file(name, SimpleFileOptions::default())?;
        ordered.write_all(format_before_marker(&chart).as_bytes())?;
    }
    Ok(ordered.finish()?.into_inner())
}

/// The chart with the format of each series before its marker.
fn format_before_marker(chart: &str) -> String {
    let (marker, format, format_end) = ("<c:marker>", "</c:marker><c:spPr>", "</c:spPr>");
    let mut ordered = String::with_capacity(chart.len());
    let mut rest = chart;
    while let Some(border) = rest.find(format) {
        let start = rest[..border].rfind(marker).unwrap_or(border);
        let middle = border + "</c:marker>".len();
        let end = rest[middle..].find(format_end).map_or(middle, |length| middle + length + format_end.len());
        ordered.push_str(&rest[..start]);
        ordered.push_str(&rest[middle..end]);
        ordered.push_str(&rest[start..middle]);
        rest = &rest[end..];
    }
    ordered + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_format_of_a_series_comes_first() {
        let marker = "<c:marker><c:size val=\"8\"/><c:spPr>fill</c:spPr></c:marker>";
        let series = |parts: &str| format!("<c:ser>{parts}<c:xVal/></c:ser>");
        let wrong = series(&format!("<c:tx/>{marker}<c:spPr>line</c:spPr>"));
        let right = series(&format!("<c:tx/><c:spPr>line</c:spPr>{marker}"));
        assert_eq!(format_before_marker(&(wrong.clone() + &wrong)), right.clone() + &right);
        assert_eq!(format_before_marker(&right), right);
        assert_eq!(format_before_marker(&series(marker)), series(marker));
    }
}
