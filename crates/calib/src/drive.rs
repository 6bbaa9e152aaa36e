//! A calibration from nothing: drive a method's own protocol on a robot and give it what was measured.
//!
//! The robot is any [`Platform`]: the simulator, which this crate does not link, or a real one.

use motion_programs::{Platform, Schedule, record_session};

use crate::estimate::{CalibError, Calibration, Method};

/// Why driving and calibrating came to nothing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DriveError<E: std::error::Error> {
    /// The robot did not drive.
    #[error("the robot did not drive: {0}")]
    Platform(E),
    /// The method found no calibration in what was measured.
    #[error(transparent)]
    Calibration(CalibError),
}

/// Drives `protocol`, or the method's own when it is `None`, and calibrates.
///
/// # Errors
/// [`DriveError`] with the platform's or the method's reason.
pub fn drive_and_calibrate<P: Platform + ?Sized>(
    platform: &mut P,
    method: &dyn Method,
    protocol: Option<&[Schedule]>,
) -> Result<Calibration, DriveError<P::Error>> {
    let own = method.protocol();
    let programs: Vec<_> = protocol.unwrap_or(&own).iter().flat_map(Schedule::programs).collect();
    let measured = record_session(platform, &programs).map_err(DriveError::Platform)?;
    method.calibrate(&[measured.session()]).map_err(DriveError::Calibration)
}
