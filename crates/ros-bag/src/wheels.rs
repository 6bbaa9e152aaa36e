//! Wheels from messages: counts, angles, speeds or a twist.

use crate::error::RosBagError;
use crate::topics::Topic;
use crate::value::Value;

/// What a pair of numbers of wheels is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WheelQuantity {
    /// Cumulative counts.
    Ticks,
    /// Cumulative angles, radians.
    Angles,
    /// Angular speeds, rad/s.
    AngularSpeeds,
    /// Speeds of the contacts, m/s.
    Speeds,
    /// Forward speed and yaw rate, m/s and rad/s.
    Twist,
}

impl WheelQuantity {
    /// What the flag may say.
    pub const ALL: [Self; 5] = [Self::Ticks, Self::Angles, Self::AngularSpeeds, Self::Speeds, Self::Twist];

    /// The name that flags and output use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ticks => "ticks",
            Self::Angles => "rad",
            Self::AngularSpeeds => "radps",
            Self::Speeds => "mps",
            Self::Twist => "twist",
        }
    }

    /// Does a value hold over an interval, rather than at an instant?
    pub(crate) const fn is_rate(self) -> bool {
        matches!(self, Self::AngularSpeeds | Self::Speeds | Self::Twist)
    }
}

/// What a user says of the wheels' fields.
#[derive(Debug, Clone, Default)]
pub struct WheelFields {
    /// Name of the left wheel's joint.
    pub left_joint: Option<String>,
    /// Name of the right wheel's joint.
    pub right_joint: Option<String>,
    /// Path of the left wheel's number; of the forward speed for a twist.
    pub left_field: Option<String>,
    /// Path of the right wheel's number; of the yaw rate for a twist.
    pub right_field: Option<String>,
    /// What these numbers are.
    pub quantity: Option<WheelQuantity>,
}

/// Types whose fields are known: type, left, right, quantity, width of the counters.
///
/// Reference: the definitions in turtlebot3_msgs, kobuki_ros_interfaces, irobot_create_msgs, nav_msgs and
/// geometry_msgs.
pub(crate) const WHEEL_TYPES: [(&str, &str, &str, WheelQuantity, Option<u8>); 6] = [
    ("turtlebot3_msgs/msg/SensorState", "left_encoder", "right_encoder", WheelQuantity::Ticks, None),
    ("kobuki_ros_interfaces/msg/SensorState", "left_encoder", "right_encoder", WheelQuantity::Ticks, Some(16)),
    ("irobot_create_msgs/msg/WheelTicks", "ticks_left", "ticks_right", WheelQuantity::Ticks, None),
    ("irobot_create_msgs/msg/WheelVels", "velocity_left", "velocity_right", WheelQuantity::AngularSpeeds, None),
    ("nav_msgs/msg/Odometry", "twist.twist.linear.x", "twist.twist.angular.z", WheelQuantity::Twist, None),
    ("geometry_msgs/msg/TwistStamped", "twist.linear.x", "twist.angular.z", WheelQuantity::Twist, None),
];

/// How wheels are read from a topic's messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum WheelReader {
    Fields { left: String, right: String, quantity: WheelQuantity },
    Joints { left: String, right: String },
    DynamicJoints { left: String, right: String },
}

/// Both wheels of one message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WheelReading {
    pub(crate) quantity: WheelQuantity,
    pub(crate) left: f64,
    pub(crate) right: f64,
}

/// The joints of the two wheels, where the robot's own files or their names tell.
pub(crate) fn wheel_joints(topic: &Topic) -> Option<(String, String)> {
    let side = |full: &str, letter: &str| {
        let of = |name: &&String| {
            let name = name.to_lowercase();
            name.contains(full) || name.split(|c: char| !c.is_alphanumeric()).any(|part| part == letter)
        };
        let named: Vec<&String> = topic.joints.iter().filter(of).collect();
        // Arms have left joints too.
        let wheels: Vec<&String> = named.iter().copied().filter(|name| name.to_lowercase().contains("wheel")).collect();
        match (&wheels[..], &named[..]) {
            ([wheel], _) | ([], [wheel]) => Some((*wheel).clone()),
            _ => None,
        }
    };
    let by_names = || Some((side("left", "l")?, side("right", "r")?)).filter(|(left, right)| left != right);
    topic.known_wheels.clone().or_else(by_names)
}

/// Is a topic's type one of joints?
pub(crate) fn has_joints(type_name: &str) -> bool {
    ["sensor_msgs/msg/JointState", "control_msgs/msg/DynamicJointState"].contains(&type_name)
}

impl WheelReader {
    /// The reader of a topic; and the width of its counters, where its type says that.
    pub(crate) fn new(topic: &Topic, fields: &WheelFields) -> Result<(Self, Option<u8>), RosBagError> {
        let refuse = |why: String| topic.unusable(why);
        match (&fields.left_field, &fields.right_field, fields.quantity) {
            (Some(left), Some(right), Some(quantity)) => {
                return Ok((Self::Fields { left: left.clone(), right: right.clone(), quantity }, None));
            }
            (None, None, None) => {}
            _ => return Err(refuse("--left-field, --right-field and --as belong together".to_owned())),
        }
        if has_joints(&topic.type_name) {
            let given = fields.left_joint.clone().zip(fields.right_joint.clone());
            let Some((left, right)) = given.or_else(|| wheel_joints(topic)) else {
                let joints = topic.joints.iter().cloned().collect::<Vec<_>>().join(", ");
                let why = format!(
                    "which joints are the wheels is not clear from their names ({joints}); say --left-joint NAME --right-joint NAME"
                );
                return Err(refuse(why));
            };
            let missing = [&left, &right].into_iter().find(|joint| !topic.joints.contains(*joint));
            if let Some(joint) = missing {
                let joints = topic.joints.iter().cloned().collect::<Vec<_>>().join(", ");
                return Err(refuse(format!("no joint {joint:?}; the joints are {joints}")));
            }
            let is_dynamic = topic.type_name != "sensor_msgs/msg/JointState";
            let reader = if is_dynamic { Self::DynamicJoints { left, right } } else { Self::Joints { left, right } };
            return Ok((reader, None));
        }
        let Some((_, left, right, quantity, bits)) = WHEEL_TYPES.iter().find(|(of, ..)| *of == topic.type_name) else {
            let numbers = match topic.numbers.join(", ") {
                none if none.is_empty() => String::new(),
                numbers => format!("; its numbers are {numbers}"),
            };
            let flags = "say --left-field PATH --right-field PATH --as ticks, rad, radps, mps or twist";
            return Err(refuse(format!("no type whose wheels are known here; {flags}{numbers}")));
        };
        let reader = Self::Fields { left: (*left).to_owned(), right: (*right).to_owned(), quantity: *quantity };
        Ok((reader, *bits))
    }

    /// Both wheels; none where a message is about something else, and an error where fields are missing.
    pub(crate) fn read(&self, message: &Value) -> Result<Option<WheelReading>, String> {
        match self {
            Self::Fields { left, right, quantity } => {
                let number = |path: &str| {
                    message.number(path).ok_or_else(|| {
                        format!("no number at {path:?}; there are {}", message.paths_of_numbers().join(", "))
                    })
                };
                Ok(Some(WheelReading { quantity: *quantity, left: number(left)?, right: number(right)? }))
            }
            Self::Joints { left, right } => {
                let names = message.texts("name");
                let index = |joint: &str| names.iter().position(|name| *name == joint);
                let (Some(left), Some(right)) = (index(left), index(right)) else { return Ok(None) };
                let both = |list: &str, quantity| {
                    let of = |index: usize| message.list(list).get(index)?.number("");
                    Some(WheelReading { quantity, left: of(left)?, right: of(right)? })
                };
                let angles = both("position", WheelQuantity::Angles);
                Ok(angles.or_else(|| both("velocity", WheelQuantity::AngularSpeeds)))
            }
            Self::DynamicJoints { left, right } => {
                let names = message.texts("joint_names");
                let of = |joint: &str, interface: &str| {
                    let values = message.list("interface_values").get(names.iter().position(|name| *name == joint)?)?;
                    let at = values.texts("interface_names").iter().position(|name| *name == interface)?;
                    values.list("values").get(at)?.number("")
                };
                let both = |interface: &str, quantity| {
                    Some(WheelReading { quantity, left: of(left, interface)?, right: of(right, interface)? })
                };
                let angles = both("position", WheelQuantity::Angles);
                Ok(angles.or_else(|| both("velocity", WheelQuantity::AngularSpeeds)))
            }
        }
    }

    /// What is read, for the user.
    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Fields { left, right, .. } => format!("fields {left} and {right}"),
            Self::Joints { left, right } | Self::DynamicJoints { left, right } => format!("joints {left} and {right}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use kinematics::Wheels;

    use super::*;
    use crate::topics::Survey;

    #[test]
    fn wheels_are_told_from_other_joints_by_their_names() {
        let of = |names: &[&str]| {
            let joints = names.iter().map(|name| (*name).to_owned()).collect();
            wheel_joints(&Topic { joints, ..Topic::default() })
        };
        let pair = |left: &str, right: &str| Some((left.to_owned(), right.to_owned()));
        assert_eq!(of(&["wheel_left_joint", "wheel_right_joint"]), pair("wheel_left_joint", "wheel_right_joint"));
        assert_eq!(of(&["left_arm", "left_wheel", "right_arm", "right_wheel"]), pair("left_wheel", "right_wheel"));
        assert_eq!(of(&["wheel_l", "wheel_r", "castor"]), pair("wheel_l", "wheel_r"));
        assert_eq!(of(&["front_left_wheel", "rear_left_wheel", "front_right_wheel", "rear_right_wheel"]), None);
        assert_eq!(of(&["a", "b"]), None);
        // The robot's own files come before names.
        let mut survey = Survey::default();
        for (name, joints) in [("/arm", ["left", "right"]), ("/base", ["m0", "m1"])] {
            let joints = joints.map(str::to_owned).into();
            survey.topics.insert(name.to_owned(), Topic { joints, ..Topic::default() });
        }
        survey.know_wheels(&Wheels { left: "m1".to_owned(), right: "m0".to_owned() });
        assert_eq!(wheel_joints(&survey.topics["/base"]), pair("m1", "m0"));
        assert_eq!(wheel_joints(&survey.topics["/arm"]), pair("left", "right"));
    }

    #[test]
    fn joints_without_positions_give_speeds_and_other_joints_nothing() {
        let text = |name: &str| Value::Text(name.to_owned());
        let message = |position: &[f64], names: [&str; 2]| {
            let list = |values: &[f64]| Value::List(values.iter().map(|value| Value::Float(*value)).collect());
            Value::Message(vec![
                ("name".to_owned(), Value::List(names.map(text).to_vec())),
                ("position".to_owned(), list(position)),
                ("velocity".to_owned(), list(&[3.0, 4.0])),
            ])
        };
        let reader = WheelReader::Joints { left: "l".to_owned(), right: "r".to_owned() };
        let read = |value: &Value| reader.read(value).expect("no fault");
        let reading = |quantity, left, right| Some(WheelReading { quantity, left, right });
        assert_eq!(read(&message(&[1.0, 2.0], ["r", "l"])), reading(WheelQuantity::Angles, 2.0, 1.0));
        assert_eq!(read(&message(&[], ["r", "l"])), reading(WheelQuantity::AngularSpeeds, 4.0, 3.0));
        assert_eq!(read(&message(&[1.0, 2.0], ["r", "arm"])), None);
    }

    #[test]
    fn dynamic_joints_are_found_by_the_names_of_joints_and_interfaces() {
        let texts = |names: &[&str]| Value::List(names.iter().map(|name| Value::Text((*name).to_owned())).collect());
        let interfaces = |names: &[&str], values: &[f64]| {
            let values = Value::List(values.iter().map(|value| Value::Float(*value)).collect());
            Value::Message(vec![("interface_names".to_owned(), texts(names)), ("values".to_owned(), values)])
        };
        let message = |right: Value| {
            Value::Message(vec![
                ("joint_names".to_owned(), texts(&["r", "l"])),
                (
                    "interface_values".to_owned(),
                    Value::List(vec![right, interfaces(&["velocity", "position"], &[5.0, 1.0])]),
                ),
            ])
        };
        let reader = WheelReader::DynamicJoints { left: "l".to_owned(), right: "r".to_owned() };
        let read = |right: Value| reader.read(&message(right)).expect("no fault");
        let reading = |quantity, left, right| Some(WheelReading { quantity, left, right });
        let angles = interfaces(&["position", "velocity"], &[2.0, 6.0]);
        assert_eq!(read(angles), reading(WheelQuantity::Angles, 1.0, 2.0));
        assert_eq!(read(interfaces(&["velocity"], &[6.0])), reading(WheelQuantity::AngularSpeeds, 5.0, 6.0));
        assert_eq!(read(interfaces(&["velocity"], &[])), None);
    }
}
