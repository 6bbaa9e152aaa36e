//! Self-calibration on line: the filter goes through logs once, row by row, and reports when its parameters
//! have settled.

use dataset::Session;
use kinematics::{DriveGeometry, Pose, Wheels};
use nalgebra::{Matrix3, Vector3};

use super::{AugmentedFilter, AugmentedKalman};
use crate::estimate::{CalibError, nominal};
use crate::pose_measurements::{PoseMeasurement, PoseMeasurements, Spacing};

/// What the robot knows of its drive after a measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Followed {
    /// The run, by its id.
    pub run: String,
    /// Measurements since the very first.
    pub measurements: usize,
    /// Distance driven since then by the nominal drive, metres.
    pub distance_m: f64,
    /// Turn since then by the nominal drive, in either direction, radians.
    pub turn_rad: f64,
    /// The estimated drive.
    pub geometry: DriveGeometry,
    /// Standard deviations of left diameter, right diameter and separation, metres.
    pub sigma_m: Vector3<f64>,
    /// Are the parameters known well enough, and have they stopped moving?
    pub settled: bool,
}

impl AugmentedKalman {
    /// Follows the parameters through sessions in the order given, a measurement after the other; what is
    /// known is never gone back on.
    ///
    /// # Errors
    /// [`CalibError`] when the sessions hold no poses, or a factor leaves what is a drive.
    pub fn follow(&self, sessions: &[Session<'_>]) -> Result<Vec<Followed>, CalibError> {
        let (_, geometry) = nominal(Self::NAME, sessions)?;
        let spacing = Spacing { every_m: self.measurement_every_m, every_rad: self.measurement_every_rad };
        let (runs, _) = PoseMeasurements::of_all(Self::NAME, sessions, spacing)?;
        let mut turned = Wheels::both(0.0);
        let start = runs.first().map_or(Pose::IDENTITY, |measurements| measurements.start);
        let noise = self.first_guess(sessions);
        let m_per_rad = geometry.m_per_rad();
        let mut filter = AugmentedFilter::new(&geometry, m_per_rad, self.factor_sigma, noise, start, turned);
        let (mut followed, mut distance_m, mut turn_rad) = (Vec::new(), 0.0, 0.0);
        for measurements in runs {
            filter.restart(measurements.start, turned);
            for PoseMeasurement { wheel_rad, pose } in &measurements.later {
                for rad in wheel_rad {
                    turned = turned.zip_with(*rad, |turned, rad| turned + rad);
                    filter.predict(turned);
                    let step = geometry.increment(m_per_rad.zip_with(*rad, |m_per_rad, rad| m_per_rad * rad));
                    distance_m += step.distance_m.abs();
                    turn_rad += step.turn_rad.abs();
                }
                filter.update(*pose);
                let found = filter.geometry();
                let geometry = found.map_err(|source| CalibError::NotADrive { method: Self::NAME, source })?;
                let covariance: Matrix3<f64> = filter.covariance();
                followed.push(Followed {
                    run: measurements.run.to_owned(),
                    measurements: followed.len() + 1,
                    distance_m,
                    turn_rad,
                    geometry,
                    sigma_m: covariance.diagonal().map(|variance| variance.max(0.0).sqrt()),
                    settled: filter.is_settled(),
                });
            }
        }
        Ok(followed)
    }
}

/// Where the parameters settled for good: the first measurement from which on they count as settled at every
/// later one.
#[must_use]
pub fn settled_at(followed: &[Followed]) -> Option<&Followed> {
    let unsettled = followed.iter().rposition(|step| !step.settled).map_or(0, |last| last + 1);
    followed.get(unsettled)
}
