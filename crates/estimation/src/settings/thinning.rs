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

/// Steps of the fit of thinned measurements after which their innovations are tested for the first time.
/// Budgeted: such a fit costs a quarter of one that converges, and the test does not depend on the noise's
/// scale.
pub(crate) const PRELIMINARY_THINNING_STEPS: usize = 3;

/// Autocorrelation of that fit's innovations, in standard errors, from which on they are not white for sure.
/// Budgeted: three times the level at which they count as white; nearer to that the fit converges first.
pub(crate) const CERTAINLY_CORRELATED_Z: f64 = 8.8;
