//! A run whose clock is sought.

use std::borrow::Cow;

use dataset::quantum_of_angles;
use kinematics::Wheels;

use crate::run_log::RunLog;
use crate::windows::Reading;

/// A run, how its instrument's records are read, and the drive: metres a radian and the separation, negative
/// where a wheel counts backwards.
pub(super) struct SearchedRun<'r> {
    /// Session and run.
    pub(super) number: (usize, usize),
    pub(super) log: Cow<'r, RunLog>,
    pub(super) reading: Reading,
    /// What a count stands for, radians; 0 where wheels are not counted.
    pub(super) count_rad: Wheels<f64>,
    pub(super) m_per_rad: Wheels<f64>,
    pub(super) separation_m: f64,
}

/// What a count of a log stands for, radians; 0 where wheels are not counted.
pub(super) fn count_rad(log: &RunLog) -> Wheels<f64> {
    match log.count_rad {
        0.0 => log.wheels.as_ref().map(|angles| quantum_of_angles(angles)),
        count_rad => Wheels::both(count_rad),
    }
}
