//! Texts of files as a terminal and a spreadsheet may have them: one function a sink.
//!
//! Comments of C, Java and YAML are the sink of `export::comment`, HTML that of the templates of
//! `report-page`, which escape by themselves, scripts in HTML that of `report_page::embedded_json`.

use std::borrow::Cow;

/// Letters that a terminal takes for a command, or that turn the direction of the text behind them, so that a
/// reader sees another text than a script does.
fn is_command(letter: char) -> bool {
    letter.is_control()
        || matches!(letter, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}')
}

/// Text as a terminal may have it: commands are escaped, line ends and tabulators stay.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    let is_kept = |letter: char| matches!(letter, '\n' | '\t') || !is_command(letter);
    escaped(text, is_kept, |letter| letter.escape_unicode().to_string())
}

/// A JSON document as a terminal may have it. It is the same document: JSON itself has the escapes.
pub(crate) fn printable_json(text: &str) -> Cow<'_, str> {
    let is_kept = |letter: char| (letter.is_ascii() && letter != '\u{7f}') || !is_command(letter);
    // All commands beyond ASCII are below U+10000.
    escaped(text, is_kept, |letter| format!("\\u{:04x}", u32::from(letter)))
}

/// Longest message, characters: the longest good one lists the effects that are known.
const MAX_MESSAGE_CHARS: usize = 2000;

/// A message as a terminal may have it: parsers show keys of any length.
pub(crate) fn printable_message(text: &str) -> Cow<'_, str> {
    match text.char_indices().nth(MAX_MESSAGE_CHARS) {
        Some((end, _)) => Cow::Owned(printable(&text[..end]).into_owned() + "…"),
        None => printable(text),
    }
}

fn escaped<'t>(text: &'t str, is_kept: impl Fn(char) -> bool, escape: impl Fn(char) -> String) -> Cow<'t, str> {
    if text.chars().all(&is_kept) {
        return Cow::Borrowed(text);
    }
    let letter = |letter: char| if is_kept(letter) { letter.to_string() } else { escape(letter) };
    Cow::Owned(text.chars().map(letter).collect())
}

/// Text of a file within one line: line ends and tabulators too are none.
pub(crate) fn one_line(text: &str) -> String {
    printable(text).replace(['\n', '\t'], " ")
}

/// Text of a file in Markdown, on one line: no HTML, and nothing that Markdown takes for more than text.
pub(crate) fn markdown(text: &str) -> String {
    let line = one_line(text);
    let mut out = String::with_capacity(line.len());
    let mut before = ' ';
    let mut rest = line.chars().peekable();
    while let Some(letter) = rest.next() {
        let is_inside = before.is_alphanumeric() && rest.peek().is_some_and(|next| next.is_alphanumeric());
        match letter {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            // An underscore within a word, as ids have it, is none of Markdown.
            '_' if is_inside => out.push('_'),
            '\\' | '`' | '*' | '_' | '[' | ']' | '|' | '~' | '$' => out.extend(['\\', letter]),
            // At the start of a line: a heading, a list.
            '#' | '-' | '+' | '=' if out.is_empty() => out.extend(['\\', letter]),
            other => out.push(other),
        }
        before = letter;
    }
    out
}

/// A text as a cell of a table for people. A spreadsheet takes one that begins with any of these signs for a
/// formula; an apostrophe before it makes it a text. Numbers stay as they are.
pub(crate) fn spreadsheet_cell(text: &str) -> Cow<'_, str> {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n']) && text.parse::<f64>().is_err() {
        Cow::Owned(format!("'{text}"))
    } else {
        Cow::Borrowed(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_command_reaches_a_terminal() {
        assert_eq!(printable("a\u{1b}[31m\r\nb\tc\u{9b}2J\u{202e}d"), "a\\u{1b}[31m\\u{d}\nb\tc\\u{9b}2J\\u{202e}d");
        assert!(matches!(printable("– σ² = 1 é 中"), Cow::Borrowed(_)));
    }

    #[test]
    fn a_message_ends() {
        let long = printable_message(&"é".repeat(100_000)).into_owned();
        assert_eq!(long.chars().count(), MAX_MESSAGE_CHARS + 1);
        assert_eq!(printable_message("short\u{7}"), "short\\u{7}");
    }

    #[test]
    fn a_document_stays_the_same_document() {
        let value = serde_json::json!({ "name": "a\u{1b}\u{9b}\u{202e}\u{feff} é\n" });
        let text = value.to_string();
        let shown = printable_json(&text);
        assert!(!shown.contains(is_command), "{shown}");
        assert_ne!(shown, text);
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).expect("JSON"), value);
    }

    #[test]
    fn markdown_is_text() {
        assert_eq!(markdown("<script>a</script> & b"), "&lt;script&gt;a&lt;/script&gt; &amp; b");
        assert_eq!(
            markdown("[a](javascript:b) ![c](d) `e` *f* __g__"),
            "\\[a\\](javascript:b) !\\[c\\](d) \\`e\\` \\*f\\* \\_\\_g\\_\\_"
        );
        assert_eq!(markdown("a\u{202e}b\n# c\n| d"), "a\\\\u{202e}b # c \\| d");
        assert_eq!((markdown("# a"), markdown("- b"), markdown("=c")), ("\\# a".into(), "\\- b".into(), "\\=c".into()));
        let plain = "wheel_scale = 1.0e-3 ± 2.0e-4 – σ² of run-01 (p = 0.02)";
        assert_eq!(markdown(plain), plain);
    }

    #[test]
    fn formulas_are_texts_and_numbers_are_numbers() {
        for formula in ["=1+1", "+cmd|x", "-2+3", "@SUM(A1)", "\t=1", "-"] {
            assert_eq!(spreadsheet_cell(formula), format!("'{formula}"));
        }
        for plain in ["-1.5", "+2e3", "robot-7", "", "a=b"] {
            assert_eq!(spreadsheet_cell(plain), plain);
        }
    }
}
