//! Why a scenario is not one, and why its protocols do not fit into a budget.

use std::path::PathBuf;

use effects::EffectError;
use kinematics::GeometryError;

/// Why a scenario is not one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("{}: cannot read the scenario: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The text is not a scenario; the message carries line and column and lists the known words.
    #[error("{location}: {message}")]
    Toml {
        /// File, and line where it is known.
        location: String,
        /// What is wrong, in one line.
        message: String,
    },
    /// An effect's size is not physical.
    #[error("{location}: {source}")]
    Effect {
        /// The file.
        location: String,
        /// Which and why.
        source: EffectError,
    },
    /// The robot's nominal geometry is not physical.
    #[error("{location}: robot: {source}")]
    Geometry {
        /// The file.
        location: String,
        /// Which and why.
        source: GeometryError,
    },
    /// A value is outside its range.
    #[error("{location}: {key} is {value}; it must be {must_be}")]
    OutOfRange {
        /// The file.
        location: String,
        /// Dotted key.
        key: String,
        /// The offending value.
        value: f64,
        /// The range.
        must_be: &'static str,
    },
    /// Protocols that cannot be driven within the budget.
    #[error("{location}: {key} does not fit into the budget: {source}")]
    NoFit {
        /// The file.
        location: String,
        /// Dotted key of the protocols.
        key: String,
        /// Why.
        source: NoFit,
    },
    /// A sweep's axis or case names a key that the scenario does not have, or one that is not a number.
    #[error("{location}: {key}: {problem}")]
    Axis {
        /// The file.
        location: String,
        /// Which axis or case, with its dotted key.
        key: String,
        /// What is wrong with it.
        problem: String,
    },
}

/// Why protocols cannot be driven within a budget.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoFit {
    /// The room has no place to move.
    #[error("a side of {room_m} m leaves no room for a robot that needs {clearance_m} m of it")]
    Room {
        /// The side of the room, metres.
        room_m: f64,
        /// What the robot needs of it, metres.
        clearance_m: f64,
    },
    /// One run in each direction takes longer than there is.
    #[error("one run in each direction takes {needed_min:.1} min of {minutes} min")]
    Time {
        /// What the fewest runs take, minutes.
        needed_min: f64,
        /// The budget, minutes.
        minutes: f64,
    },
    /// One run in each direction goes farther than is allowed.
    #[error("one run in each direction makes {needed_m:.1} m of {metres} m")]
    Travel {
        /// What the fewest runs travel, metres.
        needed_m: f64,
        /// The budget, metres.
        metres: f64,
    },
    /// A validation path was asked for.
    #[error("a validation path cannot be shrunk: its legs are whole numbers of the distance between two readings")]
    ValidationPath,
}
