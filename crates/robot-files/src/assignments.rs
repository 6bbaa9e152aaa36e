//! Entries of texts that are no YAML, a line each: `#define NAME 0.1`, `… NAME = 0.1;`, and the rows of the
//! table in millimetres that `yair export mm` writes.

use crate::entries::{Entry, Scalar};

/// Letters of a name.
fn is_name(letter: char) -> bool {
    letter.is_alphanumeric() || letter == '_'
}

/// The assignments of a text, in its order. What stands in a comment assigns nothing.
pub(crate) fn entries(text: &str) -> Vec<Entry> {
    let mut found = Vec::new();
    let (mut at, mut is_comment) = (0, false);
    for line in text.split_inclusive('\n') {
        let start = at;
        at += line.len();
        let trimmed = line.trim_start();
        if is_comment || trimmed.starts_with("/*") {
            is_comment = !line.contains("*/");
            continue;
        }
        if trimmed.starts_with("//") {
            continue;
        }
        let code = line.find("//").map_or(line, |end| &line[..end]);
        let assigned = define(code).or_else(|| equals(code)).or_else(|| row(line));
        if let Some((name, value)) = assigned {
            let length = number_length(&code[value..]);
            let span = (length > 0).then(|| start + value..start + value + length);
            let rest = code[value..].split([' ', '\t', ';', '\r', '\n']).next().unwrap_or_default();
            let text = if length > 0 { &code[value..value + length] } else { rest };
            found.push(Entry { path: vec![name], key: None, values: vec![Scalar { text: text.to_owned(), span }] });
        }
    }
    found
}

/// Name and place of the value in `#define NAME value`.
fn define(line: &str) -> Option<(String, usize)> {
    let rest = line.trim_start().strip_prefix('#')?.trim_start().strip_prefix("define")?;
    let name = rest.trim_start();
    let length = name.find(|letter: char| !is_name(letter)).filter(|length| *length > 0)?;
    let value = name[length..].trim_start_matches(|letter: char| letter.is_whitespace() || letter == '(');
    Some((name[..length].to_owned(), line.len() - value.len()))
}

/// Name and place of the value in `double NAME = value;`.
fn equals(line: &str) -> Option<(String, usize)> {
    let at = line.find('=').filter(|at| !line[at + 1..].starts_with('='))?;
    let before = line[..at].trim_end();
    let name = before.rsplit(|letter: char| !is_name(letter)).next().filter(|name| !name.is_empty())?;
    let value = line[at + 1..].trim_start();
    Some((name.to_owned(), line.len() - value.len()))
}

/// Rows of the table in millimetres.
pub(crate) const ROWS: [&str; 3] = ["left wheel diameter", "right wheel diameter", "wheel separation"];

/// Name and place of the value in a row of the table in millimetres.
fn row(line: &str) -> Option<(String, usize)> {
    let name = ROWS.into_iter().find(|name| line.starts_with(*name))?;
    let value = line[name.len()..].trim_start();
    Some((name.to_owned(), line.len() - value.len()))
}

/// Bytes of the number that a text begins with, without a suffix such as `f`.
fn number_length(text: &str) -> usize {
    let letters = text.find(|letter: char| !(letter.is_ascii_digit() || "+-.eE".contains(letter)));
    (1..=letters.unwrap_or(text.len())).rev().find(|end| text[..*end].parse::<f64>().is_ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_without_what_stands_around_them() {
        let text = "#pragma once\n  # define WHEEL_DIAMETER (0.0650f) // m = 0.7\n#define LR_WHEELS_DISTANCE 0.2\r\n// double kOld = 3.0;\n\
                    /* #define X 1\n#define Y 2 */\npublic double kTrack = 1.5e-1;\n\
                    if (a == 3) {}\n#define EMPTY\n#define NAME OTHER\nwheel separation    408.000  0.20\n";
        let found = entries(text);
        let shown: Vec<(&str, &str, bool)> = found
            .iter()
            .map(|entry| {
                let value = &entry.values[0];
                if let Some(span) = &value.span {
                    assert_eq!(&text[span.clone()], value.text);
                }
                (&entry.path[0][..], &value.text[..], value.span.is_some())
            })
            .collect();
        assert_eq!(
            shown,
            [
                ("WHEEL_DIAMETER", "0.0650", true),
                ("LR_WHEELS_DISTANCE", "0.2", true),
                ("kTrack", "1.5e-1", true),
                ("EMPTY", "", false),
                ("NAME", "OTHER", false),
                ("wheel separation", "408.000", true),
            ]
        );
    }
}
