//! What a bag holds: its topics, and the fields by which two of them are chosen.

use std::collections::{BTreeMap, BTreeSet};

use crate::bag::Bag;
use crate::cdr;
use crate::definition::Definitions;
use crate::error::RosBagError;
use crate::mcap_file::Channel;
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
}

impl Topic {
    pub(crate) fn span_s(&self) -> f64 {
        self.last_ns.saturating_sub(self.first_ns) as f64 / 1e9
    }
}

/// All topics, by name, and what was lost.
pub(crate) struct Survey {
    pub(crate) topics: BTreeMap<String, Topic>,
    pub(crate) losses: Vec<String>,
}

/// Types of joints: the list of their names.
const JOINT_NAMES: [(&str, &str); 2] =
    [("sensor_msgs/msg/JointState", "name"), ("control_msgs/msg/DynamicJointState", "joint_names")];

/// Transforms.
pub(crate) const TRANSFORMS: &str = "tf2_msgs/msg/TFMessage";

impl Survey {
    pub(crate) fn of(bag: &Bag) -> Result<Self, RosBagError> {
        let mut topics: BTreeMap<String, Topic> = BTreeMap::new();
        let mut decoders: BTreeMap<String, Option<Definitions>> = BTreeMap::new();
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
                    if is_first {
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
        Ok(Self { topics, losses })
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
    for transform in value.list("transforms") {
        if let Some((parent, child)) = frames(transform) {
            *topic.frames.entry((parent.to_owned(), child.to_owned())).or_default() += 1;
        }
    }
}

/// Parent and child of a stamped transform, without the slash of older names.
pub(crate) fn frames(transform: &Value) -> Option<(&str, &str)> {
    let of = |path| transform.text(path).map(|frame| frame.trim_start_matches('/'));
    Some((of("header.frame_id")?, of("child_frame_id")?))
}

/// How a channel's messages are read.
pub(crate) fn definitions(channel: &Channel) -> Result<Definitions, RosBagError> {
    let refuse = |why: String| {
        let (topic, type_name) = (channel.topic.clone(), channel.type_name.clone());
        RosBagError::Definition { topic, type_name, why }
    };
    match (&channel.message_encoding[..], &channel.schema_encoding[..]) {
        ("cdr", "ros2msg") => Definitions::parse(&channel.type_name, &channel.definition).map_err(refuse),
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
