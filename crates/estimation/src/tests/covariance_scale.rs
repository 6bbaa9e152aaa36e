//! Covariances that rows state up to one factor of positions and headings together.

use dataset::{CovarianceScale, Dataset, TruthSigma};

use crate::{FitSettings, NoiseComponent};

/// Rows whose positions are stated right and whose headings are stated ten times too large.
fn log(scale: CovarianceScale, row: TruthSigma) -> Dataset {
    let mut dataset = super::dataset_of(8, true);
    dataset.truth_noise.covariance_scale = scale;
    for run in &mut dataset.runs {
        run.truth_sigma = Some(vec![row; run.truth.len()]);
    }
    dataset
}

/// Estimated over stated standard deviations of position and heading.
fn factors(dataset: &Dataset) -> [f64; 2] {
    let fit = FitSettings::CALIBRATION.fit(&[dataset.session()]).expect("a fit");
    let prior = crate::noise::NoisePrior::of(dataset.truth_noise).measurement_sigma();
    let of = [NoiseComponent::MeasurementPosition, NoiseComponent::MeasurementHeading];
    [0, 1].map(|k| fit.solution.noise.sigma(of[k]) / prior[k])
}

#[test]
fn one_factor_of_a_filters_covariances_is_estimated_where_the_dataset_says_so() {
    let stated = TruthSigma { sigma_xy_m: Some(2e-3), sigma_theta_rad: Some(2e-2), covariance: None };
    let [xy, theta] = factors(&log(CovarianceScale::Common, stated));
    // The same steps in logarithms, each rounded.
    assert!((xy / theta - 1.0).abs() < 1e-9, "{xy} {theta}");
    // Rejects a tie that holds everywhere: apart they are an order of magnitude.
    let [apart_xy, apart_theta] = factors(&log(CovarianceScale::Separate, stated));
    assert!(apart_xy / apart_theta > 3.0, "{apart_xy} {apart_theta}");
    assert!(apart_theta < theta && xy < apart_xy, "{apart_xy} {xy} {theta} {apart_theta}");
    // Rows that do not state both have no ratio to keep.
    let partly = TruthSigma { sigma_theta_rad: None, ..stated };
    assert_eq!(
        factors(&log(CovarianceScale::Common, partly)).map(f64::to_bits),
        factors(&log(CovarianceScale::Separate, partly)).map(f64::to_bits)
    );
}
