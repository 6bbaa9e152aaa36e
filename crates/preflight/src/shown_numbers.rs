//! Numbers as people read them.

/// A ratio as people read it. What is beyond all numbers, or below, has a bound.
pub(crate) fn times(ratio: f64) -> String {
    match ratio.abs() {
        size if size >= f64::MAX => "more than 1e308 times".to_owned(),
        size if size < f64::MIN_POSITIVE => "less than 1e-307 times".to_owned(),
        1e-2..1e5 => format!("{ratio:.3} times"),
        _ => format!("{ratio:.2e} times"),
    }
}

/// An instant, seconds, to a millisecond.
pub(crate) fn to_ms(t_s: f64) -> f64 {
    (1e3 * t_s).round() / 1e3
}
