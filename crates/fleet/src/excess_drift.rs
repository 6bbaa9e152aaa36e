//! How much farther a robot drifts because its configured geometry is not its calibrated one.
//!
//! Each run of the latest session is dead-reckoned twice from one pose, with the configured geometry g₀ and
//! with the calibrated one ĝ. The predicted excess drift is 100 · Σ |d_r| / Σ L_r per cent, where d_r is the
//! distance between both ends of run r and L_r its length. It needs no truth, has no part of the noise of the
//! odometry or of the instrument, and is what a new calibration saves on such runs.
//!
//! With J_r the derivative of the end by the geometry and C the covariance of ĝ, an error δ of ĝ changes the
//! excess by at most 100 · Σ |J_r δ| / Σ L_r, whose root mean square is at most
//! σ = 100 · Σ √tr(J_r C J_rᵀ) / Σ L_r. Whether there is an excess at all is the test of ĝ = g₀ by
//! T² = (ĝ − g₀)ᵀ C⁻¹ (ĝ − g₀). C comes from the scatter of n runs, so that T² (ν − 2)/(3ν) is F with 3 and
//! ν − 2 degrees of freedom, ν = n − 1 (Hotelling 1931). Where runs are so few that C is the model's own, the
//! test is conservative.

use calib::Calibration;
use dataset::{NominalRobot, NotNegative, RunView, Session, Share, checked};
use kinematics::{DriveGeometry, GeometryError, Point, Pose, Rule, Wheels};
use nalgebra::{Cholesky, Matrix2x3, Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::geometry::{GEOMETRY, GeometryEstimate, geometry_m};
use crate::settings::DIFFERENCE_STEP;

/// Predicted drift with the configured geometry minus that with the calibrated one, per cent of the distance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ExcessDrift {
    /// Per cent of the distance; never negative, and never above the drift that was measured.
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub percent: f64,
    /// At most one standard deviation of it, per cent of the distance.
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub sigma_percent: f64,
    /// Probability of calibrated values as far from the configured ones where these are right.
    #[serde(deserialize_with = "checked::<Share, _>")]
    pub p_value: f64,
}

impl ExcessDrift {
    /// The excess on the runs of a session, of which the configured geometry was measured to drift by
    /// `drift_percent`: more than that a calibration cannot save.
    ///
    /// # Errors
    /// A sentence where the runs do not determine the geometry or go nowhere.
    pub fn of(
        session: &Session<'_>,
        calibration: &Calibration,
        estimate: &GeometryEstimate,
        drift_percent: Option<f64>,
    ) -> Result<Self, String> {
        if let Some(row) = (0..GEOMETRY.len()).find(|row| estimate.value_m[*row].is_none()) {
            return Err(format!("the runs do not determine {}", GEOMETRY[row].key()));
        }
        let no_scatter = || "too few runs to show a scatter: the calibration has no standard deviations".to_owned();
        let covariance = estimate.covariance_m2.ok_or_else(no_scatter)?;
        let covariance = Matrix3::from_fn(|row, column| covariance[row][column]);
        let not_a_drive = |error: GeometryError| error.to_string();
        let configured = session.robot.geometry().map_err(not_a_drive)?;
        let calibrated = calibration.geometry;
        let (mut separation_m, mut error_m, mut length_m) = (0.0, 0.0, 0.0);
        for run in &session.runs {
            let Some((end, driven_m)) = end_and_length(run, session.robot, &calibrated) else { continue };
            let Some((other, _)) = end_and_length(run, session.robot, &configured) else { continue };
            let jacobian = end_by_geometry(run, session.robot, &calibrated).map_err(not_a_drive)?;
            separation_m += end.distance_m(other);
            error_m += (jacobian * covariance * jacobian.transpose()).trace().max(0.0).sqrt();
            length_m += driven_m;
        }
        if length_m <= 0.0 {
            return Err("no run goes anywhere: there is no distance to drift on".to_owned());
        }
        Ok(Self {
            percent: (100.0 * separation_m / length_m).min(drift_percent.unwrap_or(f64::INFINITY)),
            sigma_percent: 100.0 * error_m / length_m,
            p_value: p_value(&configured, &calibrated, covariance, calibration.runs_used).ok_or_else(no_scatter)?,
        })
    }
}

/// The test of Hotelling; `None` where the covariance is singular or the runs are too few for one.
fn p_value(
    configured: &DriveGeometry,
    calibrated: &DriveGeometry,
    covariance_m2: Matrix3<f64>,
    runs: usize,
) -> Option<f64> {
    let tested = GEOMETRY.len();
    let difference_m = Vector3::from(geometry_m(calibrated)) - Vector3::from(geometry_m(configured));
    let t_squared = difference_m.dot(&Cholesky::new(covariance_m2)?.solve(&difference_m));
    // Degrees of freedom of the scatter, and of the ratio's denominator.
    let of_scatter = runs.checked_sub(1)? as f64;
    let of_ratio = runs.checked_sub(tested).filter(|left| *left > 0)? as f64;
    let ratio = FisherSnedecor::new(tested as f64, of_ratio).ok()?;
    Some(ratio.sf(t_squared * of_ratio / (tested as f64 * of_scatter)))
}

/// Where a run that starts at the origin ends, and the length of its path, metres; `None` without rows.
fn end_and_length(run: &RunView<'_>, robot: &NominalRobot, geometry: &DriveGeometry) -> Option<(Point, f64)> {
    let (mut last, mut length_m): (Option<Pose>, f64) = (None, 0.0);
    run.dead_reckon(robot, geometry, Rule::Midpoint, Pose::IDENTITY, |_, pose| {
        length_m += last.map_or(0.0, |last| last.position().distance_m(pose.position()));
        last = Some(pose);
    });
    Some((last?.position(), length_m))
}

/// ∂(x, y of the end)/∂(left diameter, right diameter, separation), by central differences.
fn end_by_geometry(
    run: &RunView<'_>,
    robot: &NominalRobot,
    geometry: &DriveGeometry,
) -> Result<Matrix2x3<f64>, GeometryError> {
    let mut jacobian = Matrix2x3::zeros();
    for column in 0..GEOMETRY.len() {
        let at = |sign: f64| {
            let mut moved_m = geometry_m(geometry);
            let step_m = DIFFERENCE_STEP * moved_m[column];
            moved_m[column] += sign * step_m;
            let [left, right, separation_m] = moved_m;
            let moved = DriveGeometry::new(Wheels { left, right }, separation_m)?;
            let end = end_and_length(run, robot, &moved).map_or_else(Point::default, |(end, _)| end);
            Ok::<_, GeometryError>((end, step_m))
        };
        let ((ahead, step_m), (behind, _)) = (at(1.0)?, at(-1.0)?);
        jacobian[(0, column)] = (ahead.x_m - behind.x_m) / (2.0 * step_m);
        jacobian[(1, column)] = (ahead.y_m - behind.y_m) / (2.0 * step_m);
    }
    Ok(jacobian)
}

#[cfg(test)]
mod tests {
    use super::*;
    use calib::Covariance;
    use dataset::{Dataset, Odometry, Provenance, Run, TruthNoise, WheelLog};
    use std::f64::consts::PI;

    /// A robot that drives 1 m straight by its nominal wheels of 0.1 m, in ten rows.
    fn straight() -> Dataset {
        let angles: Vec<f64> = (0..=10).map(|row| f64::from(row) * 2.0).collect();
        let odometry = Odometry {
            t_s: (0..=10).map(f64::from).collect(),
            wheels: WheelLog::Angles(Wheels { left: angles.clone(), right: angles }),
            ..Odometry::default()
        };
        Dataset {
            provenance: Provenance::default(),
            robot: NominalRobot {
                left_wheel_diameter_m: 0.1,
                right_wheel_diameter_m: 0.1,
                wheel_separation_m: 0.3,
                ticks_per_rev: None,
                counter_bits: None,
            },
            truth_noise: TruthNoise::default(),
            points: Vec::new(),
            runs: vec![Run { odometry, ..Run::default() }],
        }
    }

    fn excess(set: &Dataset, diameter_m: Wheels<f64>, sigma_m: f64) -> Result<ExcessDrift, String> {
        excess_of_drift(set, diameter_m, sigma_m, None)
    }

    fn excess_of_drift(
        set: &Dataset,
        diameter_m: Wheels<f64>,
        sigma_m: f64,
        drift_percent: Option<f64>,
    ) -> Result<ExcessDrift, String> {
        let calibrated = DriveGeometry::new(diameter_m, 0.3).expect("a drive");
        let covariance = Some(Covariance::from_diagonal_element(3, 3, sigma_m * sigma_m));
        let calibration = Calibration { covariance, runs_used: 5, ..Calibration::new("joint", calibrated, None) };
        ExcessDrift::of(&set.session(), &calibration, &GeometryEstimate::of(&calibration, |_| true), drift_percent)
    }

    #[test]
    fn regress_an_excess_is_not_above_the_drift() {
        let of = |drift| excess_of_drift(&straight(), Wheels::both(0.101), 1e-4, drift).expect("determined").percent;
        assert_eq!(of(Some(0.2)), 0.2);
        assert!(of(Some(5.0)) < 1.0);
    }

    #[test]
    fn wheels_that_are_one_per_cent_larger_drift_by_one_per_cent_of_the_true_distance() {
        let found = excess(&straight(), Wheels::both(0.101), 1e-4).expect("determined");
        // 1.00 m is believed of 1.01 m.
        assert!((found.percent - 100.0 * 0.01 / 1.01).abs() < 1e-9, "{found:?}");
        // Two wheels off by ten standard deviations each: T² = 200, over five runs a ratio of 100/3, beyond
        // which F with 3 and 2 degrees of freedom has 1 − (100/102)^1.5.
        assert!((found.p_value - (1.0 - (100.0_f64 / 102.0).powf(1.5))).abs() < 1e-9, "{found:?}");
        // Along x each wheel of 20 rad moves the end by 5 times the error of its diameter: 0.71 mm for both;
        // across, it turns the robot by 10 times that over 0.3 m, half of which times the distance is the
        // offset of the end: 2.38 mm for both.
        let along_m = 5.0 * 1e-4 * 2.0_f64.sqrt();
        let across_m = 10.0 * 1e-4 / 0.3 * 0.5 * 1.01 * 2.0_f64.sqrt();
        let expected = 100.0 * along_m.hypot(across_m) / 1.01;
        assert!((found.sigma_percent / expected - 1.0).abs() < 1e-6, "{found:?} {expected}");
    }

    #[test]
    fn unequal_wheels_bend_the_path_by_half_of_the_turn() {
        // The right wheel 0.1 % larger: a turn of 1 mm / 0.3 m over 1 m, and half of it to the side.
        let found = excess(&straight(), Wheels { left: 0.1, right: 0.1001 }, 1e-4).expect("determined");
        let expected = 100.0 * 0.5e-3_f64.hypot(0.5 * 1e-3 / 0.3) / 1.0005;
        assert!((found.percent / expected - 1.0).abs() < 1e-3, "{found:?} {expected}");
    }

    #[test]
    fn a_robot_that_is_configured_as_it_is_has_no_excess() {
        let found = excess(&straight(), Wheels::both(0.1), 1e-4).expect("determined");
        assert_eq!((found.percent, found.p_value), (0.0, 1.0));
    }

    #[test]
    fn what_the_runs_do_not_determine_and_runs_that_go_nowhere_have_no_excess() {
        let mut set = straight();
        let calibration = Calibration::new("joint", set.robot.geometry().expect("a drive"), None);
        let of = |determined: fn(calib::Parameter) -> bool| {
            ExcessDrift::of(&set.session(), &calibration, &GeometryEstimate::of(&calibration, determined), None)
        };
        assert!(of(|_| false).is_err_and(|why| why.contains("left_wheel_diameter_m")));
        assert!(of(|_| true).is_err_and(|why| why.contains("too few runs")));
        let spin = |sign: f64| (0..=10).map(|row| sign * PI * f64::from(row)).collect::<Vec<f64>>();
        set.runs[0].odometry.wheels = WheelLog::Angles(Wheels { left: spin(-1.0), right: spin(1.0) });
        assert!(
            excess(&set, Wheels::both(0.1), 1e-4).is_err_and(|why| why.contains("nowhere") || why.contains("anywhere"))
        );
    }
}
