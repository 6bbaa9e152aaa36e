//! What a stated distortion of the instrument's map adds to a covariance.
//!
//! The map's error at a place is the same whenever the robot is there, in every run: it does not average out,
//! and neither whiteness of innovations nor scatter over runs shows it. The fit is linear in what was
//! measured near its solution. So each function of which the distortion is made ([`map_functions`]) shifts
//! the poses, one pass gives the gradients, and I⁻¹ (Σ g gᵀ) I⁻¹ is the covariance that all of them make.

use dataset::MapDistortion;
use nalgebra::{DMatrix, DVector};

use crate::map_functions::{MapFunction, map_functions};
use crate::normal_equations::{ClusterRobust, Information};
use crate::records::Records;
use crate::segment::Start;

/// What of a covariance is there without the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OwnScatter {
    /// The scatter over runs, which has what the map does to runs differently.
    Counted,
    /// The inverse information.
    NotCounted,
}

/// How each function of the distortion shifts the runs' gradients.
pub(crate) struct MapShifts {
    /// The runs as they were measured.
    runs: Vec<Information>,
    /// For each function the shift of each run's gradient.
    gradients: Vec<Vec<DVector<f64>>>,
}

impl MapShifts {
    /// `equations` gives the normal equation of each run with other measured poses.
    pub(crate) fn of(
        records: &Records<'_>,
        distortion: MapDistortion,
        mut equations: impl FnMut(&Records<'_>) -> Vec<Information>,
    ) -> Self {
        let runs = equations(records);
        let mut shifted = records.clone();
        let functions = functions(records, distortion.length_m);
        let sigmas = [distortion.sigma_xy_m, distortion.sigma_xy_m, distortion.sigma_theta_rad];
        let distorted = (0..sigmas.len()).filter(|coordinate| sigmas[*coordinate] > 0.0);
        let gradients = distorted
            .flat_map(|coordinate| functions.iter().map(move |of| (coordinate, of)))
            .map(|(coordinate, function)| {
                shift(&mut shifted, records, coordinate, |place| sigmas[coordinate] * function.at(place));
                equations(&shifted)
                    .into_iter()
                    .zip(&runs)
                    .map(|(moved, rest)| moved.gradient - &rest.gradient)
                    .collect()
            })
            .collect();
        Self { runs, gradients }
    }

    /// What the distortion adds to the covariance of parameters; `inverse` is that of the whole information.
    ///
    /// Where the scatter over runs is counted, what it has of the map already is taken off ([`of_function`]).
    pub(crate) fn added_covariance(&self, own: OwnScatter, inverse: &DMatrix<f64>) -> DMatrix<f64> {
        let n = inverse.nrows();
        let mut added = DMatrix::zeros(n, n);
        for gradients in &self.gradients {
            let of_run = |(gradient, run): (&DVector<f64>, &Information)| Information {
                gradient: gradient.clone(),
                matrix: run.matrix.clone(),
            };
            let runs: Vec<Information> = gradients.iter().zip(&self.runs).map(of_run).collect();
            added += of_function(&runs, own, inverse);
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

/// What one function adds, by the shift g of each run's gradient.
///
/// The estimate moves by I⁻¹ Σ g. The scatter over runs is taken after the fit has moved: it sees what is
/// left of each run's shift, g − I_r I⁻¹ Σ g, and nothing of a shift that all runs have in common.
fn of_function(runs: &[Information], own: OwnScatter, inverse: &DMatrix<f64>) -> DMatrix<f64> {
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

/// The functions of which the distortion is made where poses were measured.
fn functions(records: &Records<'_>, length_m: f64) -> Vec<MapFunction> {
    let in_map = records.segments.iter().filter(|segment| segment.start != Start::Origin);
    let places = in_map.flat_map(|segment| &segment.measurements).map(|measured| [measured.x_m, measured.y_m]);
    map_functions(places, length_m)
}

/// Shifts a coordinate of every measured pose by a function of its place; displacements are in no map.
fn shift(shifted: &mut Records<'_>, records: &Records<'_>, coordinate: usize, function: impl Fn([f64; 2]) -> f64) {
    for (to, from) in shifted.segments.iter_mut().zip(&records.segments) {
        if from.start == Start::Origin {
            continue;
        }
        for (to, from) in to.measurements.iter_mut().zip(&from.measurements) {
            let by = function([from.x_m, from.y_m]);
            *to = *from;
            match coordinate {
                0 => to.x_m += by,
                1 => to.y_m += by,
                _ => to.theta_rad = from.theta_rad.map(|theta_rad| theta_rad + by),
            }
        }
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
            of_function(&runs, own, &DMatrix::from_element(1, 1, 0.25))[(0, 0)]
        };
        // A shift of all runs by 1 moves the estimate by 1, and no run from the others.
        assert!((of([1.0; 4], OwnScatter::Counted) - 1.0).abs() < 1e-15);
        // What runs differ by cancels in the mean and is in their scatter: the sample variance 4/3 over four.
        assert!((of([1.0, -1.0, 1.0, -1.0], OwnScatter::Counted) + 1.0 / 3.0).abs() < 1e-15);
        assert!(of([1.0, -1.0, 1.0, -1.0], OwnScatter::NotCounted).abs() < 1e-15);
    }
}
