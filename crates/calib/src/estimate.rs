//! What a calibration is: the trait of a method and the form of its result.

use std::borrow::Cow;

use dataset::{LANES, NominalRobot, NotNegative, Number, Replicates, Session, checked};
use kinematics::{DriveGeometry, GeometryError, Pose, Wheels};
use motion_programs::Schedule;
use nalgebra::{DMatrix, Matrix3};
use serde::{Deserialize, Serialize};

use estimation::{EstimationError, OneStep, WrappedCounter};

use crate::settings::{MAX_PLAUSIBLE_DIAMETER_RATIO, MAX_PLAUSIBLE_SEPARATION_RATIO, MAX_UNREMARKED_RATIO};

/// A quantity that calibration estimates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Parameter {
    /// Effective diameter of the left wheel, metres.
    LeftWheelDiameter,
    /// Effective diameter of the right wheel, metres.
    RightWheelDiameter,
    /// Effective distance between the wheel contacts, metres (`B`).
    WheelSeparation,
    /// Travel of the left wheel per tick, metres (`C_L`).
    LeftPerTick,
    /// Travel of the right wheel per tick, metres (`C_R`).
    RightPerTick,
    /// Position of the outside instrument on the robot: ahead of the drive's centre, metres.
    SensorX,
    /// Its position to the left of the drive's centre, metres.
    SensorY,
    /// Its heading on the robot, radians.
    SensorTheta,
    /// Latency of the outside instrument's time stamps, seconds.
    Latency,
    /// The factor common to both wheels; only ever not observable.
    CommonScale,
}

impl Parameter {
    /// The key in JSON and calibration files.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::LeftWheelDiameter => "left_wheel_diameter_m",
            Self::RightWheelDiameter => "right_wheel_diameter_m",
            Self::WheelSeparation => "wheel_separation_m",
            Self::LeftPerTick => "left_m_per_tick",
            Self::RightPerTick => "right_m_per_tick",
            Self::SensorX => "sensor_x_m",
            Self::SensorY => "sensor_y_m",
            Self::SensorTheta => "sensor_theta_rad",
            Self::Latency => "latency_s",
            Self::CommonScale => "common_scale",
        }
    }

    /// Every parameter of the drive that a result may carry a value of.
    pub const ESTIMATED: [Self; 5] = [
        Self::LeftWheelDiameter,
        Self::RightWheelDiameter,
        Self::WheelSeparation,
        Self::LeftPerTick,
        Self::RightPerTick,
    ];

    /// The lengths of a drive: left diameter, right diameter, separation.
    pub const LENGTHS: [Self; 3] = [Self::LeftWheelDiameter, Self::RightWheelDiameter, Self::WheelSeparation];

    /// The parameters of [`Extrinsics`], in the order of its covariance.
    pub const EXTRINSICS: [Self; 3] = [Self::SensorX, Self::SensorY, Self::SensorTheta];

    /// The parameters of an instrument: [`Self::EXTRINSICS`] and its latency.
    pub const INSTRUMENT: [Self; 4] = [Self::SensorX, Self::SensorY, Self::SensorTheta, Self::Latency];
}

/// A value with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Of what.
    pub parameter: Parameter,
    /// In SI units.
    pub value: f64,
    /// One standard deviation of the value's error, in its unit; `None` where the data show no scatter.
    pub sigma: Option<f64>,
}

/// Joint covariance of the drive's geometry, order: left diameter, right diameter, separation (m²).
pub type Covariance = DMatrix<f64>;

/// Extrinsics of the outside instrument, for methods that estimate them: its pose in the robot's frame,
/// metres and radians, with the covariance in the order x, y, θ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extrinsics {
    /// The instrument's frame on the robot.
    pub body_from_sensor: Pose,
    /// Covariance of x, y (m²) and heading (rad²), in this order; `None` when the data do not show a scatter.
    pub covariance: Option<Matrix3<f64>>,
}

/// The instrument of a session or a run that has extrinsics or a latency of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GroupInstrument {
    /// The session's name, and the run's id where each run has its own.
    pub of: String,
    /// Ahead of the drive's centre, metres; `None`, as the others, where it is common to all or not
    /// observable in these runs.
    #[serde(default, deserialize_with = "checked::<Option<Number>, _>")]
    pub sensor_x_m: Option<f64>,
    /// To the left of the drive's centre, metres.
    #[serde(default, deserialize_with = "checked::<Option<Number>, _>")]
    pub sensor_y_m: Option<f64>,
    /// Its heading on the robot, radians.
    #[serde(default, deserialize_with = "checked::<Option<Number>, _>")]
    pub sensor_theta_rad: Option<f64>,
    /// Latency of its time stamps, seconds.
    #[serde(default, deserialize_with = "checked::<Option<Number>, _>")]
    pub latency_s: Option<f64>,
}

impl GroupInstrument {
    /// An instrument without known values.
    pub(crate) fn new(of: &str) -> Self {
        Self { of: of.to_owned(), sensor_x_m: None, sensor_y_m: None, sensor_theta_rad: None, latency_s: None }
    }
}

/// Noise of the odometry, for methods that estimate it: variances grow with what was driven, not with time
/// (Chong & Kleeman 1997).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OdometryNoise {
    /// Of each wheel's travel: one standard deviation is this times the root of the travel, m/√m.
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub wheel_sigma_m_per_sqrt_m: f64,
    /// Of the heading beyond that of the wheels: this times the root of the turn, rad/√rad.
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub turn_sigma_rad_per_sqrt_rad: f64,
    /// It is what is usual of robots, and the standard deviations of what was estimated with it: the
    /// measurements are no more than what is fitted to them, so that they show no scatter.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_assumed: bool,
}

/// A parameter that the data do not determine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotObservable {
    /// Which.
    pub parameter: Parameter,
    /// Why, and what would show it.
    pub why: Cow<'static, str>,
}

/// A run that was left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rejected {
    /// The run's id.
    pub run: String,
    /// Why.
    pub why: String,
}

/// What a method found: effective diameters and separation in metres with their covariance (order left,
/// right, separation), and what was not found, with the reason. [`Self::estimate`] gives single values with
/// their standard deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The method's name.
    pub method: &'static str,
    /// The estimated geometry, for dead reckoning.
    pub geometry: DriveGeometry,
    /// Ticks of a wheel turn, when the robot reports ticks.
    pub ticks_per_rev: Option<f64>,
    /// Covariance of the geometry, m²; `None` when the data show no scatter (one run a direction, say).
    pub covariance: Option<Covariance>,
    /// Extrinsics of the outside instrument; `None` for methods that take it to be at the drive's centre.
    pub extrinsics: Option<Extrinsics>,
    /// Latency of the outside instrument's time stamps, seconds, with one standard deviation; `None` for
    /// methods that take it to be zero.
    pub latency_s: Option<(f64, Option<f64>)>,
    /// Extrinsics and latencies of sessions or runs that have their own; the two above are then their means.
    pub group_instruments: Vec<GroupInstrument>,
    /// What the fit saw beside the values, a sentence each: instruments that differ between sessions,
    /// distance that is lost in turns.
    pub seen: Vec<String>,
    /// Noise of the odometry; `None` for methods that do not estimate it.
    pub noise: Option<OdometryNoise>,
    /// What the data do not determine.
    pub not_observable: Vec<NotObservable>,
    /// How many runs the values rest on.
    pub runs_used: usize,
    /// What was left out, run by run and wheel by wheel.
    pub runs_rejected: Vec<Rejected>,
    /// How large datasets were calibrated; `None` where all runs were fitted as a whole.
    pub one_step: Option<OneStep>,
    /// False when an iteration stopped without a result; closed-form methods always converge.
    pub converged: bool,
}

impl Calibration {
    /// A converged result with nothing but its geometry; a method sets what else it knows:
    /// `Calibration { runs_used, covariance, ..Calibration::new(name, geometry, ticks_per_rev) }`.
    #[must_use]
    pub const fn new(method: &'static str, geometry: DriveGeometry, ticks_per_rev: Option<f64>) -> Self {
        Self {
            method,
            geometry,
            ticks_per_rev,
            covariance: None,
            extrinsics: None,
            latency_s: None,
            group_instruments: Vec::new(),
            seen: Vec::new(),
            noise: None,
            not_observable: Vec::new(),
            runs_used: 0,
            runs_rejected: Vec::new(),
            one_step: None,
            converged: true,
        }
    }

    /// The value of a parameter with its standard deviation; `None` when the method has no such parameter.
    #[must_use]
    pub fn estimate(&self, parameter: Parameter) -> Option<Estimate> {
        let diameter_m = self.geometry.wheel_diameter_m();
        let per_tick = || self.ticks_per_rev.map(|ticks| std::f64::consts::PI / ticks);
        let (row, value, factor) = match parameter {
            Parameter::LeftWheelDiameter => (0, diameter_m.left, 1.0),
            Parameter::RightWheelDiameter => (1, diameter_m.right, 1.0),
            Parameter::WheelSeparation => (2, self.geometry.wheel_separation_m(), 1.0),
            Parameter::LeftPerTick => (0, diameter_m.left, per_tick()?),
            Parameter::RightPerTick => (1, diameter_m.right, per_tick()?),
            Parameter::SensorX | Parameter::SensorY | Parameter::SensorTheta => return self.mounted(parameter),
            Parameter::Latency => {
                let (value, sigma) = self.latency_s?;
                return Some(Estimate { parameter, value, sigma });
            }
            Parameter::CommonScale => return None,
        };
        let sigma = self.covariance.as_ref().map(|covariance| covariance[(row, row)].sqrt() * factor);
        // A variance that the arithmetic could not hold tells nothing.
        let sigma = sigma.filter(|sigma| sigma.is_finite());
        Some(Estimate { parameter, value: value * factor, sigma })
    }

    fn mounted(&self, parameter: Parameter) -> Option<Estimate> {
        let extrinsics = self.extrinsics?;
        let row = Parameter::EXTRINSICS.iter().position(|of| *of == parameter)?;
        let Pose { x_m, y_m, theta_rad } = extrinsics.body_from_sensor;
        let sigma = extrinsics.covariance.map(|covariance| covariance[(row, row)].sqrt());
        let sigma = sigma.filter(|sigma| sigma.is_finite());
        Some(Estimate { parameter, value: [x_m, y_m, theta_rad][row], sigma })
    }

    /// Remarks on implausible values: calibration corrects per cents, and a factor is a fault of another
    /// kind.
    #[must_use]
    pub fn plausibility_warnings(&self, robot: &NominalRobot) -> Vec<String> {
        let remark = |(parameter, nominal): (Parameter, f64)| {
            let factor = self.estimate(parameter)?.value / nominal;
            let cause = "look for a wrong ticks_per_rev, a wrapping counter, swapped wheels or a unit";
            let times = if factor < 1e6 { format!("{factor:.3}") } else { "more than a million".to_owned() };
            let message = || format!("{} is {times} times its nominal value: {cause}", parameter.key());
            is_implausible(parameter, factor).then(message)
        };
        stated_lengths(robot).into_iter().filter_map(remark).collect()
    }

    /// Remarks on lengths that are far from the stated ones and may be right.
    #[must_use]
    pub fn remarks(&self, robot: &NominalRobot) -> Vec<String> {
        let remark = |(parameter, stated_m): (Parameter, f64)| {
            let is_open = self.not_observable.iter().any(|blind| blind.parameter == parameter);
            let factor = self.estimate(parameter)?.value / stated_m;
            let is_far = is_off(parameter, factor, [MAX_UNREMARKED_RATIO; 2]) && !is_implausible(parameter, factor);
            let readings = if parameter == Parameter::WheelSeparation {
                "either the stated one or the driver's formula is off (ω = (r − l)/2b makes a factor of 2), or the \
                 robot skids in turns, as four-wheeled and tracked robots do: then it is the right one for odometry"
            } else {
                "look for a radius, a gear or ticks_per_rev, and for tyres under load"
            };
            (is_far && !is_open).then(|| format!("{} is {factor:.3} times the stated one: {readings}", parameter.key()))
        };
        stated_lengths(robot).into_iter().filter_map(remark).chain(self.seen.clone()).collect()
    }

    /// Every value that the method has.
    pub fn estimates(&self) -> impl Iterator<Item = Estimate> + '_ {
        let all = Parameter::ESTIMATED.into_iter().chain(Parameter::EXTRINSICS);
        all.chain([Parameter::Latency]).filter_map(|parameter| self.estimate(parameter))
    }
}

/// The lengths that a robot states, metres.
fn stated_lengths(robot: &NominalRobot) -> [(Parameter, f64); 3] {
    [
        (Parameter::LeftWheelDiameter, robot.left_wheel_diameter_m),
        (Parameter::RightWheelDiameter, robot.right_wheel_diameter_m),
        (Parameter::WheelSeparation, robot.wheel_separation_m),
    ]
}

/// Whether a length is no correction of its nominal value, by the ratio of the two.
pub(crate) fn is_implausible(parameter: Parameter, ratio: f64) -> bool {
    is_off(parameter, ratio, [MAX_PLAUSIBLE_DIAMETER_RATIO, MAX_PLAUSIBLE_SEPARATION_RATIO])
}

/// Whether a ratio of lengths is beyond the most of diameters or of separations, to either side; what is no
/// number is.
pub(crate) fn is_off(parameter: Parameter, ratio: f64, [of_diameters, of_separations]: [f64; 2]) -> bool {
    let most = if parameter == Parameter::WheelSeparation { of_separations } else { of_diameters };
    !(1.0 / most..=most).contains(&ratio)
}

/// Why a method gives no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibError {
    /// The sessions do not hold what the method needs.
    #[error("{method} cannot be applied: {why}")]
    NotApplicable {
        /// The method.
        method: &'static str,
        /// What is missing and how to get it.
        why: String,
    },
    /// A parameter that the method must have is not determined by the runs.
    #[error("{method}: {} is not observable in these runs: {why}", parameter.key())]
    Unobservable {
        /// The method.
        method: &'static str,
        /// Which parameter.
        parameter: Parameter,
        /// What would show it.
        why: String,
    },
    /// The counters wrap at a width that the dataset does not state.
    #[error(transparent)]
    CounterWraps(WrappedCounter),
    /// The estimate is no drive.
    #[error("{method}: the estimate is not a drive: {source}")]
    NotADrive {
        /// The method.
        method: &'static str,
        /// Which value.
        source: GeometryError,
    },
}

impl CalibError {
    /// A method's reason where its maximum-likelihood fit gives none.
    pub(crate) fn of_fit(method: &'static str, error: EstimationError) -> Self {
        match error {
            EstimationError::NotADrive(source) => Self::NotADrive { method, source },
            EstimationError::CounterWraps(wrapped) => Self::CounterWraps(wrapped),
            other => Self::NotApplicable { method, why: other.to_string() },
        }
    }
}

/// A calibration method.
///
/// It sees borrowed sessions of one robot and nothing else: records, nominal values, stated precision of the
/// instrument. Everything is in SI units, poses in the room's frame (x, y metres, θ radians,
/// counter-clockwise). A method of your own works wherever one of [`crate::METHODS`] does in the library,
/// in a sweep too.
pub trait Method: Sync + Send {
    /// The name that commands and files use.
    fn name(&self) -> &'static str;

    /// One line for `--help` and tables: what it needs and what it gives.
    fn about(&self) -> &'static str;

    /// What to drive for this method, as its authors did.
    fn protocol(&self) -> Vec<Schedule>;

    /// Calibrates one robot from its sessions. Where sessions disagree about nominal values, the first one's
    /// are used.
    ///
    /// # Errors
    /// [`CalibError`] when the method does not apply to these sessions, with the reason.
    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError>;

    /// Calibrates the first `trials` of replicates, at most [`LANES`], each as [`Self::calibrate`] does.
    fn calibrate_replicates(&self, replicates: &Replicates, trials: usize) -> Vec<Result<Calibration, CalibError>> {
        let of_lanes = self.calibrate_lanes(replicates).into_iter().take(trials).enumerate();
        let alone = |lane| self.calibrate(&[replicates.dataset(lane).session()]);
        of_lanes.map(|(lane, found)| found.unwrap_or_else(|| alone(lane))).collect()
    }

    /// What a method finds that does its arithmetic for all lanes at once, to the bits of
    /// [`Self::calibrate`]; `None` in a lane that is to be calibrated by itself.
    fn calibrate_lanes(&self, _replicates: &Replicates) -> [Option<Result<Calibration, CalibError>>; LANES] {
        [const { None }; LANES]
    }
}

/// The nominal drive of the first session.
pub(crate) fn nominal(
    method: &'static str,
    sessions: &[Session<'_>],
) -> Result<(NominalRobot, DriveGeometry), CalibError> {
    let Some(first) = sessions.first() else {
        return Err(CalibError::NotApplicable { method, why: "there is no session".to_owned() });
    };
    let geometry = first.robot.geometry().map_err(|source| CalibError::NotADrive { method, source })?;
    Ok((*first.robot, geometry))
}

/// Covariance of diameters and separation (m²) from that of their relative changes, by row and column.
pub(crate) fn geometry_covariance(relative: impl Fn(usize, usize) -> f64, geometry_m: [f64; 3]) -> Covariance {
    Covariance::from_fn(3, 3, |row, column| relative(row, column) * geometry_m[row] * geometry_m[column])
}

/// A drive from its estimated geometry.
pub(crate) fn drive(
    method: &'static str,
    diameter_m: Wheels<f64>,
    separation_m: f64,
) -> Result<DriveGeometry, CalibError> {
    DriveGeometry::new(diameter_m, separation_m).map_err(|source| CalibError::NotADrive { method, source })
}
