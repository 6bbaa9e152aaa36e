//! Absolute and relative pose errors of an estimated path against a reference, as evo 1.38 computes them.
//!
//! With reference poses Q and estimated poses P at the same instants, the absolute error of a pose is
//! P⁻¹ Q, its translation the distance of the positions; the relative error of a pair (i, j) is
//! (Qᵢ⁻¹ Qⱼ)⁻¹ (Pᵢ⁻¹ Pⱼ). Rotations count by their angle, and the standard deviation is that of a population.
//! Reference: Grupp, *evo: Python package for the evaluation of odometry and SLAM*, 2017
//! (github.com/MichaelGrupp/evo, evo/core/metrics.py); Sturm et al. 2012 for the two errors.

use kinematics::{Pose, wrap_to_pi};
use serde::Serialize;

use crate::alignment::Alignment;
use crate::pose_pairs::Delta;

/// How pose errors are taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PoseErrorOptions {
    /// Before absolute errors. Relative ones do not change under it.
    pub alignment: Alignment,
    /// Between the poses of a relative error.
    pub delta: Delta,
}

/// Statistics of the sizes of errors, in their unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorStatistics {
    /// Root of the mean square.
    pub rmse: f64,
    /// Mean.
    pub mean: f64,
    /// Median; of an even number the mean of the two in the middle.
    pub median: f64,
    /// Standard deviation of the population: no degree of freedom is taken off.
    pub std: f64,
    /// The smallest, in the unit of what is summarised: metres, or radians of a rotation.
    pub min: f64,
    /// The largest.
    pub max: f64,
}

impl ErrorStatistics {
    /// Of some errors; none of none.
    #[must_use]
    pub fn of(errors: &[f64]) -> Option<Self> {
        let count = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / count;
        let mean_square = errors.iter().map(|error| error * error).sum::<f64>() / count;
        let variance = errors.iter().map(|error| (error - mean) * (error - mean)).sum::<f64>() / count;
        let mut sorted = errors.to_vec();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.len() / 2;
        let median =
            if sorted.len() % 2 == 1 { sorted[middle] } else { 0.5 * (sorted.get(middle)? + sorted[middle - 1]) };
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        Some(Self { rmse: mean_square.sqrt(), mean, median, std: variance.sqrt(), min, max })
    }
}

/// Sizes of errors, one by one.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PoseErrors {
    /// Of the translation, metres.
    pub translation_m: Vec<f64>,
    /// Of the rotation, radians.
    pub rotation_rad: Vec<f64>,
}

impl PoseErrors {
    fn push(&mut self, translation_m: f64, rotation_rad: f64) {
        self.translation_m.push(translation_m);
        self.rotation_rad.push(wrap_to_pi(rotation_rad).abs());
    }

    /// Adds errors of further poses.
    pub(crate) fn extend(&mut self, other: &Self) {
        self.translation_m.extend(&other.translation_m);
        self.rotation_rad.extend(&other.rotation_rad);
    }
}

/// Statistics of absolute or relative errors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PoseErrorStatistics {
    /// Of the translation, metres.
    pub translation_m: Option<ErrorStatistics>,
    /// Of the rotation, radians.
    pub rotation_rad: Option<ErrorStatistics>,
    /// Poses of absolute errors, pairs of relative ones.
    pub count: usize,
    /// Why there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_null: Option<&'static str>,
}

impl PoseErrorStatistics {
    /// Of errors, or of the reason why there are none.
    #[must_use]
    pub fn of(errors: Result<&PoseErrors, &'static str>) -> Self {
        let statistics = |of: fn(&PoseErrors) -> &[f64]| errors.ok().and_then(|errors| ErrorStatistics::of(of(errors)));
        let count = errors.map_or(0, |errors| errors.translation_m.len());
        Self {
            translation_m: statistics(|errors| &errors.translation_m),
            rotation_rad: statistics(|errors| &errors.rotation_rad),
            count,
            why_null: errors.err().or((count == 0).then_some("no poses to compare")),
        }
    }
}

/// Absolute errors of every pose (APE), after the alignment.
///
/// # Errors
/// Why there is no alignment.
pub fn absolute_pose_errors(
    reference: &[Pose],
    estimate: &[Pose],
    alignment: Alignment,
) -> Result<PoseErrors, &'static str> {
    let aligned = alignment.reference_from_estimate(reference, estimate)?;
    let mut errors = PoseErrors::default();
    for (reference, estimate) in reference.iter().zip(estimate) {
        let estimate = aligned.map_or(*estimate, |aligned| aligned * *estimate);
        let distance_m = estimate.position().distance_m(reference.position());
        errors.push(distance_m, reference.theta_rad - estimate.theta_rad);
    }
    Ok(errors)
}

/// Relative errors of the pairs of poses that are a step apart (RPE).
///
/// # Errors
/// Why there are no pairs.
pub fn relative_pose_errors(reference: &[Pose], estimate: &[Pose], delta: &Delta) -> Result<PoseErrors, &'static str> {
    let mut errors = PoseErrors::default();
    for (first, second) in delta.pairs(estimate)? {
        let moved = |poses: &[Pose]| poses[first].to(poses[second]);
        let error = moved(reference).to(moved(estimate));
        errors.push(error.position().distance_m(Pose::IDENTITY.position()), error.theta_rad);
    }
    Ok(errors)
}

/// Both errors of one path.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PathErrors {
    pub(crate) absolute: Result<PoseErrors, &'static str>,
    pub(crate) relative: Result<PoseErrors, &'static str>,
}

impl PathErrors {
    pub(crate) fn of(reference: &[Pose], estimate: &[Pose], options: &PoseErrorOptions) -> Self {
        Self {
            absolute: absolute_pose_errors(reference, estimate, options.alignment),
            relative: relative_pose_errors(reference, estimate, &options.delta),
        }
    }

    /// The same of positions without headings, beside which the reference has those of the estimate.
    pub(crate) fn of_positions(self) -> Self {
        let absolute = self.absolute.map(|errors| PoseErrors { rotation_rad: Vec::new(), ..errors });
        Self { absolute, relative: Err("positions without headings show no motion of a pose") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose_pairs::DeltaUnit;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn statistics_of_three_and_of_four_by_hand() {
        let of = ErrorStatistics::of(&[3.0, 0.0, 3.0]).expect("some");
        // Mean 2; squares 9, 0, 9; deviations 1, −2, 1.
        assert_eq!((of.rmse, of.mean, of.median, of.min, of.max), (6.0_f64.sqrt(), 2.0, 3.0, 0.0, 3.0));
        assert_eq!(of.std, 2.0_f64.sqrt());
        assert_eq!(ErrorStatistics::of(&[4.0, 1.0, 2.0, 9.0]).map(|of| of.median), Some(3.0));
        assert_eq!(ErrorStatistics::of(&[]), None);
    }

    #[test]
    fn absolute_errors_are_distances_and_angles_within_half_a_turn() {
        let reference = [Pose::IDENTITY, Pose::new(3.0, 0.0, 0.0), Pose::new(0.0, 0.0, -3.0)];
        let estimate = [Pose::IDENTITY, Pose::new(0.0, 4.0, FRAC_PI_2), Pose::new(0.0, 0.0, 3.0)];
        let errors = absolute_pose_errors(&reference, &estimate, Alignment::None).expect("errors");
        assert_eq!(errors.translation_m, [0.0, 5.0, 0.0]);
        assert_eq!(errors.rotation_rad[..2], [0.0, FRAC_PI_2]);
        // Six radians are 2π − 6 the other way round.
        assert!((errors.rotation_rad[2] - (2.0 * PI - 6.0)).abs() < 1e-15);
        let moved: Vec<Pose> = estimate.iter().map(|pose| Pose::new(5.0, -1.0, 0.3) * *pose).collect();
        assert!(absolute_pose_errors(&estimate, &moved, Alignment::Se2).is_err(), "three poses on a line");
    }

    #[test]
    fn relative_errors_forget_where_the_path_began() {
        let reference = [Pose::IDENTITY, Pose::new(1.0, 0.0, 0.0), Pose::new(2.0, 0.0, 0.0)];
        // Begins elsewhere and turned; the second step is a tenth too long and turns by 0.2 rad.
        let begin = Pose::new(7.0, 7.0, FRAC_PI_2);
        let estimate = [Pose::IDENTITY, Pose::new(1.0, 0.0, 0.0), Pose::new(2.1, 0.0, 0.2)].map(|pose| begin * pose);
        let errors = relative_pose_errors(&reference, &estimate, &Delta::default()).expect("pairs");
        let close = |found: &[f64], expected: [f64; 2]| found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14);
        assert!(close(&errors.translation_m, [0.0, 0.1]), "{errors:?}");
        assert!(close(&errors.rotation_rad, [0.0, 0.2]), "{errors:?}");
        let far = Delta::new(9.0, DeltaUnit::Metres, false, 0.1).expect("a step");
        let none = PathErrors::of(&reference, &estimate, &PoseErrorOptions { delta: far, ..Default::default() });
        let statistics = PoseErrorStatistics::of(none.relative.as_ref().map_err(|why| *why));
        assert_eq!((statistics.translation_m, statistics.count), (None, 0));
        assert!(statistics.why_null.is_some_and(|why| why.contains("--delta")));
    }
}
