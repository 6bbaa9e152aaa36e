//! Words in the names of columns, in English and German.

/// The robot's own estimate.
pub(crate) const OWN: &[&str] =
    &["odom", "odometry", "odo", "est", "estimate", "estimated", "dr", "reckoned", "ekf", "fused", "filtered"];
/// An outside instrument's.
pub(crate) const OUTSIDE: &[&str] = &[
    "gt",
    "truth",
    "true",
    "ground",
    "groundtruth",
    "ref",
    "reference",
    "mocap",
    "vicon",
    "optitrack",
    "qualisys",
    "cam",
    "camera",
    "slam",
    "amcl",
    "map",
    "tag",
    "apriltag",
    "laser",
    "lidar",
    "tracker",
    "actual",
    "world",
];
/// No quantity that is read.
pub(crate) const NEVER: &[&str] = &[
    "cmd",
    "command",
    "commanded",
    "set",
    "setpoint",
    "target",
    "desired",
    "des",
    "goal",
    "soll",
    "acc",
    "accel",
    "acceleration",
    "imu",
    "mag",
    "gyro",
    "cov",
    "covariance",
    "sigma",
    "std",
    "var",
    "battery",
    "voltage",
    "current",
    "temp",
    "temperature",
    "pwm",
    "duty",
    "err",
    "error",
    "status",
    "frame",
    "seq",
    "torque",
    "offset",
    "dt",
];
/// What an Imu measures besides rates, and what is said of its rates.
pub(crate) const OTHER_THAN_RATES: &[&str] = &[
    "acc",
    "accel",
    "acceleration",
    "mag",
    "orientation",
    "cov",
    "covariance",
    "temp",
    "temperature",
    "sigma",
    "std",
    "var",
    "bias",
    "offset",
    "raw",
    "t",
    "time",
    "stamp",
    "timestamp",
    "sec",
    "secs",
    "seq",
    "frame",
];
/// A time.
pub(crate) const TIME: &[&str] = &[
    "t",
    "time",
    "timestamp",
    "stamp",
    "ts",
    "zeit",
    "zeitstempel",
    "clock",
    "uhrzeit",
    "epoch",
    "elapsed",
    "sec",
    "secs",
    "seconds",
    "millis",
    "micros",
    "nanos",
];
/// A run.
pub(crate) const RUN: &[&str] =
    &["run", "runs", "trial", "lauf", "versuch", "experiment", "lap", "segment", "session", "episode", "bag", "fahrt"];
/// Stand with words of a run.
pub(crate) const NUMBERED: &[&str] = &["id", "no", "nr", "number", "index", "name", "num"];
/// The left side.
pub(crate) const LEFT: &[&str] = &["left", "l", "lft", "links", "linkes", "linker", "li", "lw", "lh"];
/// The right side.
pub(crate) const RIGHT: &[&str] = &["right", "r", "rgt", "rechts", "rechtes", "rechter", "re", "rw", "rh"];
/// Counts.
pub(crate) const COUNTED: &[&str] = &[
    "enc",
    "encoder",
    "encoders",
    "tick",
    "ticks",
    "count",
    "counts",
    "cnt",
    "pulse",
    "pulses",
    "inkremente",
    "impulse",
    "n",
];
/// Rates.
pub(crate) const RATE: &[&str] =
    &["vel", "velocity", "speed", "v", "w", "omega", "rate", "rpm", "dot", "geschwindigkeit", "drehzahl", "twist"];
/// Further words that stand with a side: `lwheel`, `posl`.
pub(crate) const OF_WHEEL: &[&str] =
    &["wheel", "rad", "angle", "ang", "pos", "position", "phi", "theta", "motor", "mot", "m", "winkel"];
/// A heading.
pub(crate) const HEADING: &[&str] = &[
    "theta",
    "th",
    "yaw",
    "heading",
    "psi",
    "phi",
    "hdg",
    "azimuth",
    "gierwinkel",
    "winkel",
    "kurs",
    "richtung",
    "orientation",
    "angle",
    "rot",
    "bearing",
];
/// A forward speed.
pub(crate) const SPEED: &[&str] = &["v", "vx", "vel", "velocity", "speed", "linear", "lin", "geschwindigkeit"];
/// A yaw rate.
pub(crate) const YAW_RATE: &[&str] =
    &["omega", "w", "wz", "yawrate", "vth", "vtheta", "angular", "gierrate", "turnrate"];
/// A quaternion.
pub(crate) const OF_ROTATION: &[&str] = &["orientation", "quat", "quaternion", "q", "rot", "rotation"];
