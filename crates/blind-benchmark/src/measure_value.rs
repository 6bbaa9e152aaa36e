//! A measure with its value, its limit and its bar.

use super::power::{limits, two_sided};

/// One measure against its bar.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Measure {
    /// A word for scripts.
    pub id: &'static str,
    /// What is measured, for people.
    pub what: &'static str,
    /// The value; `None` where no case tells.
    pub value: Option<f64>,
    /// Its one-sided 95 % limit on the side of the bar.
    pub limit: Option<f64>,
    /// Two-sided 95 % interval of a share (Clopper–Pearson); `None` of what is no share.
    pub interval: Option<[f64; 2]>,
    /// How many of them, of a share.
    pub count: Option<usize>,
    /// Over how many cases or findings.
    pub of: usize,
    /// The bar.
    pub bar: f64,
    /// Whether the limit must not be above the bar, or not below.
    pub at_most: bool,
    /// Whether the limit clears the bar; `None` for measures that are shown only.
    pub met: Option<bool>,
}

/// Hits among cases.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Counted {
    pub(crate) hits: usize,
    pub(crate) of: usize,
}

/// A share of so many.
pub(crate) fn share(id: &'static str, what: &'static str, counted: Counted, bar: f64, at_most: bool) -> Measure {
    let Counted { hits: k, of: n } = counted;
    let (low, high) = limits(k, n);
    let limit = if at_most { high } else { low };
    let value = (n > 0).then(|| k as f64 / n as f64);
    let met = if at_most { limit <= bar } else { limit >= bar };
    Measure {
        id,
        what,
        value,
        limit: value.map(|_| limit),
        interval: value.map(|_| two_sided(k, n).into()),
        count: Some(k),
        of: n,
        bar,
        at_most,
        met: value.map(|_| met),
    }
}
