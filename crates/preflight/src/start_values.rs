//! What a fit starts from: the instrument's clock and the drive by the windows of motion, whatever is stated
//! of the robot.

use std::collections::BTreeMap;

use dataset::{RunView, Session};
use kinematics::Wheels;

use crate::clock::{Clock, ClockOffset};
use crate::problems::clock::{best_clock, clock_drift, offset_gain, without_odd_runs};
use crate::regression::slope;
use crate::run_log::RunLog;
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;
use crate::windows::Reading;

/// What the windows of a session's motion say of its clock and of the drive.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StartValues {
    /// The instrument's clock, where an offset or a rate is seen.
    pub clock: Option<Clock>,
    /// Ids of runs that have another clock, with its offset.
    pub odd_runs: BTreeMap<String, ClockOffset>,
    /// How late the instrument's stamps are against the log's by one offset, seconds, where it is seen.
    pub clock_offset_s: Option<f64>,
    /// The drive, where the windows determine it.
    pub drive: Option<DriveStart>,
}

/// A drive to start from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveStart {
    /// Metres that each wheel rolls a radian.
    pub m_per_rad: Wheels<f64>,
    /// Distance between the wheels' contacts, metres.
    pub wheel_separation_m: f64,
    /// Heading of the instrument on the robot, radians.
    pub sensor_rad: f64,
}

impl StartValues {
    /// Of a session, by its records as they are.
    #[must_use]
    pub fn of(session: &Session<'_>) -> Self {
        let mut check = SessionCheck::new(session);
        let odd_runs = without_odd_runs(&mut check);
        let as_is = check.explained(Reading::AS_IS, Clock::default());
        let clock = best_clock(&check, Reading::AS_IS, as_is)
            .filter(|best| offset_gain(&check, Reading::AS_IS, as_is, best.clock, best.sigma_s).is_some())
            .map(|best| best.clock);
        let drift =
            clock_drift(&check, Reading::AS_IS, clock.unwrap_or_default()).filter(|drift| drift.clock.of_session);
        let clock_offset_s = clock.map(|clock| clock.offset_s);
        let clock = drift.map(|drift| drift.clock).or(clock);
        let drive = check.matched_at(Reading::AS_IS, clock.unwrap_or_default()).and_then(|matched| {
            let geometry = matched.geometry?;
            // All negative: an instrument that looks backwards.
            let lengths = [geometry.m_per_rad.left, geometry.m_per_rad.right, geometry.separation_m];
            let is_drive = lengths.iter().all(|of| *of > 0.0) || lengths.iter().all(|of| *of < 0.0);
            let is_certain = !geometry.is_diluted && geometry.sigma.iter().all(|sigma| *sigma < CHECKS.max_start_sigma);
            (is_drive && is_certain).then(|| DriveStart {
                m_per_rad: geometry.m_per_rad.map(f64::abs),
                wheel_separation_m: geometry.separation_m.abs(),
                sensor_rad: geometry.sensor_rad,
            })
        });
        Self { clock, odd_runs, clock_offset_s, drive: drive.or_else(|| by_gyro(session, &check)) }
    }
}

/// The drive with wheels as they are stated and the separation by a gyroscope, where nothing else sees turns.
fn by_gyro(session: &Session<'_>, check: &SessionCheck) -> Option<DriveStart> {
    if check.runs.iter().any(|run| !run.truth.is_empty() || !run.displacements.is_empty()) {
        return None;
    }
    let m_per_rad = check.m_per_rad();
    let mut pairs: Vec<(f64, f64)> = Vec::new();
    for run in &session.runs {
        let Some(log) = RunLog::of(run, session.robot) else { continue };
        pairs.extend(gyro_windows(run, &log, m_per_rad).unwrap_or_default());
    }
    if pairs.len() < CHECKS.min_windows {
        return None;
    }
    let (rad_per_m, sigma, ..) = slope(&pairs)?;
    (sigma < CHECKS.max_start_sigma * rad_per_m).then(|| DriveStart {
        m_per_rad,
        wheel_separation_m: rad_per_m.recip(),
        sensor_rad: 0.0,
    })
}

/// By how much farther the right wheel rolls than the left in each window, metres, and the turn by the
/// gyroscope, radians.
fn gyro_windows(run: &RunView<'_>, log: &RunLog, m_per_rad: Wheels<f64>) -> Option<Vec<(f64, f64)>> {
    let rates = run.run().gyro_rates()?;
    let (mut windows, mut from, mut turn_rad) = (Vec::new(), 0, 0.0);
    for row in 1..log.t_s.len().min(rates.len()) {
        turn_rad += rates[row] * (log.t_s[row] - log.t_s[row - 1]);
        if log.t_s[row] - log.t_s[from] >= CHECKS.gyro_window_s {
            let rolled_m = |angles: &[f64], m: f64| m * (angles[row] - angles[from]);
            let farther_m = rolled_m(&log.wheels.right, m_per_rad.right) - rolled_m(&log.wheels.left, m_per_rad.left);
            if turn_rad.is_finite() {
                windows.push((farther_m, turn_rad));
            }
            (from, turn_rad) = (row, 0.0);
        }
    }
    Some(windows)
}
