//! Every limit on the files that are read here: memory stays within them and the files' own sizes. Beside
//! them what every reader of a table must agree on.

/// Bytes. Longest line of any table, and longest object of a `.tuple` file.
/// Budgeted: ten numbers of 400 digits and an id fit; a binary file rarely gets this far.
pub(crate) const LINE_LIMIT_BYTES: usize = 64 * 1024;

/// Rows of one table of a dataset.
/// Budgeted: a month at 400 Hz; its columns take 24 GB.
pub(crate) const MAX_ROWS: usize = 1_000_000_000;

/// Counts. Largest count of a wheel, to either side of zero.
/// Budgeted: a counter of 10⁹ counts a second runs for two years; sums of a dozen counts stay within 64 bits.
pub(crate) const MAX_COUNT: u64 = 1 << 56;

/// Bytes. Longest `dataset.toml`; it bounds the number of runs, at 15 bytes each.
/// Budgeted: tens of thousands of runs with covariates; the parser takes up to a hundred times the
/// memory.
pub(crate) const MANIFEST_LIMIT_BYTES: u64 = 4 * 1024 * 1024;

/// Bytes. Largest file of `import csv` and `import tum`, which are held in memory as a whole.
/// Budgeted: ten million rows.
pub(crate) const FILE_LIMIT_BYTES: u64 = 1 << 30;

/// Lines of a file of settings beside a log of another format.
/// Budgeted: they have some dozens.
pub(crate) const SHORT_FILE_LINES: u64 = 1000;

/// Characters of a file's text that a message shows.
/// Convention: a message stays on one or two lines.
pub(crate) const SHOWN_CHARS: usize = 60;

/// Radians. Least range of a run's headings in which a lidar whose place on the robot is sought measures
/// distances. In a straight its yaw cannot be told from how obliquely the robot drives at the wall, by which
/// a distance is a length: calibrated so, wheels had biases of 0.07 % and intervals that covered 65 %.
/// Budgeted: the lever of the lidar swings by nearly its own length.
pub const MIN_LIDAR_TURN_RAD: f64 = 1.0;

/// Seconds. Rows that lie farther apart on average are not stamped in seconds.
/// Convention: wheels are logged at 1 Hz or more.
pub const MAX_ROW_S: f64 = 4.0;

/// Most decimals of recorded rates that count as rounded.
/// Budgeted: 10 µm/s for a minute displace a robot by a fraction of a millimetre.
pub(crate) const MAX_DECIMALS: i32 = 5;

/// How far a rounded rate, in its steps, is from a whole number.
/// Budgeted: files say six digits of a number, and single precision has seven.
pub(crate) const DECIMAL_TOLERANCE: f64 = 1e-3;

/// Distinct values of the rates of a run from which on their decimals are those of rounding.
/// Budgeted: robots are told to drive at some round speeds, and speed up through many.
pub(crate) const MIN_DISTINCT_RATES: usize = 8;

/// Counts that the rounding of a rate is at the most, for the nearest to be the right one.
/// Derived: half of it is halfway to the next.
pub(crate) const MAX_ROUNDED_COUNTS: f64 = 0.25;

/// Counts by which a rate is off a whole number beside its rounding at the most.
/// Budgeted: periods are known to some 1e-4, of a hundred counts.
pub(crate) const COUNT_TOLERANCE: f64 = 0.02;

/// The same as a share of the counts.
/// Budgeted: twice what periods are known to.
pub(crate) const COUNT_TOLERANCE_RATIO: f64 = 2e-4;

/// The same of few counts.
/// Budgeted: stamps that jitter by half a period leave as much of a hundred rows; numbers of counts that are
/// taken for each other, 1000 and 1024, differ by five times as much.
pub(crate) const MIN_COUNT_TOLERANCE: f64 = 5e-3;

/// What counts are taken to be off whole numbers by at the least.
/// Budgeted: periods are known to some 1e-4, of a count; of equal rates all are off by as much.
pub(crate) const MIN_COUNT_ERROR: f64 = 1e-4;

/// Share of the rows in which a wheel turns that are made of counts at the least.
/// Budgeted: rows at the ends of gaps have times of their own.
pub(crate) const MIN_COUNTED_SHARE: f64 = 0.98;

/// Probability at the most that rates which are not made of counts are within their rounding of such.
/// Budgeted: one log in 1e12.
pub(crate) const MAX_CHANCE_OF_COUNTS: f64 = 1e-12;

/// Counts of a counter that are told from others by a number of double precision, and of any log.
/// Derived: a number of 1e12 has steps of 1e-4, far below the tolerance.
pub(crate) const MAX_COUNTS: f64 = 1e12;

/// Largest number of a document that is read back: calibrations, kept results, states and baselines.
/// Derived: its fourth power, of a Monte-Carlo error, times that of a count is a double.
pub(crate) const LARGEST_NUMBER: f64 = 1e60;

/// Smallest number above zero there.
/// Derived: quotients with the largest one, and their squares, are doubles.
pub(crate) const SMALLEST_POSITIVE: f64 = 1e-60;

/// Lengths of quaternions that are rotations: rounded ones are 1 to within some 1e-3.
/// Budgeted: messages that were never filled have 0, and a component that was overwritten is rarely near.
pub(crate) const QUATERNION_LENGTH: std::ops::RangeInclusive<f64> = 0.5..=2.0;
