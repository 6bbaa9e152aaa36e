//! Values of a text with the bytes that they stand in.

use std::ops::Range;

/// A value as it is written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scalar {
    pub(crate) text: String,
    /// Its bytes; `None` where it is quoted, an alias, or goes over several lines.
    pub(crate) span: Option<Range<usize>>,
}

impl Scalar {
    /// The number that is written there.
    pub(crate) fn number(&self) -> Option<f64> {
        self.text.trim().parse::<f64>().ok().filter(|number| number.is_finite())
    }
}

/// A key with its value, or with its list of values.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Entry {
    /// Keys from the outermost on; a key with dots is several.
    pub(crate) path: Vec<String>,
    /// The bytes of the last key; `None` where it is quoted.
    pub(crate) key: Option<Range<usize>>,
    pub(crate) values: Vec<Scalar>,
}

impl Entry {
    /// The keys around the last `count` ones; `None` where these are others.
    pub(crate) fn before(&self, last: &[&str]) -> Option<&[String]> {
        let at = self.path.len().checked_sub(last.len())?;
        (self.path[at..].iter().zip(last).all(|(key, of)| key == of)).then(|| &self.path[..at])
    }
}

/// The value of a key under a prefix.
pub(crate) fn find<'a>(entries: &'a [Entry], prefix: &[String], last: &[&str]) -> Option<&'a Entry> {
    entries.iter().find(|entry| entry.before(last) == Some(prefix))
}

/// A key's parts.
pub(crate) fn parts(key: &str) -> impl Iterator<Item = String> + '_ {
    key.split('.').map(str::to_owned)
}
