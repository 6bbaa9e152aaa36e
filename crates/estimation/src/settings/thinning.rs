//! Numbers of thinning: at which spacing measurements are taken whose errors are autocorrelated.

/// Phases in which thinned measurements are taken.
/// Tuned: by hand; no record of what on.
pub(crate) const THINNING_PHASES: usize = 4;

/// Factor from one thinning to the next.
/// Convention: doubling.
pub(crate) const THINNING_FACTOR: f64 = 2.0;

/// Share of a measurement's interval by which the spacing may be short: instruments jitter.
/// Derived: half of an interval, so that jitter does not pass over the measurement that is due.
pub(crate) const SPACING_SLACK: f64 = 0.5;

/// Fewest measurements of a run, on average, that thinning leaves.
/// Derived: with fewer a run would be no more than its ends.
pub(crate) const MIN_MEASUREMENTS_PER_RUN: f64 = 1.0;
