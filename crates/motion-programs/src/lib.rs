//! Motion programs: what a protocol drives and when it measures, what that costs, and the trait of whatever
//! can drive it.

mod cost;
mod platform;
mod program;

pub use cost::{Cost, DriveLimits};
pub use platform::{Platform, record_session};
pub use program::{Motion, MotionProgram, Schedule};
