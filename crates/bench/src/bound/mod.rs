//! The Cramér–Rao bound of a protocol: how well its runs can tell the drive's geometry, whoever estimates.
//!
//! Model: a run is a state-space system, linear about its true path; a measurement's innovation has
//! covariance S and slope H in the geometry, so I = Σ Hᵀ S⁻¹ H, and no unbiased estimator varies less than
//! (I⁻¹)ⱼⱼ. Every run's start pose is unknown. What S itself tells of the geometry (Kay's second term) is
//! left out: with it the bounds of the paper's protocol would be 1.4e-4 of themselves lower, those of its
//! squares alone 0.5 %.
//! Assumptions: errors are Gaussian with the simulator's second moments. Where they are uniform (rounded
//! counts, the grid's rounding) the bound is that of the best *linear* estimator (Gauss–Markov), and others
//! can beat it where rounding dominates: who knows the commanded counts needs no recorded ones. Not in it:
//! whatever the robot has beyond geometry, wheel noise, contact patch and rounding (slip, play, latency,
//! blunders), so that its harm shows as a ratio above one. Both engines have the same formulas; a stepped
//! robot also settles after a motion and is seen a few times more. Of a gyroscope, a tape measure, a wall or
//! a return the bias, the wall's place and the start are unknown in every run, the scale is the same in all.
//! Reference: Kay, Fundamentals of Statistical Signal Processing: Estimation Theory, 1993, eq. 3.31; Schweppe
//! 1965 for the innovations' form.

mod error;
mod filter;
mod innovation;
mod model;
mod partial;
mod timeline;

use calib::Parameter;
use motion_programs::{Motion, MotionProgram};
use nalgebra::{Matrix3, Matrix4, SymmetricEigen, Vector3};
use scenario::Scenario;

pub use error::NoBound;
use filter::{Filter, RunInformation};
pub use innovation::LinearizedInnovation;
use model::Model;
use timeline::Timeline;

impl LinearizedInnovation {
    /// The innovations of the poses of one run, in order. Its first measurement finds where it starts and is
    /// none.
    ///
    /// # Errors
    /// [`NoBound`] with the reason.
    pub fn of_run(scenario: &Scenario, program: &MotionProgram) -> Result<Vec<Self>, NoBound> {
        Ok(run_information(&Model::of(scenario)?, &program.motions)?.innovations)
    }
}

/// What the measurements of a run tell.
fn run_information(model: &Model, motions: &[Motion]) -> Result<RunInformation, NoBound> {
    Filter::run(model, &Timeline::of(model, motions))
}

/// An eigenvalue below this share of the largest is rounding: a few hundred terms, each good to 1e-16 of the
/// largest.
const ROUNDING_SHARE: f64 = 1e-12;

/// A parameter with more than this share in directions that are not seen at all is not seen. Rounding turns
/// eigenvectors by 1e-16 of the gap between their eigenvalues; a parameter that takes part in what is not
/// seen, as all do in the common scale, has a tenth or more.
const UNOBSERVABLE_SHARE: f64 = 1e-9;

/// What is told without error has this many times the information of the best known direction: its own
/// variance is then a millionth of any other.
const EXACT_INFORMATION_FACTOR: f64 = 1e6;

/// What a protocol's runs can tell of the drive's geometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FisherInformation {
    matrix: Matrix3<f64>,
    /// Left diameter, right diameter, separation of the true drive, metres.
    geometry_m: Vector3<f64>,
    /// Travel of a wheel by a tick over its diameter, π over the ticks of a turn.
    per_tick: f64,
}

impl FisherInformation {
    /// The information of some programs, driven by a scenario's robot, at its true geometry.
    ///
    /// # Errors
    /// [`NoBound`] with the reason.
    pub fn of(scenario: &Scenario, programs: &[MotionProgram]) -> Result<Self, NoBound> {
        let model = Model::of(scenario)?;
        // Where a run starts changes nothing, instruments being the same everywhere: what is driven alike
        // tells alike.
        let mut kinds: Vec<(&MotionProgram, f64)> = Vec::new();
        for program in programs {
            match kinds.iter_mut().find(|(kind, _)| kind.motions == program.motions) {
                Some((_, runs)) => *runs += 1.0,
                None => kinds.push((program, 1.0)),
            }
        }
        let (mut matrix, mut in_part) = (Matrix3::zeros(), Matrix4::zeros());
        for (program, runs) in kinds {
            let RunInformation { innovations, partial } = run_information(&model, &program.motions)?;
            matrix += runs * innovations.iter().map(LinearizedInnovation::information).sum::<Matrix3<f64>>();
            in_part += runs * partial;
        }
        matrix += partial::without_scale(in_part, model.scale_sigma);
        let diameter_m = model.geometry.wheel_diameter_m();
        Ok(Self {
            matrix,
            geometry_m: Vector3::new(diameter_m.left, diameter_m.right, model.geometry.wheel_separation_m()),
            per_tick: std::f64::consts::PI / model.ticks_per_turn(),
        })
    }

    /// The information matrix, 1/m²; order: left diameter, right diameter, separation.
    #[must_use]
    pub const fn matrix(&self) -> &Matrix3<f64> {
        &self.matrix
    }

    /// The information where the mean of both diameters is known too, as UMBmark has it: its bound is that of
    /// the other parameters.
    #[must_use]
    pub fn given_mean_diameter(&self) -> Self {
        let mean = Vector3::new(0.5, 0.5, 0.0);
        let exact = EXACT_INFORMATION_FACTOR * self.matrix.symmetric_eigenvalues().max();
        Self { matrix: self.matrix + exact * mean * mean.transpose(), ..*self }
    }

    /// The least variance of an unbiased estimator of `parameter`, in the square of its unit; `None` when
    /// these runs do not show it: their information is singular in its direction, or leaves a standard
    /// deviation above the value itself, where a model linear about the truth says nothing.
    #[must_use]
    pub fn bound_var(&self, parameter: Parameter) -> Option<f64> {
        let (row, unit) = match parameter {
            Parameter::LeftWheelDiameter => (0, 1.0),
            Parameter::RightWheelDiameter => (1, 1.0),
            Parameter::WheelSeparation => (2, 1.0),
            Parameter::LeftPerTick => (0, self.per_tick),
            Parameter::RightPerTick => (1, self.per_tick),
            _ => return None,
        };
        // In shares of the values, so that eigenvalues compare: one of λ is a direction known to 1/√λ of its
        // value.
        let scale = Matrix3::from_diagonal(&self.geometry_m);
        let eigen = SymmetricEigen::new(scale * self.matrix * scale);
        let rounding = ROUNDING_SHARE * eigen.eigenvalues.max();
        let (mut variance, mut unobservable) = (0.0, 0.0);
        for (direction, &eigenvalue) in eigen.eigenvectors.column_iter().zip(&eigen.eigenvalues) {
            let share = direction[row] * direction[row];
            if eigenvalue > rounding {
                variance += share / eigenvalue;
            } else {
                unobservable += share;
            }
        }
        (unobservable < UNOBSERVABLE_SHARE && variance < 1.0).then(|| variance * (self.geometry_m[row] * unit).powi(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn information(matrix: Matrix3<f64>) -> FisherInformation {
        FisherInformation { matrix, geometry_m: Vector3::new(0.16, 0.16, 0.363), per_tick: 2.0 }
    }

    #[test]
    fn variances_are_those_of_the_inverse() {
        let root = Matrix3::new(3e4, -1e4, 2e3, 0.0, 2e4, 5e3, 1e3, 0.0, 4e3);
        let matrix = root.transpose() * root;
        let inverse = matrix.try_inverse().expect("regular");
        let information = information(matrix);
        for (row, parameter) in Parameter::LENGTHS.into_iter().enumerate() {
            let var = information.bound_var(parameter).expect("seen");
            // The condition of the matrix, about 1e2, times the rounding of a double.
            assert!((var / inverse[(row, row)] - 1.0).abs() < 1e-12, "{parameter:?}");
        }
        let left = information.bound_var(Parameter::LeftWheelDiameter).expect("seen");
        assert!((information.bound_var(Parameter::LeftPerTick).expect("seen") / (4.0 * left) - 1.0).abs() < 1e-15);
        assert_eq!(information.bound_var(Parameter::CommonScale), None);
    }

    #[test]
    fn a_known_mean_diameter_leaves_the_bound_of_the_difference() {
        // Both diameters, to σ each: their difference to √2 σ, and with the mean each is known to half
        // of that.
        let sigma_m = 1e-4_f64;
        let separate = information(Matrix3::from_diagonal_element(1.0 / (sigma_m * sigma_m)));
        let given_mean = separate.given_mean_diameter();
        let left = given_mean.bound_var(Parameter::LeftWheelDiameter).expect("seen").sqrt();
        // What the mean keeps of its variance is a millionth.
        assert!((left / (sigma_m / 2_f64.sqrt()) - 1.0).abs() < 2e-6, "{left}");
        let separation = given_mean.bound_var(Parameter::WheelSeparation).expect("seen").sqrt();
        assert!((separation / sigma_m - 1.0).abs() < 1e-9, "{separation}");
        // Squares do not show the common scale: with the mean known, everything is.
        let ratio = |a: Vector3<f64>| a * a.transpose() * 1e8;
        let shape =
            ratio(Vector3::new(1.0 / 0.16, -1.0 / 0.16, 0.0)) + ratio(Vector3::new(1.0 / 0.16, 0.0, -1.0 / 0.363));
        assert!(information(shape).given_mean_diameter().bound_var(Parameter::WheelSeparation).is_some());
    }

    #[test]
    fn what_is_not_seen_has_no_bound_and_leaves_the_others_theirs() {
        // Both diameters by themselves and nothing of the separation.
        let straights = information(Matrix3::from_diagonal(&Vector3::new(4e8, 1e8, 0.0)));
        assert_eq!(straights.bound_var(Parameter::WheelSeparation), None);
        let left = straights.bound_var(Parameter::LeftWheelDiameter).expect("seen");
        assert!((left / 2.5e-9 - 1.0).abs() < 1e-12, "{left}");
        // Both ratios and not the common scale: all three take part in it.
        let ratio = |a: Vector3<f64>| a * a.transpose() * 1e8;
        let shape =
            ratio(Vector3::new(1.0 / 0.16, -1.0 / 0.16, 0.0)) + ratio(Vector3::new(1.0 / 0.16, 0.0, -1.0 / 0.363));
        for parameter in Parameter::ESTIMATED {
            assert_eq!(information(shape).bound_var(parameter), None, "{parameter:?}");
        }
        // Known to twice its value is not known.
        let vague = information(Matrix3::from_diagonal(&Vector3::new(4e8, 1e8, 1.0 / (2.0_f64 * 0.363).powi(2))));
        assert_eq!(vague.bound_var(Parameter::WheelSeparation), None);
        assert_eq!(information(Matrix3::zeros()).bound_var(Parameter::LeftWheelDiameter), None);
    }
}
