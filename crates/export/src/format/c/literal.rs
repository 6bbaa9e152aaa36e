//! Numbers as C text.

/// A number that reads back as it is; its exponent makes it a double.
pub(super) fn exact(value: f64) -> String {
    format!("{value:e}")
}
