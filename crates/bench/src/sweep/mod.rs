//! Sweeps: a design of points, trials at each of them on all cores, and what every method made of them.

mod accuracy;
mod campaign;
mod dyadic;
mod lock;
mod merge;
mod page;
mod plan;
mod quantile;
mod result;
#[cfg(feature = "parquet")]
mod rows;
mod spool;
mod state;
mod table;
mod tally;
mod validation;

pub use accuracy::{AccuracyCheck, Comparison, FALSE_ALARM_BUDGET, compare, read_baseline};
pub use campaign::{Campaign, Outcome, Progress};
pub use lock::FolderLock;
pub use merge::{Merged, merge};
pub use page::figure;
pub use plan::{MAX_TRIALS, SweepOptions, SweepPlan, TRACKED};
pub use result::{Coverage, DriftResult, EstimatorResult, MethodCost, PointResult, Quantile, SweepResult};
pub use state::Shard;
pub use table::{can_be_written, write_merged, write_results};
