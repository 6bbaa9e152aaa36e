//! The tables that a file of SQLite declares: where their rows begin, and the order of their columns.
//!
//! What only looks like a table, a view, a virtual table or a computed column, is refused.

use std::collections::BTreeMap;

use crate::settings::MAX_FIELDS;
use crate::sqlite_pages::{Column, Pages, column};

/// A table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Declared {
    /// Its first page.
    pub(crate) root: u32,
    columns: Vec<String>,
    /// The column that stands for the row's own number, and is empty in the record.
    number: Option<usize>,
}

impl Declared {
    /// Where a column stands.
    pub(crate) fn place(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }

    /// A column of a row; none where the bytes end before it.
    pub(crate) fn column<'r>(&self, record: &'r [u8], row: i64, place: usize) -> Option<Column<'r>> {
        if self.number == Some(place) { Some(Column::Integer(row)) } else { column(record, place) }
    }
}

/// Tables by name, of those that are asked for. Names differ by no case in SQLite.
pub(crate) fn tables(
    pages: &mut Pages,
    asked: &[&str],
    lose: &mut impl FnMut(String),
) -> Result<BTreeMap<String, Declared>, String> {
    let mut found = BTreeMap::new();
    for leaf in pages.leaves(1, lose) {
        for cell in pages.rows(leaf)? {
            let record = pages.record(&cell)?;
            let text = |place: usize| match column(&record, place) {
                Some(Column::Bytes(text)) => String::from_utf8_lossy(text).into_owned(),
                _ => String::new(),
            };
            let (kind, name) = (text(0), text(1).to_ascii_lowercase());
            if !asked.contains(&&name[..]) || !["table", "view"].contains(&&kind[..]) {
                continue;
            }
            let root = match column(&record, 3) {
                Some(Column::Integer(root)) if kind == "table" => u32::try_from(root).ok(),
                _ => None,
            };
            let computed = || format!("{name} is a view or computed, where a table belongs");
            let root = root.filter(|root| *root > 0).ok_or_else(computed)?;
            let (columns, number) = columns(&text(4)).ok_or_else(computed)?;
            found.insert(name, Declared { root, columns, number });
        }
    }
    Ok(found)
}

/// A word of a statement in lower case, and whether it was quoted; or one sign.
type Token = (String, bool);

/// Names of a table's columns, and which is the number of the row; none of a statement that does not declare
/// plain columns.
fn columns(statement: &str) -> Option<(Vec<String>, Option<usize>)> {
    let tokens = tokens(statement);
    let is = |token: &Token, word: &str| !token.1 && token.0 == word;
    let first = tokens.iter().position(|token| is(token, "("))?;
    if tokens[..first].iter().any(|token| is(token, "virtual")) {
        return None;
    }
    let (mut depth, mut parts): (usize, Vec<Vec<&Token>>) = (0, vec![Vec::new()]);
    let mut rest = tokens[first..].iter();
    for token in rest.by_ref() {
        depth = if is(token, "(") { depth + 1 } else { depth };
        if is(token, ")") && depth == 1 {
            break;
        }
        match parts.last_mut() {
            _ if depth == 1 && is(token, ",") => parts.push(Vec::new()),
            Some(part) if depth > 1 || !is(token, "(") => part.push(token),
            _ => {}
        }
        depth = if is(token, ")") { depth - 1 } else { depth };
    }
    if rest.any(|token| is(token, "without")) || parts.len() > MAX_FIELDS {
        return None;
    }
    let (mut names, mut number) = (Vec::new(), None);
    for part in parts {
        let (name, declared) = part.split_first()?;
        if ["constraint", "primary", "unique", "check", "foreign"].iter().any(|word| is(name, word)) {
            continue;
        }
        if declared.iter().any(|token| is(token, "generated") || is(token, "as")) {
            return None;
        }
        let is_key = declared.windows(2).any(|pair| is(pair[0], "primary") && is(pair[1], "key"));
        let is_down = declared.iter().any(|token| is(token, "desc"));
        if is_key && !is_down && declared.first().is_some_and(|token| is(token, "integer")) {
            number = Some(names.len());
        }
        names.push(name.0.clone());
    }
    Some((names, number))
}

fn tokens(statement: &str) -> Vec<Token> {
    let mut tokens = Vec::new();
    let mut rest = statement;
    while let Some(first) = rest.chars().next() {
        let quoted = match first {
            '"' | '\'' | '`' => Some(first),
            '[' => Some(']'),
            _ => None,
        };
        let is_word = |letter: char| letter.is_alphanumeric() || letter == '_';
        let skip = |end: &str| rest.find(end).map_or(rest.len(), |at| at + end.len());
        let length = if let Some(end) = quoted {
            let inside = &rest[1..];
            let length = inside.find(end).unwrap_or(inside.len());
            tokens.push((inside[..length].to_lowercase(), true));
            (length + 2).min(rest.len())
        } else if rest.starts_with("--") {
            skip("\n")
        } else if rest.starts_with("/*") {
            skip("*/")
        } else if is_word(first) {
            let length = rest.find(|letter| !is_word(letter)).unwrap_or(rest.len());
            tokens.push((rest[..length].to_lowercase(), false));
            length
        } else {
            if !first.is_whitespace() {
                tokens.push((first.to_string(), false));
            }
            first.len_utf8()
        };
        rest = &rest[length..];
    }
    tokens
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_come_in_their_order_and_what_is_computed_is_refused() {
        let names = |statement: &str| columns(statement).map(|(names, number)| (names.join(" "), number));
        let plain = |text: &str, number| Some((text.to_owned(), number));
        let of_bag = "CREATE TABLE messages(id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL)";
        assert_eq!(names(of_bag), plain("id topic_id timestamp data", Some(0)));
        let odd = "create table t (\"Data\" BLOB DEFAULT (x'00,'), -- as, it says\n [id] integer primary key /* as */, `at` NUMERIC(3, 4) CHECK (at > 1), PRIMARY KEY (id, at), FOREIGN KEY (id) REFERENCES u(id))";
        assert_eq!(names(odd), plain("data id at", Some(1)));
        assert_eq!(names("CREATE TABLE t(id INTEGER PRIMARY KEY DESC, a INT)"), plain("id a", None));
        for refused in [
            "CREATE VIRTUAL TABLE t USING fts5(a, b)",
            "CREATE TABLE t(a INT, b AS (a + 1))",
            "CREATE TABLE t(a INT, b INT GENERATED ALWAYS AS (a) STORED)",
            "CREATE TABLE t(a INT PRIMARY KEY) WITHOUT ROWID",
            "CREATE TABLE t",
            "CREATE TABLE t(",
            "'",
        ] {
            assert_eq!(names(refused), None, "{refused}");
        }
    }
}
