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

impl<'r> SearchedRun<'r> {
    /// A run by metres a radian and the separation.
    pub(super) fn of(
        number: (usize, usize),
        log: Cow<'r, RunLog>,
        reading: Reading,
        drive: (Wheels<f64>, f64),
    ) -> Self {
        let count_rad = match log.count_rad {
            0.0 => log.wheels.as_ref().map(|angles| quantum_of_angles(angles)),
            count_rad => Wheels::both(count_rad),
        };
        let (m_per_rad, separation_m) = drive;
        Self { number, log, reading, count_rad, m_per_rad, separation_m }
    }
}
