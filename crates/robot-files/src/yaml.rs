//! Entries of a YAML text. The parser is asked event by event: nothing is copied where an alias stands, and
//! nothing recurses.

use std::ops::Range;

use yaml_rust2::Event;
use yaml_rust2::parser::Parser;
use yaml_rust2::scanner::{Marker, TScalarStyle};

use crate::entries::{Entry, Scalar, parts};
use crate::error::RobotFileError;

/// A mapping or a list that is open.
enum Open {
    Mapping {
        /// The key whose value comes next.
        key: Option<(String, Option<Range<usize>>)>,
    },
    /// `None` once something other than scalars was in it.
    List(Option<Vec<Scalar>>),
}

/// The keys with scalars and with lists of scalars, in the text's order.
pub(crate) fn entries(text: &str) -> Result<Vec<Entry>, RobotFileError> {
    let lines = line_starts(text);
    let mut parser = Parser::new_from_str(text);
    let mut open: Vec<Open> = Vec::new();
    let mut found = Vec::new();
    loop {
        let (event, marker) =
            parser.next_token().map_err(|error| RobotFileError::NotYaml { why: error.to_string() })?;
        match event {
            Event::StreamEnd => return Ok(found),
            Event::Scalar(value, style, ..) => {
                let span = (style == TScalarStyle::Plain).then(|| span(text, &lines, marker, &value)).flatten();
                take(&mut open, &mut found, Scalar { text: value, span });
            }
            Event::Alias(_) => take(&mut open, &mut found, Scalar { text: "*alias".to_owned(), span: None }),
            Event::SequenceStart(..) => open.push(Open::List(Some(Vec::new()))),
            Event::MappingStart(..) => open.push(Open::Mapping { key: None }),
            Event::SequenceEnd | Event::MappingEnd => {
                let closed = open.pop();
                let path = path(&open);
                match open.last_mut() {
                    Some(Open::Mapping { key: key @ None }) => *key = Some((String::new(), None)),
                    Some(Open::Mapping { key }) => {
                        let (_, span) = key.take().unwrap_or_default();
                        if let Some(Open::List(Some(values))) = closed {
                            found.push(Entry { path, key: span, values });
                        }
                    }
                    Some(Open::List(values)) => *values = None,
                    None => {}
                }
            }
            _ => {}
        }
    }
}

fn take(open: &mut [Open], found: &mut Vec<Entry>, scalar: Scalar) {
    let path = path(open);
    match open.last_mut() {
        Some(Open::Mapping { key: key @ None }) => *key = Some((scalar.text, scalar.span)),
        Some(Open::Mapping { key }) => {
            let (_, span) = key.take().unwrap_or_default();
            found.push(Entry { path, key: span, values: vec![scalar] });
        }
        Some(Open::List(Some(values))) => values.push(scalar),
        Some(Open::List(None)) | None => {}
    }
}

fn path(open: &[Open]) -> Vec<String> {
    let key = |of: &Open| match of {
        Open::Mapping { key: Some((key, _)) } => Some(key.clone()),
        _ => None,
    };
    open.iter().filter_map(key).flat_map(|key| parts(&key).collect::<Vec<_>>()).collect()
}

/// Where each line begins, as the parser counts them.
fn line_starts(text: &str) -> Vec<usize> {
    let bytes = text.as_bytes();
    let ends = |(at, byte): (usize, &u8)| match byte {
        b'\n' => Some(at + 1),
        b'\r' if bytes.get(at + 1) != Some(&b'\n') => Some(at + 1),
        _ => None,
    };
    std::iter::once(0).chain(bytes.iter().enumerate().filter_map(ends)).collect()
}

/// The bytes of a plain scalar; `None` where they are not what it says, as of one over two lines.
fn span(text: &str, lines: &[usize], marker: Marker, value: &str) -> Option<Range<usize>> {
    let line = text.get(*lines.get(marker.line().checked_sub(1)?)?..)?;
    let (column, _) = line.char_indices().nth(marker.col())?;
    let start = text.len() - line.len() + column;
    text.get(start..)?.starts_with(value).then(|| start..start + value.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_where_their_bytes_are() {
        let text = "# ä\r\n/**:\r\n  base.ros__parameters:\r\n    wheel_radius: 0.1 # m\r\n    names: [ \"a\", b ]\r\n    \
                    list:\r\n    - 1.0\r\n    - *x\r\n    é: {inner: 2}\r\n    deep: [[1], 2]\r\n";
        let text = text.replace("*x", "0.25");
        let found = entries(&text).expect("YAML");
        let shown: Vec<String> = found
            .iter()
            .map(|entry| {
                let of = |scalar: &Scalar| match &scalar.span {
                    Some(span) => text[span.clone()].to_owned(),
                    None => format!("?{}", scalar.text),
                };
                format!("{}={}", entry.path.join("."), entry.values.iter().map(of).collect::<Vec<_>>().join(","))
            })
            .collect();
        assert_eq!(
            shown,
            [
                "/**.base.ros__parameters.wheel_radius=0.1",
                "/**.base.ros__parameters.names=?a,b",
                "/**.base.ros__parameters.list=1.0,0.25",
                "/**.base.ros__parameters.é.inner=2",
            ]
        );
        let key = found[0].key.clone().expect("plain");
        assert_eq!(&text[key], "wheel_radius");
    }

    #[test]
    fn aliases_and_depth_cost_nothing() {
        let bomb = format!("a: &a [x]\n{}", "b: [*a, *a]\n".repeat(1000));
        assert_eq!(entries(&bomb).expect("YAML").len(), 1001);
        assert!(entries(&"[".repeat(100_000)).is_err());
        assert!(matches!(entries("a: [1\nb: }"), Err(RobotFileError::NotYaml { .. })));
        assert_eq!(entries("").expect("nothing"), []);
    }
}
