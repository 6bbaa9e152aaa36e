//! The words of an experiment as data: robot, noise, effects with sizes, instruments, protocols, budget and
//! sweep. TOML in and out, no behaviour.
//!
//! A scenario is all that a simulated number depends on besides seed and trial. Unknown keys are errors, and
//! no physical quantity has a default but by a `preset` that the scenario names.

mod axis;
mod budget;
mod error;
mod estimated;
mod experiment;
mod file;
mod limits;
mod points;
mod preset;
mod programs;
mod robot;
mod shipped;
mod slam;
mod sweep;
mod wall;

pub use axis::{Level, Levels, Range, Scale};
pub use budget::Budget;
pub use error::{NoFit, ScenarioError};
pub use estimated::{Estimated, EstimatedTerm};
pub use experiment::{Engine, Instrument, Log, Noise, Placement, Scenario};
pub use file::LARGEST_FILE_BYTES;
pub use points::{Axis, CASE_AXIS, Point};
pub use robot::{ControlMode, Controller, Encoder, Mark, Motor, QUADRATURE_DECODING, Robot};
pub use shipped::{MOTION_CAPTURE, PAPER};
pub use slam::Slam;
pub use sweep::{Case, Sobol, Sweep};
pub use wall::Wall;
