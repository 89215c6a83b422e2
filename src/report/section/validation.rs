//! Validation: each effect against a known answer.

use anyhow::Result;

use crate::report::measured::Measured;
use crate::report::section::Content;
use crate::report::summary::CellPhase;
use crate::report::table::TableView;
use crate::report::validation::{ValidationRow, rows_of};

/// The section.
pub fn content(measured: &Measured, _: &[CellPhase]) -> Result<Content> {
    Ok(content_of(measured, "validation"))
}

/// What there is to say about the validating cases of any experiment; nothing where it has none.
pub fn content_of(measured: &Measured, id: &str) -> Content {
    let rows = rows_of(measured, id);
    if rows.is_empty() {
        return Content::default();
    }
    Content { findings: findings(&rows), tables: vec![table(&rows)], ..Content::default() }
}

fn findings(rows: &[ValidationRow<'_>]) -> Vec<String> {
    let count = |verdict: &str| rows.iter().filter(|row| row.verdict == verdict).count();
    let (passed, failed, broken) = (count("pass"), count("fail"), count("none"));
    let mut findings = vec![format!("{passed} of {} comparisons are within their gate.", passed + failed)];
    let fail = |row: &&ValidationRow<'_>| row.verdict == "fail";
    findings.extend(rows.iter().filter(fail).map(|row| {
        format!(
            "{}, {}: {} is off by {}, and {} passes.",
            row.effect,
            row.simulated,
            row.quantity,
            row.error.map_or("nothing".to_string(), percent),
            row.gate.map_or("nothing".to_string(), percent)
        )
    }));
    if broken > 0 {
        let reasons = rows.iter().filter(|row| row.verdict == "none");
        let reasons: Vec<String> =
            reasons.map(|row| format!("{} ({})", row.validating_case, row.reason)).collect();
        findings.push(format!("Without an answer: {}.", reasons.join("; ")));
    }
    findings
}

fn percent(error: f64) -> String {
    match 100.0 * error.abs() {
        small if small < 0.01 => format!("{:.1e}", error.abs()),
        percent => format!("{percent:.2} %"),
    }
}

fn table(rows: &[ValidationRow<'_>]) -> TableView {
    let mut view = TableView::new(
        "Effects and their cases: what was found, what is known, the error and the largest one that passes.",
        &["effect", "case", "quantity", "found", "known", "error", "gate", "verdict", "known from"],
    );
    let number = |value: Option<f64>| value.map_or("none".to_string(), short);
    for row in rows {
        let percents = |value: Option<f64>| value.map_or("none".to_string(), percent);
        view.rows.push(vec![
            if row.effect.is_empty() { row.validating_case } else { row.effect }.to_string(),
            if row.simulated.is_empty() { row.reason } else { row.simulated }.to_string(),
            row.quantity.to_string(),
            number(row.value),
            number(row.reference),
            percents(row.error),
            percents(row.gate),
            row.verdict.to_string(),
            row.source.to_string(),
        ]);
    }
    view
}

/// Five digits, however large or small the number.
fn short(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_string(),
        size if (1e-3..1e5).contains(&size) => {
            let digits = (4 - size.log10().floor() as i32).max(0) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.4e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_five_digits() {
        assert_eq!([1.0, 0.0123456, 1234.567, 0.0].map(short), ["1.0000", "0.012346", "1234.6", "0"]);
        assert_eq!([1.25e-5, -9.0e9].map(short), ["1.2500e-5", "-9.0000e9"]);
        assert_eq!([0.0123, 1e-7].map(percent), ["1.23 %", "1.0e-7"]);
    }
}
