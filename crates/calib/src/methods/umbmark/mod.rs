//! `umbmark`: squares driven both ways and measured at their ends.
//!
//! Model: errors of type A (wrong wheelbase: every corner turns too far by α) and of type B (unequal wheels:
//! every side bends by β). With ε the end position, true minus odometry, in the start's frame (first leg
//! along +x, counter-clockwise turns to the left), averaged over the runs of a direction: α = (x_cw +
//! x_ccw)/(−4L), β = (x_cw − x_ccw)/(−4L), and to first order also α = (y_cw − y_ccw)/(−4L), β = (y_cw +
//! y_ccw)/(−4L). Then E_b = (π/2)/(π/2 − α), R = (L/2)/sin(β/2), E_d = (R + b/2)/(R − b/2), which is
//! (1+q)/(1−q) with q = (b/L) sin(β/2) and needs no R.
//! Assumptions: the mean diameter is right (D_L = 2D/(E_d+1), D_R = 2D/(1/E_d+1)); corners are turned on the
//! spot.
//! Observability: the wheelbase and the ratio of the wheels. Blind to their common scale, which shows up as a
//! wrong wheelbase: measure the scale first.
//! Reference: Borenstein & Feng 1995 (UMBmark), 1996 (eq. for E_b and E_d; b is the nominal wheelbase).

mod lanes;

use std::f64::consts::FRAC_PI_2;

use dataset::{NominalRobot, Protocol, Replicates, Session};
use kinematics::{DriveGeometry, Pose, Rule, Wheels};
use motion_programs::Schedule;
use nalgebra::{Matrix2, Matrix3x2};

use crate::estimate::{CalibError, Calibration, Covariance, Method, NotObservable, Parameter, drive, nominal};
use crate::pose_measurements::EndPoses;
use crate::robust::Summary;

/// Which coordinate of the end errors α and β are taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// From x: the published form.
    X,
    /// From y: the same to first order.
    Y,
}

/// The method in one of its two forms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Umbmark {
    /// Coordinate used.
    pub form: Form,
}

impl Umbmark {
    /// The method as the table of contents offers it: the x form.
    pub const DEFAULT: Self = Self { form: Form::X };

    const NAME: &'static str = "umbmark";

    fn not_applicable(why: impl Into<String>) -> CalibError {
        CalibError::NotApplicable { method: Self::NAME, why: why.into() }
    }
}

/// End errors of the squares of one direction.
#[derive(Debug, Clone, Copy)]
struct Direction {
    x_m: Summary,
    y_m: Summary,
}

impl Method for Umbmark {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn about(&self) -> &'static str {
        "squares driven both ways, measured at their ends: wheel ratio and wheelbase, blind to the common scale"
    }

    /// Five squares each way (Borenstein & Feng 1995) of the paper's 4 m.
    fn protocol(&self) -> Vec<Schedule> {
        vec![Schedule::Squares { side_m: 4.0, runs_each_way: 5 }]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, geometry) = nominal(Self::NAME, sessions)?;
        let mut errors: [(Protocol, Vec<(f64, f64)>); 2] =
            [(Protocol::SquareCw, Vec::new()), (Protocol::SquareCcw, Vec::new())];
        let mut side_m = None;
        for session in sessions {
            for run in &session.runs {
                let Some((_, errors)) = errors.iter_mut().find(|(protocol, _)| run.info().protocol == Some(*protocol))
                else {
                    continue;
                };
                // Marks are read at standstills, before and after the whole log. Poses span the log from the
                // first measurement to the last.
                let by_marks = run.run().truth.is_empty();
                let ends = if by_marks { None } else { EndPoses::of(run, session.robot, &geometry) };
                let observed =
                    if by_marks { run.observed_ends() } else { ends.as_ref().map(|ends| (ends.start, ends.end)) };
                let Some((world_from_start, world_from_end)) = observed else { continue };
                let Some(run_side_m) = run.info().settings.side_m else {
                    return Err(Self::not_applicable(format!("run {} does not say its side_m", run.info().id)));
                };
                // Settings, not measurements: compared exactly.
                if *side_m.get_or_insert(run_side_m) != run_side_m {
                    return Err(Self::not_applicable(
                        "its squares must all have the same side_m; calibrate them apart",
                    ));
                }
                // In the start's frame the odometry starts at the origin and the first leg points along +x.
                let measured = world_from_start.to(world_from_end);
                let mut dead_reckoned = ends.map(|ends| ends.dead_reckoned(&geometry));
                if by_marks {
                    let visit = |_, pose| dead_reckoned = Some(pose);
                    run.dead_reckon(session.robot, &geometry, Rule::Midpoint, Pose::IDENTITY, visit);
                }
                if let Some(dead_reckoned) = dead_reckoned {
                    errors.push((measured.x_m - dead_reckoned.x_m, measured.y_m - dead_reckoned.y_m));
                }
            }
        }
        let summary = |errors: &[(f64, f64)]| {
            Some(Direction {
                x_m: Summary::of(errors.iter().map(|error| error.0))?,
                y_m: Summary::of(errors.iter().map(|error| error.1))?,
            })
        };
        let [(_, cw), (_, ccw)] = &errors;
        let (Some(side_m), Some(cw), Some(ccw)) = (side_m, summary(cw), summary(ccw)) else {
            return Err(Self::not_applicable(
                "it needs squares in both directions (protocol = \"square_cw\" and \"square_ccw\") with the pose measured at both ends",
            ));
        };
        self.calibration(&robot, &geometry, side_m, (cw, ccw))
    }

    fn calibrate_replicates(&self, replicates: &Replicates) -> Vec<Result<Calibration, CalibError>> {
        lanes::calibrate(self, replicates)
    }
}

impl Umbmark {
    /// A calibration by the end errors of both directions.
    fn calibration(
        &self,
        robot: &NominalRobot,
        geometry: &DriveGeometry,
        side_m: f64,
        (cw, ccw): (Direction, Direction),
    ) -> Result<Calibration, CalibError> {
        let corner = corner_errors(self.form, side_m, cw, ccw);
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
                why: "a closed square hides the scale common to both wheels, and reads it as a wrong wheelbase; measure a straight run of known length first",
            }],
            runs_used: cw.x_m.count + ccw.x_m.count,
            ..Calibration::new(Self::NAME, drive(Self::NAME, diameter_m, separation_m)?, robot.ticks_per_rev)
        })
    }
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
