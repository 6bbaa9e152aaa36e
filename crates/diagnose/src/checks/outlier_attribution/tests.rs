//! Causes of large errors: those that made them, and on paper.

use dataset::{Dataset, Displacement, Odometry, Run, RunInfo, TruthSample, WheelLog};
use effects::{Address, Stream, StreamName};
use estimation::FitSettings;
use kinematics::{Increment, Pose, Wheels};

use super::*;
use crate::fits::augmented_model::AugmentedModel;
use crate::small_robot::{assert_unmoved, dataset_of};

const ROW_S: f64 = 0.1;
const ROWS_PER_MEASUREMENT: u32 = 10;
const SEPARATION_M: f64 = 0.363;
const NAMES: [&str; 4] = ["traction_loss", "bumps", "truth_outliers", "stick_slip"];

/// Travel of each wheel in a row: starts and stops every eight seconds and a half, with turns both ways.
fn tread_m(run: u32, row: u32) -> Wheels<f64> {
    let (drive, at) = ((row / 85 + run) % 4, row % 85);
    let share = (f64::from(at) / 5.0).min(f64::from(75_u32.saturating_sub(at)) / 5.0).clamp(0.0, 1.0);
    let sides = [(0.03, 0.03), (0.03, 0.02), (-0.025, -0.03), (0.015, 0.03)];
    let (left, right) = sides[drive as usize];
    Wheels { left: share * left, right: share * right }
}

/// Six runs of a robot whose wheels lose way and whose measurements err as `cause` does, with white
/// errors of a millimetre or so.
pub(crate) fn driven(cause: &str, mahalanobis_distance: bool) -> Dataset {
    let mut runs = Vec::new();
    for run in 0..6_u32 {
        let address = Address { seed: 17, point: 0, trial: 0, run };
        let mut stream: Stream = address.stream(StreamName::new("test"));
        let (mut angles, mut pose) = (Wheels { left: vec![0.0], right: vec![0.0] }, Pose::IDENTITY);
        let (mut measurements, mut behind_m) = (Vec::new(), Wheels::both(0.0));
        for row in 0..=680_u32 {
            if row % ROWS_PER_MEASUREMENT == 0 {
                let errs = [stream.normal(), stream.normal(), stream.normal()];
                let jumps = [stream.normal(), stream.normal(), stream.normal()];
                let far = if cause == "truth_outliers" && stream.uniform() < 0.03 { 0.02 } else { 0.0 };
                let [x_m, y_m, theta_rad] = std::array::from_fn(|k| 1e-3 * errs[k] + far * jumps[k]);
                measurements.push(Pose::new(pose.x_m + x_m, pose.y_m + y_m, pose.theta_rad + theta_rad));
            }
            let (tread, before) = (tread_m(run, row), if row > 0 { tread_m(run, row - 1) } else { tread_m(run, 84) });
            let (relative_odds, amount) = (stream.uniform(), stream.uniform());
            let mut ground = tread;
            match cause {
                // Eight millimetres of one wheel.
                "bumps" if tread.left != 0.0 && relative_odds < 0.02 => {
                    let lost = |m: f64| m - 0.008 * m.signum();
                    if amount < 0.5 { ground.left = lost(ground.left) } else { ground.right = lost(ground.right) }
                }
                // One start or stop in four is too hard.
                "traction_loss" if row % 85 == 2 || row % 85 == 72 => {
                    let lost = if relative_odds < 0.25 { 0.5 + amount } else { 0.0 };
                    ground = tread.zip_with(before, |tread, before| tread - lost * (tread - before));
                }
                // Behind while it stands, in one stop of three.
                "stick_slip" if row % 85 == 74 && relative_odds < 0.33 => {
                    behind_m =
                        Wheels { left: 0.012 * amount, right: 0.0 }.zip_with(tread, |m, tread| m * tread.signum());
                    ground = ground.zip_with(behind_m, |ground, behind| ground - behind);
                }
                "stick_slip" if row % 85 == 3 => {
                    ground = ground.zip_with(behind_m, |ground, behind| ground + behind);
                    behind_m = Wheels::both(0.0);
                }
                _ => {}
            }
            pose = pose * Increment::from_travel(ground, SEPARATION_M).arc();
            if cause == "kicked aside" && relative_odds < 0.02 {
                pose = pose * Pose::new(0.0, 0.03 * (amount - 0.5), 0.0);
            }
            angles.left.push(angles.left[row as usize] + tread.left / 0.08);
            angles.right.push(angles.right[row as usize] + tread.right / 0.08);
        }
        let measurement_s =
            |k: usize| ROW_S * f64::from(ROWS_PER_MEASUREMENT) * f64::from(u32::try_from(k).expect("few"));
        let of_poses = |(k, measurement): (usize, &Pose)| {
            TruthSample::new(measurement_s(k), measurement.x_m, measurement.y_m, Some(measurement.theta_rad))
        };
        let of_pairs = |(k, pair): (usize, &[Pose])| {
            let moved = pair[0].to(pair[1]);
            let (t0_s, t1_s) = (measurement_s(k), measurement_s(k + 1));
            Displacement { t0_s, t1_s, dx_m: moved.x_m, dy_m: moved.y_m, dtheta_rad: moved.theta_rad }
        };
        let (truth, displacements) = if mahalanobis_distance {
            (Vec::new(), measurements.windows(2).enumerate().map(of_pairs).collect())
        } else {
            (measurements.iter().enumerate().map(of_poses).collect(), Vec::new())
        };
        let t_s = (0..=681).map(|row| ROW_S * f64::from(row)).collect();
        let info = RunInfo { id: format!("run-{run}"), ..RunInfo::default() };
        let odometry = Odometry { t_s, wheels: WheelLog::Angles(angles), ..Odometry::default() };
        runs.push(Run { info, odometry, truth, displacements, ..Run::default() });
    }
    dataset_of(SEPARATION_M, runs)
}

/// Causes with their log likelihoods, the likeliest first, and that of any cause.
fn order(dataset: &Dataset) -> (Vec<(&'static str, f64)>, f64) {
    let fit = FitSettings::GEOMETRY_ONLY.fit(&[dataset.session()]).expect("a fit");
    let any = [ErrorSource::Robot, ErrorSource::Instrument];
    let (likelihoods, any) = log_likelihoods(&AugmentedModel::base(&fit), &NAMES, &any).expect("large errors");
    let mut order: Vec<_> = NAMES.into_iter().zip(likelihoods).collect();
    order.sort_by(|a, b| b.1.total_cmp(&a.1));
    (order, any)
}

#[test]
fn the_cause_that_made_them_is_the_likeliest_of_large_errors() {
    for (cause, mahalanobis_distance) in [
        ("bumps", false),
        ("bumps", true),
        ("traction_loss", false),
        ("truth_outliers", false),
        ("truth_outliers", true),
        ("stick_slip", false),
    ] {
        let (order, any) = order(&driven(cause, mahalanobis_distance));
        // Twenty to one: with the signs of ways lost the wrong way round, the first two are not the
        // first.
        assert_eq!(order[0].0, cause, "{mahalanobis_distance}: {order:?} {any}");
        assert!(order[0].1 > order[1].1 + 3.0, "{cause} {mahalanobis_distance}: {order:?} {any}");
        assert!(order[0].1 > any - 3.0, "{cause} {mahalanobis_distance}: {order:?} {any}");
    }
}

#[test]
fn what_no_name_does_is_likelier_by_any_cause() {
    let (order, any) = order(&driven("kicked aside", false));
    assert!(any > order[0].1 + 3.0, "{order:?} {any}");
}

/// An error whose columns have no information but on the diagonal.
fn response(information: f64, score: &[(usize, f64)]) -> ErrorResponse {
    let mut all = DVector::zeros(COLUMNS);
    score.iter().for_each(|(column, value)| all[*column] = *value);
    ErrorResponse {
        large: LargeError {
            run: (0, 0),
            run_id: String::new(),
            from_s: 1.0,
            at_s: 2.0,
            travel_m: Wheels { left: 0.2, right: -0.2 },
            is_displacement: false,
            relative_distance: 2.0,
            ramp_odds: 3.0,
            z: 5.0,
        },
        separation_m: 0.4,
        information: DMatrix::identity(COLUMNS, COLUMNS) * information,
        score: all,
    }
}

fn is_near(found: f64, expected: f64) -> bool {
    (found - expected).abs() < 1e-9 * expected.abs().max(1.0)
}

#[test]
fn a_size_of_one_sense_is_likelier_by_the_normal_tail_of_its_score() {
    // Information 3 and a scale of 1: precision 4, mean 2/2 = 1. 2 Φ(1) e^½/2.
    let of = response(3.0, &[(0, 2.0)]);
    let phi = 0.841_344_746_068_542_9_f64;
    assert!(is_near(of.one_sided(&of.column(0), 1.0), (phi * 0.5_f64.exp()).ln()));
    // The other sense: 2 (1 − Φ(1)) e^½/2.
    assert!(is_near(of.one_sided(&-of.column(0), 1.0), ((1.0 - phi) * 0.5_f64.exp()).ln()));
    // Where nothing is measured it is as likely as none, whatever the scale.
    let none = response(0.0, &[]);
    assert!(is_near(none.one_sided(&none.column(0), 0.01), 0.0));
    // A scale of a half: precision 3 + 4, and 7/4 of the prior's.
    let mean = 2.0 / 7_f64.sqrt();
    let cdf = Normal::new(0.0, 1.0).expect("normal").cdf(mean);
    let expected = std::f64::consts::LN_2 - 0.5 * 1.75_f64.ln() + 0.5 * mean * mean + cdf.ln();
    assert!(is_near(of.one_sided(&of.column(0), 0.5), expected));
}

#[test]
fn an_error_of_a_measurement_is_normal_in_all_three() {
    // Scales 2, 2 and 0.5 with information 3: |1 + TI| = 13 · 13 · 1.75; scores 1, 0 and 4.
    let of = response(3.0, &[(AT, 1.0), (AT + 2, 4.0), (FROM, 1.0)]);
    let expected = 0.5 * (4.0 / 13.0 + 4.0 / 1.75) - 0.5 * (13.0 * 13.0 * 1.75_f64).ln();
    assert!(is_near(of.error(AT, 2.0, 0.5), expected));
    let before = 0.5 * 4.0 / 13.0 - 0.5 * (13.0 * 13.0 * 1.75_f64).ln();
    assert!(is_near(of.of_measurement(2.0, 0.5), log_mean(&[expected, before])));
}

#[test]
fn causes_go_by_their_columns_and_by_where_they_are() {
    let lost = response(3.0, &[(1, 2.0)]);
    let each: Vec<f64> = (0..6).map(|column| lost.one_sided(&lost.column(column), 1.0)).collect();
    assert!(is_near(lost.of_bump(1.0), log_mean(&each) + 2_f64.ln()));
    // Both wheels slide: their columns together.
    let slides = response(3.0, &[(SLIDES, 2.0), (SLIDES + 1, 1.0)]);
    let [left, right] = [0, 1].map(|side| slides.column(SLIDES + side));
    let ways = [&left, &right, &(&left + &right)].map(|of| slides.one_sided(of, 1.0));
    assert!(is_near(slides.of_slide(1.0), log_mean(&ways) + 3_f64.ln()));
    // Behind at the measurement: half of what a wheel lacks, and a turn by what it lacks over the separation;
    // the left wheel went ahead, and the right one back.
    let behind = response(3.0, &[(AT, 1.0), (AT + 2, 0.3)]);
    let turn = 1.0 / 0.4;
    let [left, right] = [(-0.5, turn), (0.5, turn)].map(|(along, turned)| {
        let mut of = DVector::zeros(COLUMNS);
        (of[AT], of[AT + 2]) = (along, turned);
        of
    });
    let at = [&left, &right, &(&left + &right)].map(|of| behind.one_sided(of, 0.01));
    let [left, right] = [0, 1].map(|side| -behind.column(SLIDES + side));
    // 0.01 m at 0.2 m/s are 0.05 s.
    let before = [&left, &right, &(&left + &right)].map(|of| behind.one_sided(of, 0.05));
    let expected = log_mean(&[log_mean(&at), log_mean(&before)]) + 3_f64.ln();
    assert!(is_near(behind.of_wind_up(0.01, 0.2), expected));
    assert_eq!((sense(0.0), sense(-2.0), sense(3.0)), (0.0, -1.0, 1.0));
}

#[test]
fn likelihoods_are_averaged_over_scales_and_no_error_speaks_against_a_cause_by_more_than_twenty_to_one() {
    assert!(is_near(log_mean(&[0.0, 3_f64.ln()]), 2_f64.ln()) && log_mean(&[f64::NEG_INFINITY]) == f64::NEG_INFINITY);
    assert!(is_near(log_mean(&[1000.0, 1000.0]), 1000.0));
    // Two causes of one scale each, two errors: the first explains the first one far better, the second the
    // second one by ln 2.
    let found = of_causes(&[vec![vec![100.0, 0.0]], vec![vec![0.0, 2_f64.ln()]]]);
    assert!(is_near(found[0], (0.95 * 0.5 + 0.05_f64).ln()), "{found:?}");
    assert!(is_near(found[1], 0.05_f64.ln()), "{found:?}");
    // A cause of two scales is the mean of both.
    let found = of_causes(&[vec![vec![0.0], vec![2_f64.ln()]]]);
    assert!(is_near(found[0], ((0.95 * 0.5 + 0.05 + 1.0) / 2.0_f64).ln()), "{found:?}");
}

#[test]
fn any_error_has_two_scales_and_displacements_may_err_alone() {
    let mut of = response(3.0, &[(AT, 1.0)]);
    let scales = RESIDUALS.measurement_error_scales.len().pow(2);
    let number = |source, of: &ErrorResponse| of_any(source, std::slice::from_ref(of)).len();
    assert_eq!((number(ErrorSource::Robot, &of), number(ErrorSource::Instrument, &of)), (scales, scales));
    of.large.is_displacement = true;
    assert_eq!((number(ErrorSource::Robot, &of), number(ErrorSource::Instrument, &of)), (scales, 2 * scales));
    let [m, rad] = [RESIDUALS.measurement_error_scales[0], RESIDUALS.measurement_error_scales[1]];
    let all = of_any(ErrorSource::Robot, std::slice::from_ref(&of));
    assert_eq!(all[1], [of.error(ANY, m, rad)]);
    assert!(of_cause("slip_speed", &[of.clone()], 0.2).is_none());
    assert!(of_cause("bumps", &[of.clone()], 0.2).is_some_and(|all| all.iter().all(|of| of.len() == 1)));
    assert_eq!(of_cause("truth_outliers", &[of.clone()], 0.2), Some(of_any(ErrorSource::Instrument, &[of])));
}

#[test]
fn regress_no_number_of_an_attribution_moves() {
    let mut text = String::new();
    for (cause, are_displacements) in [("bumps", false), ("truth_outliers", true)] {
        let datasets = [driven(cause, are_displacements)];
        let fit = FitSettings::GEOMETRY_ONLY.fit(&[datasets[0].session()]).expect("a fit");
        let model = AugmentedModel::base(&fit);
        let fit = fit.evaluated_ungated();
        let large = large_errors(&fit, &fit.scan(&mut terms(&[])).innovations);
        for of in responses(&model, &fit, &large[..2]) {
            text += &format!("{cause}: {:?} {:?}\n", of.information.diagonal().as_slice(), of.score.as_slice());
        }
        text += &format!("{:?}\n", log_likelihoods(&model, &NAMES, &[ErrorSource::Robot]));
    }
    assert_unmoved("attribution.txt", &text);
}
