//! Bags of ROS 2 as datasets.
//!
//! The order of work, a file each: `bag` which files → `mcap_file` records and chunks (`decompress`) →
//! `definition` and `cdr` messages (`value`) → `topics` what the bag holds → `wheels`, `truth` rows of the two
//! topics → `clock` their times → `import` the dataset.

mod cdr;
mod decompress;
mod definition;
mod error;
mod value;

pub use error::RosBagError;
