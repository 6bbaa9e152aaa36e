//! Of the rounding of recorded rates.

/// Recorded rates whose errors are shared, at the most.
/// Budgeted: a pass each, which together take as long as some fits do.
pub(crate) const MAX_SHARED_RATES: usize = 96;

/// Median of the squares of standard normal numbers.
/// Derived: the square of the quantile at 0.75.
pub(crate) const MEDIAN_OF_NORMAL_SQUARES: f64 = 0.4549;
