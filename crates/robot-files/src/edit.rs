//! Edits of a text, and what they change line by line.

use std::ops::Range;

/// Bytes with what takes their place. An empty range at the beginning of a line inserts lines.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Edit {
    pub(crate) span: Range<usize>,
    pub(crate) text: String,
}

/// A text with calibrated values in their places.
#[derive(Debug, Clone, PartialEq)]
pub struct Edited {
    /// The whole text.
    pub text: String,
    /// What should be known, one line each.
    pub remarks: Vec<String>,
}

/// The text with all edits; none of them overlap.
pub(crate) fn apply(text: &str, edits: &[Edit]) -> String {
    let mut in_order: Vec<&Edit> = edits.iter().collect();
    in_order.sort_by_key(|edit| edit.span.start);
    let (mut edited, mut at) = (String::with_capacity(text.len()), 0);
    for edit in in_order {
        edited.push_str(&text[at..edit.span.start]);
        edited.push_str(&edit.text);
        at = edit.span.end;
    }
    edited.push_str(&text[at..]);
    edited
}

/// Two versions of a file as a unified diff without lines around the changes; empty where they are alike.
///
/// Lines that were changed in their place are paired: what is added between them is found by the next line
/// that is the same in both.
#[must_use]
pub fn diff(file: &str, before: &str, after: &str) -> String {
    let (old, new): (Vec<&str>, Vec<&str>) = (lines(before), lines(after));
    let (mut text, mut i, mut j) = (String::new(), 0, 0);
    while i < old.len() || j < new.len() {
        if i < old.len() && j < new.len() && old[i] == new[j] {
            (i, j) = (i + 1, j + 1);
            continue;
        }
        let (next_i, next_j) = next_same(&old, &new, i, j);
        if text.is_empty() {
            text = format!("--- {file}\n+++ {file}\n");
        }
        let range = |from: usize, count: usize| format!("{},{count}", if count == 0 { from } else { from + 1 });
        text.push_str(&format!("@@ -{} +{} @@\n", range(i, next_i - i), range(j, next_j - j)));
        for (sign, line) in
            old[i..next_i].iter().map(|line| ('-', line)).chain(new[j..next_j].iter().map(|line| ('+', line)))
        {
            text.push(sign);
            text.push_str(line.trim_end_matches(['\n', '\r']));
            text.push('\n');
        }
        (i, j) = (next_i, next_j);
    }
    text
}

fn lines(text: &str) -> Vec<&str> {
    text.split_inclusive('\n').collect()
}

/// The nearest pair of lines from here on that are alike.
fn next_same(old: &[&str], new: &[&str], i: usize, j: usize) -> (usize, usize) {
    let most = old.len() - i + new.len() - j;
    for total in 1..=most {
        for of_old in (0..=total).rev() {
            let (at_old, at_new) = (i + of_old, j + total - of_old);
            if at_old < old.len() && at_new < new.len() && old[at_old] == new[at_new] {
                return (at_old, at_new);
            }
        }
    }
    (old.len(), new.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_leave_every_other_byte_and_the_diff_shows_them() {
        let text = "a: 1 # one\r\nb: 2\r\n\r\nc: 3";
        let edits = [
            Edit { span: text.len() - 1..text.len(), text: "30".to_owned() },
            Edit { span: 3..4, text: "10".to_owned() },
            Edit { span: 12..12, text: "new: 0\r\n".to_owned() },
        ];
        let edited = apply(text, &edits);
        assert_eq!(edited, "a: 10 # one\r\nnew: 0\r\nb: 2\r\n\r\nc: 30");
        assert_eq!(
            diff("f", text, &edited),
            "--- f\n+++ f\n@@ -1,1 +1,2 @@\n-a: 1 # one\n+a: 10 # one\n+new: 0\n@@ -4,1 +5,1 @@\n-c: 3\n+c: 30\n"
        );
        assert_eq!(diff("f", text, text), "");
        assert_eq!(diff("f", "a\nb\n", "a\nx\nb\n"), "--- f\n+++ f\n@@ -1,0 +2,1 @@\n+x\n");
    }
}
