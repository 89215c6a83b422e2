//! An .xlsx file as its parts say it: types and values of cells, without the library that wrote it.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use resvg::usvg::roxmltree::{Document, Node};

/// A cell with a value.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    Text(String),
    Number(f64),
    /// A number that is shown as a time, as ISO 8601.
    Time(String),
    Boolean(bool),
}

/// The parts of a workbook, by their path.
pub struct Workbook(BTreeMap<String, String>);

impl Workbook {
    pub fn open(path: &Path) -> Workbook {
        let mut archive = zip::ZipArchive::new(File::open(path).unwrap()).unwrap();
        let mut parts = BTreeMap::new();
        for place in 0..archive.len() {
            let mut part = archive.by_index(place).unwrap();
            let (name, mut text) = (part.name().unwrap().into_owned(), String::new());
            part.read_to_string(&mut text).unwrap();
            parts.insert(name, text);
        }
        Workbook(parts)
    }

    /// The sheet of that name, as XML.
    pub fn sheet(&self, name: &str) -> &str {
        let book = Document::parse(&self.0["xl/workbook.xml"]).unwrap();
        let sheets: Vec<Node<'_, '_>> = named(&book, "sheet").collect();
        let place = sheets.iter().position(|sheet| sheet.attribute("name") == Some(name));
        let place = place.unwrap_or_else(|| panic!("no sheet {name}"));
        &self.0[&format!("xl/worksheets/sheet{}.xml", place + 1)]
    }

    /// The charts, in the order of their numbers.
    pub fn charts(&self) -> Vec<String> {
        (1..).map_while(|number| self.0.get(&format!("xl/charts/chart{number}.xml")).cloned()).collect()
    }

    pub fn formulas(&self) -> usize {
        let sheets = self.0.iter().filter(|(name, _)| name.starts_with("xl/worksheets/sheet"));
        sheets.map(|(_, xml)| xml.matches("<f>").count() + xml.matches("<f ").count()).sum()
    }

    /// All cells of a sheet by row and column; `None` for empty ones.
    pub fn cells(&self, name: &str) -> Vec<Vec<Option<Cell>>> {
        let shared = Document::parse(&self.0["xl/sharedStrings.xml"]).unwrap();
        let strings: Vec<String> = named(&shared, "si").map(|item| unescaped(&text_of(item))).collect();
        let times = self.time_styles();
        let sheet = Document::parse(self.sheet(name)).unwrap();
        let mut rows = Vec::new();
        for row in named(&sheet, "row") {
            let mut cells = Vec::new();
            for cell in row.children().filter(Node::is_element) {
                cells.resize(column(cell.attribute("r").unwrap()), None);
                let Some(value) = cell.children().find(|child| child.tag_name().name() == "v") else {
                    continue;
                };
                let value = value.text().unwrap();
                let style = cell.attribute("s").and_then(|style| style.parse().ok()).unwrap_or(0);
                cells.push(Some(match cell.attribute("t").filter(|kind| *kind != "n") {
                    Some("s") => Cell::Text(strings[value.parse::<usize>().unwrap()].clone()),
                    Some("b") => Cell::Boolean(value == "1"),
                    None if times.contains(&style) => Cell::Time(time(value.parse().unwrap())),
                    None => Cell::Number(value.parse().unwrap()),
                    other => panic!("a cell of type {other:?}"),
                }));
            }
            rows.push(cells);
        }
        rows
    }

    /// The styles that show a number as a time.
    fn time_styles(&self) -> Vec<usize> {
        let styles = Document::parse(&self.0["xl/styles.xml"]).unwrap();
        let code = |format: &Node<'_, '_>| format.attribute("formatCode").unwrap().replace('\\', "");
        let is_time = |format: &Node<'_, '_>| code(format).eq_ignore_ascii_case("yyyy-mm-dd hh:mm:ss");
        let formats: Vec<&str> = named(&styles, "numFmt")
            .filter(is_time)
            .filter_map(|format| format.attribute("numFmtId"))
            .collect();
        let used = named(&styles, "cellXfs").next().unwrap().children().filter(Node::is_element);
        let of_time = used
            .enumerate()
            .filter(|(_, style)| style.attribute("numFmtId").is_some_and(|id| formats.contains(&id)));
        of_time.map(|(place, _)| place).collect()
    }
}

fn named<'a, 'input>(
    document: &'a Document<'input>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'input>> {
    document.descendants().filter(move |node| node.tag_name().name() == name)
}

fn text_of(node: Node<'_, '_>) -> String {
    node.descendants().filter(|node| node.tag_name().name() == "t").filter_map(|text| text.text()).collect()
}

/// The place of the column in a reference such as `AB7`, from 0.
fn column(reference: &str) -> usize {
    let letters = reference.bytes().take_while(u8::is_ascii_uppercase);
    letters.fold(0, |number, letter| 26 * number + usize::from(letter - b'A') + 1) - 1
}

/// Characters that XML cannot hold stand as `_xHHHH_`, and an underscore before what looks like that as `_x005F_`.
fn unescaped(text: &str) -> String {
    text.replace("_x0001_", "\u{1}").replace("_x005F_", "_")
}

/// Days since 1899-12-30 as a time.
fn time(days: f64) -> String {
    let second = (days * 86_400.0).round() as i64 - 25_569 * 86_400;
    jiff::Timestamp::from_second(second).unwrap().to_string()
}

/// The order of a series' parts in its schema, which Excel insists on.
const SERIES: [&str; 14] = [
    "idx",
    "order",
    "tx",
    "spPr",
    "invertIfNegative",
    "marker",
    "dPt",
    "dLbls",
    "trendline",
    "errBars",
    "cat",
    "val",
    "xVal",
    "yVal",
];

/// Whether the parts of each series of a chart are in order.
pub fn is_in_order(chart: &str) -> bool {
    let chart = Document::parse(chart).unwrap();
    named(&chart, "ser").all(|series| {
        let parts = series.children().map(|part| part.tag_name().name().to_string());
        parts.map(|part| SERIES.iter().position(|known| *known == part)).is_sorted()
    })
}
