//! Every limit on what a bag may say of itself. Memory and time stay within them whatever the bytes claim.

/// Bytes. Longest `metadata.yaml`.
/// Budgeted: a kilobyte a topic and file, and some ten thousand of these.
pub(crate) const MAX_METADATA_BYTES: u64 = 16 << 20;

/// Nodes of `metadata.yaml` with every alias (`*name`) expanded.
/// Budgeted: some ten a topic and file, of 16 MiB without aliases.
pub(crate) const MAX_YAML_NODES: u64 = 1 << 20;

/// Bytes. Largest chunk or message, compressed or not; records beyond are left out.
/// Budgeted: recorders close a chunk at 768 KiB (rosbag2) or 1 MiB (MCAP's writers); a larger one holds one
/// message, and the largest of those are point clouds and raw images of some 100 MB.
pub(crate) const MAX_CHUNK_BYTES: u64 = 256 << 20;

/// Decompressed over compressed bytes of a file, beyond [`MIN_EXPANDED_BYTES`].
/// Budgeted: logs of wheels and poses compress 3 to 20 times; an image of one colour 1000 times.
pub(crate) const MAX_EXPANSION: u64 = 1000;

/// Bytes. A file may become so large by decompression whatever its own size.
/// Budgeted: a second or two of decompression.
pub(crate) const MIN_EXPANDED_BYTES: u64 = 1 << 30;

/// Bytes. All schemas and channels of a file together; those beyond are left out.
/// Budgeted: some ten kilobytes a topic, of some thousand topics.
pub(crate) const MAX_DECLARED_BYTES: usize = 64 << 20;

/// Places of a file at which records no longer follow each other; what stands behind the last is left out.
/// Budgeted: at each, the rest of the file may be read once more.
pub(crate) const MAX_BREAKS: usize = 100;

/// Bytes. Longest message that is decoded.
/// Budgeted: wheels and poses take some hundred bytes, the frames of a large robot some 10 kB.
pub(crate) const MAX_MESSAGE_BYTES: usize = 4 << 20;

/// Numbers, texts, lists and messages in one decoded message.
/// Budgeted: a scan of a laser has some ten thousand; decoded, a value takes up to 100 bytes.
pub(crate) const MAX_VALUES: usize = 1 << 20;

/// Levels of types inside of types; a type that holds itself would go on for ever.
/// Budgeted: standard messages reach 6.
pub(crate) const MAX_DEPTH: usize = 32;

/// Transforms in a chain of frames; a ring would go on for ever.
/// Budgeted: an arm of ten joints on a mast on a base.
pub(crate) const MAX_CHAIN: usize = 32;

/// Seconds. Longest step between two transforms of the wheels' odometry in which a pose lies.
/// Budgeted: five messages at 10 Hz, the slowest in use.
pub(crate) const MAX_FRAME_GAP_S: f64 = 0.5;

/// Smallest share of the wheels' stamps at which a transform that moves with them has its own.
/// Budgeted: a tenth of the messages may be lost.
pub(crate) const MIN_SHARED_STAMPS: f64 = 0.9;

/// Types in one definition.
/// Budgeted: the largest in use hold some dozens.
pub(crate) const MAX_TYPES: usize = 1000;

/// Fields of one type.
/// Budgeted: the largest in use hold some dozens.
pub(crate) const MAX_FIELDS: usize = 1000;

/// Bytes. Longest file of a type's definition, as `--msg` takes it.
/// Budgeted: a kilobyte is usual.
pub(crate) const MAX_DEFINITION_BYTES: u64 = 1 << 20;

/// Faults of a file that are told one by one; more are counted.
/// Convention: a screen holds them.
pub(crate) const MAX_REPORTED: usize = 5;

/// Pairs of points of a scan through which lines are tried.
/// Derived: a wall of a fifth of the points is hit by both points of one of 150 pairs but once in
/// (1 − 0.2²)^−150, 450 scans.
pub(crate) const WALL_PAIRS: u32 = 150;

/// Metres. Distance from a wall's line within which points are of it.
/// Budgeted: the noise of lidars for robots is 1 to 2 cm, and walls are as straight as that.
pub(crate) const WALL_TOLERANCE_M: f64 = 0.05;

/// Standard deviations. The same by the points' own scatter.
/// Convention: three, which leaves out 0.3 % of sound points.
pub(crate) const WALL_TOLERANCE_SIGMAS: f64 = 3.0;

/// Metres. The same at the least.
/// Budgeted: a few steps of a range's last digit.
pub(crate) const MIN_WALL_TOLERANCE_M: f64 = 0.005;

/// Fits of a wall, each to the points near the one before.
/// Budgeted: the points hardly change after the second.
pub(crate) const WALL_REFITS: usize = 4;

/// Metres. Shortest distance of two points, or from the lidar to a wall, at which a line is defined.
/// Budgeted: several times the noise of a range.
pub(crate) const MIN_PAIR_M: f64 = 0.2;

/// Metres. Shortest piece of a wall.
/// Budgeted: longer than boxes, legs and doors; at 1 cm and 50 points its heading is good to 5 mrad.
pub(crate) const MIN_WALL_LENGTH_M: f64 = 1.0;

/// Metres. Longest gap between two points of a wall.
/// Budgeted: beams of 1° on a wall 1 m away are so far apart at 5 m.
pub(crate) const MAX_WALL_GAP_M: f64 = 0.5;

/// Fewest beams of a wall.
/// Budgeted: an error bar of residuals is then good to 1/√(2·20), 16 %.
pub(crate) const MIN_WALL_BEAMS: usize = 20;

/// Smallest share of a scan's ranges that a wall takes.
/// Budgeted: a piece of 1 m is seen within 10 % of a turn from 1.5 m away.
pub(crate) const MIN_WALL_SHARE: f64 = 0.1;

/// Walls of a scan.
/// Budgeted: a room has four, and one of them is far.
pub(crate) const MAX_WALLS_PER_SCAN: usize = 3;

/// Metres. Least standard deviation of a distance.
/// Budgeted: the last digit of most drivers.
pub(crate) const MIN_WALL_SIGMA_M: f64 = 1e-3;

/// Radians. Least standard deviation of a heading.
/// Derived: beams turn by ω t in the scan; a wheelbase that is 5 % wrong leaves 5 % of it, over the quarter
/// of a scan that a wall takes, at 1 rad/s and 10 Hz 1 mrad from end to end, of which the slope has half.
pub(crate) const MIN_WALL_SIGMA_RAD: f64 = 5e-4;

/// Radians. By how much a wall's heading may be off from what the wheels predict from the last scan of it.
/// Budgeted: ten standard deviations of a short wall.
pub(crate) const WALL_HEADING_TOLERANCE_RAD: f64 = 0.05;

/// The same as a share of the turn since then.
/// Budgeted: twice the error of a nominal wheelbase that nobody measured.
pub(crate) const WALL_TURN_SHARE: f64 = 0.1;

/// Radians. The same at the most: a wall that was hidden for longer counts as another one.
/// Budgeted: walls of a room are 90° apart; a third of that.
pub(crate) const MAX_WALL_HEADING_TOLERANCE_RAD: f64 = 0.5;

/// Metres. By how much a wall's distance may be off from the prediction.
/// Budgeted: ten standard deviations, and less than furniture is deep.
pub(crate) const WALL_DISTANCE_TOLERANCE_M: f64 = 0.1;

/// The same as a share of the distance driven since then.
/// Budgeted: as that of turns.
pub(crate) const WALL_DRIVE_SHARE: f64 = 0.1;

/// Metres. How far from the drive's centre a lidar of unknown place may stand.
/// Budgeted: at the front of a robot of 0.8 m.
pub(crate) const MAX_LIDAR_LEVER_M: f64 = 0.4;

/// How many times as far off the next best wall must be for a line to be of the best.
/// Tuned: by hand, on simulated rooms.
pub(crate) const MIN_WALL_DISCRIMINATION: f64 = 3.0;

/// Fewest readings of a wall in a run; with fewer it is left out.
/// Budgeted: a second at 10 Hz; two determine the wall itself.
pub(crate) const MIN_WALL_READINGS: usize = 10;

/// Walls of a run, those with the most readings.
/// Budgeted: each adds two numbers to the state of the estimator, whose time grows with their square.
pub(crate) const MAX_WALLS_PER_RUN: usize = 8;
