//! A robot's own files: what they say of its wheels, and calibrated values put into their places.
//!
//! The order of work, a file each: `entries` of a text, with the bytes that each value stands in, by `yaml`
//! or by `assignments` (firmware, Java, tables) → `controller` which of them are the wheels' → `read` the
//! lengths of a `robot`. `urdf` reads joints and links, `wheel_joints` finds the wheels among them. `put`
//! and `put_in_urdf` make edits of a text, `edit` applies them and shows the difference.

mod assignments;
mod controller;
mod edit;
mod entries;
mod error;
mod put;
mod put_in_urdf;
mod read;
mod robot;
mod urdf;
mod wheel_joints;
mod yaml;

pub use edit::{Edited, diff};
pub use error::RobotFileError;
pub use put::put;
pub use put_in_urdf::put_in_urdf;
pub use robot::Robot;
