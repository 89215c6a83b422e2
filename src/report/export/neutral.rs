//! Text that a spreadsheet which opens a CSV file would take for something else: a formula, a number, a date.
//!
//! Excel and LibreOffice look at what a cell says, quoted or not, and neither reads a leading apostrophe in a CSV file as
//! the sign for text, as both do at the keyboard: they show it. So an apostrophe makes text of anything, at the price of
//! being seen; `="..."`, the other usual way, is itself a formula. A reader gets the text back by taking one leading
//! apostrophe away; only an apostrophe before a formula inside the text cannot be told from one that was there.

use std::borrow::Cow;

/// Words that occur in numbers and dates.
const VALUE_WORDS: &str = "e a p am pm jan feb mar apr may jun jul aug sep sept oct nov dec january february march april \
                           june july august september october november december 年 月 日 時 分 秒 午前 午後";

/// Words that occur in dates with year, month and day: parts of ISO 8601, and Japanese eras.
const DATE_WORDS: &str = "t z utc r h s m 令和 平成 昭和 大正 明治";

/// The text, with an apostrophe before it if a spreadsheet would not take it for text, and before every formula that
/// would begin a cell if the file were cut at another separator than its own.
pub fn neutral(text: &str) -> Cow<'_, str> {
    let mut safe = String::new();
    if is_misread(text) {
        safe.push('\'');
    }
    let mut before = None;
    for letter in text.chars() {
        if before.is_some_and(may_end_a_cell) && begins_formula(letter) {
            safe.push('\'');
        }
        safe.push(letter);
        before = Some(letter);
    }
    if safe.len() == text.len() { Cow::Borrowed(text) } else { Cow::Owned(safe) }
}

/// Whether the whole text is a formula, a number, a date or a time to some spreadsheet, or begins with an apostrophe of
/// its own.
fn is_misread(text: &str) -> bool {
    let control = text.starts_with(|first: char| first.is_control() || first == '\'');
    control || text.trim_start().starts_with(begins_formula) || looks_like_value(text)
}

/// The characters with which formulas begin, and their wide and small forms.
fn begins_formula(letter: char) -> bool {
    matches!(letter, '=' | '+' | '-' | '@' | '＝' | '＋' | '－' | '＠' | '﹦' | '﹢' | '﹣' | '﹫' | '−')
}

fn may_end_a_cell(letter: char) -> bool {
    matches!(letter, ',' | ';' | '\t' | '\r' | '\n' | '"')
}

/// Digits, and no words but those of numbers and dates; or a truth value. Too much is taken for a value rather than too
/// little.
fn looks_like_value(text: &str) -> bool {
    let text: String = text.chars().map(narrow).flat_map(char::to_lowercase).collect();
    let words = || text.split(|c: char| !c.is_alphabetic()).filter(|word| !word.is_empty());
    let numbers = text.split(|c: char| !c.is_numeric()).filter(|number| !number.is_empty()).count();
    match numbers {
        0 => matches!(text.trim(), "true" | "false"),
        1 | 2 => words().all(|word| is_one_of(word, VALUE_WORDS)),
        _ => words().all(|word| is_one_of(word, VALUE_WORDS) || is_one_of(word, DATE_WORDS)),
    }
}

fn is_one_of(word: &str, words: &str) -> bool {
    words.split(' ').any(|known| known == word)
}

/// The plain form of a full-width letter, digit or sign.
fn narrow(letter: char) -> char {
    let wide = u32::from(letter);
    let plain = (0xFF01..=0xFF5E).contains(&wide).then(|| char::from_u32(wide - 0xFEE0));
    plain.flatten().unwrap_or(letter)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_become_text() {
        for formula in
            ["=1+1", "+1", "-1", "@SUM(1)", "\tx", "\rx", "  =1", "＝1", "－x", "=cmd|' /C calc'!A0"]
        {
            assert_eq!(neutral(formula), format!("'{formula}"));
        }
    }

    #[test]
    fn numbers_dates_and_truth_values_become_text() {
        let values =
            ["12345e67", "1-2", "2026-11-22", "2026-11-22T10:00:00Z", "10:30", "007", "1,5", "50 %", "true"];
        let words =
            ["1 Jan", "MAR1", "sept-2", "5 p", "12月1日", "令和6年1月2日", "R6.1.2", "１２３", "TRUE", "(5)"];
        for value in values.into_iter().chain(words) {
            assert_eq!(neutral(value), format!("'{value}"), "{value}");
        }
    }

    #[test]
    fn text_that_nobody_takes_for_anything_else_stays_as_it_is() {
        let names = [
            "paper-linked-list",
            "dynamic:64",
            "850aa34f4b0f",
            "39a10904bede",
            "1.17x",
            "T2",
            "C4a",
            "table2",
        ];
        let others = [
            "水柱崩壊",
            "needs 4 threads, 2 may be used",
            "section 4.1, Table 2",
            "a - b",
            "none",
            "",
            "x = 1",
        ];
        for text in names.into_iter().chain(others) {
            assert_eq!(neutral(text), text);
        }
    }

    #[test]
    fn one_apostrophe_is_taken_away_to_get_the_text_back() {
        for text in ["'quoted'", "=1", "12", "plain"] {
            let safe = neutral(text);
            let back = safe.strip_prefix('\'').unwrap_or(&safe);
            assert_eq!(back, text);
        }
    }

    #[test]
    fn no_formula_begins_a_cell_of_a_file_cut_at_another_separator() {
        assert_eq!(neutral("a;=cmd()"), "a;'=cmd()");
        assert_eq!(neutral("a\n@x"), "a\n'@x");
        assert_eq!(neutral("a;\"=b"), "a;\"'=b");
    }
}
