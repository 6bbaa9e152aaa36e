//! When nuisances of the instrument explain autocorrelation and outliers.

use super::partial::{NO_GYRO, dataset as driven};
use super::selection::Normals;
use super::*;
use crate::FitSettings;
use crate::nuisances::{Explained, explained_by_nuisances};

/// Eight runs that are measured every second row by a sensor that sits so many metres beside the drive's
/// centre, with errors of 1 mm and 1 mrad of which a share lasts to the next row; some rows are 0.1 m off.
fn measured(sensor_m: f64, gross: &[usize], lasting: f64) -> Dataset {
    let logs = [0, 1].map(|half| {
        driven(NO_GYRO, |run, poses| {
            let number = 4 * half + u64::from(run.info.id.as_bytes()[4] - b'0');
            let mut normals = Normals(1000 * number + 17);
            let mut errors = [0.0; 3];
            for row in (0..=280).step_by(2) {
                errors = errors.map(|error| lasting * error + (1.0 - lasting * lasting).sqrt() * 1e-3 * normals.next());
                let Pose { x_m, y_m, theta_rad } = poses[row] * Pose::new(sensor_m, sensor_m, 0.0);
                let by_m = if gross.contains(&row) { 0.1 } else { 0.0 };
                let (x_m, y_m) = (x_m + errors[0] + by_m, y_m + errors[1]);
                run.truth.push(TruthSample::new(run.odometry.t_s[row], x_m, y_m, Some(theta_rad + errors[2])));
            }
        })
    });
    let [mut log, more] = logs;
    log.runs.extend(more.runs);
    log
}

/// What becomes of a fit of the geometry alone.
fn explained(log: &Dataset, thin: bool) -> Explained<Found> {
    let fit = FitSettings::GEOMETRY_ONLY.fit(&[log.session()]).expect("a fit");
    let of = |fit: &ModelFit<'_>| Found {
        sensor_m: fit.solution.model.body_from_sensor.x_m,
        outliers: fit.solution.pass.outliers.len(),
        thinning: fit.thinning,
        is_white: fit.is_white(),
    };
    match explained_by_nuisances(&fit, thin).expect("fits") {
        Explained::Yes(found) => Explained::Yes(of(&found)),
        Explained::No { thinned } => Explained::No { thinned: of(&thinned) },
        Explained::NotTried => Explained::NotTried,
    }
}

struct Found {
    sensor_m: f64,
    outliers: usize,
    thinning: Thinning,
    is_white: bool,
}

/// A row of the straight.
const GROSS: &[usize] = &[90];

#[test]
fn a_sensor_beside_the_centre_explains_innovations_that_are_not_white() {
    let log = measured(0.01, &[], 0.0);
    // There is nothing to explain where measurements are not to be thinned, and none is an outlier.
    assert!(matches!(explained(&log, false), Explained::NotTried));
    let Explained::Yes(found) = explained(&log, true) else { panic!("not explained") };
    assert!(found.is_white && found.thinning == Thinning::NONE);
    // 1128 poses of a millimetre, of which a fifth are of a spin.
    assert!((found.sensor_m - 0.01).abs() < 5e-4, "{}", found.sensor_m);
    // Gross errors beside it stay outliers: it explains what is to be thinned, and none of them.
    let log = measured(0.01, GROSS, 0.0);
    let Explained::Yes(found) = explained(&log, true) else { panic!("not explained") };
    assert_eq!((found.outliers, found.thinning), (8, Thinning::NONE));
    let Explained::No { thinned } = explained(&log, false) else {
        panic!("outliers are tried, and explained by nothing")
    };
    assert_eq!((thinned.outliers, thinned.sensor_m, thinned.thinning), (8, 0.0, Thinning::NONE));
}

#[test]
fn what_is_white_and_without_outliers_needs_no_explanation() {
    for thin in [false, true] {
        assert!(matches!(explained(&measured(0.0, &[], 0.0), thin), Explained::NotTried), "{thin}");
        // Gross errors of a centred sensor are outliers that no nuisance explains.
        let Explained::No { thinned } = explained(&measured(0.0, GROSS, 0.0), thin) else {
            panic!("explained: {thin}")
        };
        assert_eq!((thinned.outliers, thinned.thinning, thinned.sensor_m), (8, Thinning::NONE, 0.0));
    }
}

#[test]
fn errors_that_last_are_thinned_whatever_the_sensor() {
    // No nuisance predicts them.
    assert!(matches!(explained(&measured(0.0, &[], 0.6), true), Explained::NotTried));
    // The sensor is found, but innovations are not white with it.
    let Explained::No { thinned } = explained(&measured(0.01, &[], 0.6), true) else { panic!("explained") };
    assert!(thinned.is_white && thinned.thinning.every_s > 0.2 && thinned.sensor_m == 0.0, "{:?}", thinned.thinning);
}
