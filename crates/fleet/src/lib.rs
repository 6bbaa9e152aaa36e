//! A fleet: the sessions of many robots side by side.
//!
//! [`SessionResult`] is what one session shows of its robot. [`Fleet::of`] groups sessions by robot and
//! orders them by time, tests what changed between consecutive sessions (`change.rs`) at a false-discovery
//! rate over the fleet (`false_discovery.rs`), and ranks the robots by their predicted excess drift
//! (`excess_drift.rs`). There are no files and no clock.

mod change;
mod excess_drift;
mod false_discovery;
mod geometry;
mod robots;
mod session;
mod settings;

pub use change::Change;
pub use excess_drift::ExcessDrift;
pub use false_discovery::q_values;
pub use geometry::{GEOMETRY, GeometryEstimate, Undetermined};
pub use robots::{Failed, Fleet, FleetSession, Robot, RobotExcess};
pub use session::{SessionDrift, SessionFinding, SessionResult};
pub use settings::DEFAULT_FALSE_DISCOVERY_RATE;
