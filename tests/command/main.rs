//! The command as a user runs it: what scripts rely on, bad input, sessions compared, poses corrected, files
//! for robots, fleets, pages, campaigns that are stopped, disturbances, and the gate on accuracy.

mod accuracy_gate;
mod answers;
mod bad_input;
mod bad_logs;
#[cfg(unix)]
mod bounds;
mod case_bundles;
mod cluster;
mod compare;
mod contract;
mod correct;
mod demo;
#[cfg(unix)]
mod disturbances;
mod export;
mod export_mcap;
mod field_logs;
mod fleet;
mod gates;
mod good_log;
mod import_csv;
mod import_csv_files;
mod import_instruments;
mod import_ros1;
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
mod misdeclared;
mod moved_instrument;
mod pages;
mod partial;
mod pose_errors;
mod record_faults;
mod robot_files;
mod slam;
mod spoiled_files;
#[path = "../support/mod.rs"]
mod support;
mod sweep_campaign;
mod wall;
