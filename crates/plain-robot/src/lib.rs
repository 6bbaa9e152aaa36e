//! A differential-drive robot that shares no code with the project: integrated by the millisecond, driven by
//! its own profiles, with its own random numbers. It writes dataset folders as plain text.
//!
//! The project's simulator and estimators have one author; what both get wrong, a test between them does not
//! see. This one follows textbook equations only: midpoint integration, trapezoids of speed, encoders that
//! round down.

mod draws;
mod drive;
mod kinds;
mod log;
mod mixed;
mod robot;
mod stamps;
mod write;

pub use draws::Draws;
pub use kinds::{Change, KINDS, Kind, set_extrinsics};
pub use mixed::Mixed;
pub use robot::{Event, PlainRobot, Records, Reports, Stamps};
