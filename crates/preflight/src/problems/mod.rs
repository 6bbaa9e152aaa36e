//! The table of contents: one file a kind of problem.

pub(crate) mod clock;
pub(crate) mod counters;
pub(crate) mod coverage;
pub(crate) mod ends;
pub(crate) mod held_poses;
pub(crate) mod idle_columns;
pub(crate) mod log_rows;
pub(crate) mod rate_rows;
pub(crate) mod rates;
pub(crate) mod remedies;
pub(crate) mod rounded_rates;
pub(crate) mod run_order;
pub(crate) mod runs_on;
pub(crate) mod several_robots;
pub(crate) mod standstill;
pub(crate) mod time_unit;
pub(crate) mod truth_is_odometry;
pub(crate) mod truth_outliers;
pub(crate) mod wheel_changes;
pub(crate) mod wheels;
