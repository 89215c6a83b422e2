//! A run written for other programs: every format says the same, and nothing in a run folder becomes a formula.
#![cfg(feature = "driver")]

#[path = "export/fixture.rs"]
mod fixture;
#[path = "export/libreoffice.rs"]
mod libreoffice;
#[path = "export/workbook.rs"]
mod workbook;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use fixture::{ALIAS, COMMIT, REASON, TITLE, Table, export, hostile_run, read_csv, repro};
use serde_json::Value;
use workbook::{Cell, Workbook};

/// The tables of an export, in their order.
const TABLES: [&str; 16] = [
    "claims",
    "table2",
    "figure4",
    "summary",
    "samples",
    "steps",
    "observations",
    "fronts",
    "twin",
    "validation",
    "peaks",
    "effort",
    "experiments",
    "machine",
    "run",
    "dictionary",
];

/// The plain CSV of a run: what all other formats are held to.
fn plain(run: &Path, out: &Path) -> BTreeMap<&'static str, Table> {
    let (code, _, complaint) = export(run, &["--csv", "--output", out.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{complaint}");
    TABLES.map(|name| (name, read_csv(&out.join("csv").join(format!("{name}.csv")), b','))).into()
}

fn same_number(a: &str, b: &str) -> bool {
    matches!((a.parse::<f64>(), b.parse::<f64>()), (Ok(a), Ok(b)) if a == b)
}

#[test]
fn plain_csv_holds_exactly_the_rows_of_the_run_folder() {
    let place = tempfile::tempdir().unwrap();
    for id in ["table2", "figure4"] {
        let run = hostile_run(&place.path().join(id), id);
        assert!(repro(&["report", run.to_str().unwrap()]).status.success());
        let tables = plain(&run, &place.path().join("out"));
        let files = ["claims", "summary", "samples", "steps", "observations", "fronts"]
            .map(|name| (name, String::new()));
        let table2 = (id == "table2").then(|| ("table2", "tables/".to_string()));
        for (name, below) in files.into_iter().chain(table2) {
            let own = read_csv(&run.join(format!("{below}{name}.csv")), b',');
            assert_eq!(own.header, tables[name].header, "{name}");
            assert_eq!(own.rows.len(), tables[name].rows.len(), "{name}");
            for (own, exported) in own.rows.iter().flatten().zip(tables[name].rows.iter().flatten()) {
                assert!(own == exported || same_number(own, exported), "{name}: {own} became {exported}");
            }
        }
        let figure4 = &tables["figure4"];
        assert_eq!(
            figure4.rows.len() > 1,
            id == "figure4",
            "a row a preset and thread count, and the paper's"
        );
        if id == "figure4" {
            assert_eq!(figure4.cell(1, "total_speed_up"), "1.0", "over itself");
        }
    }
}

#[test]
fn what_a_run_folder_says_comes_through_exactly() {
    let place = tempfile::tempdir().unwrap();
    let run = hostile_run(place.path(), "table2");
    let tables = plain(&run, &place.path().join("out"));
    assert_eq!(tables["experiments"].cell(0, "title"), TITLE);
    let reasons = tables["samples"].column("reason");
    assert!(reasons.contains(&REASON), "{reasons:?}");
    let run_table = &tables["run"];
    let of = |key: &str| {
        let row = run_table.column("key").iter().position(|k| *k == key).unwrap();
        run_table.cell(row, "value")
    };
    assert_eq!((of("commit"), of("machine_alias")), (COMMIT, ALIAS));
    assert!(of("created_utc").ends_with('Z'), "ISO 8601");
}

#[test]
fn csv_is_rfc_4180_and_described_column_by_column() {
    let place = tempfile::tempdir().unwrap();
    let run = hostile_run(place.path(), "table2");
    for (flags, delimiter, decimal) in [(&["--csv"][..], ",", "."), (&["--csv", "--decimal-comma"], ";", ",")]
    {
        let out = place.path().join(delimiter.escape_unicode().to_string());
        let (code, printed, _) = export(&run, &[flags, &["--output", out.to_str().unwrap()]].concat());
        assert_eq!((code, printed.lines().count()), (Some(0), TABLES.len() + 1), "{printed}");
        let text = fs::read_to_string(out.join("csv/samples.csv")).unwrap();
        assert!(text.ends_with("\r\n") && !text.starts_with('\u{FEFF}'));
        let package: Value =
            serde_json::from_slice(&fs::read(out.join("csv/datapackage.json")).unwrap()).unwrap();
        let resources = package["resources"].as_array().unwrap();
        assert_eq!(resources.iter().map(|r| r["name"].as_str().unwrap()).collect::<Vec<_>>(), TABLES);
        for resource in resources {
            assert_eq!(resource["dialect"]["delimiter"], delimiter);
            let file = out.join("csv").join(resource["path"].as_str().unwrap());
            assert_eq!(resource["bytes"].as_u64(), Some(fs::metadata(&file).unwrap().len()));
            let table = read_csv(&file, delimiter.as_bytes()[0]);
            let fields = resource["schema"]["fields"].as_array().unwrap();
            let names: Vec<&str> = fields.iter().map(|field| field["name"].as_str().unwrap()).collect();
            assert_eq!(table.header, names);
            for (place, field) in fields.iter().enumerate() {
                assert!(field["description"].as_str().unwrap().ends_with('.'), "{field}");
                let cells = table.rows.iter().map(|row| row[place].as_str()).filter(|cell| !cell.is_empty());
                for cell in cells {
                    assert!(is_a(cell, field["type"].as_str().unwrap(), decimal), "{field}: {cell}");
                }
            }
        }
    }
}

/// Whether a cell is of a type of Table Schema.
fn is_a(cell: &str, kind: &str, decimal: &str) -> bool {
    match kind {
        "integer" => cell.parse::<i64>().is_ok(),
        "number" => {
            (decimal == "." || !cell.contains('.'))
                && cell.replace(decimal, ".").parse::<f64>().is_ok_and(f64::is_finite)
        }
        "boolean" => matches!(cell, "true" | "false"),
        "datetime" => cell.len() == 20 && cell.ends_with('Z'),
        "string" | "any" => true,
        _ => false,
    }
}

#[test]
fn spreadsheet_csv_has_no_formula_and_loses_nothing() {
    let place = tempfile::tempdir().unwrap();
    let run = hostile_run(place.path(), "table2");
    let out = place.path().join("out");
    let plain = plain(&run, &out);
    for (flags, delimiter) in [(&["--excel-csv"][..], b','), (&["--excel-csv", "--decimal-comma"], b';')] {
        let (code, _, complaint) = export(&run, &[flags, &["--output", out.to_str().unwrap()]].concat());
        assert_eq!(code, Some(0), "{complaint}");
        for (name, expected) in &plain {
            let path = out.join("excel-csv").join(format!("{name}.csv"));
            assert!(fs::read(&path).unwrap().starts_with("\u{FEFF}".as_bytes()), "{name}: byte-order mark");
            let table = read_csv(&path, delimiter);
            assert_eq!(table.rows.len(), expected.rows.len(), "{name}");
            for (cell, exact) in table.rows.iter().flatten().zip(expected.rows.iter().flatten()) {
                let number = cell.replace(',', ".").parse::<f64>().is_ok();
                let formula = cell.starts_with(['=', '+', '-', '@', '\t', '\r', '＝', '＋', '－', '＠']);
                assert!(number || !formula, "{name}: {cell}");
                let back = cell.strip_prefix('\'').unwrap_or(cell);
                let same_time = exact.ends_with('Z') && exact.replace(['T', 'Z'], " ").trim() == cell;
                let inside = back.replace(";'=", ";=");
                assert!(
                    inside == *exact || same_time || same_number(&cell.replace(',', "."), exact),
                    "{name}: {cell}"
                );
            }
        }
    }
    let table = read_csv(&out.join("excel-csv/run.csv"), b';');
    assert!(table.column("value").contains(&"'12345e67"), "a commit is no number");
}

#[test]
fn json_holds_the_same_cells_with_null_for_missing_ones() {
    let place = tempfile::tempdir().unwrap();
    let run = hostile_run(place.path(), "table2");
    let plain = plain(&run, &place.path().join("out"));
    let file = place.path().join("run.json");
    assert_eq!(export(&run, &["--json", "--output", file.to_str().unwrap()]).0, Some(0));
    let document: Value = serde_json::from_slice(&fs::read(file).unwrap()).unwrap();
    assert_eq!(document["run"]["commit"], COMMIT);
    let tables = document["tables"].as_object().unwrap();
    assert_eq!(tables.len(), TABLES.len() - 2, "the run and the dictionary stand apart");
    for (name, rows) in tables {
        let expected = &plain[name.as_str()];
        assert_eq!(rows.as_array().unwrap().len(), expected.rows.len(), "{name}");
        for (row, record) in rows.as_array().unwrap().iter().zip(&expected.rows) {
            for (column, cell) in expected.header.iter().zip(record) {
                let same = match &row[column] {
                    Value::Null => cell.is_empty(),
                    Value::String(text) => text == cell,
                    // The reader of JSON in this test may be off by the last bit.
                    other => agrees(&other.to_string(), cell),
                };
                assert!(same, "{name}.{column}: {} became {cell}", row[column]);
            }
        }
        let described = document["dictionary"][name]["columns"].as_array().unwrap();
        assert_eq!(described.len(), expected.header.len(), "{name}");
    }
}

#[test]
fn the_workbook_has_typed_cells_that_equal_the_csv() {
    let place = tempfile::tempdir().unwrap();
    let run = hostile_run(place.path(), "table2");
    let plain = plain(&run, &place.path().join("out"));
    let file = place.path().join("run.xlsx");
    assert_eq!(export(&run, &["--xlsx", "--output", file.to_str().unwrap()]).0, Some(0));
    let book = Workbook::open(&file);
    assert_eq!(book.formulas(), 0, "nothing is computed in the workbook");
    for (name, expected) in &plain {
        let cells = book.cells(name);
        let header: Vec<Option<Cell>> =
            expected.header.iter().map(|name| Some(Cell::Text(name.clone()))).collect();
        assert_eq!(cells[0], header, "{name}");
        assert_eq!(cells.len(), 1 + expected.rows.len(), "{name}");
        for (row, record) in cells[1..].iter().zip(&expected.rows) {
            for (place, text) in record.iter().enumerate() {
                let same = match row.get(place).cloned().flatten() {
                    None => text.is_empty(),
                    Some(Cell::Text(found)) => found == *text,
                    Some(Cell::Number(found)) => text.parse::<f64>().is_ok_and(|exact| exact == found),
                    Some(Cell::Time(found)) => found == *text,
                    Some(Cell::Boolean(found)) => found.to_string() == *text,
                };
                assert!(same, "{name}.{}: {text} became {:?}", expected.header[place], row.get(place));
            }
        }
        let xml = book.sheet(name);
        assert!(xml.contains("state=\"frozen\"") && xml.contains("<autoFilter"), "{name}");
    }
    let commit = book.cells("run").into_iter().find(|row| row[0] == Some(Cell::Text("commit".into())));
    assert_eq!(commit.unwrap()[1], Some(Cell::Text(COMMIT.into())), "text, though it looks like a number");
    let times =
        book.cells("samples").into_iter().flatten().flatten().filter(|cell| matches!(cell, Cell::Time(_)));
    assert!(times.count() > 0, "times are times");
}

#[test]
fn the_workbook_draws_table_2_and_figure_4() {
    let place = tempfile::tempdir().unwrap();
    let book = |id: &str| {
        let run = hostile_run(&place.path().join(id), id);
        let file = place.path().join(format!("{id}.xlsx"));
        assert_eq!(export(&run, &["--xlsx", "--output", file.to_str().unwrap()]).0, Some(0));
        Workbook::open(&file)
    };
    let table2 = book("table2");
    let [bars] = &table2.charts()[..] else { panic!("one chart of Table 2") };
    assert!(bars.contains("<c:barChart>") && bars.contains("<c:grouping val=\"stacked\"/>"));
    assert_eq!(bars.matches("<c:ser>").count(), 2, "inside and outside CG");
    let paper = &table2.cells("chart data")[2];
    let drawn = ["paper: linked list", "25.4", "128.5"].map(|cell| {
        cell.parse().map_or_else(|_| Some(Cell::Text(cell.to_string())), |number| Some(Cell::Number(number)))
    });
    assert_eq!([&paper[0], &paper[1], &paper[4]], drawn.each_ref(), "as the paper prints them");
    let [times, speed_ups] = &book("figure4").charts()[..] else { panic!("two charts of Figure 4") };
    for chart in [times, speed_ups, bars] {
        assert!(workbook::is_in_order(chart), "{chart}");
    }
    for chart in [times, speed_ups] {
        assert!(chart.contains("<c:scatterChart>"));
        assert_eq!(chart.matches("<c:logBase val=\"2\"/>").count(), 2, "both axes are logarithmic");
    }
}

/// Whether a cell that another program read says what the CSV says: numbers to 15 digits and, as LibreOffice writes them,
/// 19 decimals; times without letters, truth values in capitals.
fn agrees(found: &str, exact: &str) -> bool {
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-14 * b.abs() + 1e-19;
    let numbers = (found.parse::<f64>(), exact.parse::<f64>());
    found == exact
        || found == exact.to_uppercase() && matches!(exact, "true" | "false")
        || matches!(numbers, (Ok(a), Ok(b)) if close(a, b))
        || format!("{}Z", found.replace(' ', "T")) == exact
}

#[test]
fn libreoffice_opens_the_workbook_and_finds_the_cells_of_the_csv() {
    let place = tempfile::tempdir().unwrap();
    for id in ["table2", "figure4"] {
        let run = hostile_run(&place.path().join(id), id);
        let plain = plain(&run, &place.path().join("out"));
        let file = place.path().join(format!("{id}.xlsx"));
        assert_eq!(export(&run, &["--xlsx", "--output", file.to_str().unwrap()]).0, Some(0));
        let Some(folder) = libreoffice::convert(&file, None, libreoffice::WRITING, place.path()) else {
            return;
        };
        for (name, expected) in &plain {
            let found = read_csv(&folder.join(format!("{id}-{name}.csv")), b',');
            assert_eq!((&found.header, found.rows.len()), (&expected.header, expected.rows.len()), "{name}");
            for (found, exact) in found.rows.iter().flatten().zip(expected.rows.iter().flatten()) {
                assert!(agrees(found, exact), "{name}: {exact:?} became {found:?}");
            }
        }
    }
}

#[test]
fn libreoffice_takes_no_text_of_a_spreadsheet_csv_for_anything_else() {
    let place = tempfile::tempdir().unwrap();
    let run = hostile_run(place.path(), "table2");
    let out = place.path().join("out");
    let plain = plain(&run, &out);
    let (english, japanese, german) = (1033, 1041, 1031);
    for (flags, separator, language) in [
        (&["--excel-csv"][..], b',', english),
        (&["--excel-csv"], b',', japanese),
        (&["--excel-csv", "--decimal-comma"], b';', german),
    ] {
        let code = export(&run, &[flags, &["--output", out.to_str().unwrap()]].concat()).0;
        assert_eq!(code, Some(0));
        for name in ["run", "experiments", "samples", "claims"] {
            let file = out.join(format!("excel-csv/{name}.csv"));
            let reading = libreoffice::reading(separator, language);
            let Some(folder) = libreoffice::convert(&file, Some(&reading), "xlsx", place.path()) else {
                return;
            };
            let book = Workbook::open(&folder.join(format!("{name}.xlsx")));
            assert_eq!(book.formulas(), 0, "{name} in {language}");
            let texts = read_csv(&file, separator);
            for ((row, text), exact) in book.cells(name)[1..].iter().zip(&texts.rows).zip(&plain[name].rows) {
                for (place, (text, exact)) in text.iter().zip(exact).enumerate() {
                    let same = match row.get(place).cloned().flatten() {
                        None => text.is_empty(),
                        Some(Cell::Text(found)) => found == *text && exact.parse::<f64>().is_err(),
                        Some(Cell::Number(found)) => agrees(&found.to_string(), exact),
                        Some(Cell::Time(found)) => found == *exact,
                        Some(Cell::Boolean(found)) => found.to_string() == *exact,
                    };
                    let number_as_text =
                        text.starts_with('\'') && row[place] == Some(Cell::Text(text.clone()));
                    assert!(
                        same || number_as_text,
                        "{name} in {language}: {text:?} became {:?}",
                        row.get(place)
                    );
                }
            }
        }
    }
}

#[test]
fn an_export_is_the_same_to_the_last_byte_when_it_is_repeated() {
    let place = tempfile::tempdir().unwrap();
    let run = hostile_run(place.path(), "figure4");
    let all = ["--csv", "--excel-csv", "--xlsx", "--json"];
    let contents = || -> BTreeMap<String, Vec<u8>> {
        let (code, printed, complaint) = export(&run, &all);
        assert_eq!(code, Some(0), "{complaint}");
        printed.lines().map(|path| (path.to_string(), fs::read(path).unwrap())).collect()
    };
    let first = contents();
    assert_eq!(first.len(), 2 * (TABLES.len() + 1) + 2);
    assert!(first.keys().all(|path| Path::new(path).starts_with(run.join("export"))), "below the run folder");
    fs::write(run.join("export/notes.txt"), "mine").unwrap();
    assert_eq!(first, contents());
    assert_eq!(fs::read_to_string(run.join("export/notes.txt")).unwrap(), "mine", "other files stay");
}

#[test]
fn wrong_commands_end_with_2_and_say_what_is_allowed() {
    let place = tempfile::tempdir().unwrap();
    let run = hostile_run(place.path(), "table2");
    let file = place.path().join("taken");
    fs::write(&file, "").unwrap();
    let file = file.to_str().unwrap();
    let refused = |flags: &[&str], words: &[&str]| {
        let (code, _, complaint) = export(&run, flags);
        assert_eq!(code, Some(2), "{flags:?}: {complaint}");
        for word in words {
            assert!(complaint.contains(word), "{flags:?} does not say {word}: {complaint}");
        }
    };
    refused(&[], &["--csv", "--excel-csv", "--xlsx", "--json"]);
    refused(&["--xlsx", "--decimal-comma"], &["--decimal-comma", "--csv"]);
    refused(&["--csv", "--output", file], &["--output", "a file"]);
    refused(&["--csv", "--xlsx", "--output", "both.xlsx"], &["--output", "both.xlsx"]);
    let (code, _, complaint) = export(place.path(), &["--csv"]);
    assert_eq!(code, Some(2), "{complaint}");
    assert!(complaint.contains("run.json"), "{complaint}");
}

#[test]
fn what_cannot_be_read_or_written_ends_with_3_and_leaves_nothing() {
    let place = tempfile::tempdir().unwrap();
    let run = hostile_run(place.path(), "table2");
    let taken = place.path().join("taken");
    fs::write(&taken, "").unwrap();
    let (code, _, complaint) = export(&run, &["--csv", "--output", taken.join("below").to_str().unwrap()]);
    assert_eq!(code, Some(3), "{complaint}");
    fixture::change(&run.join("rounds/table2-paired-000.json"), |round| {
        round["trials"][0]["started_utc"] = "yesterday".into();
    });
    let (code, _, complaint) = export(&run, &["--json"]);
    assert_eq!(code, Some(3), "{complaint}");
    assert!(complaint.contains("samples, row 1: `started_utc` is \"yesterday\""), "{complaint}");
    fs::write(run.join("rounds/table2-paired-001.json"), "{\"schema_version\":").unwrap();
    let (code, _, complaint) = export(&run, &["--csv"]);
    assert_eq!(code, Some(3), "{complaint}");
    assert!(complaint.contains("table2-paired-001.json"), "{complaint}");
    assert!(!run.join("export").exists(), "nothing is written before everything is read");
}

#[cfg(unix)]
#[test]
fn a_run_folder_does_not_lead_out_of_itself() {
    let place = tempfile::tempdir().unwrap();
    let run = hostile_run(place.path(), "table2");
    let elsewhere = place.path().join("elsewhere");
    fs::create_dir(&elsewhere).unwrap();
    std::os::unix::fs::symlink(&elsewhere, run.join("export")).unwrap();
    let (code, _, complaint) = export(&run, &["--csv"]);
    assert_eq!(code, Some(2), "{complaint}");
    assert!(complaint.contains("is a link"), "{complaint}");
    assert_eq!(fs::read_dir(&elsewhere).unwrap().count(), 0);
    fs::remove_file(run.join("export")).unwrap();
    fixture::change(&run.join("run.json"), |info| info["run_id"] = "../../elsewhere/x".into());
    let out = place.path().join("out");
    let (code, printed, complaint) = export(&run, &["--xlsx", "--output", out.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{complaint}");
    assert!(Path::new(printed.trim()).parent().unwrap() == out, "{printed}");
    assert_eq!(fs::read_dir(&elsewhere).unwrap().count(), 0);
}
