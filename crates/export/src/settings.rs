//! Constants of the formats: unit, meaning and source.

/// Hertz. Rate of a controller's twists where none is given.
/// Published: `publish_rate` of ROS 2's diff_drive_controller, 50.
pub(crate) const DEFAULT_RATE_HZ: f64 = 50.0;

/// Metres per second. Speed at which the covariance of a twist is stated where none is given.
/// Convention: that of the shipped scenarios; the covariance is in proportion to it.
pub(crate) const DEFAULT_SPEED_M_S: f64 = 0.25;

/// Metres. Travel after which the constant pose covariance is stated.
/// Convention: that of the noise's own unit, m/√m.
pub(crate) const POSE_TRAVEL_M: f64 = 1.0;

/// Square metres or radians. Variance of what wheels do not measure: height, roll, pitch.
/// Convention: that of ROS drivers for "unknown"; a filter in the plane ignores it.
pub(crate) const UNMEASURED_VARIANCE: f64 = 1e6;

/// Bits. Width of a counter that nobody states.
/// Convention: `int32_t`, as most drivers give it.
pub(crate) const DEFAULT_COUNTER_BITS: u8 = 32;

/// Metres in an inch.
/// Published: the international yard of 1959, exact.
pub(crate) const INCH_M: f64 = 0.0254;

/// Ratio. Counts of a turn this near to a whole number are it.
/// Derived: the ratio of two written doubles rounds by a few 1e-16; no encoder has 10⁹ counts a turn.
pub(crate) const WHOLE_COUNTS_TOLERANCE: f64 = 1e-9;

/// Ratio. Nominal lengths of a dataset and of a calibration file differ from here on.
/// Derived: what is written as a ratio comes back to a few 1e-16.
pub(crate) const SAME_NOMINAL_TOLERANCE: f64 = 1e-9;

/// Share. Lateness of a stamp that is kept from interval to interval on board.
/// Convention: a fading mean over 20 intervals, which leaves a sixth of white jitter, √(0.05/1.95).
pub(crate) const LATENESS_KEPT: f64 = 0.95;

/// Intervals. Number of past intervals whose mean is the period of the stamps on board.
/// Convention: two seconds at 50 Hz; the mean is known to a hundredth of the jitter.
pub(crate) const PERIOD_INTERVALS: f64 = 100.0;

/// Share of the period. An interval that is off by more is a pause and no jitter.
/// Convention: half; a row that is missing is off by one.
pub(crate) const MAX_JITTER_SHARE: f64 = 0.5;
