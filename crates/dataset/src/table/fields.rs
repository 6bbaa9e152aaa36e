//! The fields of one line of a table: commas, and quotes as in RFC 4180, except that a quoted field ends on
//! its line.
//!
//! The exception is why this is not the csv crate: to it, one stray quote makes a field of the rest of the
//! file, however long that is, and rows can then neither be counted by their line ends nor be held to a
//! length.

use std::ops::Range;

/// Where the fields of a line are; buffers are reused from line to line.
#[derive(Debug, Default)]
pub(crate) struct Fields {
    spans: Vec<Range<usize>>,
    /// Content of a line that has quotes, without them.
    unquoted: Vec<u8>,
    has_quotes: bool,
}

/// A quoted field does not end on its line, or something stands between its end and the comma.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct BadQuote;

impl Fields {
    /// Splits a line; spaces around a field that is not quoted do not count.
    pub(crate) fn split(&mut self, line: &[u8]) -> Result<(), BadQuote> {
        self.spans.clear();
        self.has_quotes = memchr::memchr(b'"', line).is_some();
        if self.has_quotes {
            return self.split_quoted(line);
        }
        let mut start = 0;
        for (at, &byte) in line.iter().enumerate() {
            if byte == b',' {
                self.spans.push(trimmed(line, start..at));
                start = at + 1;
            }
        }
        self.spans.push(trimmed(line, start..line.len()));
        Ok(())
    }

    pub(crate) fn len(&self) -> usize {
        self.spans.len()
    }

    /// A field of the line that was split last.
    pub(crate) fn get<'a>(&'a self, line: &'a [u8], index: usize) -> &'a [u8] {
        let content = if self.has_quotes { &self.unquoted } else { line };
        &content[self.spans[index].clone()]
    }

    fn split_quoted(&mut self, line: &[u8]) -> Result<(), BadQuote> {
        self.unquoted.clear();
        let mut rest = line;
        loop {
            let blank = rest.iter().take_while(|byte| is_blank(**byte)).count();
            let from = self.unquoted.len();
            if rest.get(blank) == Some(&b'"') {
                rest = self.take_quoted(&rest[blank + 1..])?;
                self.spans.push(from..self.unquoted.len());
            } else {
                let length = memchr::memchr(b',', rest).unwrap_or(rest.len());
                self.unquoted.extend_from_slice(&rest[..length]);
                self.spans.push(trimmed(&self.unquoted, from..self.unquoted.len()));
                rest = &rest[length..];
            }
            match rest.split_first() {
                None => return Ok(()),
                Some((b',', after)) => rest = after,
                Some(_) => return Err(BadQuote),
            }
        }
    }

    /// Takes a field whose opening quote was passed and the spaces behind it; what is left starts with a
    /// comma or is empty.
    fn take_quoted<'a>(&mut self, mut rest: &'a [u8]) -> Result<&'a [u8], BadQuote> {
        loop {
            let length = memchr::memchr(b'"', rest).ok_or(BadQuote)?;
            self.unquoted.extend_from_slice(&rest[..length]);
            rest = &rest[length + 1..];
            if rest.first() == Some(&b'"') {
                self.unquoted.push(b'"');
                rest = &rest[1..];
            } else {
                let blank = rest.iter().take_while(|byte| is_blank(**byte)).count();
                return Ok(&rest[blank..]);
            }
        }
    }
}

const fn is_blank(byte: u8) -> bool {
    byte == b' ' || byte == b'\t'
}

fn trimmed(content: &[u8], Range { mut start, mut end }: Range<usize>) -> Range<usize> {
    while start < end && is_blank(content[start]) {
        start += 1;
    }
    while start < end && is_blank(content[end - 1]) {
        end -= 1;
    }
    start..end
}

/// The field as a table holds it: quoted where [`Fields::split`] would otherwise read something else.
pub(crate) fn quoted_where_needed(field: &str) -> std::borrow::Cow<'_, str> {
    let needs_quotes = field.contains([',', '"']) || field.starts_with([' ', '\t']) || field.ends_with([' ', '\t']);
    if needs_quotes { format!("\"{}\"", field.replace('"', "\"\"")).into() } else { field.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn split(line: &str) -> Result<Vec<String>, BadQuote> {
        let mut fields = Fields::default();
        // Anything left over from another line must not show.
        fields.split(b"\"left\",over")?;
        fields.split(line.as_bytes())?;
        Ok((0..fields.len())
            .map(|k| String::from_utf8(fields.get(line.as_bytes(), k).to_vec()).expect("text"))
            .collect())
    }

    #[test]
    fn commas_spaces_and_quotes() {
        assert_eq!(split("a, 1.5 ,,\t2").expect("fields"), ["a", "1.5", "", "2"]);
        assert_eq!(split("").expect("fields"), [""]);
        assert_eq!(split(r#""a, ""b"" ", 1 ,"" ,c"d"#).expect("fields"), [r#"a, "b" "#, "1", "", "c\"d"]);
        assert_eq!(split(r#""a"#), Err(BadQuote));
        assert_eq!(split(r#"1,"a"b,2"#), Err(BadQuote));
        assert_eq!(split(r#""a"""#), Err(BadQuote));
    }

    proptest! {
        #[test]
        fn what_the_csv_crate_writes_is_read_back(row in prop::collection::vec("[ -~äé]{0,12}", 1..6), always: bool) {
            let style = if always { csv::QuoteStyle::Always } else { csv::QuoteStyle::Necessary };
            let mut writer = csv::WriterBuilder::new().quote_style(style).from_writer(Vec::new());
            writer.write_record(&row).expect("in memory");
            let line = String::from_utf8(writer.into_inner().expect("in memory")).expect("text");
            let read = split(line.trim_end_matches('\n')).expect("fields");
            if always {
                prop_assert_eq!(&read, &row);
            }
            // Where it does not quote for spaces at the ends, they do not count here.
            prop_assert!(read.iter().map(|field| field.trim()).eq(row.iter().map(|field| field.trim())));
        }

        #[test]
        fn what_is_quoted_here_is_read_here_and_by_the_csv_crate(row in prop::collection::vec("[ -~\tä]{0,12}", 2..6)) {
            let line = row.iter().map(|field| quoted_where_needed(field)).collect::<Vec<_>>().join(",");
            prop_assert_eq!(&split(&line).expect("fields"), &row);
            let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line.as_bytes());
            let record = reader.records().next().expect("one record").expect("valid");
            prop_assert!(record.iter().eq(&row));
        }
    }
}
