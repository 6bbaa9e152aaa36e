//! A stated distortion of the map in which the poses are.

use dataset::{MapDistortion, TruthSample, WheelLog};

use crate::FitSettings;

/// Poses of SLAM of a robot that stands: no direction of its geometry is determined.
#[test]
fn regress_a_fit_that_determines_nothing_has_no_map_to_add() {
    let mut dataset = super::dataset(true);
    for run in &mut dataset.runs {
        let WheelLog::Angles(angles) = &mut run.odometry.wheels else { panic!("angles") };
        angles.left.fill(0.0);
        angles.right.fill(0.0);
        let error = |k: f64| 3e-3 * (12.9898 * k).sin();
        let poses = (0..run.truth.len()).map(|row| {
            let k = row as f64;
            TruthSample::new(2.0 * k, error(k), error(k + 0.3), Some(error(k + 0.6)))
        });
        run.truth = poses.collect();
    }
    dataset.truth_noise.map = Some(MapDistortion { sigma_xy_m: 0.02, sigma_theta_rad: 0.01, length_m: 2.0 });
    let fit = FitSettings::CALIBRATION.fit(&[dataset.session()]).expect("a fit");
    assert_eq!((fit.unobservable.len(), fit.free_basis().ncols()), (3, 0), "{:?}", fit.columns);
    // An empty matrix has no eigenvalues to take, and the library that was asked for them panicked.
    let covariance = fit.covariance(&mut []).expect("nothing is uncertain");
    assert!(covariance.iter().all(|element| *element == 0.0), "{covariance}");
}
