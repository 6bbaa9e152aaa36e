//! The noise of rates once more.

use super::*;
use crate::{FitSettings, Segment};

/// A run whose wheels turn by sines, in rows of 0.1 s, measured every second; counts stand for so many
/// radians.
fn driven(rad: f64) -> Dataset {
    let mut log = dataset_of(1, true);
    let t_s: Vec<f64> = (0..4000).map(|row| 0.1 * f64::from(row)).collect();
    let counts =
        |rate: f64| t_s.iter().map(|t_s| ((3.0 * t_s + 2.0 * (rate * t_s).sin()) / rad).floor() as i64).collect();
    let ticks = Wheels { left: counts(0.7), right: counts(0.9) };
    log.robot.ticks_per_rev = Some(std::f64::consts::TAU / rad);
    log.runs[0].truth = (0..400).map(|s| TruthSample::new(f64::from(s), 0.0, 0.0, Some(0.0))).collect();
    log.runs[0].odometry = Odometry { t_s: t_s.into(), wheels: WheelLog::Ticks(ticks), ..Odometry::default() };
    log
}

#[test]
fn rates_have_the_rounding_of_counts_once_more() {
    let rad = 0.2;
    let log = driven(rad);
    let fit = FitSettings::GEOMETRY_ONLY.fit(&[log.session()]).expect("a fit");
    let noisier = fit.with_noisier_rates().expect("counts are rounded");
    let [own, noisier]: [&Segment<'_>; 2] = [&fit.records.segments[0], &noisier.records.segments[0]];
    assert_eq!(own.measurements, noisier.measurements);
    // A slope over m rows to each side has the variance σ²/Σ(kT)², k from −m to m, and σ² = q²/12.
    let m = f64::from(u8::try_from(own.rate_window.rows).expect("few rows"));
    let squares = m * (m + 1.0) * (2.0 * m + 1.0) / 3.0 * 0.01;
    let of = |(own, noisier): (&crate::wheel_angles::WheelInterval, &crate::wheel_angles::WheelInterval)| {
        assert_eq!(own.wheel_rad, noisier.wheel_rad);
        let [own, noisier] = [own, noisier].map(|interval| interval.rate_at_ends_rad_s[0]);
        (noisier.left - own.left).powi(2) + (noisier.right - own.right).powi(2)
    };
    let added: f64 = own.intervals.iter().zip(&noisier.intervals).map(of).sum();
    let ratio = added / (2.0 * own.intervals.len() as f64) / (rad * rad / 12.0 / squares);
    // Windows that overlap leave some 8000/(2m + 1) independent rates: a standard error of 6 % for m = 3.
    // Rejects noise of twice the variance, and a window of one row more or less.
    assert!((ratio - 1.0).abs() < 0.2, "{ratio} {m}");
}

#[test]
fn angles_that_are_not_rounded_have_no_noise() {
    let log = dataset(true);
    let fit = FitSettings::GEOMETRY_ONLY.fit(&[log.session()]).expect("a fit");
    assert!(fit.with_noisier_rates().is_none());
}
