//! `censi`: both wheels, the axle and where the instrument sits, six parameters at once, from what the instrument saw between pairs of instants.
//!
//! Model: the instrument at ℓ on the robot sees s = ⊖ℓ ⊕ o ⊕ ℓ where the robot moved by o. The turn of o is J₂₁ Φ_L + J₂₂ Φ_R in the wheels' turns Φ, with
//! J₂₁ = −r_L/b and J₂₂ = r_R/b: linear least squares. Given them the rest is Q x = 0 with x = (b, ℓ_x, ℓ_y, cos ℓ_θ, sin ℓ_θ): the minimum of |Q x|² on
//! cos² + sin² = 1. It has two stationary solutions; the cheaper one is taken. Then the worst 1 % in position or heading are dropped, and all over, four times.
//! Assumptions: the instrument's error is alike in all directions and the wheels' own is small beside it. Rows of the log are arcs (the print takes the whole
//! interval for one). Positions alone and marks without poses are not enough.
//! Observability: all six, from two proportions of the wheels' turns: straights and turns. A single circle and a path without turns are refused.
//! Reference: Censi, Franchi, Marchionni, Oriolo 2013 (IEEE T-RO 29, 475–492); the trimming is their program's.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use dataset::{RunView, Session};
use kinematics::{Increment, Pose, Wheels, unwrap_near, wrap_to_pi};
use motion_programs::Schedule;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Matrix3x6, Matrix6, Vector2, Vector3};

use crate::dead_reckoning_jacobian::{DeadReckoned, GeometryParameters};
use crate::estimate::{CalibError, Calibration, Covariance, Extrinsics, Method, Parameter, Rejected, drive, nominal};
use crate::pose_measurements::{PoseMeasurement, PoseMeasurements, Spacing};
use crate::robust::left_of_variance;
use crate::settings::{
    DISPLACEMENT_DISTANCE_M, DISPLACEMENT_TURN_RAD, MAX_POSITION_CONDITION, MAX_PROPORTION_OFFSET, MAX_TURN_CONDITION,
    MIN_COST_RATIO, MIN_DISPLACEMENT_SIGMA, TRIMMED_SHARE, TRIMMING_ROUNDS,
};
use estimation::WheelAngleInterpolator;

/// The method with its trimming and its limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Censi {
    /// How often the worst displacements are dropped.
    pub rounds: u32,
    /// Which share of them goes each time, for its position and for its heading.
    pub trimmed_share: f64,
    /// Where the instrument gives poses, two that follow each other lie at least so far apart by the nominal robot, metres, …
    pub least_distance_m: f64,
    /// … or so much turn, radians: the error of a displacement does not shrink with its length.
    pub least_turn_rad: f64,
}

/// A displacement that the instrument saw, and how the wheels turned meanwhile.
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

/// A fit after trimming, and what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Trimmed {
    /// The six parameters.
    pub fit: CensiFit,
    /// Which excursions were kept, in their order.
    pub kept: Vec<bool>,
    /// Shares that were dropped for their position and for their heading.
    pub dropped: (f64, f64),
}

/// One of the two stationary solutions with its cost Σ|Q x|², m².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// The six parameters.
    pub fit: CensiFit,
    /// Sum of squared position errors, m².
    pub cost_m2: f64,
}

impl CensiFit {
    fn geometry_parameters(&self) -> GeometryParameters {
        GeometryParameters { m_per_rad: self.radius_m, separation_m: self.separation_m }
    }

    fn reckon(&self, sample: &DisplacementSample) -> DeadReckoned {
        let mut dead_reckoned = DeadReckoned::at(Pose::IDENTITY);
        sample.wheel_rad.iter().for_each(|rad| dead_reckoned.advance(&self.geometry_parameters(), *rad));
        dead_reckoned
    }

    /// What the instrument should have seen: ⊖ℓ ⊕ o ⊕ ℓ.
    #[must_use]
    pub fn predicted(&self, sample: &DisplacementSample) -> Pose {
        self.body_from_sensor.inverse() * self.reckon(sample).pose * self.body_from_sensor
    }

    /// Predicted minus seen, in the instrument's earlier frame: x, y in metres, heading in radians.
    #[must_use]
    pub fn residual(&self, sample: &DisplacementSample) -> Vector3<f64> {
        let (predicted, seen) = (self.predicted(sample), sample.sensor_from_later);
        Vector3::new(
            predicted.x_m - seen.x_m,
            predicted.y_m - seen.y_m,
            wrap_to_pi(predicted.theta_rad - seen.theta_rad),
        )
    }

    /// ∂[`Self::predicted`]/∂(left radius, right radius, separation, ℓ_x, ℓ_y, ℓ_θ).
    #[must_use]
    pub fn jacobian(&self, sample: &DisplacementSample) -> Matrix3x6<f64> {
        let DeadReckoned { pose, by_geometry } = self.reckon(sample);
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

    /// Fisher information of the six parameters for normal errors of the instrument with standard deviations x, y (m) and heading (rad).
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

fn not_applicable(why: impl Into<String>) -> CalibError {
    CalibError::NotApplicable { method: Censi::NAME, why: why.into() }
}

impl Censi {
    /// The method as the table of contents offers it, with the authors' trimming.
    pub const DEFAULT: Self = Self {
        rounds: TRIMMING_ROUNDS,
        trimmed_share: TRIMMED_SHARE,
        least_distance_m: DISPLACEMENT_DISTANCE_M,
        least_turn_rad: DISPLACEMENT_TURN_RAD,
    };

    const NAME: &'static str = "censi";

    /// What the instrument saw in all sessions: displacements where a run has them, else pairs of poses that follow each other.
    #[must_use]
    pub fn samples(&self, sessions: &[Session<'_>]) -> Vec<DisplacementSample> {
        let mut samples = Vec::new();
        for session in sessions {
            let Ok(geometry) = session.robot.geometry() else { continue };
            let nominal = CensiFit {
                radius_m: geometry.m_per_rad(),
                separation_m: geometry.wheel_separation_m(),
                body_from_sensor: Pose::IDENTITY,
            };
            for run in &session.runs {
                let Some(track) = WheelAngleInterpolator::of(run, session.robot) else { continue };
                if run.run().displacements.is_empty() {
                    let spacing = Spacing { every_m: self.least_distance_m, every_rad: self.least_turn_rad };
                    let Some(measurements) = PoseMeasurements::at(run, &track, &geometry, spacing) else { continue };
                    let mut before = measurements.start;
                    samples.extend(measurements.later.into_iter().filter_map(|PoseMeasurement { wheel_rad, pose }| {
                        let seen = before.to(pose);
                        before = pose;
                        sample(run, &nominal, wheel_rad, seen)
                    }));
                } else {
                    samples.extend(run.run().displacements.iter().filter_map(|seen| {
                        let later = Pose::new(seen.dx_m, seen.dy_m, seen.dtheta_rad);
                        sample(run, &nominal, track.steps(seen.t0_s, seen.t1_s)?, later)
                    }));
                }
            }
        }
        samples
    }

    /// Fits, drops the worst and fits again, as often as [`Self::rounds`] says.
    ///
    /// # Errors
    /// [`CalibError`] when the excursions do not determine the parameters.
    pub fn trimmed(&self, samples: &[DisplacementSample]) -> Result<Trimmed, CalibError> {
        let mut kept = vec![true; samples.len()];
        let mut dropped = (0, 0);
        for _ in 0..self.rounds {
            let [Solution { fit, .. }, _] = solutions(&mut among(samples, &kept).map(|(_, sample)| sample))?;
            let errors: Vec<(usize, f64, f64)> = among(samples, &kept)
                .map(|(index, sample)| {
                    let residual = fit.residual(sample);
                    (index, residual.x.hypot(residual.y), residual.z.abs())
                })
                .collect();
            let last = ((1.0 - self.trimmed_share) * errors.len() as f64).round() as usize;
            let limit = |of: fn(&(usize, f64, f64)) -> f64| {
                let mut sorted: Vec<f64> = errors.iter().map(of).collect();
                sorted.sort_by(f64::total_cmp);
                sorted.get(last).copied().unwrap_or(f64::INFINITY)
            };
            let (limit_m, limit_rad) = (limit(|error| error.1), limit(|error| error.2));
            for (index, error_m, error_rad) in errors {
                kept[index] = error_m <= limit_m && error_rad <= limit_rad;
                dropped.0 += usize::from(error_m > limit_m);
                dropped.1 += usize::from(error_rad > limit_rad);
            }
        }
        let [cheap, dear] = solutions(&mut among(samples, &kept).map(|(_, sample)| sample))?;
        if dear.cost_m2 <= MIN_COST_RATIO * cheap.cost_m2.max(0.0) {
            return Err(CalibError::Unobservable {
                method: Self::NAME,
                parameter: Parameter::SensorTheta,
                why: "the instrument sees no translation that stands out from its error; add straight runs".to_owned(),
            });
        }
        let share = |count: usize| count as f64 / samples.len() as f64;
        Ok(Trimmed { fit: cheap.fit, kept, dropped: (share(dropped.0), share(dropped.1)) })
    }
}

fn sample(
    run: &RunView<'_>,
    nominal: &CensiFit,
    wheel_rad: Vec<Wheels<f64>>,
    seen: Pose,
) -> Option<DisplacementSample> {
    let mut sample = DisplacementSample { run: run.info().id.clone(), wheel_rad, sensor_from_later: seen };
    // Standing still says nothing, and its small errors would make those of motion look like outliers.
    if sample.wheel_rad.iter().all(|rad| rad.left == 0.0 && rad.right == 0.0) {
        return None;
    }
    // Whole turns come from the wheels.
    let about_rad = nominal.reckon(&sample).pose.theta_rad;
    sample.sensor_from_later.theta_rad = unwrap_near(seen.theta_rad, about_rad);
    Some(sample)
}

fn among<'e>(
    samples: &'e [DisplacementSample],
    kept: &'e [bool],
) -> impl Iterator<Item = (usize, &'e DisplacementSample)> {
    samples.iter().enumerate().filter(|(index, _)| kept[*index])
}

/// Both stationary solutions of the constrained least squares, the cheaper one first.
///
/// # Errors
/// [`CalibError`] when the excursions do not determine the parameters.
pub fn solutions<'e>(
    samples: &mut (dyn Iterator<Item = &'e DisplacementSample> + '_),
) -> Result<[Solution; 2], CalibError> {
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
        let seen = sample.sensor_from_later;
        let rows = Matrix2x3::new(-by_separation.x_m, 1.0 - cos, sin, -by_separation.y_m, -sin, 1.0 - cos);
        let turned = Matrix2::new(seen.x_m, -seen.y_m, seen.y_m, seen.x_m);
        place += rows.transpose() * rows;
        mixed += rows.transpose() * turned;
        heading += turned.transpose() * turned;
    }
    let eigenvalues = place.symmetric_eigenvalues();
    let unobservable = CalibError::Unobservable {
        method: Censi::NAME,
        parameter: Parameter::SensorX,
        why: "between two measurements the robot turns by nothing or by whole turns only; add measurements after quarter turns"
            .to_owned(),
    };
    if eigenvalues.min() * MAX_POSITION_CONDITION <= eigenvalues.max() {
        return Err(unobservable);
    }
    let inverse = place.try_inverse().ok_or(unobservable)?;
    // With (b, ℓ_x, ℓ_y) at their best for a heading, the cost is a quadratic form in (cos, sin); its eigenvectors are the stationary solutions, the multiplier of the
    // print is minus the eigenvalue.
    let form = heading - mixed.transpose() * inverse * mixed;
    let eigen = form.symmetric_eigen();
    let solution = |column: usize| {
        let direction: Vector2<f64> = eigen.eigenvectors.column(column).into_owned();
        let others = -(inverse * mixed * direction);
        // x and −x cost the same: the axle is positive.
        let sign = others.x.signum();
        let separation_m = sign * others.x;
        let theta_rad = (sign * direction.y).atan2(sign * direction.x);
        Solution {
            fit: CensiFit {
                radius_m: unit.m_per_rad.map(|ratio| ratio * separation_m),
                separation_m,
                body_from_sensor: Pose::new(sign * others.y, sign * others.z, theta_rad),
            },
            cost_m2: eigen.eigenvalues[column],
        }
    };
    let (cheap, dear) = if eigen.eigenvalues[0] <= eigen.eigenvalues[1] { (0, 1) } else { (1, 0) };
    Ok([solution(cheap), solution(dear)])
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
        return Err(not_applicable("the wheels do not turn between two measurements of the instrument"));
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
    let why = format!(
        "the wheels turn almost always in one proportion (condition {condition:.0}, at most {MAX_TURN_CONDITION}), since {missing}"
    );
    Err(CalibError::Unobservable { method: Censi::NAME, parameter: Parameter::WheelSeparation, why })
}

impl Method for Censi {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn about(&self) -> &'static str {
        "both wheels, wheelbase and the instrument's place on the robot, from displacements or poses along any path with turns"
    }

    /// The authors drove at random; straights and quarter turns excite the same.
    fn protocol(&self) -> Vec<Schedule> {
        vec![Schedule::Straights { length_m: 0.5, runs: 40 }, Schedule::Spins { turn_rad: FRAC_PI_2, runs: 40 }]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, _) = nominal(Self::NAME, sessions)?;
        let samples = self.samples(sessions);
        if samples.is_empty() {
            return Err(not_applicable(
                "no run has displacements (displacement.csv) or two poses (truth.csv with headings, or two marked points) while the wheels turn",
            ));
        }
        let Trimmed { fit, kept, dropped } = self.trimmed(&samples)?;
        let mut by_run: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
        for (sample, kept) in samples.iter().zip(&kept) {
            let (all, lost) = by_run.entry(&sample.run).or_default();
            *all += 1;
            *lost += usize::from(!kept);
        }
        let runs_rejected = by_run
            .iter()
            .filter(|(_, (_, lost))| *lost > 0)
            .map(|(run, (all, lost))| Rejected {
                run: (*run).to_owned(),
                why: format!("{lost} of {all} displacements are among the worst"),
            })
            .collect();

        let covariance = covariance(&fit, &samples, &kept, dropped);
        let block = |covariance: &Matrix6<f64>| {
            let mut scale = Matrix3::identity();
            scale[(0, 0)] = 2.0; // radii to diameters
            scale[(1, 1)] = 2.0;
            let drive = scale * covariance.fixed_view::<3, 3>(0, 0) * scale;
            Covariance::from_column_slice(3, 3, drive.as_slice())
        };
        let geometry = drive(Self::NAME, fit.radius_m.map(|radius_m| 2.0 * radius_m), fit.separation_m)?;
        Ok(Calibration {
            covariance: covariance.as_ref().map(block),
            extrinsics: Some(Extrinsics {
                body_from_sensor: fit.body_from_sensor,
                covariance: covariance.map(|covariance| covariance.fixed_view::<3, 3>(3, 3).into_owned()),
            }),
            runs_used: by_run.len(),
            runs_rejected,
            ..Calibration::new(Self::NAME, geometry, robot.ticks_per_rev)
        })
    }
}

/// Inverse Fisher information with the instrument's error as the kept residuals show it, made up for what trimming took of them.
fn covariance(
    fit: &CensiFit,
    samples: &[DisplacementSample],
    kept: &[bool],
    dropped: (f64, f64),
) -> Option<Matrix6<f64>> {
    let (sum, count) = among(samples, kept).fold((Vector3::zeros(), 0.0), |(sum, count), (_, sample)| {
        let residual = fit.residual(sample);
        (sum + residual.component_mul(&residual), count + 1.0)
    });
    // Three readings an excursion, six parameters.
    let degrees_of_freedom = count - 2.0;
    if degrees_of_freedom < 1.0 {
        return None;
    }
    let (plane, axis) = left_of_variance(dropped);
    let var = (sum / degrees_of_freedom).component_div(&Vector3::new(plane, plane, axis));
    let sigma = var.map(|var| var.sqrt().max(MIN_DISPLACEMENT_SIGMA));
    fit.information(among(samples, kept).map(|(_, sample)| sample), sigma).try_inverse()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRUTH: CensiFit = CensiFit {
        radius_m: Wheels { left: 0.0811, right: 0.0797 },
        separation_m: 0.363,
        body_from_sensor: Pose::new(0.12, -0.05, 0.4),
    };

    /// What the instrument sees of these wheel turns, row by row.
    fn seen(fit: &CensiFit, wheel_rad: &[(f64, f64)]) -> DisplacementSample {
        let wheel_rad = wheel_rad.iter().map(|&(left, right)| Wheels { left, right }).collect();
        let mut sample = DisplacementSample { run: "run".to_owned(), wheel_rad, sensor_from_later: Pose::IDENTITY };
        sample.sensor_from_later = fit.predicted(&sample);
        sample
    }

    /// Straights and turns both ways, bent in themselves.
    fn samples(fit: &CensiFit) -> Vec<DisplacementSample> {
        let turns: [&[(f64, f64)]; 6] = [
            &[(3.0, 3.1), (2.0, 1.0)],
            &[(-2.0, 2.0)],
            &[(4.0, 4.0)],
            &[(1.0, -2.5), (3.0, 3.0)],
            &[(-3.0, -3.0), (1.0, 2.0)],
            &[(2.0, 5.0)],
        ];
        turns.iter().map(|wheel_rad| seen(fit, wheel_rad)).collect()
    }

    fn off(found: &CensiFit, truth: &CensiFit) -> f64 {
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
            let [cheap, dear] = solutions(&mut samples(&truth).iter()).expect("excited");
            // Normal equations of a condition of about 10 twice over: a hundred roundings.
            assert!(off(&cheap.fit, &truth) < 1e-13, "{cheap:?}");
            assert!(off(&dear.fit, &truth) > 0.1 && dear.cost_m2 > 1e-2 && cheap.cost_m2 < 1e-12, "{dear:?}");
        }
    }

    #[test]
    fn an_interval_taken_for_one_arc_would_not_pass() {
        let mut whole = samples(&TRUTH);
        for sample in &mut whole {
            let sum = sample.whole_rad();
            sample.wheel_rad = vec![Wheels { left: sum.x, right: sum.y }];
        }
        let [cheap, _] = solutions(&mut whole.iter()).expect("excited");
        assert!(off(&cheap.fit, &TRUTH) > 1e-2);
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
                // Under a metre and 1.3 rad: third derivatives by a radius under (10/0.363)³ ≈ 2e4, truncation 4e-9; rounding 1e-16/1e-6.
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
        let all = |wheel_rad: &[(f64, f64)]| [seen(&TRUTH, wheel_rad), seen(&TRUTH, wheel_rad)];
        assert!(message(&all(&[(4.0, 4.01)])).contains("drives straight: add spins"));
        assert!(message(&all(&[(-2.0, 2.01)])).contains("spins: add straight runs"));
        assert!(message(&all(&[(1.0, 3.0)])).contains("drives one arc"));
        assert!(message(&all(&[(0.0, 0.0)])).contains("do not turn"));
        // Straights, and spins by whole turns: where the instrument sits does not show.
        let whole_rad = std::f64::consts::TAU * 0.363 / (0.0811 + 0.0797);
        let whole = [seen(&TRUTH, &[(4.0, 4.0)]), seen(&TRUTH, &[(-whole_rad, whole_rad)])];
        assert!(message(&whole).contains("whole turns only"), "{}", message(&whole));
        // The limit itself, from both sides.
        let normal = |ratio: f64| Matrix2::from_diagonal(&Vector2::new(1.0, ratio));
        assert!(excited(&normal(1.0 / (0.999 * MAX_TURN_CONDITION))).is_ok());
        assert!(excited(&normal(1.0 / (1.001 * MAX_TURN_CONDITION))).is_err());
    }

    #[test]
    fn the_worst_in_position_or_heading_go_each_round() {
        let mut all: Vec<DisplacementSample> = (0..40).flat_map(|_| samples(&TRUTH)).collect();
        all[7].sensor_from_later.x_m += 0.3;
        all[11].sensor_from_later.theta_rad += 0.3;
        let trimmed = Censi::DEFAULT.trimmed(&all).expect("excited");
        assert!(!trimmed.kept[7] && !trimmed.kept[11]);
        assert!(off(&trimmed.fit, &TRUTH) < 1e-12, "{:?}", trimmed.fit);
        let untrimmed = Censi { rounds: 0, ..Censi::DEFAULT }.trimmed(&all).expect("excited");
        assert!(untrimmed.kept.iter().all(|kept| *kept) && off(&untrimmed.fit, &TRUTH) > 1e-4);
    }
}
