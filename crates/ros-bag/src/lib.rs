//! Bags of ROS 2 as datasets.
//!
//! The order of work, a file each: `bag` which files → `mcap_file` records and chunks (`record_fields`,
//! `decompress`, `resync`), with the feature `db3` `sqlite_file` → `definition` (`known_types`) and `cdr`
//! messages (`value`) → `topics` what the bag holds → `choice` which two topics → `rows` of them by `wheels`
//! (`wheel_pair` where each has its topic), `truth` and `gyro` → `clock` their times → `gyro_column` →
//! `import` the dataset (`recorded` when). Every limit stands in `settings`. `listing` shows the topics.
//! `recorder` writes a dataset's runs as a bag, of `messages` by `cdr_writer`.

mod bag;
mod cdr;
mod cdr_writer;
mod choice;
mod clock;
mod decompress;
mod definition;
mod error;
mod gyro;
mod gyro_column;
mod import;
mod known_types;
mod listing;
mod mcap_file;
mod messages;
mod record_fields;
mod recorded;
mod recorder;
mod resync;
mod rows;
mod settings;
#[cfg(feature = "db3")]
mod sqlite_file;
mod topics;
mod truth;
mod value;
mod wheel_pair;
mod wheels;
mod yaml_size;

pub use error::RosBagError;
pub use import::{FromBag, Options, Took, TookTopic, import};
pub use listing::{ListedTopic, Listing, list};
pub use recorder::{
    BODY_FRAME, FIRST_STAMP_S, GYRO_FRAME, RUN_GAP_S, RecordedGyro, RecordedPath, RecordedRun, RecordedTopic,
    RecordedWheels, Recorder, TRUTH_FRAME, WORLD_FRAME,
};
pub use wheels::{WheelFields, WheelQuantity};
