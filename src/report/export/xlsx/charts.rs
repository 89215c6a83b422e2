//! The workbook's charts, drawn by the spreadsheet itself from the cells of the sheet beside them.

use anyhow::Result;
use rust_xlsxwriter::{
    Chart, ChartAxis, ChartAxisCrossing, ChartAxisLabelPosition, ChartDataLabel, ChartDataLabelPosition,
    ChartErrorBars, ChartErrorBarsType, ChartFont, ChartFormat, ChartLegendPosition, ChartLine,
    ChartLineDashType, ChartMarker, ChartMarkerType, ChartRange, ChartSeries, ChartSolidFill, ChartType,
    Workbook,
};

use super::block::{Block, Curve, Part, Places, Range, Role};

/// Size of a chart, and the rows of the sheet that it covers with a margin.
const WIDTH: u32 = 900;
const HEIGHT: u32 = 440;
const ROWS: u32 = 24;

/// Colours of Okabe and Ito, as in all figures: the linked list blue, relocation vermilion.
const LINKED_LIST: u32 = 0x00_72_B2;
const RELOCATED: u32 = 0xD5_5E_00;
const PAPER: u32 = 0x00_00_00;
const INSIDE_CG: u32 = 0xE6_9F_00;
const OUTSIDE_CG: u32 = 0x56_B4_E9;
const IDEAL: u32 = 0x7A_7A_7A;
const INTERVAL: u32 = 0x22_22_22;
const GRID: u32 = 0xE0_E0_E0;

/// Adds the sheet of charts, if there are any.
pub fn add(workbook: &mut Workbook, blocks: &[Block]) -> Result<()> {
    if blocks.is_empty() {
        return Ok(());
    }
    let worksheet = workbook.add_worksheet().set_name("charts")?;
    worksheet.set_screen_gridlines(false);
    worksheet.set_print_fit_to_pages(1, 0);
    let mut top = 0;
    for (row, block) in (1u32..).step_by(ROWS as usize).zip(blocks) {
        let mut chart = match block.places {
            Places::Names(_) => bars(block, top),
            Places::Threads(_) => lines(block, top),
        };
        chart.set_width(WIDTH).set_height(HEIGHT);
        worksheet.insert_chart(row, 1, &chart)?;
        top += block.height();
    }
    Ok(())
}

/// Stacked bars, with the interval of the whole on the upper part.
fn bars(block: &Block, top: u32) -> Chart {
    let mut chart = Chart::new(ChartType::ColumnStacked);
    dress(
        &mut chart,
        block,
        "Stacked bars of the seconds inside and outside CG: the paper's, and this run's.",
    );
    for (number, curve) in block.curves.iter().enumerate() {
        let color = Look::of(curve.role).color;
        let mut label = ChartDataLabel::new();
        label.show_value().set_num_format("0.0").set_position(ChartDataLabelPosition::Center);
        let series = chart.add_series();
        name_and_values(series, block, top, number);
        series
            .set_format(ChartFormat::new().set_solid_fill(ChartSolidFill::new().set_color(color)))
            .set_data_label(&label)
            .set_gap(60);
        if let Some(intervals) = intervals(block, curve, top, number) {
            series.set_y_error_bars(&intervals);
        }
    }
    chart.x_axis().set_font(ChartFont::new().set_size(9));
    chart.y_axis().set_name("time of the run (s)").set_min(0).set_num_format("0");
    pale_grid(chart.y_axis());
    chart
}

/// Points against threads on logarithmic axes, joined where they were measured.
fn lines(block: &Block, top: u32) -> Chart {
    let mut chart = Chart::new(ChartType::ScatterStraightWithMarkers);
    dress(
        &mut chart,
        block,
        "Against the number of threads on logarithmic axes, with the smallest and largest round, and ideal scaling.",
    );
    for (number, curve) in block.curves.iter().enumerate() {
        if curve.points.iter().all(Option::is_none) {
            continue;
        }
        let look = Look::of(curve.role);
        let series = chart.add_series();
        name_and_values(series, block, top, number);
        series.set_format(&mut look.line()).set_marker(&look.marker());
        if let Some(intervals) = intervals(block, curve, top, number) {
            series.set_y_error_bars(&intervals);
        }
    }
    let threads = if let Places::Threads(threads) = &block.places { threads.as_slice() } else { &[] };
    let values =
        || block.curves.iter().flat_map(|curve| curve.points.iter().flatten()).map(|point| point.value);
    logarithmic(chart.x_axis(), "threads", threads.iter().copied());
    logarithmic(chart.y_axis(), if block.unit == "1" { "speed-up" } else { "time of a step (ms)" }, values());
    chart
}

fn dress(chart: &mut Chart, block: &Block, description: &str) {
    chart.title().set_name(block.title).set_font(ChartFont::new().set_size(13).set_bold());
    chart.set_alt_text(format!("{}. {description}", block.title));
    chart.legend().set_position(ChartLegendPosition::Right);
}

fn name_and_values(series: &mut ChartSeries, block: &Block, top: u32, number: usize) {
    let (sheet, first, column, ..) = block.range(top, number, Part::Value);
    series
        .set_name((sheet, first - 1, column))
        .set_categories(block.places_range(top))
        .set_values(block.range(top, number, Part::Value));
}

/// The intervals of a curve, where any of its points has one.
fn intervals(block: &Block, curve: &Curve, top: u32, number: usize) -> Option<ChartErrorBars> {
    let any = curve.points.iter().flatten().any(|point| point.low.is_some() && point.high.is_some());
    let cells = |(sheet, row, column, last_row, last_column): Range| {
        ChartRange::new_from_range(sheet, row, column, last_row, last_column)
    };
    let (above, below) = (block.range(top, number, Part::Above), block.range(top, number, Part::Below));
    let kind = ChartErrorBarsType::Custom(cells(above), cells(below));
    any.then(|| {
        let mut bars = ChartErrorBars::new();
        bars.set_type(kind).set_format(ChartLine::new().set_color(INTERVAL).set_width(1));
        bars
    })
}

/// An axis whose ends are powers of two around all values; LibreOffice does not draw a point on the upper end.
fn logarithmic(axis: &mut ChartAxis, name: &str, values: impl Iterator<Item = f64> + Clone) {
    let least = values.clone().fold(f64::INFINITY, f64::min);
    let most = values.fold(0.0, f64::max);
    let (least, most) = (least.log2().floor(), most.log2().floor() + 1.0);
    if least.is_finite() && most.is_finite() {
        axis.set_min(least.exp2()).set_max(most.exp2());
    }
    axis.set_name(name)
        .set_log_base(2)
        .set_major_unit(2)
        .set_num_format("General")
        .set_crossing(ChartAxisCrossing::Min)
        .set_label_position(ChartAxisLabelPosition::Low);
    pale_grid(axis);
}

fn pale_grid(axis: &mut ChartAxis) {
    axis.set_major_gridlines(true).set_major_gridlines_line(ChartLine::new().set_color(GRID).set_width(0.75));
}

/// How a curve is drawn.
struct Look {
    color: u32,
    /// `None` for points alone.
    dash: Option<ChartLineDashType>,
    /// `None` for a line alone.
    marker: Option<ChartMarkerType>,
}

impl Look {
    /// Markers differ in shape, not in being filled: LibreOffice draws no border around them.
    fn of(role: Role) -> Look {
        let points = |color, shape| Look { color, dash: None, marker: Some(shape) };
        let curve = |color, shape| Look { dash: Some(ChartLineDashType::Solid), ..points(color, shape) };
        match role {
            Role::InsideCg => points(INSIDE_CG, ChartMarkerType::Square),
            Role::OutsideCg => points(OUTSIDE_CG, ChartMarkerType::Square),
            Role::Ideal => Look { color: IDEAL, dash: Some(ChartLineDashType::Dash), marker: None },
            Role::Published { whole: true } => points(PAPER, ChartMarkerType::Diamond),
            Role::Published { whole: false } => points(PAPER, ChartMarkerType::X),
            Role::Measured { relocated: false, whole: true } => curve(LINKED_LIST, ChartMarkerType::Circle),
            Role::Measured { relocated: false, whole: false } => {
                curve(LINKED_LIST, ChartMarkerType::Triangle)
            }
            Role::Measured { relocated: true, whole: true } => curve(RELOCATED, ChartMarkerType::Square),
            Role::Measured { relocated: true, whole: false } => curve(RELOCATED, ChartMarkerType::Diamond),
        }
    }

    fn line(&self) -> ChartFormat {
        let mut format = ChartFormat::new();
        match self.dash {
            Some(dash) => {
                format.set_line(ChartLine::new().set_color(self.color).set_width(1.75).set_dash_type(dash))
            }
            None => format.set_no_line(),
        };
        format
    }

    fn marker(&self) -> ChartMarker {
        let mut marker = ChartMarker::new();
        let Some(shape) = self.marker else {
            marker.set_none();
            return marker;
        };
        let mut format = ChartFormat::new();
        format
            .set_solid_fill(ChartSolidFill::new().set_color(self.color))
            .set_border(ChartLine::new().set_color(self.color));
        marker.set_type(shape).set_size(8).set_format(&mut format);
        marker
    }
}
