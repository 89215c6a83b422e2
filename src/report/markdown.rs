//! Texts of others in Markdown: none becomes markup, a link or a picture, or runs past the end of its line.

/// The text as it may stand in a paragraph, a list or a table.
pub fn plain(text: &str) -> String {
    let line = one_line(text).replace('<', "&lt;");
    // What would make a link, a picture or the target of one; and what would open a block of code up to the page's end.
    line.replace("](", "]\\(").replace("]:", "]\\:").replace("```", "\\`\\`\\`").replace("~~~", "\\~\\~\\~")
}

/// The text as it may stand between two backticks, where nothing can be escaped: what no command has is replaced.
pub fn code(text: &str) -> String {
    one_line(text).replace(['`', '<'], "'").replace("](", "] (")
}

fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_of_others_is_text() {
        for (text, expected) in [
            ("<script>alert(1)</script>", "&lt;script>alert(1)&lt;/script>"),
            ("![x](http://a)", "![x]\\(http://a)"),
            ("a\n[b]: http://a", "a [b]\\: http://a"),
            ("```\nrest", "\\`\\`\\` rest"),
            ("1.064 [1.056, 1.074] x, `table2`, $(rm)", "1.064 [1.056, 1.074] x, `table2`, $(rm)"),
        ] {
            assert_eq!(plain(text), expected);
        }
        assert_eq!(code("repro `rm`\u{1b}[2J <b>"), "repro 'rm' [2J 'b>");
    }
}
