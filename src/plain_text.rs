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
    fn formulas_are_texts_and_numbers_are_numbers() {
        for formula in ["=1+1", "+cmd|x", "-2+3", "@SUM(A1)", "\t=1", "-"] {
            assert_eq!(spreadsheet_cell(formula), format!("'{formula}"));
        }
        for plain in ["-1.5", "+2e3", "robot-7", "", "a=b"] {
            assert_eq!(spreadsheet_cell(plain), plain);
        }
    }
}
