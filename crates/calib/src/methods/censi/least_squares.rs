//! The least squares of Censi et al.: displacements, the six parameters that predict them, and both
//! stationary solutions.
//!
//! The turn of a displacement is linear in J₂₁ and J₂₂. Given them, with x = (b, ℓ_x, ℓ_y, cos ℓ_θ, sin ℓ_θ),
//! the rest is the minimum of |Q x|² on cos² + sin² = 1: an eigenvalue problem of two dimensions once b, ℓ_x
//! and ℓ_y are eliminated.
//! Reference: Censi, Franchi, Marchionni, Oriolo 2013 (IEEE T-RO 29, 475–492).

use std::f64::consts::FRAC_PI_2;

use kinematics::{Increment, Pose, Wheels, wrap_to_pi};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Matrix3x6, Matrix6, Vector2, Vector3};

use crate::dead_reckoning_jacobian::{DeadReckoned, GeometryParameters};
use crate::estimate::{CalibError, Parameter};
use crate::settings::{MAX_POSITION_CONDITION, MAX_PROPORTION_OFFSET, MAX_TURN_CONDITION};

/// The method's name.
pub(super) const NAME: &str = "censi";

/// A measured displacement of the instrument, and how the wheels turned meanwhile.
#[derive(Debug, Clone, PartialEq)]
pub struct DisplacementSample {
    /// The run's id.
    pub run: String,
    /// Turns of both wheels, row by row, radians.
    pub wheel_rad: Vec<Wheels<f64>>,
    /// The instrument's later frame in its earlier one, whole turns counted.
    pub sensor_from_later: Pose,
}

impl DisplacementSample {
    fn whole_rad(&self) -> Vector2<f64> {
        self.wheel_rad.iter().fold(Vector2::zeros(), |sum, rad| sum + Vector2::new(rad.left, rad.right))
    }
}

/// The six parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CensiFit {
    /// Radius of each wheel, metres.
    pub radius_m: Wheels<f64>,
    /// Distance between the wheel contacts, metres.
    pub separation_m: f64,
    /// The instrument's frame on the robot.
    pub body_from_sensor: Pose,
}

/// One of the two stationary solutions with its cost Σ|Q x|², m².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StationarySolution {
    /// The six parameters.
    pub fit: CensiFit,
    /// Sum of squared position errors, m².
    pub cost_m2: f64,
}

impl CensiFit {
    fn geometry_parameters(&self) -> GeometryParameters {
        GeometryParameters { m_per_rad: self.radius_m, separation_m: self.separation_m }
    }

    pub(super) fn dead_reckon(&self, sample: &DisplacementSample) -> DeadReckoned {
        let mut dead_reckoned = DeadReckoned::at(Pose::IDENTITY);
        sample.wheel_rad.iter().for_each(|rad| dead_reckoned.advance(&self.geometry_parameters(), *rad));
        dead_reckoned
    }

    /// The predicted displacement of the instrument: ⊖ℓ ⊕ o ⊕ ℓ.
    #[must_use]
    pub fn predicted(&self, sample: &DisplacementSample) -> Pose {
        self.body_from_sensor.inverse() * self.dead_reckon(sample).pose * self.body_from_sensor
    }

    /// Predicted minus measured, in the instrument's earlier frame: x, y in metres, heading in radians.
    #[must_use]
    pub fn residual(&self, sample: &DisplacementSample) -> Vector3<f64> {
        let (predicted, measured) = (self.predicted(sample), sample.sensor_from_later);
        Vector3::new(
            predicted.x_m - measured.x_m,
            predicted.y_m - measured.y_m,
            wrap_to_pi(predicted.theta_rad - measured.theta_rad),
        )
    }

    /// ∂[`Self::predicted`]/∂(left radius, right radius, separation, ℓ_x, ℓ_y, ℓ_θ).
    #[must_use]
    pub fn jacobian(&self, sample: &DisplacementSample) -> Matrix3x6<f64> {
        let DeadReckoned { pose, by_geometry } = self.dead_reckon(sample);
        let place = self.body_from_sensor;
        let sensor_from_body = rotation(-place.theta_rad);
        let turned = rotation(pose.theta_rad);
        let lever = Vector2::new(place.x_m, place.y_m);
        // The lever arm sweeps sideways as the robot turns.
        let swept = rotation(pose.theta_rad + FRAC_PI_2) * lever;
        let by_length: Matrix2x3<f64> = by_geometry.fixed_rows::<2>(0) + swept * by_geometry.row(2);
        let predicted = self.predicted(sample);
        let mut jacobian = Matrix3x6::zeros();
        jacobian.fixed_view_mut::<2, 3>(0, 0).copy_from(&(sensor_from_body * by_length));
        jacobian.fixed_view_mut::<1, 3>(2, 0).copy_from(&by_geometry.row(2));
        jacobian.fixed_view_mut::<2, 2>(0, 3).copy_from(&(sensor_from_body * (turned - Matrix2::identity())));
        jacobian.fixed_view_mut::<2, 1>(0, 5).copy_from(&Vector2::new(predicted.y_m, -predicted.x_m));
        jacobian
    }

    /// Fisher information of the six parameters for normal errors of the instrument with standard deviations
    /// x, y (m) and heading (rad).
    #[must_use]
    pub fn information<'e>(
        &self,
        samples: impl Iterator<Item = &'e DisplacementSample>,
        sigma: Vector3<f64>,
    ) -> Matrix6<f64> {
        let weight = Matrix3::from_diagonal(&sigma.map(|sigma| 1.0 / (sigma * sigma)));
        samples.fold(Matrix6::zeros(), |sum, sample| {
            let jacobian = self.jacobian(sample);
            sum + jacobian.transpose() * weight * jacobian
        })
    }
}

fn rotation(theta_rad: f64) -> Matrix2<f64> {
    let (sin, cos) = theta_rad.sin_cos();
    Matrix2::new(cos, -sin, sin, cos)
}

/// Both stationary solutions of the constrained least squares, the cheaper one first.
///
/// # Errors
/// [`CalibError`] when the displacements do not determine the parameters.
pub fn solutions<'e>(
    samples: &mut (dyn Iterator<Item = &'e DisplacementSample> + '_),
) -> Result<[StationarySolution; 2], CalibError> {
    // First the turns, linear in J₂₁ and J₂₂.
    let samples: Vec<&DisplacementSample> = samples.collect();
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for sample in &samples {
        let whole_rad = sample.whole_rad();
        normal += whole_rad * whole_rad.transpose();
        right += whole_rad * sample.sensor_from_later.theta_rad;
    }
    excited(&normal)?;
    let turn_by_rad: Vector2<f64> = normal.lu().solve(&right).unwrap_or_default();
    // Then the rest. A robot with a separation of 1 and these turns moves by o/b.
    let unit =
        GeometryParameters { m_per_rad: Wheels { left: -turn_by_rad.x, right: turn_by_rad.y }, separation_m: 1.0 };
    let (mut place, mut mixed, mut heading) = (Matrix3::zeros(), Matrix3x2::zeros(), Matrix2::zeros());
    for sample in &samples {
        let by_separation = sample.wheel_rad.iter().fold(Pose::IDENTITY, |pose, rad| {
            let travel = unit.m_per_rad.zip_with(*rad, |m_per_rad, rad| m_per_rad * rad);
            pose * Increment::from_travel(travel, unit.separation_m).arc()
        });
        let (sin, cos) = by_separation.theta_rad.sin_cos();
        let measured = sample.sensor_from_later;
        let rows = Matrix2x3::new(-by_separation.x_m, 1.0 - cos, sin, -by_separation.y_m, -sin, 1.0 - cos);
        let turned = Matrix2::new(measured.x_m, -measured.y_m, measured.y_m, measured.x_m);
        place += rows.transpose() * rows;
        mixed += rows.transpose() * turned;
        heading += turned.transpose() * turned;
    }
    let eigenvalues = place.symmetric_eigenvalues();
    let unobservable = CalibError::Unobservable {
        method: NAME,
        parameter: Parameter::SensorX,
        why: "between two measurements the robot turns by nothing or by whole turns only; add measurements after quarter turns"
            .to_owned(),
    };
    if eigenvalues.min() * MAX_POSITION_CONDITION <= eigenvalues.max() {
        return Err(unobservable);
    }
    let inverse = place.try_inverse().ok_or(unobservable)?;
    // With (b, ℓ_x, ℓ_y) at their best for a heading, the cost is a quadratic form in (cos, sin); its
    // eigenvectors are the stationary solutions, the multiplier of the print is minus the eigenvalue.
    let form = heading - mixed.transpose() * inverse * mixed;
    let eigen = form.symmetric_eigen();
    let solution = |column: usize| {
        let direction: Vector2<f64> = eigen.eigenvectors.column(column).into_owned();
        let others = -(inverse * mixed * direction);
        // x and −x cost the same: the axle is positive.
        let sign = others.x.signum();
        let separation_m = sign * others.x;
        let theta_rad = (sign * direction.y).atan2(sign * direction.x);
        StationarySolution {
            fit: CensiFit {
                radius_m: unit.m_per_rad.map(|ratio| ratio * separation_m),
                separation_m,
                body_from_sensor: Pose::new(sign * others.y, sign * others.z, theta_rad),
            },
            cost_m2: eigen.eigenvalues[column],
        }
    };
    let (best, other) = if eigen.eigenvalues[0] <= eigen.eigenvalues[1] { (0, 1) } else { (1, 0) };
    Ok([solution(best), solution(other)])
}

/// Refuses wheel turns that are all in one proportion.
fn excited(normal: &Matrix2<f64>) -> Result<(), CalibError> {
    let eigen = normal.symmetric_eigen();
    let (weak, strong) = if eigen.eigenvalues[0] < eigen.eigenvalues[1] { (0, 1) } else { (1, 0) };
    let condition = eigen.eigenvalues[strong] / eigen.eigenvalues[weak];
    if condition > 0.0 && condition <= MAX_TURN_CONDITION {
        return Ok(());
    }
    if eigen.eigenvalues[strong] <= 0.0 {
        return Err(CalibError::NotApplicable {
            method: NAME,
            why: "the wheels do not turn between two measurements of the instrument".to_owned(),
        });
    }
    let proportion = eigen.eigenvectors.column(strong);
    let (left, right) = (proportion[0], proportion[1]);
    let missing = if (left - right).abs() < MAX_PROPORTION_OFFSET {
        "the robot drives straight: add spins, or arcs to both sides"
    } else if (left + right).abs() < MAX_PROPORTION_OFFSET {
        "the robot spins: add straight runs"
    } else {
        "the robot drives one arc: add straight runs and spins, or arcs to the other side"
    };
    // Of motions that are exactly in one proportion the condition has no end.
    let found = if condition.is_finite() { format!("condition {condition:.0}") } else { "singular".to_owned() };
    let why = format!(
        "the wheels turn almost always in one proportion ({found}; condition at most {MAX_TURN_CONDITION}), since {missing}"
    );
    Err(CalibError::Unobservable { method: NAME, parameter: Parameter::WheelSeparation, why })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in super::super) const TRUTH: CensiFit = CensiFit {
        radius_m: Wheels { left: 0.0811, right: 0.0797 },
        separation_m: 0.363,
        body_from_sensor: Pose::new(0.12, -0.05, 0.4),
    };

    /// The displacement of the instrument by these wheel turns, row by row.
    fn measured(fit: &CensiFit, wheel_rad: &[(f64, f64)]) -> DisplacementSample {
        let wheel_rad = wheel_rad.iter().map(|&(left, right)| Wheels { left, right }).collect();
        let mut sample = DisplacementSample { run: "run".to_owned(), wheel_rad, sensor_from_later: Pose::IDENTITY };
        sample.sensor_from_later = fit.predicted(&sample);
        sample
    }

    /// Straights and turns both ways, bent in themselves.
    pub(in super::super) fn samples(fit: &CensiFit) -> Vec<DisplacementSample> {
        let turns: [&[(f64, f64)]; 6] = [
            &[(3.0, 3.1), (2.0, 1.0)],
            &[(-2.0, 2.0)],
            &[(4.0, 4.0)],
            &[(1.0, -2.5), (3.0, 3.0)],
            &[(-3.0, -3.0), (1.0, 2.0)],
            &[(2.0, 5.0)],
        ];
        turns.iter().map(|wheel_rad| measured(fit, wheel_rad)).collect()
    }

    pub(in super::super) fn off(found: &CensiFit, truth: &CensiFit) -> f64 {
        let place = truth.body_from_sensor.to(found.body_from_sensor);
        [
            found.radius_m.left / truth.radius_m.left - 1.0,
            found.radius_m.right / truth.radius_m.right - 1.0,
            found.separation_m / truth.separation_m - 1.0,
            place.x_m,
            place.y_m,
            wrap_to_pi(place.theta_rad),
        ]
        .into_iter()
        .map(f64::abs)
        .fold(0.0, f64::max)
    }

    #[test]
    fn without_errors_the_cheaper_solution_is_the_robot_and_the_other_one_is_not() {
        for theta_rad in [0.4, -1.6, 3.1] {
            let truth = CensiFit { body_from_sensor: Pose::new(0.12, -0.05, theta_rad), ..TRUTH };
            let [best, other] = solutions(&mut samples(&truth).iter()).expect("excited");
            // Normal equations of a condition of about 10 twice over: a hundred roundings.
            assert!(off(&best.fit, &truth) < 1e-13, "{best:?}");
            assert!(off(&other.fit, &truth) > 0.1 && other.cost_m2 > 1e-2 && best.cost_m2 < 1e-12, "{other:?}");
        }
    }

    #[test]
    fn an_interval_taken_for_one_arc_would_not_pass() {
        let mut whole = samples(&TRUTH);
        for sample in &mut whole {
            let sum = sample.whole_rad();
            sample.wheel_rad = vec![Wheels { left: sum.x, right: sum.y }];
        }
        let [best, _] = solutions(&mut whole.iter()).expect("excited");
        assert!(off(&best.fit, &TRUTH) > 1e-2);
    }

    #[test]
    fn the_jacobian_is_the_derivative_and_would_not_pass_wrong() {
        let h = 1e-6;
        for sample in samples(&TRUTH) {
            let jacobian = TRUTH.jacobian(&sample);
            for column in 0..6 {
                let moved = |by: f64| {
                    let mut fit = TRUTH;
                    let place = &mut fit.body_from_sensor;
                    *[
                        &mut fit.radius_m.left,
                        &mut fit.radius_m.right,
                        &mut fit.separation_m,
                        &mut place.x_m,
                        &mut place.y_m,
                        &mut place.theta_rad,
                    ][column] += by;
                    let Pose { x_m, y_m, theta_rad } = fit.predicted(&sample);
                    Vector3::new(x_m, y_m, theta_rad)
                };
                let difference = (moved(h) - moved(-h)) / (2.0 * h);
                // Under a metre and 1.3 rad: third derivatives by a radius under (10/0.363)³ ≈ 2e4,
                // truncation 4e-9; rounding 1e-16/1e-6.
                let tolerance = 1e-8;
                assert!((jacobian.column(column) - difference).amax() < tolerance, "{column}");
                assert!((jacobian.column(column).add_scalar(1e-3) - difference).abs().min() > tolerance);
            }
        }
    }

    fn message(samples: &[DisplacementSample]) -> String {
        solutions(&mut samples.iter()).expect_err("not excited").to_string()
    }

    #[test]
    fn what_does_not_excite_is_refused_with_what_is_missing() {
        let all = |wheel_rad: &[(f64, f64)]| [measured(&TRUTH, wheel_rad), measured(&TRUTH, wheel_rad)];
        assert!(message(&all(&[(4.0, 4.01)])).contains("drives straight: add spins"));
        assert!(message(&all(&[(-2.0, 2.01)])).contains("spins: add straight runs"));
        assert!(message(&all(&[(1.0, 3.0)])).contains("drives one arc"));
        assert!(message(&all(&[(0.0, 0.0)])).contains("do not turn"));
        // Straights, and spins by whole turns: the sensor's position is not observable.
        let whole_rad = std::f64::consts::TAU * 0.363 / (0.0811 + 0.0797);
        let whole = [measured(&TRUTH, &[(4.0, 4.0)]), measured(&TRUTH, &[(-whole_rad, whole_rad)])];
        assert!(message(&whole).contains("whole turns only"), "{}", message(&whole));
        // The limit itself, from both sides.
        let normal = |ratio: f64| Matrix2::from_diagonal(&Vector2::new(1.0, ratio));
        assert!(excited(&normal(1.0 / (0.999 * MAX_TURN_CONDITION))).is_ok());
        assert!(excited(&normal(1.0 / (1.001 * MAX_TURN_CONDITION))).is_err());
    }
}
