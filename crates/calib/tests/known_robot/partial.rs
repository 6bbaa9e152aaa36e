//! Logs that tapes, headings and a gyroscope measure in place of poses: what they leave open has its reason.

use dataset::{Dataset, ExtraChannel, HeadingReading, Protocol, TapeDistance, TruthSample};

use crate::log::{DIAMETER_M, Log, SEPARATION_M};

/// What measures a log, of what its poses say.
#[derive(Clone, Copy)]
struct Measured {
    tapes: bool,
    headings: bool,
    gyro: bool,
}

fn log(Measured { tapes, headings, gyro }: Measured) -> Dataset {
    let mut dataset = Log::exact().dataset();
    if gyro {
        dataset.truth_noise.gyro.noise_rad_per_sqrt_s = Some(1e-4);
    }
    for run in &mut dataset.runs {
        run.info.continuous = true;
        let truth = std::mem::take(&mut run.truth);
        let theta_rad = |sample: &TruthSample| sample.theta_rad().expect("measured");
        let (first, last) = (truth[0], truth[truth.len() - 1]);
        if tapes && run.info.protocol == Some(Protocol::Straight) {
            let distance_m = (last.x_m - first.x_m).hypot(last.y_m - first.y_m);
            run.distances.push(TapeDistance { t0_s: first.t_s, t1_s: last.t_s, distance_m, sigma_m: 1e-4 });
        }
        if headings {
            let reading = |of: &TruthSample| HeadingReading { t_s: of.t_s, theta_rad: theta_rad(of), sigma_rad: 1e-4 };
            run.headings.extend(truth.iter().step_by(10).map(reading));
        }
        if gyro {
            let rate = |pair: &[TruthSample]| (theta_rad(&pair[1]) - theta_rad(&pair[0])) / (pair[1].t_s - pair[0].t_s);
            // A row's rate is that of the interval which ends there.
            let rates = std::iter::once(0.0).chain(truth.windows(2).map(rate));
            run.odometry.extra.insert(ExtraChannel::GyroYawRate, rates.collect());
        }
    }
    dataset
}

fn calibrated(measured: Measured) -> calib::Calibration {
    let dataset = log(measured);
    calib::method("joint").expect("known").calibrate(&[dataset.session()]).expect("a calibration")
}

#[test]
fn what_partial_measurements_leave_open_is_told_with_what_would_measure_it() {
    let none = Measured { tapes: false, headings: false, gyro: false };
    for (measured, expected) in [
        (Measured { tapes: true, ..none }, &["nothing measures a turn", "nothing measures how straights bend"][..]),
        (Measured { tapes: true, gyro: true, ..none }, &["the gyro's scale is not known"]),
        (Measured { headings: true, ..none }, &["nothing measures a length"]),
        (Measured { tapes: true, headings: true, ..none }, &[]),
    ] {
        let found = calibrated(measured);
        let reasons: std::collections::BTreeSet<&str> =
            found.not_observable.iter().map(|blind| blind.why.split(':').next().expect("a text")).collect();
        let matches = |(why, expected): (&&str, &&str)| why.starts_with(*expected);
        let mut sorted = expected.to_vec();
        sorted.sort_unstable();
        assert_eq!(reasons.len(), sorted.len(), "{reasons:?}");
        assert!(reasons.iter().zip(&sorted).all(matches), "{reasons:?} {sorted:?}");
    }
}

#[test]
fn tapes_and_headings_give_the_robot_back() {
    let found = calibrated(Measured { tapes: true, headings: true, gyro: false });
    let diameter_m = found.geometry.wheel_diameter_m();
    for (found, truly) in [
        (diameter_m.left, DIAMETER_M.left),
        (diameter_m.right, DIAMETER_M.right),
        (found.geometry.wheel_separation_m(), SEPARATION_M),
    ] {
        // Tapes of 0.1 mm over a metre, headings of 0.1 mrad over a turn.
        assert!((found / truly - 1.0).abs() < 4e-4, "{found} {truly}");
    }
}
