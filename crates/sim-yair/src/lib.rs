//! YAIR simulated: motors under two HCTL-1100 controllers, wheels, floor, encoders and the instruments that
//! watch from outside.
//!
//! A [`scenario::Scenario`] goes in, a [`dataset::Dataset`] and the [`HiddenTruth`] come out.
//! [`SimulatedRobot`] is the robot itself, a [`motion_programs::Platform`] that calibrators drive without
//! knowing what it is. Two engines share everything from the shaft to the record: stepping (≤ 1 ms; motors,
//! controllers, transients) and the closed form (each motion one arc, noise summed), and statistical tests
//! hold them equal.

mod active;
mod actuator;
mod body;
mod drive;
mod hctl1100;
mod instrument;
mod lanes;
mod motor;
mod planned_motion;
mod precomputed_run;
mod prepared_program;
mod quadrature;
mod robot;
mod servo;
mod servo_error;
mod simulation;
mod slam;

pub use instrument::{MIN_RETURN_TURN_RAD, TAPE_FROM_M};
pub use lanes::LaneDrive;
pub use prepared_program::PreparedProgram;
pub use robot::{SimulatedRobot, SimulationError};
pub use servo::ServoError;
pub use simulation::{HiddenTruth, Simulation, TrueRun, simulate, simulate_programs};
