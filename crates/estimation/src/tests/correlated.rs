//! Rows whose errors are correlated, by their stated covariances.

use dataset::{PoseCovariance, TruthSigma};

use super::*;

/// Standard deviations of [`NOISE`].
const SIGMA: [f64; 2] = [3e-3, 5e-3];

/// The dataset whose rows state covariances of the noise's size: R Rᵀ about `correlation` of all coordinates,
/// in other directions from row to row.
pub(super) fn stated(with_headings: bool, correlation: f64) -> Dataset {
    let mut dataset = dataset(with_headings);
    dataset.truth_noise =
        TruthNoise { sigma_xy_m: Some(SIGMA[0]), sigma_theta_rad: Some(SIGMA[1]), ..TruthNoise::default() };
    for run in &mut dataset.runs {
        let of = |row: usize| {
            let (sin, cos) = (1.3 * row as f64).sin_cos();
            let [short, long] = [SIGMA[0] * (1.0 - correlation), SIGMA[0] * (1.0 + correlation)].map(|m| m * m);
            let with_heading = correlation * 0.5 * SIGMA[0] * SIGMA[1] * (1.0 - correlation);
            let elements = [
                cos * cos * long + sin * sin * short,
                sin * cos * (long - short),
                -sin * with_heading,
                sin * sin * long + cos * cos * short,
                cos * with_heading,
                SIGMA[1] * SIGMA[1],
            ];
            let covariance = PoseCovariance::stated(elements).expect("possible");
            TruthSigma { covariance, ..TruthSigma::UNKNOWN }
        };
        run.truth_sigma = Some((0..run.truth.len()).map(of).collect());
    }
    dataset
}

fn all_scores() -> PassOptions<'static> {
    PassOptions { gate: OutlierGate::Off, noise_score: true, innovations: true, ..PassOptions::default() }
}

#[test]
fn a_covariance_that_is_nearly_plain_is_a_plain_one() {
    let plain = run(&dataset(true), &model(), &NOISE, &[0.0, 0.0], all_scores());
    let near = run(&stated(true, 1e-9), &model(), &NOISE, &[0.0, 0.0], all_scores());
    assert_eq!(near.innovations[0].len(), plain.innovations[0].len());
    // To first order in the correlation, of dozens of terms.
    let close = |a: f64, b: f64| (a - b).abs() < 1e-6 * (1.0 + b.abs());
    assert!(close(cost(&near), cost(&plain)), "{} {}", cost(&near), cost(&plain));
    for (near, plain) in near.innovations[0].iter().zip(&plain.innovations[0]) {
        assert!(close(near.z, plain.z) && near.component == plain.component, "{near:?} {plain:?}");
    }
    let (near, plain) = (near.noise, plain.noise);
    assert!(near.gradient.iter().zip(plain.gradient.iter()).all(|(a, b)| close(*a, *b)), "{near:?} {plain:?}");
    // The sums of both have the same expectation, over other parts of a measurement: a realisation each.
    for k in 0..4 {
        let ratio = near.information[(k, k)] / plain.information[(k, k)];
        assert!((0.7..1.4).contains(&ratio), "{k}: {ratio}");
    }
}

/// As [`the_noise_score_is_the_derivative_of_the_cost`], with its tolerance.
#[test]
fn the_noise_score_of_correlated_rows_is_the_derivative_of_the_cost() {
    let dataset = stated(true, 0.6);
    let at_noise = |noise: &Noise| run(&dataset, &model(), noise, &[0.0, 0.0], all_scores());
    let score = at_noise(&NOISE).noise.gradient;
    for k in 0..4 {
        let h = 1e-4_f64;
        let at = |by: f64| {
            let mut noise = NOISE;
            noise.variance[k] *= by.exp();
            cost(&at_noise(&noise))
        };
        let difference = (at(h) - at(-h)) / (2.0 * h);
        let tolerance = 2e-3 * (1.0 + difference.abs());
        assert!((score[k] - difference).abs() < tolerance, "{k}: {} {difference}", score[k]);
    }
}

/// Positions alone: of a stated heading nothing is left, and the score is that of plain rows to first order.
#[test]
fn positions_alone_have_the_score_of_their_own_part() {
    let of = |dataset: &Dataset| run(dataset, &CENTRED_MODEL, &NOISE, &[0.5, 1.5], all_scores()).noise.gradient;
    let (near, plain) = (of(&stated(false, 1e-9)), of(&dataset(false)));
    assert!((near - plain).norm() < 1e-6 * (1.0 + plain.norm()), "{near} {plain}");
    let far = of(&stated(false, 0.6));
    assert!((far - plain).norm() > 0.1 * plain.norm(), "{far} {plain}");
}

/// A straight of 1 m along x, from a start that is known; its end is measured off along one axis of an
/// ellipse at 45°, ten times as long as wide. On paper the pull on the wheels is jᵀ R⁻¹ v, and R⁻¹ v is v
/// over the variance along it.
#[test]
fn a_long_ellipse_pulls_along_its_short_axis_alone() {
    const SHORT_M: f64 = 1e-3;
    const LONG_M: f64 = 1e-2;
    let pull = |off: [f64; 2]| {
        let mut dataset = dataset_of(1, true);
        let travel_rad = 1.0 / 0.08;
        let run = &mut dataset.runs[0];
        run.odometry.t_s = vec![0.0, 1.0].into();
        run.odometry.wheels = WheelLog::Angles(Wheels::both(vec![0.0, travel_rad]));
        run.truth =
            vec![TruthSample::new(0.0, 0.0, 0.0, Some(0.0)), TruthSample::new(1.0, 1.0 + off[0], off[1], Some(0.0))];
        let [short, long] = [SHORT_M * SHORT_M, LONG_M * LONG_M];
        let ellipse = [0.5 * (long + short), 0.5 * (long - short), 0.0, 0.5 * (long + short), 0.0, 1e-6];
        let exact = [1e-14, 0.0, 0.0, 1e-14, 0.0, 1e-14];
        let of = |elements| TruthSigma {
            covariance: PoseCovariance::stated(elements).expect("possible"),
            sigma_xy_m: Some(1e-7),
            ..TruthSigma::UNKNOWN
        };
        run.truth_sigma = Some(vec![of(exact), of(ellipse)]);
        dataset.truth_noise =
            TruthNoise { sigma_xy_m: Some(SHORT_M), sigma_theta_rad: Some(1e-3), ..TruthNoise::default() };
        let model = Model { m_per_rad: Wheels::both(0.08), body_from_sensor: Pose::IDENTITY, latency_s: 0.0, ..MODEL };
        let noise = Noise { variance: [1e-16, 1e-16, SHORT_M * SHORT_M, 1e-6], timing_s2: 0.0 };
        let records = Records::of(&[dataset.session()]);
        let selections = Selection::of(&records, Thinning::NONE, &model);
        let options = PassOptions { gate: OutlierGate::Off, ..PassOptions::default() };
        let found = pass(&records, &selections, &model, &noise, &[0.0], &mut [], options);
        let gradient = total(&found.runs).expect("a run").gradient;
        gradient[0] + gradient[1]
    };
    let off_m = 2e-3 / f64::sqrt(2.0);
    for ([x, y], variance) in [([1.0, 1.0], LONG_M * LONG_M), ([1.0, -1.0], SHORT_M * SHORT_M)] {
        let found = pull([x * off_m, y * off_m]);
        // Both wheels' relative change moves the end along x by 1 m; −v lowers the cost.
        let on_paper = -off_m / variance;
        // The start's 0.1 µm and the wheels' 0.01 µm beside 1 mm. A filter with the mean variance of both
        // axes would pull the same along both.
        assert!((found / on_paper - 1.0).abs() < 1e-6, "{found} {on_paper}");
    }
}
