//! Every number that decides something about a fleet: unit, meaning and source.

/// Share of false ones among the changes that are called significant, and among the robots whose excess drift
/// is called distinguishable from zero.
/// Convention: one in twenty.
pub const DEFAULT_FALSE_DISCOVERY_RATE: f64 = 0.05;

/// Relative step of the central differences of a path's end by the geometry.
/// Derived: truncation of order h², 1e-8, of a smooth function.
pub(crate) const DIFFERENCE_STEP: f64 = 1e-4;

/// Standard deviations of the predicted excess drift below which a robot may lie that is not distinguishable
/// from zero.
/// Convention: about 95 % of a normal distribution.
pub(crate) const DETECTION_SIGMAS: f64 = 2.0;
