//! Covariances that rows state up to one factor of positions and headings together.

use dataset::{CovarianceScale, Dataset, TruthSample, TruthSigma};
use kinematics::Pose;

use super::partial::{NO_GYRO, dataset};

use crate::{FitSettings, NoiseComponent};

/// Positions that err by 2 mm and headings by 2 mrad, by rows that state `row`.
fn log(scale: CovarianceScale, row: TruthSigma) -> Dataset {
    let mut dataset = dataset(NO_GYRO, |run, poses| {
        for at in (0..=280).step_by(5) {
            let error = |k: f64| 2e-3 * 2.0_f64.sqrt() * (12.9898 * at as f64 + 78.233 * k).sin();
            let Pose { x_m, y_m, theta_rad } = poses[at];
            let (x_m, y_m, theta_rad) = (x_m + error(1.0), y_m + error(2.0), theta_rad + error(3.0));
            run.truth.push(TruthSample::new(run.odometry.t_s[at], x_m, y_m, Some(theta_rad)));
        }
    });
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
