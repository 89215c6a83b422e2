//! The sheet that holds the numbers of the charts: a block of cells a chart.

use anyhow::Result;
use rust_xlsxwriter::{Format, Workbook, Worksheet};

use super::header_format;

/// The name of the sheet.
pub const SHEET: &str = "chart data";

/// Rows of a block before its points: its title and its header.
const HEAD: u32 = 2;

/// A value with the ends of its interval, where it has one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    pub value: f64,
    pub low: Option<f64>,
    pub high: Option<f64>,
}

/// What a curve or a colour of bars stands for, which decides its looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The part of a bar inside the conjugate gradients, and the rest.
    InsideCg,
    OutsideCg,
    /// What was measured of the whole step or of its part outside the conjugate gradients.
    Measured {
        relocated: bool,
        whole: bool,
    },
    Ideal,
    /// What the paper prints.
    Published {
        whole: bool,
    },
}

/// Values at the places of a block.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    pub name: String,
    pub role: Role,
    pub points: Vec<Option<Point>>,
}

/// Where the points of a chart stand.
#[derive(Debug, Clone, PartialEq)]
pub enum Places {
    Names(Vec<String>),
    Threads(Vec<f64>),
}

/// The numbers of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    pub title: &'static str,
    pub unit: &'static str,
    pub places: Places,
    pub curves: Vec<Curve>,
}

/// A range of cells as charts name it: sheet, first row and column, last row and column.
pub type Range = (&'static str, u32, u16, u32, u16);

/// A column of a curve: its values, and how far the interval reaches below and above them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    Value,
    Below,
    Above,
}

impl Places {
    pub fn count(&self) -> usize {
        match self {
            Places::Names(names) => names.len(),
            Places::Threads(threads) => threads.len(),
        }
    }
}

impl Block {
    /// Rows of the sheet that the block takes, and an empty one after it.
    pub fn height(&self) -> u32 {
        HEAD + self.places.count() as u32 + 1
    }

    /// The range of the places, for a block that starts at row `top`.
    pub fn places_range(&self, top: u32) -> Range {
        self.column_range(top, 0)
    }

    /// The range of one part of a curve.
    pub fn range(&self, top: u32, curve: usize, part: Part) -> Range {
        self.column_range(top, column(curve, part))
    }

    fn column_range(&self, top: u32, column: u16) -> Range {
        let first = top + HEAD;
        (SHEET, first, column, first + (self.places.count() as u32).saturating_sub(1), column)
    }
}

/// The first column holds the places, then each curve has three.
fn column(curve: usize, part: Part) -> u16 {
    1 + 3 * curve as u16 + part as u16
}

/// Adds the sheet, if there is any chart.
pub fn add(workbook: &mut Workbook, charts: &[Block]) -> Result<()> {
    if charts.is_empty() {
        return Ok(());
    }
    let worksheet = workbook.add_worksheet().set_name(SHEET)?;
    worksheet.set_column_width(0, 26)?;
    let mut top = 0;
    for block in charts {
        write(worksheet, top, block)?;
        top += block.height();
    }
    Ok(())
}

fn write(worksheet: &mut Worksheet, top: u32, block: &Block) -> Result<()> {
    let header = header_format();
    let bold = Format::new().set_bold();
    worksheet.write_string_with_format(top, 0, format!("{}, {}", block.title, block.unit), &bold)?;
    let corner = if let Places::Threads(_) = block.places { "threads" } else { "bar" };
    worksheet.write_string_with_format(top + 1, 0, corner, &header)?;
    for place in 0..block.places.count() {
        let row = top + HEAD + place as u32;
        match &block.places {
            Places::Names(names) => worksheet.write_string(row, 0, &names[place])?,
            Places::Threads(threads) => worksheet.write_number(row, 0, threads[place])?,
        };
    }
    for (number, curve) in block.curves.iter().enumerate() {
        for (part, title) in [
            (Part::Value, curve.name.clone()),
            (Part::Below, "down to".into()),
            (Part::Above, "up to".into()),
        ] {
            worksheet.write_string_with_format(top + 1, column(number, part), title, &header)?;
        }
        for (row, point) in (top + HEAD..).zip(&curve.points) {
            write_point(worksheet, row, number, *point)?;
        }
    }
    Ok(())
}

fn write_point(worksheet: &mut Worksheet, row: u32, curve: usize, point: Option<Point>) -> Result<()> {
    let Some(Point { value, low, high }) = point else {
        return Ok(());
    };
    worksheet.write_number(row, column(curve, Part::Value), value)?;
    for (part, distance) in [(Part::Below, low.map(|l| value - l)), (Part::Above, high.map(|h| h - value))] {
        if let Some(distance) = distance {
            worksheet.write_number(row, column(curve, part), distance)?;
        }
    }
    Ok(())
}
