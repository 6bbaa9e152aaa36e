//! Bags of ROS 2 as datasets.
//!
//! The order of work, a file each: `bag` which files → `mcap_file` records and chunks (`decompress`,
//! `resync`) → `definition` and `cdr` messages (`value`) → `topics` what the bag holds → `choice` which two
//! topics → `rows` of them by `wheels` and `truth` → `clock` their times → `import` the dataset. `listing`
//! shows the topics.

mod bag;
mod cdr;
mod choice;
mod clock;
mod decompress;
mod definition;
mod error;
mod import;
mod listing;
mod mcap_file;
mod resync;
mod rows;
mod topics;
mod truth;
mod value;
mod wheels;

pub use error::RosBagError;
pub use import::{FromBag, Options, Took, TookTopic, import};
pub use listing::{ListedTopic, Listing, list};
pub use wheels::{WheelFields, WheelQuantity};
