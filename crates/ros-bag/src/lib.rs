//! Bags of ROS 2 and ROS 1 as datasets.
//!
//! The order of work, a file each: `bag` which files → `mcap_file` records and chunks (`record_fields`,
//! `decompress`, `resync`), `sqlite_file` rows of tables (`sqlite_tables`, `sqlite_pages`), `ros1_file`
//! records of ROS 1 → `definition` (`known_types`) and `cdr` messages (`value`) → `topics` what the bag holds
//! → `choice` which two topics → `rows` of them by `wheels` (`wheel_pair` where each has its topic), `truth`
//! (`frame_chain` of its `transform`s) and `gyro` → `clock` their times → `gyro_column` → `assembly` the
//! dataset (`recorded` when) → `import` of an `open_bag`, `took` of what. Scans of a lidar (`laser_scan`)
//! become walls in a second pass, `scan_walls`: `wall_line` finds them, `wall_tracks` follows them by the
//! `nominal_path`, `static_frames` says where the lidar stands. Every limit stands in `settings`. `listing`
//! shows the topics. `recorder` writes a dataset's runs as a bag, of `messages` by `cdr_writer`.

mod assembly;
mod bag;
mod cdr;
mod cdr_writer;
mod choice;
mod clock;
mod decompress;
mod definition;
mod error;
mod frame_chain;
mod gyro;
mod gyro_column;
mod import;
mod known_types;
mod laser_scan;
mod listing;
mod mcap_file;
mod mcap_records;
mod mcap_writer;
mod messages;
mod nominal_path;
mod open_bag;
mod record_fields;
mod recorded;
mod recorder;
mod resync;
mod ros1_file;
mod rows;
mod scan_walls;
mod settings;
mod sqlite_file;
mod sqlite_pages;
mod sqlite_tables;
mod static_frames;
mod took;
mod topics;
mod transform;
mod truth;
mod value;
mod wall_line;
mod wall_tracks;
mod wheel_pair;
mod wheels;
mod yaml_size;

pub use error::RosBagError;
pub use import::{FromBag, Options};
pub use listing::{ListedTopic, Listing, list};
pub use mcap_writer::McapWriter;
pub use open_bag::{OpenBag, import};
pub use recorder::{
    BODY_FRAME, FIRST_STAMP_S, GYRO_FRAME, RUN_GAP_S, RecordedGyro, RecordedPath, RecordedRun, RecordedTopic,
    RecordedWheels, Recorder, TRUTH_FRAME, WORLD_FRAME,
};
pub use took::{Took, TookTopic};
pub use wheels::{WheelFields, WheelQuantity};
