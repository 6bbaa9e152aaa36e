//! Why a file says nothing of a robot's wheels, or is not edited: one variant a reason that a user can act
//! on. The file's name stands before the message.

/// Why a file was not read or edited.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RobotFileError {
    /// The text is no YAML.
    #[error("no YAML: {why}")]
    NotYaml {
        /// What the parser says.
        why: String,
    },
    /// The text is no XML.
    #[error("no XML: {why}")]
    NotXml {
        /// What the parser says.
        why: String,
    },
    /// A URDF whose values ROS computes.
    #[error("it is a xacro, whose values ROS computes; write them out: xacro FILE > robot.urdf, and give robot.urdf")]
    Xacro,
    /// XML of something else.
    #[error("the XML is a <{root}>; expected the <robot> of a URDF")]
    NotARobot {
        /// Its first element.
        root: String,
    },
    /// The controller drives other wheels.
    #[error(
        "{controller} is a {type_name}; yair calibrates differential drives: two wheels, or sides, one wheel_separation apart"
    )]
    NotDifferential {
        /// The controller's node.
        controller: String,
        /// Its type.
        type_name: String,
    },
    /// No key of it is one of wheels.
    #[error(
        "it has no wheel_separation and no wheel_radius{found}; expected the parameters of a diff_drive_controller, a URDF, a dataset.toml, or a file that yair export writes"
    )]
    NoWheels {
        /// What it has; empty, or from its separator on.
        found: String,
    },
    /// Wheels of several controllers, with other values.
    #[error("it has the wheels of {names}; choose one by --controller NAME")]
    Several {
        /// The controllers.
        names: String,
    },
    /// No controller of that name has wheels.
    #[error("it has no wheels of a controller {name}; it has those of {names}")]
    UnknownController {
        /// The name that was asked for.
        name: String,
        /// Those that are there.
        names: String,
    },
    /// The value of a key is no number.
    #[error("{key}: {value:?} is no number; write the number itself")]
    NotANumber {
        /// The key.
        key: String,
        /// What stands there.
        value: String,
    },
    /// A length that is no robot's.
    #[error("{key}: {value} m is no robot's; metres are expected: {} for millimetres", value / 1e3)]
    NotMetres {
        /// The key.
        key: String,
        /// What stands there.
        value: f64,
    },
    /// A URDF without a pair of wheels.
    #[error(
        "no two joints of it are the wheels: expected continuous joints left and right, named after wheels or with a cylinder; {found}"
    )]
    NoWheelJoints {
        /// The joints that turn.
        found: String,
    },
    /// There is nothing where a value belongs.
    #[error("it has no place for {key}: {why}")]
    NoPlace {
        /// The key.
        key: String,
        /// Why.
        why: String,
    },
    /// The edited file would not say what was to be put in.
    #[error("{key} cannot be put in place here: it would be {found} and not {expected}; edit it by hand")]
    NotInPlace {
        /// What.
        key: &'static str,
        /// What the edited file says.
        found: String,
        /// What it is to say.
        expected: String,
    },
}
