//! The rounding of recorded rates, in covariances and in simulated runs.

use dataset::{Dataset, TruthSample, WheelLog};
use kinematics::{Twist, Wheels};

use crate::recorded_rates::{RateRounding, RecordedRate};
use crate::{Column, FitSettings};

/// Five straights back and forth, each wheel at rates in whole steps of 1 mm/s: eight rows that speed up, and
/// ten that do not. Poses at both ends, of 0.01 mm and 0.01 mrad.
fn straights() -> Dataset {
    let mut dataset = super::dataset_of(5, true);
    for (number, run) in dataset.runs.iter_mut().enumerate() {
        let sense = if number % 2 == 0 { 1.0 } else { -1.0 };
        let speeds: Vec<f64> = (0..=18_i32).map(|row| sense * f64::from(11 * row.min(9)) / 1000.0).collect();
        let driven_m: f64 = speeds[1..].iter().sum();
        let off = |k: f64| 1e-5 * (12.9898 * (number as f64 + 7.0 * k)).sin();
        run.odometry.t_s = (0..speeds.len()).map(|row| row as f64).collect();
        run.odometry.wheels = WheelLog::Speeds(Wheels { left: speeds.clone(), right: speeds });
        run.truth = vec![
            TruthSample::new(0.0, off(1.0), off(2.0), Some(off(3.0))),
            TruthSample::new(18.0, driven_m + off(4.0), off(5.0), Some(off(6.0))),
        ];
    }
    dataset.truth_noise.sigma_xy_m = Some(1e-5);
    dataset.truth_noise.sigma_theta_rad = Some(1e-5);
    dataset
}

/// Each wheel's rates have errors of their own, the same in every run: ten of 18 rows have that of 99 mm/s,
/// and each of eight others that of its speed.
#[test]
fn a_rate_that_is_rounded_leaves_a_wheel_uncertain_however_often_it_is_driven() {
    let sigma = |dataset: &Dataset| {
        let fit = FitSettings::CALIBRATION.fit(&[dataset.session()]).expect("a fit");
        let covariance = fit.covariance(&mut []).expect("a covariance");
        [Column::LeftWheel, Column::RightWheel].map(|wheel| {
            let at = fit.position(wheel).expect("free");
            covariance[(at, at)].sqrt()
        })
    };
    let rounded = straights();
    let (steady_m, driven_m) = (1e-3 / 12_f64.sqrt(), 0.036 * 11.0 + 10.0 * 0.099);
    // Nine rates: the last stands for ten rows, the others for one each, and rest has no error.
    let on_paper = steady_m * (10.0_f64.powi(2) + 8.0).sqrt() / driven_m;
    for sigma in sigma(&rounded) {
        // A wheel that is 3 mm off turns the robot by 8 mrad, which is linear to a hundredth.
        assert!((sigma / on_paper - 1.0).abs() < 0.02, "{sigma} {on_paper}");
    }
    let mut exact = rounded;
    for run in &mut exact.runs {
        let WheelLog::Speeds(speeds) = &mut run.odometry.wheels else { panic!("speeds") };
        // A third of a step is no decimal.
        for speed in speeds.left.iter_mut().chain(&mut speeds.right) {
            *speed *= 1.0 / 3.0;
        }
    }
    assert!(sigma(&exact).iter().all(|sigma| *sigma < 0.01 * on_paper));
}

#[test]
fn simulated_runs_differ_by_the_rounding_of_their_rates() {
    let dataset = straights();
    let fit = FitSettings::CALIBRATION.fit(&[dataset.session()]).expect("a fit");
    assert!(fit.depends_on_rounding());
    let lengths = |number: u64| {
        let again = fit.resimulated_without_pass(&mut [], number);
        let of = |segment: &crate::Segment<'_>| {
            let [first, last] = [0, 1].map(|at| &segment.measurements[at]);
            (last.x_m - first.x_m).hypot(last.y_m - first.y_m)
        };
        again.records.segments.iter().map(of).collect::<Vec<f64>>()
    };
    let simulated: Vec<Vec<f64>> = (1..=200).map(lengths).collect();
    let mean = |of: &dyn Fn(&[f64]) -> f64| simulated.iter().map(|of_one| of(of_one)).sum::<f64>() / 200.0;
    let middle_m = mean(&|lengths| lengths[0]);
    let squares_m2 = mean(&|lengths| (lengths[0] - middle_m).powi(2));
    // Both wheels' errors, halved: 2.1 mm. Of 200 draws a variance of what is uniform is known to 6 %.
    let on_paper_m2 = 0.5 * (1e-6 / 12.0) * (10.0_f64.powi(2) + 8.0);
    assert!((squares_m2 / on_paper_m2 - 1.0).abs() < 0.3, "{squares_m2} {on_paper_m2}");
    // Drives and their reverses are off alike: they have the same wheels.
    let apart_m2 = mean(&|lengths| (lengths[0] - lengths[1]).powi(2));
    assert!(apart_m2 < 0.01 * on_paper_m2, "{apart_m2}");
}

#[test]
fn a_rate_without_a_sign_has_that_of_the_other_and_none_at_rest() {
    let of = |rate, steps| RecordedRate::of(rate, steps).map(|(recorded, sense)| (recorded.steps, sense));
    assert_eq!([of(0, [3, -2]), of(1, [3, -2])], [Some((3, 1.0)), Some((2, -1.0))]);
    // A straight backwards, whose turn is rounded to nothing.
    assert_eq!([of(0, [-3, 0]), of(1, [-3, 0])], [Some((3, -1.0)), Some((0, -1.0))]);
    assert_eq!([of(0, [0, 0]), of(1, [0, 0])], [None; 2]);
}

#[test]
fn errors_of_a_twist_are_of_both_wheels() {
    let geometry = super::dataset_of(1, true).robot.geometry().expect("lengths");
    let steps = [(0.01, 0.0), (0.0, 0.01)].map(|(v_m_s, omega_rad_s)| {
        geometry.wheel_speed_m_s(Twist { v_m_s, omega_rad_s }).map(|speed_m_s| speed_m_s / 0.08)
    });
    let rounding = RateRounding { step_rad_s: steps, shared: [1.0; 2] };
    // Half a step of the speed and a whole one of the yaw rate, for a second.
    let turned_rad = rounding.turned_rad([0.5, 1.0], 1.0);
    let on_paper = [0.005 - 0.1815 * 0.01, 0.005 + 0.1815 * 0.01].map(|m| m / 0.08);
    assert!((turned_rad.left - on_paper[0]).abs() < 1e-12 && (turned_rad.right - on_paper[1]).abs() < 1e-12);
}
