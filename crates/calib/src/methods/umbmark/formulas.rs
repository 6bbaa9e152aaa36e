//! The formulas of `umbmark`, from the end errors of both directions to its result.

use std::f64::consts::FRAC_PI_2;

use dataset::NominalRobot;
use kinematics::{DriveGeometry, Wheels};
use nalgebra::{Matrix2, Matrix3x2};

use crate::estimate::{CalibError, Calibration, Covariance, NotObservable, Parameter, drive};
use crate::robust::Summary;

/// The method's name.
pub(super) const NAME: &str = "umbmark";

/// Which coordinate of the end errors α and β are taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// From x: the published form.
    X,
    /// From y: the same to first order.
    Y,
}

/// End errors of the squares of one direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Direction {
    pub(super) x_m: Summary,
    pub(super) y_m: Summary,
}

/// A calibration by the end errors of both directions.
pub(super) fn calibration(
    form: Form,
    robot: &NominalRobot,
    geometry: &DriveGeometry,
    side_m: f64,
    cw: Direction,
    ccw: Direction,
) -> Result<Calibration, CalibError> {
    let corner = corner_errors(form, side_m, cw, ccw);
    let base_m = geometry.wheel_separation_m();
    let mean_m = 0.5 * (geometry.wheel_diameter_m().left + geometry.wheel_diameter_m().right);
    let q = base_m / side_m * (0.5 * corner.beta_rad).sin();
    let separation_m = base_m * FRAC_PI_2 / (FRAC_PI_2 - corner.alpha_rad);
    let diameter_m = Wheels { left: mean_m * (1.0 - q), right: mean_m * (1.0 + q) };

    let by_alpha = separation_m / (FRAC_PI_2 - corner.alpha_rad);
    let by_beta = mean_m * base_m / side_m * 0.5 * (0.5 * corner.beta_rad).cos();
    let covariance = corner.variances.map(|(var, cov)| {
        // α and β are half sum and half difference of the same two means: equal variances, and a
        // covariance where one direction scatters more.
        let jacobian = Matrix3x2::new(0.0, -by_beta, 0.0, by_beta, by_alpha, 0.0);
        let covariance = jacobian * Matrix2::new(var, cov, cov, var) * jacobian.transpose();
        Covariance::from_column_slice(3, 3, covariance.as_slice())
    });
    Ok(Calibration {
        covariance,
        not_observable: vec![NotObservable {
            parameter: Parameter::CommonScale,
            why: "a closed square hides the scale common to both wheels, and reads it as a wrong wheelbase; measure a straight run of known length first".into(),
        }],
        runs_used: cw.x_m.count + ccw.x_m.count,
        ..Calibration::new(NAME, drive(NAME, diameter_m, separation_m)?, robot.ticks_per_rev)
    })
}

struct CornerErrors {
    alpha_rad: f64,
    beta_rad: f64,
    /// Variance of each and covariance, rad².
    variances: Option<(f64, f64)>,
}

fn corner_errors(form: Form, side_m: f64, cw: Direction, ccw: Direction) -> CornerErrors {
    let (cw, ccw, sign) = match form {
        Form::X => (cw.x_m, ccw.x_m, 1.0),
        Form::Y => (cw.y_m, ccw.y_m, -1.0),
    };
    let four = -4.0 * side_m;
    let variances = cw
        .mean_variance()
        .zip(ccw.mean_variance())
        .map(|(cw_var, ccw_var)| ((cw_var + ccw_var) / (four * four), (cw_var - ccw_var) / (four * four)));
    CornerErrors {
        alpha_rad: (cw.mean + sign * ccw.mean) / four,
        beta_rad: (cw.mean - sign * ccw.mean) / four,
        variances,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn q_is_the_published_ratio_of_the_wheels() {
        // E_d = (R + b/2)/(R − b/2) with R = (L/2)/sin(β/2), as printed.
        for beta_rad in [0.01_f64, -0.003, 1e-9] {
            let (b, side) = (0.363, 4.0);
            let radius = (side / 2.0) / (0.5 * beta_rad).sin();
            let printed = (radius + b / 2.0) / (radius - b / 2.0);
            let q = b / side * (0.5 * beta_rad).sin();
            assert!((printed - (1.0 + q) / (1.0 - q)).abs() < 1e-14);
        }
    }

    #[test]
    fn the_two_forms_read_the_corner_errors_that_made_the_ends() {
        // To first order a type A error alone gives x_cw = x_ccw = −2Lα and y_ccw = −y_cw = 2Lα.
        let one = |mean| Summary { count: 1, mean, variance: None };
        let (side_m, alpha_rad) = (4.0, 1e-3);
        let cw = Direction { x_m: one(-2.0 * side_m * alpha_rad), y_m: one(-2.0 * side_m * alpha_rad) };
        let ccw = Direction { x_m: one(-2.0 * side_m * alpha_rad), y_m: one(2.0 * side_m * alpha_rad) };
        for form in [Form::X, Form::Y] {
            let corner = corner_errors(form, side_m, cw, ccw);
            assert!((corner.alpha_rad - alpha_rad).abs() < 1e-18, "{form:?}");
            assert!(corner.beta_rad.abs() < 1e-18, "{form:?}");
        }
    }
}
