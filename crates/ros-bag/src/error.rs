//! Why a bag was not imported: one variant a reason that a caller can act on.

use std::path::PathBuf;

/// Why a bag was not imported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RosBagError {
    /// The operating system refused.
    #[error("{path}: {source}")]
    Io {
        /// What was to be read.
        path: PathBuf,
        /// Its reason.
        source: std::io::Error,
    },
    /// Neither a bag's folder nor a file of a bag.
    #[error("{path}: {why}; expected a folder of rosbag2 with its metadata.yaml, or one .mcap, .db3 or .bag file")]
    NoBag {
        /// What was given.
        path: PathBuf,
        /// What it is instead.
        why: String,
    },
    /// A file of a bag's folder is a link to elsewhere.
    #[error("{file}: a link to {target}, outside of the bag; put a copy of the file there, or name {target}")]
    LinkOutside {
        /// The link.
        file: PathBuf,
        /// What it leads to.
        target: PathBuf,
    },
    /// `metadata.yaml` does not say what rosbag2 writes there.
    #[error("{file}: {why}; name one file of the bag instead, or let `ros2 bag reindex` write it anew")]
    Metadata {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        why: String,
    },
    /// A file given for a type's definition.
    #[error("--msg {file}: {why}")]
    DefinitionFile {
        /// The file.
        file: PathBuf,
        /// What is wrong, and what to do.
        why: String,
    },
    /// Beside a file of SQLite stands a log that was not yet written into it.
    #[error(
        "{file}: it is not whole: {beside} holds what its recorder had not yet written into it; let SQLite do that (sqlite3 {} \"PRAGMA integrity_check\"), or take {} away to read the file without it",
        file.display(),
        beside.display()
    )]
    Unfinished {
        /// The bag's file.
        file: PathBuf,
        /// The log beside it.
        beside: PathBuf,
    },
    /// A file that says little becomes much by decompression.
    #[error("{file}: it holds more than {} MiB when decompressed; split the recording (`ros2 bag convert`), or leave out the topics of images", limit_bytes >> 20)]
    TooLarge {
        /// The file.
        file: PathBuf,
        /// How much may come of it, bytes.
        limit_bytes: u64,
    },
    /// Not one record could be read.
    #[error("{file}: no message could be read{}", if why.is_empty() { String::new() } else { format!(": {why}") })]
    NoMessages {
        /// The bag.
        file: PathBuf,
        /// What was lost.
        why: String,
    },
    /// A file numbers its topics by 16 bits.
    #[error("more than 65535 topics; give fewer calibrations")]
    TooManyTopics,
    /// A topic's definition is not one that can be read.
    #[error("topic {topic}: {type_name}: {why}")]
    Definition {
        /// The topic.
        topic: String,
        /// Its type.
        type_name: String,
        /// What is wrong, and what was expected.
        why: String,
    },
    /// A message is not what its definition says.
    #[error("topic {topic}: message {number}: {why}")]
    Message {
        /// The topic.
        topic: String,
        /// Which message of the topic, from 1.
        number: u64,
        /// What is wrong.
        why: String,
    },
    /// The bag has no such topic.
    #[error("{flag} {topic}: the bag has no such topic; it has {known}")]
    UnknownTopic {
        /// The flag.
        flag: &'static str,
        /// The topic that was asked for.
        topic: String,
        /// The topics of the bag.
        known: String,
    },
    /// No topic, or several topics, may be what is looked for.
    #[error("{bag}: {why}; say {flag}; --list shows all topics")]
    Undecided {
        /// The bag.
        bag: PathBuf,
        /// What is open.
        why: String,
        /// The flag that settles it, with the candidates.
        flag: String,
    },
    /// A topic does not hold what it was to be used for.
    #[error("topic {topic}: {type_name}: {why}")]
    Unusable {
        /// The topic.
        topic: String,
        /// Its type.
        type_name: String,
        /// What is missing, and the flags.
        why: String,
    },
    /// Two messages of a topic contradict the order of time.
    #[error(
        "topic {topic}: message {number}: time runs backwards by {step_s:.3} s; the bag holds two recordings, or a clock was set: give --cut SECONDS to cut the runs there"
    )]
    TimeRunsBackwards {
        /// The topic.
        topic: String,
        /// Which message of the topic, from 1.
        number: usize,
        /// How far, seconds.
        step_s: f64,
    },
    /// Wheels and poses are of two clocks.
    #[error(
        "wheels of {wheels} span {wheels_span}, poses of {truth} span {truth_span}: two clocks; record both on one"
    )]
    TwoClocks {
        /// Topic of the wheels.
        wheels: String,
        /// Its first and last time.
        wheels_span: String,
        /// Topic of the poses.
        truth: String,
        /// Its first and last time.
        truth_span: String,
    },
    /// No run is left.
    #[error("--cut {cut_s}: no run is left that moves and was seen; say a longer time")]
    NothingLeft {
        /// The time that was given, seconds.
        cut_s: f64,
    },
    /// What the dataset's own types refuse.
    #[error(transparent)]
    Dataset(#[from] dataset::DatasetError),
}
