//! Of the rounding of recorded rates.

/// Recorded rates whose errors are shared, at the most.
/// Budgeted: a pass each, which together take as long as some fits do.
pub(crate) const MAX_SHARED_RATES: usize = 96;

/// Steps of a recorded rate that one count of a wheel makes, from which on the noise of counts dithers
/// nothing.
/// Derived: an interval of rounding then has two numbers of counts at the most, and errors of their own.
pub(crate) const MIN_COUNT_STEPS: f64 = 0.5;
