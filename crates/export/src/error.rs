//! Why nothing is exported: one variant a reason that a caller can act on.

use kinematics::GeometryError;
use robot_files::RobotFileError;

/// Why nothing is exported.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A value that every robot needs is not in the calibration.
    #[error("{place}: {parameter} has no value: {why}; drive what determines it (yair plan), then calibrate again")]
    NotDetermined {
        /// The calibration file.
        place: String,
        /// The parameter's key.
        parameter: &'static str,
        /// Why, by the calibration where it says so.
        why: String,
    },
    /// The method found nothing.
    #[error("{place}: method {method} has no result: {why}")]
    NoResult {
        /// The calibration file.
        place: String,
        /// The method.
        method: String,
        /// Its reason.
        why: String,
    },
    /// The value that is replaced is needed, and the file does not say it.
    #[error("{place}: it does not say the nominal {parameter}; give --dataset DIR with a dataset of the robot{or}")]
    NoNominal {
        /// The calibration file.
        place: String,
        /// The parameter's key.
        parameter: &'static str,
        /// What else would do; empty, or from its separator on.
        or: &'static str,
    },
    /// Nothing says how many counts a wheel turn has.
    #[error(
        "{place}: it does not say the counts of a wheel turn; give --dataset DIR with ticks_per_rev in its dataset.toml"
    )]
    NoTicks {
        /// The calibration file.
        place: String,
    },
    /// The dataset is of another robot.
    #[error("{place}: it is the calibration of another robot than the dataset's: {what}")]
    OtherRobot {
        /// The calibration file.
        place: String,
        /// What does not fit.
        what: String,
    },
    /// A covariance is made of the wheels' noise, and there is none.
    #[error(
        "{place}: it has no noise of the wheels, which a covariance is made of; yair calibrate --method joint fits it"
    )]
    NoNoise {
        /// The calibration file.
        place: String,
    },
    /// The noise is no standard deviation.
    #[error("{place}: a noise of {value}; expected a standard deviation, or no [methods.noise]")]
    BadNoise {
        /// The calibration file.
        place: String,
        /// What stands there.
        value: f64,
    },
    /// The format is a whole file.
    #[error("{format} is a file of its own, and is put into no other; give --out FILE")]
    OwnFile {
        /// The format.
        format: &'static str,
    },
    /// A robot's own file does not take the values.
    #[error("{file}: {source}")]
    NotInFile {
        /// The file.
        file: String,
        /// Why.
        source: RobotFileError,
    },
    /// The values are no drive.
    #[error("{place}: {source}")]
    NotADrive {
        /// The calibration file.
        place: String,
        /// Which value.
        source: GeometryError,
    },
    /// An option out of range.
    #[error("--{option} {value}: expected {expected}")]
    BadOption {
        /// The flag's name.
        option: &'static str,
        /// What was given.
        value: f64,
        /// What is accepted.
        expected: &'static str,
    },
}
