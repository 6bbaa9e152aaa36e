//! Constants of the formats, each with its unit and source.

/// Rate of a controller's twists where none is given, hertz: `publish_rate` of ROS 2's diff_drive_controller.
pub(crate) const DEFAULT_RATE_HZ: f64 = 50.0;

/// Speed at which the covariance of a twist is stated where none is given, m/s: indoor robots cruise at 0.2
/// to 0.5 m/s; the covariance is in proportion, so that another speed is one multiplication.
pub(crate) const DEFAULT_SPEED_M_S: f64 = 0.25;

/// Travel after which the constant pose covariance is stated, metres: the distance of which the noise's own
/// unit, m/√m, speaks.
pub(crate) const POSE_TRAVEL_M: f64 = 1.0;

/// Variance of what wheels do not measure (height, roll, pitch), m² or rad²: the usual one of ROS drivers
/// for "unknown"; a filter in the plane ignores it.
pub(crate) const UNMEASURED_VARIANCE: f64 = 1e6;

/// Width of a counter that nobody states, bits: `int32_t`, as most drivers give it.
pub(crate) const DEFAULT_COUNTER_BITS: u8 = 32;

/// An inch, metres (by definition).
pub(crate) const INCH_M: f64 = 0.0254;

/// Counts of a turn this near to a whole number, relative, are it: the ratio of two written doubles rounds by
/// a few 1e-16, and no encoder has 10^9 counts a turn.
pub(crate) const WHOLE_COUNTS_TOLERANCE: f64 = 1e-9;

/// Nominal lengths of a dataset and of a calibration file differ beyond rounding from here on, relative: what
/// is written as a ratio comes back to a few 1e-16.
pub(crate) const SAME_NOMINAL_TOLERANCE: f64 = 1e-9;
