//! Standard deviations that rows of the truth state for themselves weigh in the fit.

use dataset::{
    Dataset, NominalRobot, Odometry, PoseCovariance, Provenance, Run, RunInfo, TruthNoise, TruthSample, TruthSigma,
    WheelLog,
};
use estimation::FitSettings;
use kinematics::{Increment, Pose, Wheels};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const RADIUS_M: f64 = 0.08;
const SEPARATION_M: f64 = 0.363;

/// Four runs of straights and bends, the left wheel 0.4 % larger than nominal, measured every second with
/// errors of `error_m` of the row.
fn dataset(error_m: impl Fn(usize) -> f64, sigma_m: impl Fn(usize) -> Option<f64>) -> Dataset {
    let run = |number: usize| {
        let mut angles = Wheels { left: vec![0.0], right: vec![0.0] };
        let mut pose = Pose::new(0.0, 0.0, 0.3 * number as f64);
        let (mut truth, mut sigmas) = (Vec::new(), Vec::new());
        for row in 0..=40 {
            // Quasi-random errors: multiples of irrational numbers, folded to ±1.
            let off = |k: f64| error_m(row) * (12.9898 * (41 * number + row) as f64 + 78.233 * k).sin();
            let theta_rad = pose.theta_rad + off(3.0);
            truth.push(TruthSample::new(row as f64, pose.x_m + off(1.0), pose.y_m + off(2.0), Some(theta_rad)));
            // In the ratio of what is plausible of instruments.
            let sigma_theta_rad = sigma_m(row).map(|sigma_m| 3.0 * sigma_m);
            sigmas.push(TruthSigma { sigma_xy_m: sigma_m(row), sigma_theta_rad, covariance: None });
            let turn = if (row / 8) % 2 == 0 { 0.0 } else { 1.5 - (number % 2) as f64 * 3.0 };
            let rad = Wheels { left: 3.0 - turn, right: 3.0 + turn };
            angles.left.push(angles.left[row] + rad.left);
            angles.right.push(angles.right[row] + rad.right);
            // Wheels that scatter by 2 mm a row: without, their noise is next to nothing and its prior
            // decides it.
            let slip_m = |k: f64| 2e-3 * (7.7 * (41 * number + row) as f64 + 31.1 * k).sin();
            let travel_m =
                Wheels { left: 1.004 * RADIUS_M * rad.left + slip_m(1.0), right: RADIUS_M * rad.right + slip_m(2.0) };
            pose = pose * Increment::from_travel(travel_m, SEPARATION_M).arc();
        }
        let t_s = (0..angles.left.len()).map(|row| row as f64).collect();
        let odometry = Odometry { t_s, wheels: WheelLog::Angles(angles), ..Odometry::default() };
        let info = RunInfo { id: format!("run {number}"), continuous: true, ..RunInfo::default() };
        Run { info, odometry, truth, truth_sigma: Some(sigmas), ..Run::default() }
    };
    Dataset {
        provenance: Provenance::default(),
        robot: NominalRobot {
            left_wheel_diameter_m: 2.0 * RADIUS_M,
            right_wheel_diameter_m: 2.0 * RADIUS_M,
            wheel_separation_m: SEPARATION_M,
            ticks_per_rev: None,
            counter_bits: None,
        },
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs: (0..4).map(run).collect(),
    }
}

/// Left diameter over nominal, and its standard deviation.
fn left(dataset: &Dataset) -> (f64, f64) {
    let fit = FitSettings::GEOMETRY_ONLY.fit(&[dataset.session()]).expect("a fit");
    let information = fit.solution.information(&fit.columns).expect("runs");
    let (_, covariance) = information.solve().expect("determined");
    (fit.solution.model.m_per_rad.left / RADIUS_M, covariance[(0, 0)].sqrt())
}

#[test]
fn a_precision_that_all_rows_state_alike_changes_nothing_but_where_the_noise_is_sought() {
    let stated = left(&dataset(|_| 2e-3, |_| Some(2e-3)));
    let silent = left(&dataset(|_| 2e-3, |_| None));
    // The logarithm of the noise is sought from ln 2 farther up, with a prior standard deviation of 2 against
    // some hundred innovations: it moves by some 1e-3 of itself.
    assert!((stated.0 - silent.0).abs() < 0.01 * silent.1, "{stated:?} {silent:?}");
    assert!((silent.0 - 1.004).abs() < 4.0 * silent.1, "{silent:?}");
}

#[test]
fn rows_that_state_a_large_error_weigh_little() {
    // Every second row is off by some centimetres, and says so.
    let coarse = |row: usize| row % 2 == 1;
    let error = |row: usize| if coarse(row) { 0.04 } else { 1e-3 };
    let honest = left(&dataset(error, |row| Some(error(row))));
    let silent = left(&dataset(error, |_| None));
    let good = left(&dataset(|_| 1e-3, |_| None));
    // Half of the rows have all but all of the information.
    assert!(honest.1 < 2.0 * good.1, "{honest:?} {good:?}");
    assert!((honest.0 - 1.004).abs() < 4.0 * honest.1, "{honest:?}");
    // One noise for all knows the wheel less well; a fit that reads the precisions and ignores them would be
    // this one.
    assert!(silent.1 > 3.0 * honest.1, "{silent:?} {honest:?}");
}

/// The dataset with errors drawn from each row's covariance: an ellipse whose axes turn from row to row, 2 cm
/// long and 1 mm wide, its short axis correlated with a heading error of 4 mrad.
fn elliptic(seed: u64, full: bool) -> Dataset {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
    let mut set = dataset(|_| 0.0, |_| None);
    let [long_m, short_m, heading_rad, correlation] = [2e-2, 1e-3, 4e-3, 0.8];
    for run in &mut set.runs {
        let mut sigmas = Vec::new();
        for (row, sample) in run.truth.iter_mut().enumerate() {
            let (sin, cos) = (0.7 * row as f64).sin_cos();
            let (along, across) = (long_m * normal(), normal());
            let turned = correlation * across + (1.0 - correlation * correlation).sqrt() * normal();
            let (x, y) = (cos * along - sin * short_m * across, sin * along + cos * short_m * across);
            let theta_rad = sample.theta_rad().map(|theta_rad| theta_rad + heading_rad * turned);
            *sample = TruthSample::new(sample.t_s, sample.x_m + x, sample.y_m + y, theta_rad);
            let [long, short, mixed] = [long_m * long_m, short_m * short_m, correlation * short_m * heading_rad];
            let elements = [
                cos * cos * long + sin * sin * short,
                sin * cos * (long - short),
                -sin * mixed,
                sin * sin * long + cos * cos * short,
                cos * mixed,
                heading_rad * heading_rad,
            ];
            // A filter's own opinion: of the right shape, and three times too sure.
            let covariance = PoseCovariance::stated(elements.map(|element| element / 9.0)).expect("possible");
            let mean_m = Some((0.5 * (long + short)).sqrt() / 3.0);
            let plain = TruthSigma { sigma_xy_m: mean_m, sigma_theta_rad: Some(heading_rad / 3.0), covariance: None };
            sigmas.push(if full { TruthSigma { covariance, ..TruthSigma::UNKNOWN } } else { plain });
        }
        run.truth_sigma = Some(sigmas);
        // The wheels' scatter anew for each seed.
        if let WheelLog::Angles(angles) = &mut run.odometry.wheels {
            for side in [&mut angles.left, &mut angles.right] {
                let mut slipped_rad = 0.0;
                for angle in side.iter_mut().skip(1) {
                    slipped_rad += 2e-3 / RADIUS_M * normal();
                    *angle += slipped_rad;
                }
            }
        }
    }
    set
}

#[test]
fn intervals_cover_where_errors_are_long_ellipses_and_a_mean_sigma_knows_less() {
    const TRIALS: u64 = 600;
    let (mut covered, mut full_sigma, mut plain_sigma) = (0, 0.0, 0.0);
    for seed in 0..TRIALS {
        let (found, sigma) = left(&elliptic(7000 + seed, true));
        covered += u32::from((found - 1.004).abs() < 1.96 * sigma);
        full_sigma += sigma / TRIALS as f64;
        plain_sigma += left(&elliptic(7000 + seed, false)).1 / TRIALS as f64;
    }
    // 95 % of 600 are 570 ± 5.3; three standard deviations. The scale of the covariances is estimated: a fit
    // that took them at their word would cover some half.
    assert!((554..=586).contains(&covered), "{covered} of {TRIALS}");
    assert!(plain_sigma > 1.2 * full_sigma, "{plain_sigma} {full_sigma}");
}
