//! YAIR: a differential-drive robot simulated, calibrated and benched; the front door of the library.
//!
//! The rooms are crates of their own, named here as a user meets them: [`kinematics`] (poses, drive, dead
//! reckoning), [`dataset`] (measured runs, their files and importers, protocols), [`effects`] (what makes
//! odometry deviate), [`scenario`] (experiments as TOML), [`sim_yair`] (the robot), [`calib`] (the methods)
//! [`bench`](mod@bench) (Monte Carlo) and [`report`] (pictures). [`command`] is the whole command, for
//! programs that call it without a process of its own, as the Python package does.
//!
//! ```
//! let text = include_str!("../scenarios/paper.toml");
//! let scenario = yair::scenario::Scenario::parse(text, "paper.toml")?;
//! let measured = yair::sim_yair::simulate(&scenario, 1, 0)?.dataset;
//! let direct = yair::calib::method("direct").expect("a method of the table of contents");
//! let found = direct.calibrate(&[measured.session()])?;
//! // The robot has 363 mm; the paper's spins determine them to a few millimetres.
//! assert!((found.geometry.wheel_separation_m() - 0.363).abs() < 0.005);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use ::bench;
pub use ::diagnose;
pub use ::export;
pub use ::fleet;
pub use blind_benchmark;
pub use calib;
pub use dataset;
pub use effects;
pub use estimation;
pub use kinematics;
pub use model_term;
pub use motion_programs;
pub use paper_reproduction;
pub use preflight;
pub use report;
pub use robot_files;
pub use ros_bag;
pub use scenario;
pub use sim_yair;

pub mod command;

mod ablation;
mod calibrate;
mod calibration_file;
mod case_bundle;
mod challenge;
mod challenge_shard;
mod check;
mod command_line;
mod compare;
mod correct;
mod demo;
mod diagnosis_page;
mod evaluate;
mod export_drift;
mod export_into;
mod export_mcap;
mod help;
mod html_report;
mod import;
mod import_csv;
mod import_motions;
mod import_robot;
mod import_ros2;
mod import_tum;
mod log;
mod manual;
mod merge;
mod new_folders;
mod plain_text;
mod plan;
mod plan_instruments;
mod replay_case;
mod reproduce;
mod session_identity;
mod shard;
mod signals;
mod simulate;
mod sparse_lines;
mod standard_output;
mod sweep;
mod sweep_summary;
mod sweep_table;
mod terminal;
mod watch;
// Under other names than their files': the rooms `diagnose`, `export` and `fleet` are named here too.
#[path = "diagnose.rs"]
mod diagnose_command;
#[path = "export.rs"]
mod export_command;
#[path = "fleet/mod.rs"]
mod fleet_command;

pub use fleet_command::datasets_to_compute;

#[cfg(doctest)]
mod readmes;
