//! Calibrations and extended models in the forms that robots take: one file a format in `format/`, and its
//! table of contents there.
//!
//! A format writes what its robot's program reads and says in comments what that program cannot do: effects
//! of the model that are left out, with their names. What the data do not determine is never written.
//! [`OnBoardOdometry`] is what the C header computes, in Rust, so that a test can compare the two.

mod causal;
mod comment;
mod error;
pub mod format;
mod into_file;
mod log_path;
mod on_board;
mod on_board_covariance;
mod options;
mod robot;
mod settings;
mod tum;

pub use causal::OnBoardInputs;
pub use error::ExportError;
pub use into_file::into_file;
pub use log_path::LogStart;
pub use on_board::OnBoardOdometry;
pub use options::{Lengths, Options};
pub use robot::{CalibratedRobot, Length, RobotEffect};
pub use tum::{tum, tum_of_truth};
