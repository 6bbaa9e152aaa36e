//! A stated distortion of the map in which the poses are.

use dataset::{MapDistortion, TruthSample, WheelLog};
use nalgebra::{DMatrix, DVector};

use crate::systematic_errors::{OwnScatter, SystematicErrors};
use crate::{FitSettings, Information};

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

/// The estimate of one place in a map: the gradient of its coordinates is what was measured there, so that it
/// moves by I⁻¹ times the map's shift, whose coordinates are independent.
#[test]
fn a_map_moves_an_estimate_of_one_place_by_what_it_is_distorted_by_there() {
    // Of standard deviations that differ by two orders of magnitude.
    let inverse = DMatrix::from_row_slice(3, 3, &[4e-4, 1e-6, 2e-4, 1e-6, 9e-8, 0.0, 2e-4, 0.0, 1e-3]);
    let [sigma_xy_m, sigma_theta_rad] = [0.02, 0.01];
    let mut dataset = super::dataset(true);
    dataset.truth_noise.map = Some(MapDistortion { sigma_xy_m, sigma_theta_rad, length_m: 0.7 });
    let records = crate::Records::of(&[dataset.session()]);
    let of_place = |records: &crate::Records<'_>, _| {
        let place = &records.segments[0].measurements[2];
        let gradient = DVector::from_row_slice(&[place.x_m, place.y_m, place.theta_rad.expect("measured")]);
        vec![Information { matrix: DMatrix::zeros(3, 3), gradient }]
    };
    let shifts = SystematicErrors::of(&records, of_place).expect("a map");
    let added = shifts.added_covariance(OwnScatter::NotCounted, &inverse);
    let shift = DMatrix::from_diagonal(&DVector::from_row_slice(&[
        sigma_xy_m * sigma_xy_m,
        sigma_xy_m * sigma_xy_m,
        sigma_theta_rad * sigma_theta_rad,
    ]));
    let expected = &inverse * shift * &inverse;
    let size = expected.diagonal().map(f64::sqrt);
    for (row, column) in (0..9).map(|k| (k / 3, k % 3)) {
        let off = (added[(row, column)] - expected[(row, column)]) / (size[row] * size[column]);
        assert!(off.abs() < 1e-9, "{row} {column}: {added} {expected}");
    }
}
