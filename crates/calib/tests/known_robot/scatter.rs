//! Estimates scatter as their covariances say.
//!
//! With deviations d of the estimates from their mean over fresh logs and the mean C of their covariances,
//! d·C⁺d averages to the rank of C: variances and correlations are right together.

use calib::{METHODS, Method};
use dataset::Dataset;
use nalgebra::{DMatrix, DVector};

use crate::log::Log;

/// Fresh logs.
const LOGS: u64 = 400;

/// Eigenvalues of a correlation matrix below this belong to directions that a method fixes.
const RANK_TOLERANCE: f64 = 1e-4;

/// χ² over its 798 or 1197 degrees of freedom leaves 0.87 to 1.13 with a probability below 10⁻². Methods
/// have 0.94 to 1.10 and `segments`, which overstates its standard deviations by a tenth, 0.82: ones that any
/// method understates by 15 %, or overstates by as much, leave this range.
const WITHIN: std::ops::Range<f64> = 0.8..1.13;

/// d·C⁺d over the rank of C, mean over the logs.
fn squared_distance(estimates: &[DVector<f64>], covariance: &DMatrix<f64>) -> f64 {
    let count = estimates.len() as f64;
    let mean = estimates.iter().sum::<DVector<f64>>() / count;
    // In units of the standard deviations.
    let scale =
        DMatrix::from_diagonal(&covariance.diagonal().map(|var| if var > 0.0 { var.sqrt().recip() } else { 0.0 }));
    let eigen = (&scale * covariance * &scale).symmetric_eigen();
    let free: Vec<usize> = (0..3).filter(|index| eigen.eigenvalues[*index] > RANK_TOLERANCE).collect();
    let of = |estimate: &DVector<f64>| -> f64 {
        let deviation = &scale * (estimate - &mean);
        free.iter()
            .map(|index| eigen.eigenvectors.column(*index).dot(&deviation).powi(2) / eigen.eigenvalues[*index])
            .sum()
    };
    // The mean takes one log's worth.
    estimates.iter().map(of).sum::<f64>() / ((count - 1.0) * free.len() as f64)
}

fn scatters_as_its_covariance_says(method: &dyn Method, sets: &[Dataset]) {
    let (mut estimates, mut covariance) = (Vec::new(), DMatrix::zeros(3, 3));
    for set in sets {
        let found = method.calibrate(&[set.session()]).expect("a calibration");
        let diameter_m = found.geometry.wheel_diameter_m();
        estimates.push(DVector::from_vec(vec![diameter_m.left, diameter_m.right, found.geometry.wheel_separation_m()]));
        let found = found.covariance.unwrap_or_else(|| panic!("{} has no covariance", method.name()));
        // An infinite variance is that of a value which the method does not determine.
        covariance += found.map(|element| if element.is_finite() { element } else { 0.0 }) / LOGS as f64;
    }
    let distance = squared_distance(&estimates, &covariance);
    assert!(WITHIN.contains(&distance), "{}: {distance:.2} of what its covariance says", method.name());
}

#[test]
fn estimates_scatter_as_their_covariances_say() {
    let sets: Vec<Dataset> = (0..LOGS).map(|seed| Log::noisy(1000 + seed).dataset()).collect();
    std::thread::scope(|scope| {
        for method in METHODS {
            scope.spawn(|| scatters_as_its_covariance_says(*method, &sets));
        }
    });
}
