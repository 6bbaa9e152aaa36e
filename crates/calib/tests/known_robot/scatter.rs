//! Estimates scatter as their covariances say.
//!
//! With deviations d of the estimates from their mean over fresh logs and the mean C of their covariances,
//! d·C⁺d averages to the rank of C: variances and correlations are right together.

use calib::METHODS;
use nalgebra::{DMatrix, DVector};

use crate::log::Log;

/// Fresh logs.
const LOGS: u64 = 24;

/// Eigenvalues of a correlation matrix below this belong to directions that a method fixes.
const RANK_TOLERANCE: f64 = 1e-4;

/// χ² over its 46 or 69 degrees of freedom leaves this range with a probability below 2·10⁻³. Methods have
/// 0.91 to 1.14; standard deviations that are wrong by a factor of 1.5 leave it.
const WITHIN: std::ops::Range<f64> = 0.5..2.0;

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

#[test]
fn estimates_scatter_as_their_covariances_say() {
    let sets: Vec<_> = (0..LOGS).map(|seed| Log::noisy(1000 + seed).dataset()).collect();
    for method in METHODS {
        let found = sets.iter().map(|set| method.calibrate(&[set.session()]).expect("a calibration"));
        let (mut estimates, mut covariance) = (Vec::new(), DMatrix::zeros(3, 3));
        for found in found {
            let diameter_m = found.geometry.wheel_diameter_m();
            estimates.push(DVector::from_vec(vec![
                diameter_m.left,
                diameter_m.right,
                found.geometry.wheel_separation_m(),
            ]));
            let found = found.covariance.unwrap_or_else(|| panic!("{} has no covariance", method.name()));
            // An infinite variance is that of a value which the method does not determine.
            covariance += found.map(|element| if element.is_finite() { element } else { 0.0 }) / LOGS as f64;
        }
        let distance = squared_distance(&estimates, &covariance);
        assert!(WITHIN.contains(&distance), "{}: {distance:.2} of what its covariance says", method.name());
    }
}
