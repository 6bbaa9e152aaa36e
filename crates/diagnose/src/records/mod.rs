//! Faults of the records, clocks, and runs and intervals that do not belong: before any effect is sought.

pub(crate) mod clocks;
pub(crate) mod large_log;
pub(crate) mod log;
pub(crate) mod log_rows;
pub(crate) mod names;
pub(crate) mod part_of_runs;
pub(crate) mod pose_windows;
pub(crate) mod prepared;
pub(crate) mod record_faults;
pub(crate) mod same_measurements;
pub(crate) mod stamp_errors;
pub(crate) mod unknown_motion;
