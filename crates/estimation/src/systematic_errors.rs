//! What errors that do not average out add to a covariance: a stated distortion of the instrument's map, and
//! the rounding of recorded rates.
//!
//! The map's error at a place is the same whenever the robot is there, and that of a rounded rate whenever it
//! is recorded ([`crate::recorded_rates`]), in every run: neither whiteness of innovations nor scatter
//! over runs shows it. The fit is linear in what was recorded near its solution. So each function of which
//! the distortion is made ([`map_functions`]), and the error of each recorded rate, shifts the records, one
//! pass gives the gradients, and I⁻¹ (Σ g gᵀ) I⁻¹ is the covariance that all of them make.

use nalgebra::{DMatrix, DVector};
use rules::Rule;

use crate::map_functions::{MapFunction, map_functions};
use crate::normal_equations::{ClusterRobust, Information};
use crate::rate_rounding::shared_rates;
use crate::recorded_rates::RecordedRate;
use crate::records::Records;
use crate::segment::{Segment, Start};

/// What of a covariance is there without them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OwnScatter {
    /// The scatter over runs, which has what they do to runs differently.
    Counted,
    /// The inverse information.
    NotCounted,
}

/// An error of one standard deviation.
enum SystematicError {
    /// Of a coordinate of the map.
    OfMap { coordinate: usize, function: MapFunction, sigma: f64 },
    /// Of a recorded rate.
    OfRate(RecordedRate),
}

/// How each systematic error shifts the runs' gradients.
pub(crate) struct SystematicErrors {
    /// The runs as they were measured.
    runs: Vec<Information>,
    /// For each error the shift of each run's gradient.
    gradients: Vec<Vec<DVector<f64>>>,
}

/// What is shifted of the records.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shifts {
    Poses,
    Motion,
}

impl Shifts {
    /// Takes from the records what was shifted.
    fn undo(self, shifted: &mut Records<'_>, records: &Records<'_>) {
        for (to, from) in shifted.segments.iter_mut().zip(&records.segments) {
            match self {
                Self::Poses => to.measurements.copy_from_slice(&from.measurements),
                Self::Motion => to.intervals.copy_from_slice(&from.intervals),
            }
        }
    }
}

impl SystematicErrors {
    /// `equations` gives the normal equation of each run with other records. `None` where there are no such
    /// errors.
    pub(crate) fn of(
        records: &Records<'_>,
        mut equations: impl FnMut(&Records<'_>, Shifts) -> Vec<Information>,
    ) -> Option<Self> {
        let errors = errors(records);
        if errors.is_empty() {
            return None;
        }
        let runs = equations(records, Shifts::Poses);
        let mut shifted = records.clone();
        let mut shift_of = |error: &SystematicError| {
            let shifts = error.shift(&mut shifted);
            let moved = equations(&shifted, shifts);
            shifts.undo(&mut shifted, records);
            moved.into_iter().zip(&runs).map(|(moved, rest)| moved.gradient - &rest.gradient).collect()
        };
        let gradients = errors.iter().map(&mut shift_of).collect();
        Some(Self { runs, gradients })
    }

    /// What they add to the covariance of parameters; `inverse` is that of the whole information.
    ///
    /// Where the scatter over runs is counted, what it has of them already is taken off ([`of_error`]).
    pub(crate) fn added_covariance(&self, own: OwnScatter, inverse: &DMatrix<f64>) -> DMatrix<f64> {
        let n = inverse.nrows();
        let mut added = DMatrix::zeros(n, n);
        for gradients in &self.gradients {
            let of_run = |(gradient, run): (&DVector<f64>, &Information)| Information {
                gradient: gradient.clone(),
                matrix: run.matrix.clone(),
            };
            let runs: Vec<Information> = gradients.iter().zip(&self.runs).map(of_run).collect();
            added += of_error(&runs, own, inverse);
        }
        let size = inverse.diagonal().map(|variance| variance.max(f64::MIN_POSITIVE).sqrt());
        // Over the standard deviations: metres, radians and ratios differ by orders of magnitude.
        let scaled = DMatrix::from_fn(n, n, |i, j| added[(i, j)] / (size[i] * size[j]));
        let mut eigen = scaled.symmetric_eigen();
        eigen.eigenvalues.apply(|value| *value = value.max(0.0));
        let positive = eigen.recompose();
        DMatrix::from_fn(n, n, |i, j| positive[(i, j)] * size[i] * size[j])
    }
}

/// What one error adds, by the shift g of each run's gradient.
///
/// The estimate moves by I⁻¹ Σ g. The scatter over runs is taken after the fit has moved: it sees what is
/// left of each run's shift, g − I_r I⁻¹ Σ g, and nothing of a shift that all runs have in common.
fn of_error(runs: &[Information], own: OwnScatter, inverse: &DMatrix<f64>) -> DMatrix<f64> {
    let sum = runs.iter().fold(DVector::zeros(inverse.nrows()), |sum, run| sum + &run.gradient);
    let moved = inverse * sum;
    let whole = &moved * moved.transpose();
    if own == OwnScatter::NotCounted {
        return whole;
    }
    let left = runs
        .iter()
        .map(|run| Information { gradient: &run.gradient - &run.matrix * &moved, matrix: run.matrix.clone() });
    whole - ClusterRobust::of(inverse, left).covariance
}

/// The systematic errors of records.
fn errors(records: &Records<'_>) -> Vec<SystematicError> {
    let mut errors = Vec::new();
    if let Some(map) = records.map {
        let in_map = records.segments.iter().filter(|segment| segment.start != Start::Origin);
        let places = in_map.flat_map(|segment| &segment.measurements).map(|measured| [measured.x_m, measured.y_m]);
        let functions = map_functions(places, map.length_m);
        for (coordinate, sigma) in [map.sigma_xy_m, map.sigma_xy_m, map.sigma_theta_rad].into_iter().enumerate() {
            let of = |function: &MapFunction| SystematicError::OfMap { coordinate, function: function.clone(), sigma };
            errors.extend(functions.iter().filter(|_| sigma > 0.0).map(of));
        }
    }
    let shared = Rule::SharedRates.finds(Some(shared_rates(&records.segments)).filter(|rates| !rates.is_empty()));
    errors.extend(shared.into_iter().flatten().map(SystematicError::OfRate));
    errors
}

impl SystematicError {
    /// Shifts records by it.
    fn shift(&self, records: &mut Records<'_>) -> Shifts {
        match self {
            Self::OfMap { coordinate, function, sigma } => {
                // Displacements are in no map.
                for segment in records.segments.iter_mut().filter(|segment| segment.start == Start::MeasuredPose) {
                    shift_poses(segment, *coordinate, |place| sigma * function.at(place));
                }
                Shifts::Poses
            }
            Self::OfRate(rate) => {
                records.segments.iter_mut().for_each(|segment| shift_rate(segment, *rate));
                Shifts::Motion
            }
        }
    }
}

/// Shifts a coordinate of the measured poses by a function of their place.
fn shift_poses(segment: &mut Segment<'_>, coordinate: usize, function: impl Fn([f64; 2]) -> f64) {
    for measured in &mut segment.measurements {
        let by = function([measured.x_m, measured.y_m]);
        match coordinate {
            0 => measured.x_m += by,
            1 => measured.y_m += by,
            _ => measured.theta_rad = measured.theta_rad.map(|theta_rad| theta_rad + by),
        }
    }
}

/// Shifts how the wheels turn where a rate is recorded, by the standard deviation of what rows share of an
/// error that is uniform over a step.
fn shift_rate(segment: &mut Segment<'_>, of: RecordedRate) {
    let rounding = segment.rate_rounding;
    for interval in segment.intervals.iter_mut().filter(|_| rounding.is_any()) {
        let Some((_, sense)) = RecordedRate::of(of.rate, interval.rate_steps).filter(|(own, _)| *own == of) else {
            continue;
        };
        let mut errors = [0.0; 2];
        errors[of.rate] = sense * rounding.shared[of.rate] / 12_f64.sqrt();
        let turned_rad = rounding.turned_rad(errors, interval.dt_s);
        interval.wheel_rad = interval.wheel_rad.zip_with(turned_rad, |turn: f64, more| turn + more);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_all_runs_share_is_added_whole_and_what_they_differ_by_is_in_their_scatter() {
        // One parameter, four runs of unit information: the estimate is the mean of the runs' shifts.
        let of = |gradients: [f64; 4], own| {
            let runs = gradients.map(|gradient| Information {
                matrix: DMatrix::from_element(1, 1, 1.0),
                gradient: DVector::from_element(1, gradient),
            });
            of_error(&runs, own, &DMatrix::from_element(1, 1, 0.25))[(0, 0)]
        };
        // A shift of all runs by 1 moves the estimate by 1, and no run from the others.
        assert!((of([1.0; 4], OwnScatter::Counted) - 1.0).abs() < 1e-15);
        // What runs differ by cancels in the mean and is in their scatter: the sample variance 4/3 over four.
        assert!((of([1.0, -1.0, 1.0, -1.0], OwnScatter::Counted) + 1.0 / 3.0).abs() < 1e-15);
        assert!(of([1.0, -1.0, 1.0, -1.0], OwnScatter::NotCounted).abs() < 1e-15);
    }
}
