//! The records of a dataset, as columns in memory: SI units, one [`Run`] a run.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::checked::{Positive, checked};
use crate::interval_means::interval_means;
use crate::map_distortion::MapDistortion;
use crate::partial::{GyroNoise, GyroSample, HeadingReading, LidarExtrinsics, Revisit, TapeDistance, WallReading};
use crate::pose_covariance::PoseCovariance;
use crate::timestamps::Timestamps;
use crate::unknown_motion::{RestoredMotion, UnknownMotion, join, reach_into};
use jiff::Timestamp;
use kinematics::{DriveGeometry, GeometryError, Point, Wheels};
use serde::{Deserialize, Serialize};

/// One robot's measured runs and what is known of the robot beforehand.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// Name, licence and source, the robot's id and the session's instant; all optional.
    pub provenance: Provenance,
    /// Nominal values: what the robot believes today.
    pub robot: NominalRobot,
    /// Precision of the outside instrument, where it is known.
    pub truth_noise: TruthNoise,
    /// Marked points of the robot that `points.csv` speaks of.
    pub points: Vec<MarkedPoint>,
    /// The runs in the order in which `dataset.toml` lists them.
    pub runs: Vec<Run>,
}

impl Dataset {
    /// All but the runs.
    #[must_use]
    pub fn header(&self) -> Self {
        let Self { provenance, robot, truth_noise, points, runs: _ } = self;
        Self {
            provenance: provenance.clone(),
            robot: *robot,
            truth_noise: *truth_noise,
            points: points.clone(),
            runs: Vec::new(),
        }
    }
}

/// Where a dataset comes from.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Provenance {
    /// A name for people.
    pub name: Option<String>,
    /// Licence of the data.
    pub licence: Option<String>,
    /// Where the originals are.
    pub source: Option<String>,
    /// Anything else worth saying.
    pub notes: Option<String>,
    /// The robot's id: sessions with the same id are of one robot (`[robot] id`).
    pub robot_id: Option<String>,
    /// When the session was recorded.
    pub recorded: Option<Timestamp>,
}

/// Nominal geometry and encoder of the robot, metres: what its odometry uses today, and what a calibration
/// corrects.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NominalRobot {
    /// Nominal diameter of the left wheel, metres.
    #[serde(deserialize_with = "checked::<Positive, _>")]
    pub left_wheel_diameter_m: f64,
    /// Nominal diameter of the right wheel, metres.
    #[serde(deserialize_with = "checked::<Positive, _>")]
    pub right_wheel_diameter_m: f64,
    /// Nominal distance between the wheel contacts, metres.
    #[serde(deserialize_with = "checked::<Positive, _>")]
    pub wheel_separation_m: f64,
    /// Counts for one turn of a wheel, after decoding and gears; a real number. Absent when the robot reports
    /// no ticks.
    #[serde(default, deserialize_with = "checked::<Option<Positive>, _>", skip_serializing_if = "Option::is_none")]
    pub ticks_per_rev: Option<f64>,
    /// Width of the tick counter, when it wraps and is to be unwrapped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counter_bits: Option<u8>,
}

impl NominalRobot {
    /// The nominal drive.
    ///
    /// # Errors
    /// [`GeometryError`] when a length is not positive; a dataset that was read from files has been checked.
    pub fn geometry(&self) -> Result<DriveGeometry, GeometryError> {
        DriveGeometry::new(
            Wheels { left: self.left_wheel_diameter_m, right: self.right_wheel_diameter_m },
            self.wheel_separation_m,
        )
    }
}

/// One standard deviation of the outside instrument; `None` is unknown, and then estimated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TruthNoise {
    /// Of each position coordinate, metres.
    pub sigma_xy_m: Option<f64>,
    /// Of the heading, radians.
    pub sigma_theta_rad: Option<f64>,
    /// What the rows' own standard deviations and covariances are known up to.
    pub covariance_scale: CovarianceScale,
    /// The map in which its poses are; `None`: it has none, or nothing is known of its errors.
    pub map: Option<MapDistortion>,
    /// The gyroscope.
    pub gyro: GyroNoise,
    /// The sensor that sees the walls; `None`: their readings are of the drive's centre.
    pub lidar: Option<LidarExtrinsics>,
}

/// What standard deviations and covariances that rows of the truth state are known up to; it is estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CovarianceScale {
    /// One factor of positions and one of headings: two instruments' specifications.
    #[default]
    Separate,
    /// One factor of both, the variance of unit weight: covariances of one filter.
    Common,
}

impl CovarianceScale {
    pub(crate) fn is_separate(&self) -> bool {
        *self == Self::Separate
    }
}

/// A point marked on the robot, in the body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct MarkedPoint {
    /// The id that `points.csv` uses.
    pub id: String,
    /// Where it is on the robot.
    pub body: Point,
}

/// One run: what was driven, counted and seen.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Run {
    /// Id, protocol and covariates.
    pub info: RunInfo,
    /// What the robot counted.
    pub odometry: Odometry,
    /// Absolute poses or positions of the outside instrument (`truth.csv`).
    pub truth: Vec<TruthSample>,
    /// Precision of each truth sample, where the file gives it; as long as `truth`.
    pub truth_sigma: Option<Vec<TruthSigma>>,
    /// Headings without a position (`truth.csv`).
    pub headings: Vec<HeadingReading>,
    /// A gyroscope's rates by its own instants (`gyro.csv`).
    pub gyro: Vec<GyroSample>,
    /// Displacements between two instants (`displacement.csv`).
    pub displacements: Vec<Displacement>,
    /// Marked points read in the room (`points.csv`).
    pub point_readings: Vec<PointReading>,
    /// A tachometer's wheel speeds (`wheel_reference.csv`).
    pub wheel_reference: Vec<WheelSpeed>,
    /// Where the robot stood again, seen from where it had stood (`revisit.csv`).
    pub revisits: Vec<Revisit>,
    /// Distances between two places, by tape measure (`distance.csv`).
    pub distances: Vec<TapeDistance>,
    /// Distances from and headings along walls (`wall.csv`).
    pub walls: Vec<WallReading>,
    /// Spans over which the counts do not tell how the robot moved, in time order. No part of the format:
    /// who examines the records sets them, and nothing is compared across them.
    pub unknown_motion: Vec<UnknownMotion>,
    /// Spans over which counts were lost and are restored from the rows around, in time order. No part of the
    /// format either.
    pub restored_motion: Vec<RestoredMotion>,
    /// Distance that the robot had driven in the session before the run, metres; `None`: in the runs before
    /// it. No part of the format: who leaves runs or parts of them out sets it.
    pub session_m: Option<f64>,
    /// What the wheels' angles are ahead of the counters' readings by, radians: counters may be set back
    /// between runs, wheels keep their angles. No part of the format: readers set it
    /// ([`Dataset::carry_wheel_angles`]).
    pub wheels_ahead_rad: Wheels<f64>,
}

impl Run {
    /// The gyroscope's mean yaw rate over the interval that ends at each row of the odometry, rad/s, NaN
    /// where it is not known: from its own rates, else the column of the odometry; `None` without a
    /// gyroscope.
    #[must_use]
    pub fn gyro_rates(&self) -> Option<Cow<'_, [f64]>> {
        if self.gyro.is_empty() {
            return self.odometry.extra.get(&ExtraChannel::GyroYawRate).map(|column| Cow::Borrowed(&column[..]));
        }
        let rates: Vec<(f64, f64)> = self.gyro.iter().map(|of| (of.t_s, of.omega_radps)).collect();
        Some(Cow::Owned(interval_means(&rates, &self.odometry.t_s, |from_s, to_s| to_s - from_s)))
    }

    /// Does a gyroscope measure in it?
    #[must_use]
    pub fn has_gyro(&self) -> bool {
        !self.gyro.is_empty() || self.odometry.extra.contains_key(&ExtraChannel::GyroYawRate)
    }

    /// Do the counts leave open how the robot moved, somewhere between two instants?
    #[must_use]
    pub fn is_motion_unknown(&self, from_s: f64, to_s: f64) -> bool {
        reach_into(&self.unknown_motion, from_s, to_s)
    }

    /// The counts do not tell how the robot moved over some more spans.
    pub fn add_unknown_motion(&mut self, spans: impl IntoIterator<Item = UnknownMotion>) {
        self.unknown_motion.extend(spans);
        join(&mut self.unknown_motion);
    }
}

/// What is known of a run as a whole.
#[derive(Debug, Clone, PartialEq)]
pub struct RunInfo {
    /// Unique within the dataset.
    pub id: String,
    /// What was driven.
    pub protocol: Option<Protocol>,
    /// What the protocol says of itself.
    pub settings: ProtocolSettings,
    /// When the run began on the session's clock, seconds.
    pub start_s: Option<f64>,
    /// False when there are gaps inside: no wheel phase, no summing across rows.
    pub continuous: bool,
    /// Anything else that was measured of the run as a whole, by key with unit suffix (`payload_kg`).
    pub covariates: BTreeMap<String, f64>,
}

impl Default for RunInfo {
    fn default() -> Self {
        Self {
            id: String::new(),
            protocol: None,
            settings: ProtocolSettings::default(),
            start_s: None,
            continuous: true,
            covariates: BTreeMap::new(),
        }
    }
}

/// The kinds of run that protocols know.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Protocol {
    /// A straight line, forward or backward.
    Straight,
    /// A turn on the spot.
    Spin,
    /// A square driven clockwise.
    SquareCw,
    /// A square driven counter-clockwise.
    SquareCcw,
    /// A circle driven clockwise.
    CircleCw,
    /// A circle driven counter-clockwise.
    CircleCcw,
    /// A given path.
    Path,
    /// Anything.
    Free,
}

impl Protocol {
    /// The name that files use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Straight => "straight",
            Self::Spin => "spin",
            Self::SquareCw => "square_cw",
            Self::SquareCcw => "square_ccw",
            Self::CircleCw => "circle_cw",
            Self::CircleCcw => "circle_ccw",
            Self::Path => "path",
            Self::Free => "free",
        }
    }
}

/// What a protocol says of itself; never a covariate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ProtocolSettings {
    /// Side of a square, metres.
    pub side_m: Option<f64>,
    /// Radius of a circle, metres.
    pub radius_m: Option<f64>,
    /// Length of a straight, metres, negative backward.
    pub length_m: Option<f64>,
    /// Turn of a spin, radians, counter-clockwise.
    pub turn_rad: Option<f64>,
}

/// What the robot counted, as columns in time order: one row a reading, on the robot's clock.
#[derive(Debug, Clone, Default)]
pub struct Odometry {
    /// Seconds from the run's start, strictly increasing.
    pub t_s: Timestamps,
    /// The wheels.
    pub wheels: WheelLog,
    /// Further known columns, each as long as `t_s`; NaN where a channel that may have gaps has none.
    pub extra: BTreeMap<ExtraChannel, Vec<f64>>,
}

impl PartialEq for Odometry {
    /// Gaps are equal, though NaN stands for them.
    fn eq(&self, other: &Self) -> bool {
        let is_same = |(a, b): (&f64, &f64)| a == b || a.is_nan() && b.is_nan();
        let is_column = |a: &Vec<f64>, b: &Vec<f64>| a.len() == b.len() && a.iter().zip(b).all(is_same);
        self.t_s == other.t_s
            && self.wheels == other.wheels
            && self.extra.len() == other.extra.len()
            && self.extra.iter().zip(&other.extra).all(|(a, b)| a.0 == b.0 && is_column(a.1, b.1))
    }
}

/// The wheels' columns, each as long as [`Odometry::t_s`].
#[derive(Debug, Clone, PartialEq)]
pub enum WheelLog {
    /// Cumulative signed counts.
    Ticks(Wheels<Vec<i64>>),
    /// Cumulative wheel angles, radians.
    Angles(Wheels<Vec<f64>>),
    /// A robot that reports only the speeds of its wheels' contacts, by its nominal wheels, m/s. The value
    /// of a row holds over the interval that ends there.
    Speeds(Wheels<Vec<f64>>),
    /// A robot that reports only its twist. The value of a row holds over the interval that ends there.
    Twist {
        /// Forward speed, m/s.
        v_mps: Vec<f64>,
        /// Yaw rate, rad/s.
        omega_radps: Vec<f64>,
    },
}

impl Default for WheelLog {
    fn default() -> Self {
        Self::Ticks(Wheels::default())
    }
}

/// Columns beyond the wheels that a log may carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ExtraChannel {
    /// Commanded forward speed, m/s.
    CommandedSpeed,
    /// Commanded yaw rate, rad/s.
    CommandedYawRate,
    /// A gyroscope's yaw rate, rad/s: the mean over the interval that ends at the row.
    GyroYawRate,
}

impl ExtraChannel {
    /// All channels.
    pub const ALL: [Self; 3] = [Self::CommandedSpeed, Self::CommandedYawRate, Self::GyroYawRate];

    /// The column's name in `odometry.csv`.
    #[must_use]
    pub const fn column(self) -> &'static str {
        match self {
            Self::CommandedSpeed => "cmd_v_mps",
            Self::CommandedYawRate => "cmd_omega_radps",
            Self::GyroYawRate => "gyro_radps",
        }
    }

    /// Whether rows of a run may be without it (NaN): a sensor beside the wheels has gaps of its own.
    #[must_use]
    pub const fn may_have_gaps(self) -> bool {
        matches!(self, Self::GyroYawRate)
    }
}

/// Where the outside instrument saw the robot: the pose of what it sees (a marker, a sensor) in the room's
/// frame, x and y right-handed, heading counter-clockwise from x. 32 bytes.
#[derive(Debug, Clone, Copy)]
pub struct TruthSample {
    /// Seconds from the run's start.
    pub t_s: f64,
    /// In the room, metres.
    pub x_m: f64,
    /// In the room, metres.
    pub y_m: f64,
    theta_or_nan_rad: f64,
}

impl TruthSample {
    /// A sample; `theta_rad` is `None` when the instrument sees positions only.
    #[must_use]
    pub const fn new(t_s: f64, x_m: f64, y_m: f64, theta_rad: Option<f64>) -> Self {
        let theta_or_nan_rad = match theta_rad {
            Some(theta_rad) => theta_rad,
            None => f64::NAN,
        };
        Self { t_s, x_m, y_m, theta_or_nan_rad }
    }

    /// Heading in the room, radians, wrapped or not; `None` for position-only truth.
    #[must_use]
    pub const fn theta_rad(&self) -> Option<f64> {
        if self.theta_or_nan_rad.is_nan() { None } else { Some(self.theta_or_nan_rad) }
    }
}

impl PartialEq for TruthSample {
    /// Two samples without heading are equal where their positions are, though NaN stands for the heading.
    fn eq(&self, other: &Self) -> bool {
        (self.t_s, self.x_m, self.y_m, self.theta_rad()) == (other.t_s, other.x_m, other.y_m, other.theta_rad())
    }
}

/// How precise one truth sample is; `None` is unknown.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TruthSigma {
    /// One standard deviation of each position coordinate, metres.
    pub sigma_xy_m: Option<f64>,
    /// One standard deviation of the heading, radians.
    pub sigma_theta_rad: Option<f64>,
    /// The whole covariance; it comes before both standard deviations in what it states.
    pub covariance: Option<PoseCovariance>,
}

impl TruthSigma {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self { sigma_xy_m: None, sigma_theta_rad: None, covariance: None };
}

/// The instrument's pose at `t1_s` seen from its pose at `t0_s`, in the instrument's own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Displacement {
    /// Start, seconds from the run's start.
    pub t0_s: f64,
    /// End, seconds from the run's start.
    pub t1_s: f64,
    /// Along the instrument's x axis at `t0_s`, metres.
    pub dx_m: f64,
    /// Along the instrument's y axis at `t0_s`, metres.
    pub dy_m: f64,
    /// Turn, radians.
    pub dtheta_rad: f64,
}

/// Where a marked point stood in the room.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointReading {
    /// Seconds from the run's start.
    pub t_s: f64,
    /// Which point: index into [`Dataset::points`].
    pub point: usize,
    /// Where it was read in the room.
    pub room: Point,
}

/// A tachometer's reading of both wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WheelSpeed {
    /// Seconds from the run's start.
    pub t_s: f64,
    /// Ground speed of each wheel, m/s.
    pub speed_m_s: Wheels<f64>,
}
