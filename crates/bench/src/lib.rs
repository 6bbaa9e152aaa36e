//! Monte-Carlo bench: how far each calibration method's estimates fall from the truth that the simulator hides.
//!
//! A [`SweepPlan`] crosses the levels of a scenario's axes; at every point each trial drives the simulated robot through the protocols and gives what it
//! measured to every method. Bias, variance, RMSE and coverage carry their Monte-Carlo standard errors. Trials are addressed by (seed, trial), gathered in
//! fixed chunks and merged in order: the result is the same to the bit whatever the number of threads.

mod moments;
pub mod paper;
mod sweep;
mod table;
mod trial;

pub use moments::Moments;
pub use sweep::{BenchError, EstimatorResult, PointResult, SweepPlan, SweepResult, TRACKED};
pub use table::write_results;
pub use trial::Trial;
