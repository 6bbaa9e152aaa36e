//! Scenarios that other crates and tests start from, as text; copies of those in the repository's
//! `scenarios/`, since a package holds no file outside of its folder. `tests/architecture/packages.rs` holds
//! them equal.

/// `paper.toml`: YAIR as in the paper, in closed form, measured on a floor grid; with the paper's sweep.
pub const PAPER: &str = include_str!("shipped/paper.toml");

/// `motion-capture.toml`: YAIR stepped with its motors and controllers, under motion capture at 20 Hz.
pub const MOTION_CAPTURE: &str = include_str!("shipped/motion-capture.toml");
