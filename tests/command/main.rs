//! The command as a user runs it: what scripts rely on, bad input, sessions compared, poses corrected, files
//! for robots, fleets, pages, campaigns that are stopped, disturbances, and the gate on accuracy.

mod accuracy_gate;
mod bad_input;
mod bad_logs;
#[cfg(unix)]
mod bounds;
mod cluster;
mod compare;
mod contract;
mod correct;
mod demo;
#[cfg(unix)]
mod disturbances;
mod export;
mod export_mcap;
mod fleet;
mod good_log;
mod import_csv;
mod import_ros2;
mod import_scans;
mod import_tum;
mod instruments;
#[cfg(unix)]
mod interrupt;
#[cfg(unix)]
mod kills;
mod limits;
#[cfg(unix)]
mod links;
mod pages;
mod partial;
mod pose_errors;
mod slam;
mod spoiled_files;
#[path = "../support/mod.rs"]
mod support;
mod sweep_campaign;
mod wall;
