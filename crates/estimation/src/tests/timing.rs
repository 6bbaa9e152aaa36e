//! Measurements whose instants are known with errors.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::FitSettings;

const ROW_S: f64 = 0.1;
const SIGMA: f64 = 1e-3;
const JITTER_S: f64 = 5e-3;

/// Eight runs of 20 s that stand, drive and turn, measured at every row to a millimetre and a milliradian, at
/// instants that are off by normal errors of this size.
pub(super) fn driven(seed: u64, jitter_s: f64) -> Dataset {
    let mut dataset = dataset_of(1, true);
    let mut stream = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut draw = move |sigma: f64| {
        let normal: f64 = StandardNormal.sample(&mut stream);
        sigma * normal
    };
    let mut drive = |number: usize| {
        let (mut pose, mut turned) = (Pose::new(0.0, 0.0, 0.3 * number as f64), Wheels::both(vec![0.0]));
        let mut truth = Vec::new();
        for row in 0..=200_usize {
            let t_s = ROW_S * row as f64;
            let driving = if row % 40 < 10 { 0.0 } else { 1.0 };
            let rates = Wheels { left: 5.0 + 3.0 * (0.7 * t_s).sin(), right: 5.0 - 3.0 * (0.9 * t_s).sin() };
            let moved =
                |dt_s: f64| Increment::from_travel(rates.map(|rad_s| 0.08 * driving * rad_s * dt_s), 0.363).arc();
            let seen = pose * moved(draw(jitter_s));
            truth.push(TruthSample::new(
                t_s,
                seen.x_m + draw(SIGMA),
                seen.y_m + draw(SIGMA),
                Some(seen.theta_rad + draw(SIGMA)),
            ));
            pose = pose * moved(ROW_S);
            turned = turned.zip_with(rates, |mut all, rad_s| {
                all.push(all[row] + driving * rad_s * ROW_S);
                all
            });
        }
        turned.left.pop();
        turned.right.pop();
        Run {
            info: RunInfo { id: format!("run-{number}"), continuous: true, ..RunInfo::default() },
            odometry: Odometry {
                t_s: (0..=200).map(|row| ROW_S * f64::from(row)).collect(),
                wheels: WheelLog::Angles(turned),
                ..Odometry::default()
            },
            truth,
            ..Run::default()
        }
    };
    dataset.runs = (0..8).map(&mut drive).collect();
    dataset
}

/// 1600 measurements, of which three in four move: the variance of instants is known to 6 %, its root to 3 %,
/// five times which is the tolerance.
#[test]
fn noisy_instants_are_told_from_noisy_poses() {
    let dataset = driven(1, JITTER_S);
    let mut fit = FitSettings::GEOMETRY_ONLY.fit(&[dataset.session()]).expect("a fit");
    // All noise is the instrument's at first: its poses seem noisier than they are.
    assert!(fit.has_timing_noise() && fit.solution.noise.variance[2].sqrt() > 1.2 * SIGMA);
    fit.fit_timing_noise(&mut []).expect("a fit");
    let [_, _, position_m2, heading_rad2] = fit.solution.noise.variance;
    let found = fit.solution.noise.timing_s2.sqrt();
    assert!((found / JITTER_S - 1.0).abs() < 0.15, "{found}");
    for sigma in [position_m2.sqrt(), heading_rad2.sqrt()] {
        assert!((sigma / SIGMA - 1.0).abs() < 0.1, "{sigma}");
    }
    assert!(!fit.has_timing_noise(), "what was found is left over");
}

/// Of exact instants the score is standard normal: over 20 logs its mean is within 1/√20 and its variance
/// within √(2/19), three of each here.
#[test]
fn the_score_of_exact_instants_is_standard_normal() {
    let z: Vec<f64> = (0..20)
        .map(|seed| {
            let dataset = driven(100 + seed, 0.0);
            let fit = FitSettings::GEOMETRY_ONLY.fit(&[dataset.session()]).expect("a fit");
            fit.solution.pass.timing.z()
        })
        .collect();
    let mean = z.iter().sum::<f64>() / 20.0;
    let variance = z.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / 19.0;
    assert!(mean.abs() < 3.0 / 20_f64.sqrt() && (variance - 1.0).abs() < 3.0 * (2.0_f64 / 19.0).sqrt(), "{z:?}");
}

/// As [`the_noise_score_is_the_derivative_of_the_cost`], with its tolerance: errors along the velocity
/// correlate the components.
#[test]
fn the_noise_score_beside_noisy_instants_is_the_derivative_of_the_cost() {
    let dataset = dataset(true);
    let noisy = Noise { timing_s2: 4e-4, ..NOISE };
    let options = PassOptions { gate: OutlierGate::Off, noise_score: true, ..PassOptions::default() };
    let at_noise = |noise: &Noise| run(&dataset, &model(), noise, &[0.0, 0.0], options);
    let score = at_noise(&noisy).noise.gradient;
    for k in 0..4 {
        let h = 1e-4_f64;
        let at = |by: f64| {
            let mut noise = noisy;
            noise.variance[k] *= by.exp();
            cost(&at_noise(&noise))
        };
        let difference = (at(h) - at(-h)) / (2.0 * h);
        let tolerance = 2e-3 * (1.0 + difference.abs());
        assert!((score[k] - difference).abs() < tolerance, "{k}: {} {difference}", score[k]);
    }
}
