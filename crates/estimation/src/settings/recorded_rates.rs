//! Of the rounding of recorded rates.

/// Recorded rates whose errors are shared, at the most.
/// Budgeted: a pass each, which together take as long as some fits do.
pub(crate) const MAX_SHARED_RATES: usize = 96;
