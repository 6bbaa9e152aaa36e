//! Partial measurements beside poses: against closed forms, against central differences, and against a robot
//! that is known.

use dataset::{Dataset, ExtraChannel, Run, TruthSample};
use kinematics::{Pose, Wheels};

use super::partial::{
    GYRO, M_PER_RAD, NO_GYRO, NOISELESS, SEPARATION_M, SIGMA_M, SIGMA_RAD, all, dataset, equations, errors, fitted,
    noise, nominal, tape,
};
use crate::layout::Layout;
use crate::partial_filter::filter_taken;
use crate::partial_poses::{PartialPass, TakenPoses, Taking};
use crate::pass::{Pass, pass};
use crate::pass_options::{OutlierGate, PassOptions};
use crate::products::Products;
use crate::{Column, Model, Noise, NormalEquations, Records, Selection, Thinning};

/// How the sensor sits on the robot.
const BODY_FROM_SENSOR: Pose = Pose::new(0.05, -0.03, 0.2);

/// Poses at some rows, off by up to `off` standard deviations; the room's origin is not the run's.
fn posed(run: &mut Run, poses: &[Pose], rows: impl Iterator<Item = usize>, off: f64, has_headings: bool) {
    let room = Pose::new(1.5, -2.0, 0.7);
    for row in rows {
        let seen = room * poses[row] * BODY_FROM_SENSOR;
        let error = |k: f64| off * (12.9898 * row as f64 + 78.233 * k).sin();
        run.truth.push(TruthSample::new(
            run.odometry.t_s[row],
            seen.x_m + SIGMA_M * error(1.0),
            seen.y_m + SIGMA_M * error(2.0),
            has_headings.then_some(seen.theta_rad + SIGMA_RAD * error(3.0)),
        ));
    }
}

fn near_truth() -> Model {
    Model { m_per_rad: M_PER_RAD, separation_m: SEPARATION_M, body_from_sensor: BODY_FROM_SENSOR, ..nominal() }
}

fn passed(dataset: &Dataset, model: &Model, noise: &Noise) -> Pass {
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning::NONE, &nominal());
    let headings = vec![0.9; records.segments.len()];
    let options = PassOptions { noise_score: true, gate: OutlierGate::Off, ..PassOptions::default() };
    pass(&records, &selections, model, noise, &headings, &mut [], options)
}

/// A log of poses with everything else, whose standard deviations are a factor of what they are.
pub(super) fn beside_poses(has_headings: bool, factor: f64) -> Dataset {
    let mut gyro = GYRO;
    gyro.noise_rad_per_sqrt_s = gyro.noise_rad_per_sqrt_s.map(|noise| factor * noise);
    dataset(gyro, |run, poses| {
        all(run, poses);
        posed(run, poses, (0..=280).step_by(7), 0.8, has_headings);
        for of in &mut run.revisits {
            of.sigma_xy_m = of.sigma_xy_m.map(|sigma| factor * sigma);
            of.sigma_theta_rad = of.sigma_theta_rad.map(|sigma| factor * sigma);
        }
        run.distances.iter_mut().for_each(|of| of.sigma_m *= factor);
        for of in &mut run.walls {
            of.sigma_m = of.sigma_m.map(|sigma| factor * sigma);
            of.sigma_rad = of.sigma_rad.map(|sigma| factor * sigma);
        }
    })
}

fn poses_alone(mut dataset: Dataset) -> Dataset {
    for run in &mut dataset.runs {
        (run.revisits, run.distances, run.walls) = (Vec::new(), Vec::new(), Vec::new());
        run.odometry.extra.clear();
    }
    dataset
}

#[test]
fn a_tape_beside_poses_weighs_by_its_variance_and_counts_the_wheels_errors_once() {
    // Rows 40 to 100 are a straight of both wheels alike, by a model of equal wheels.
    let rows = [40, 100];
    let log = |has_tape: bool, has_poses: bool| {
        dataset(NO_GYRO, |run, poses| {
            if has_tape {
                tape(run, poses, rows, 0.3);
            }
            if has_poses {
                posed(run, poses, rows.into_iter(), 0.0, true);
            }
        })
    };
    let model = Model { m_per_rad: Wheels::both(0.08), separation_m: SEPARATION_M, ..nominal() };
    let noise = noise();
    let common_scale = |has_tape: bool, has_poses: bool| {
        let of = equations(&log(has_tape, has_poses), &model, &noise).information;
        of[(0, 0)] + 2.0 * of[(0, 1)] + of[(1, 1)]
    };
    // Four straights; the wheels' noise is half of one wheel's, and both poses err.
    let expected = |has_tape: bool, has_poses: bool| -> f64 {
        (0..4)
            .map(|number| {
                let length_m = 0.08 * 60.0 * (0.2 + 0.1 * f64::from(number % 2));
                let of_wheels = 0.5 * noise.variance[0] * length_m * nominal().m_per_rad.left / 0.08;
                let precision = |has: bool, variance: f64| if has { 1.0 / variance } else { 0.0 };
                let both = precision(has_tape, SIGMA_M.powi(2)) + precision(has_poses, 2.0 * SIGMA_M.powi(2));
                length_m.powi(2) / (of_wheels + 1.0 / both)
            })
            .sum()
    };
    for (has_tape, has_poses) in [(true, false), (false, true), (true, true)] {
        let [found, expected] = [common_scale(has_tape, has_poses), expected(has_tape, has_poses)];
        // Rounding of the weak start, 1e-6 of a variance. Rejects the sum of both kinds' own information,
        // 7 % more, and either kind alone.
        assert!((found / expected - 1.0).abs() < 1e-4, "{has_tape} {has_poses}: {found} {expected}");
    }
}

#[test]
fn measurements_of_no_weight_change_nothing_beside_poses() {
    for has_headings in [true, false] {
        let both = passed(&beside_poses(has_headings, 1e5), &near_truth(), &noise());
        let alone = passed(&poses_alone(beside_poses(has_headings, 1e5)), &near_truth(), &noise());
        for (both, alone) in both.runs.iter().zip(&alone.runs) {
            for column in 0..Column::GyroScale.index() {
                let scale = alone.information[(column, column)].sqrt();
                // What weighs 1e-10 moves nothing by more than rounding of sums.
                // Positions tell no mounting of a heading.
                if alone.information[(column, column)] == 0.0 {
                    continue;
                }
                let moved = (both.gradient[column] - alone.gradient[column]).abs() / scale;
                assert!(moved < 1e-3, "{has_headings} {column}: {moved}");
                let ratio = both.information[(column, column)] / alone.information[(column, column)];
                assert!((ratio - 1.0).abs() < 1e-5, "{column}: {ratio}");
            }
        }
        assert!((both.noise.gradient - alone.noise.gradient).amax() < 1e-3);
    }
}

#[test]
fn poses_are_what_they_are_in_their_own_filter() {
    let dataset = beside_poses(true, 1.0);
    let records = Records::of(&[dataset.session()]);
    let selections = Selection::of(&records, Thinning::NONE, &nominal());
    let (model, noise) = (near_truth(), noise());
    let poses = TakenPoses::of(&records.segments, &[], &selections[0].propagations, &[]);
    let products = Products::of(Layout::whole(0), &[], None);
    let own = passed(&poses_alone(dataset.clone()), &model, &noise);
    let mut score = crate::noise_score::NoiseScore::zero();
    let pass = PartialPass { poses: &poses, gate: OutlierGate::Off, model: &model, noise: &noise, products: &products };
    for ((partial, propagations), own) in records.partial.iter().zip(&selections[0].partial).zip(&own.runs) {
        let taken: Vec<bool> = partial.observations.iter().map(|of| poses.takes(of, Taking::PosesAlone)).collect();
        let of = filter_taken(partial, propagations.as_ref().expect("taken"), &taken, &pass, &mut []);
        let found = of.equations;
        score.add(&of.score, 1.0);
        // The start is taken as a measurement here.
        assert_eq!(found.count, own.count + 3.0);
        for column in 0..Column::GyroScale.index() {
            let of_own = own.information[(column, column)];
            let information = found.information[(column, column)] / of_own - 1.0;
            let gradient = (found.gradient[column] - own.gradient[column]) / of_own.sqrt();
            // Components are taken together here and one after the other there: second orders of headings
            // that are off by a milliradian. Rejects a lever or a rounding that one of them lacks.
            assert!(information.abs() < 1e-3 && gradient.abs() < 1e-3, "{column}: {information:e} {gradient:e}");
        }
    }
    // The same of the scores.
    let off = (score.gradient - own.noise.gradient).component_div(&own.noise.gradient);
    assert!(off.amax() < 1e-4, "{off}");
}

#[test]
fn gradients_and_noise_scores_beside_poses_are_those_of_the_cost() {
    for has_headings in [true, false] {
        let dataset = beside_poses(has_headings, 1.0);
        let (model, noise) = (near_truth(), noise());
        let cost = |model: &Model, noise: &Noise| -> f64 {
            passed(&dataset, model, noise).runs.iter().map(NormalEquations::cost).sum()
        };
        let found = passed(&dataset, &model, &noise);
        let sums = crate::normal_equations::total(&found.runs).expect("runs");
        let columns = Column::BASE.into_iter().filter(|column| has_headings || *column != Column::SensorTheta);
        for column in columns {
            let at = |by: f64| {
                let mut moved = model.clone();
                moved.advance(column, by);
                cost(&moved, &noise)
            };
            let scale = sums.information[(column.index(), column.index())].sqrt();
            let step = 1e-2 / scale;
            let numeric = (at(step) - at(-step)) / (2.0 * step);
            let analytic = sums.gradient[column.index()];
            // As of the filters alone: gains that turn with the path are left out.
            assert!(
                (numeric - analytic).abs() < 0.05 * scale,
                "{has_headings} {column:?}: {numeric} {analytic} of {scale}"
            );
        }
        // A heading that is not measured is eliminated from the cost, and its part of the score left out.
        for component in if has_headings { 0..4 } else { 0..0 } {
            let step = 1e-4_f64;
            let at = |by: f64| {
                let mut noise = noise;
                noise.variance[component] *= by.exp();
                cost(&model, &noise)
            };
            let numeric = (at(step) - at(-step)) / (2.0 * step);
            let analytic = found.noise.gradient[component];
            let scale = found.noise.information[(component, component)].max(0.0).sqrt();
            assert!(
                (numeric - analytic).abs() < 0.03 * (1.0 + scale),
                "{has_headings} {component}: {numeric} {analytic} of {scale}"
            );
        }
    }
}

#[test]
fn poses_determine_the_scale_of_a_gyroscope_which_makes_the_wheels_more_certain() {
    let scale = 0.03;
    let log = |has_gyro: bool| {
        let mut dataset = dataset(if has_gyro { GYRO } else { NO_GYRO }, |run, poses| {
            posed(run, poses, (0..=280).step_by(10), 0.8, true);
        });
        let bias = super::partial::BIAS_RADPS;
        for run in &mut dataset.runs {
            for rate in run.odometry.extra.get_mut(&ExtraChannel::GyroYawRate).into_iter().flatten() {
                *rate = (1.0 + scale) * (*rate - bias) + bias;
            }
        }
        dataset
    };
    let (with, without) = (log(true), log(false));
    let (with, without) = (fitted(&with), fitted(&without));
    assert!(with.unobservable.is_empty() && without.unobservable.is_empty());
    // 1 mrad of a pose over whole turns of 6.3 rad, and a run's dozens of them.
    assert!((with.solution.model.gyro_scale / scale - 1.0).abs() < 0.02, "{}", with.solution.model.gyro_scale);
    assert!(errors(&with).iter().all(|error| error.abs() < 10.0 * NOISELESS), "{:?}", errors(&with));
    let wheels_ratio = |fit: &crate::ModelFit<'_>| {
        let information = fit.solution.information(&fit.columns).expect("a fit");
        let inverse = information.matrix.try_inverse().expect("determined");
        (inverse[(0, 0)] - 2.0 * inverse[(0, 1)] + inverse[(1, 1)]).sqrt()
    };
    // A gyroscope of 0.2 mrad/√s sees straights of 6 s three times as well as headings of 1 mrad do.
    let [of_both, of_poses] = [wheels_ratio(&with), wheels_ratio(&without)];
    assert!(of_both < 0.9 * of_poses, "{of_both} {of_poses}");
}

#[test]
fn poses_that_jump_leave_the_gyroscope_as_it_is() {
    let dataset = dataset(GYRO, |run, poses| {
        posed(run, poses, (0..=280).step_by(10), 0.5, true);
        // The map has been moved under the robot.
        for sample in run.truth.iter_mut().skip(15) {
            sample.x_m += 1.0;
        }
    });
    let fit = fitted(&dataset);
    assert!(!fit.solution.pass.outliers.is_empty());
    assert!(errors(&fit).iter().all(|error| error.abs() < 10.0 * NOISELESS), "{:?}", errors(&fit));
    assert!(fit.solution.model.gyro_scale.abs() < 10.0 * NOISELESS, "{}", fit.solution.model.gyro_scale);
}
