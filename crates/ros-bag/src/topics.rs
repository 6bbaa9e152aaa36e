//! What a bag holds: its topics, and the fields by which two of them are chosen.

use std::collections::{BTreeMap, BTreeSet};

use kinematics::Wheels;

use crate::bag::Bag;
use crate::cdr;
use crate::definition::{Definitions, Wire};
use crate::error::RosBagError;
use crate::mcap_file::Channel;
use crate::static_frames::{self, StaticFrames};
use crate::transform;
use crate::value::Value;

/// Messages of a topic of transforms or joints in which names are looked for; a publisher that has not named
/// itself within so many is missed by `--list`, not by the import.
const LOOKED_AT: u64 = 2000;

/// A topic of a bag.
#[derive(Debug, Clone, Default)]
pub(crate) struct Topic {
    pub(crate) name: String,
    pub(crate) type_name: String,
    pub(crate) count: u64,
    pub(crate) first_ns: u64,
    pub(crate) last_ns: u64,
    /// Names of joints, where it holds joints.
    pub(crate) joints: BTreeSet<String>,
    /// Pairs of parent and child, where it holds transforms, with the number of transforms of each.
    pub(crate) frames: BTreeMap<(String, String), u64>,
    /// Paths of numbers in its first message, at most a dozen.
    pub(crate) numbers: Vec<String>,
    /// The joints that are the wheels by the robot's own files, where it holds them.
    pub(crate) known_wheels: Option<(String, String)>,
}

impl Topic {
    pub(crate) fn span_s(&self) -> f64 {
        self.last_ns.saturating_sub(self.first_ns) as f64 / 1e9
    }

    /// That it does not hold what it was to be used for.
    pub(crate) fn unusable(&self, why: String) -> RosBagError {
        RosBagError::Unusable { topic: self.name.clone(), type_name: self.type_name.clone(), why }
    }
}

/// All topics, by name, and what was lost.
#[derive(Default)]
pub(crate) struct Survey {
    pub(crate) topics: BTreeMap<String, Topic>,
    /// The transforms of `/tf_static`.
    pub(crate) mounted: StaticFrames,
    /// Topic and text of the robot's description.
    pub(crate) description: Option<(String, String)>,
    pub(crate) losses: Vec<String>,
}

/// Types of joints: the list of their names.
const JOINT_NAMES: [(&str, &str); 2] =
    [("sensor_msgs/msg/JointState", "name"), ("control_msgs/msg/DynamicJointState", "joint_names")];

/// How the topic of a URDF ends, under whatever name space.
const DESCRIPTION: &str = "robot_description";

/// Transforms.
pub(crate) const TRANSFORMS: &str = "tf2_msgs/msg/TFMessage";

impl Survey {
    pub(crate) fn of(bag: &Bag) -> Result<Self, RosBagError> {
        let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
        let mut decoders: BTreeMap<String, Option<Definitions>> = BTreeMap::new();
        let mut mounted = StaticFrames::default();
        let mut description = None;
        let losses = bag.visit(|channel, log_time_ns, message| {
            if !topics.contains_key(&channel.topic) {
                let topic = Topic {
                    name: channel.topic.clone(),
                    type_name: channel.type_name.clone(),
                    first_ns: log_time_ns,
                    last_ns: log_time_ns,
                    ..Topic::default()
                };
                topics.insert(channel.topic.clone(), topic);
            }
            let Some(topic) = topics.get_mut(&channel.topic) else { return Ok(()) };
            topic.count += 1;
            topic.first_ns = topic.first_ns.min(log_time_ns);
            topic.last_ns = topic.last_ns.max(log_time_ns);
            let is_first = topic.count == 1;
            let names = JOINT_NAMES.iter().find(|(of, _)| *of == channel.type_name).map(|(_, names)| *names);
            if is_first || topic.count <= LOOKED_AT && (names.is_some() || channel.type_name == TRANSFORMS) {
                if !decoders.contains_key(&channel.topic) {
                    decoders.insert(channel.topic.clone(), definitions(channel).ok());
                }
                let decoder = decoders.get(&channel.topic).and_then(Option::as_ref);
                if let Some(Ok(value)) = decoder.map(|definitions| cdr::decode(definitions, message)) {
                    note_names(topic, names, &value);
                    if channel.type_name == TRANSFORMS && static_frames::is_static(&channel.topic) {
                        mounted.take(&value);
                    }
                    if is_first {
                        if description.is_none() && channel.topic.ends_with(DESCRIPTION) {
                            description = value.text("data").map(|text| (channel.topic.clone(), text.to_owned()));
                        }
                        topic.numbers = value.paths_of_numbers();
                    }
                }
            }
            Ok(())
        })?;
        let losses = losses.lines();
        if topics.is_empty() {
            return Err(RosBagError::NoMessages { file: bag.path.clone(), why: losses.join("; ") });
        }
        Ok(Self { topics, mounted, description, losses })
    }

    /// Takes the joints of the wheels from the robot's own files, in topics that hold both.
    pub(crate) fn know_wheels(&mut self, Wheels { left, right }: &Wheels<String>) {
        let holds = |topic: &&mut Topic| topic.joints.contains(left) && topic.joints.contains(right);
        for topic in self.topics.values_mut().filter(holds) {
            topic.known_wheels = Some((left.clone(), right.clone()));
        }
    }

    /// The topic of a flag.
    pub(crate) fn named(&self, flag: &'static str, topic: &str) -> Result<&Topic, RosBagError> {
        let known = || self.topics.keys().cloned().collect::<Vec<_>>().join(", ");
        let with_slash = format!("/{topic}");
        let found = self.topics.get(topic).or_else(|| self.topics.get(&with_slash));
        found.ok_or_else(|| RosBagError::UnknownTopic { flag, topic: topic.to_owned(), known: known() })
    }
}

fn note_names(topic: &mut Topic, names: Option<&str>, value: &Value) {
    if let Some(names) = names {
        topic.joints.extend(value.texts(names).into_iter().map(str::to_owned));
    }
    for stamped in value.list("transforms") {
        if let Some((parent, child)) = transform::frames(stamped) {
            *topic.frames.entry((parent.to_owned(), child.to_owned())).or_default() += 1;
        }
    }
}

/// How a channel's messages are read.
pub(crate) fn definitions(channel: &Channel) -> Result<Definitions, RosBagError> {
    let refuse = |why: String| {
        let (topic, type_name) = (channel.topic.clone(), channel.type_name.clone());
        RosBagError::Definition { topic, type_name, why }
    };
    match (&channel.message_encoding[..], &channel.schema_encoding[..]) {
        ("cdr", "ros2msg") => Definitions::parse(&channel.type_name, &channel.definition).map_err(refuse),
        ("ros1", "ros1msg") if !channel.definition.trim().is_empty() => {
            let parsed = Definitions::parse(&channel.type_name, &channel.definition).map_err(refuse)?;
            Ok(Definitions { wire: Wire::Ros1, ..parsed })
        }
        ("ros1", "ros1msg") => Err(refuse("the bag does not define it; record it anew, or reindex the bag".to_owned())),
        (_, "ros2idl") => Err(refuse("it is defined in IDL (ros2idl), which is not read here".to_owned())),
        ("cdr", "") => {
            let why = "the bag does not define it; give its definition with --msg FILE, and those of the types inside";
            Err(refuse(why.to_owned()))
        }
        (encoding, schema) => {
            let why = format!("messages in {encoding:?} defined in {schema:?}; expected \"cdr\" and \"ros2msg\"");
            Err(refuse(why))
        }
    }
}
