//! Monte-Carlo bench: how far each calibration method's estimates fall from the truth that the simulator
//! hides.
//!
//! A [`SweepPlan`] is a design of points over a scenario's keys; at every point each trial drives the
//! simulated robot through the protocols and gives what it measured to every method. Bias, variance, RMSE,
//! quantiles and coverage carry their Monte-Carlo standard errors, and the RMSE is set against the Cramér–Rao
//! bound of what was driven. Trials are addressed by (seed, point, trial) and summed in one fixed tree: the
//! result is the same to the bit whatever the number of threads, shards and interruptions.

mod bound;
mod error;
mod moments;
mod sweep;
mod trial;

pub use bound::{FisherInformation, LinearizedInnovation, NoBound};
pub use error::BenchError;
pub use moments::Moments;
pub use sweep::{
    AccuracyCheck, Campaign, Comparison, Coverage, DriftResult, EstimatorResult, FALSE_ALARM_BUDGET, FolderLock,
    MAX_TRIALS, Merged, MethodCost, Outcome, PointResult, Progress, Quantile, Shard, SweepOptions, SweepPlan,
    SweepResult, TRACKED, can_be_written, compare, figure as sweep_figure, merge, read_baseline, write_merged,
    write_results,
};
pub use trial::Trial;
