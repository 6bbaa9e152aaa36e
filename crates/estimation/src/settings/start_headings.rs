//! Start headings that are not measured.

/// Distance from the start, metres, over which a start heading that is not measured is found.
/// Derived: a centimetre of error over half a metre is a degree.
pub(crate) const START_HEADING_BASELINE_M: f64 = 0.5;

/// Step of a start heading, radians, below which it has converged.
/// Budgeted: headings follow a step to first order, so that the square of it, 1e-12 rad, is left.
pub(crate) const HEADING_STEP_TOLERANCE_RAD: f64 = 1e-6;

/// Information on a start heading that is not measured, 1/rad², below which it hardly moves.
/// Derived: of positions that say as little, errors bend the likelihood by three times the root of the
/// information I at the most, and a step by I + 2 or more does not overshoot then.
pub(crate) const START_HEADING_PRECISION: f64 = 2.0;
