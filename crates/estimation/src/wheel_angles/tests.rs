//! Turns of wheels at rows and between them.

use super::*;
use dataset::{Dataset, Odometry, Provenance, Run, RunInfo, TruthNoise};

fn dataset(wheels: WheelLog, continuous: bool) -> Dataset {
    let odometry = Odometry { t_s: vec![0.0, 1.0, 2.0, 4.0].into(), wheels, ..Odometry::default() };
    let run = Run { info: RunInfo { continuous, ..RunInfo::default() }, odometry, ..Run::default() };
    Dataset {
        provenance: Provenance::default(),
        robot: NominalRobot {
            left_wheel_diameter_m: 0.2,
            right_wheel_diameter_m: 0.4,
            wheel_separation_m: 0.5,
            ticks_per_rev: Some(std::f64::consts::TAU),
            counter_bits: None,
        },
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs: vec![run],
    }
}

fn steps(wheels: WheelLog, continuous: bool, from_s: f64, to_s: f64) -> Option<Vec<(f64, f64)>> {
    let dataset = dataset(wheels, continuous);
    let session = dataset.session();
    let track = WheelAngleInterpolator::of(&session.runs[0], session.robot)?;
    Some(track.steps(from_s, to_s)?.into_iter().map(|step| (step.left, step.right)).collect())
}

fn ticks() -> WheelLog {
    WheelLog::Ticks(Wheels { left: vec![7, 17, 27, 67], right: vec![0, 0, -10, -10] })
}

#[test]
fn steps_follow_the_rows_and_share_the_outer_intervals() {
    assert_eq!(steps(ticks(), true, 0.0, 2.0), Some(vec![(10.0, 0.0), (10.0, -10.0)]));
    assert_eq!(steps(ticks(), true, 0.5, 3.0), Some(vec![(5.0, 0.0), (10.0, -10.0), (20.0, 0.0)]));
    assert_eq!(steps(ticks(), true, 2.5, 3.5), Some(vec![(20.0, 0.0)]));
    // A rounding beside a row is that row.
    assert_eq!(steps(ticks(), true, 1.0 + 1e-10, 2.0 - 1e-10), Some(vec![(10.0, -10.0)]));
    assert_eq!(steps(ticks(), true, 4.0, 4.0), Some(vec![(0.0, 0.0)]));
}

#[test]
fn within_short_rows_wheels_speed_up_where_their_neighbours_do() {
    // Rows of 0.1 s: the left wheel speeds up by 20 rad/s², the right one jumps from rest to 10 rad/s.
    let t_s: Vec<f64> = (0..=6).map(|row| 0.1 * f64::from(row)).collect();
    let left: Vec<f64> = t_s.iter().map(|t_s| 10.0 * t_s * t_s).collect();
    let right: Vec<f64> = t_s.iter().map(|t_s| f64::max(10.0 * (t_s - 0.3), 0.0)).collect();
    let mut dataset = dataset(WheelLog::Angles(Wheels { left, right }), true);
    dataset.runs[0].odometry.t_s = t_s.into();
    let session = dataset.session();
    let track = WheelAngleInterpolator::of(&session.runs[0], session.robot).expect("a track");
    let steps = track.steps(0.25, 0.35).expect("spanned");
    let turned = steps.iter().fold(Wheels::both(0.0), |sum, step| sum.zip_with(*step, |a, b| a + b));
    // 10 (0.35² − 0.25²). Rejects even rows, 0.575: the half of the first and of the second.
    assert!((turned.left - 0.6).abs() < 1e-12, "{turned:?}");
    // The half of a row at 10 rad/s. Rejects rates at the rows from both sides, which bend the row after
    // a jump: 0.44.
    assert!((turned.right - 0.5).abs() < 1e-12, "{turned:?}");
}

#[test]
fn a_long_row_is_off_by_all_of_its_acceleration() {
    // 20 rad/s², steadily; a row of 0.4 s among rows of 0.2 s is too long to be taken to speed up.
    let t_s = vec![0.0, 0.2, 0.4, 0.6, 1.0, 1.2, 1.4, 1.6];
    let angle: Vec<f64> = t_s.iter().map(|t_s| 10.0 * t_s * t_s).collect();
    let mut dataset = dataset(WheelLog::Angles(Wheels { left: angle.clone(), right: angle }), true);
    dataset.runs[0].odometry.t_s = t_s.into();
    let session = dataset.session();
    let track = WheelAngleInterpolator::of(&session.runs[0], session.robot).expect("a track");
    let (turned, variance) = (track.cursor().angle_rad(0.8), track.interpolated_rad2(3, 0.8));
    // ½ · 20 · 0.2 · 0.2. Rejects what the acceleration changes by from row to row, which is nothing.
    let off = turned.expect("spanned").left - 6.4;
    assert!((off - 0.4).abs() < 1e-12 && (variance.left - 0.16).abs() < 1e-9, "{off} {variance:?}");
}

#[test]
fn outside_of_the_log_and_across_gaps_there_are_no_steps() {
    for (from_s, to_s) in [(-0.6, 1.0), (1.0, 5.1), (2.0, 1.0)] {
        assert_eq!(steps(ticks(), true, from_s, to_s), None, "{from_s} {to_s}");
    }
    // A log with gaps is not extrapolated.
    assert_eq!(steps(ticks(), false, -0.1, 0.5), None);
    assert_eq!(steps(ticks(), false, 1.0, 2.0), Some(vec![(10.0, -10.0)]));
    assert_eq!(steps(ticks(), false, 1.2, 1.8).map(|steps| steps.len()), Some(1));
    assert_eq!(steps(ticks(), false, 0.0, 2.0), None);
}

#[test]
fn beside_the_log_the_outer_speeds_go_on() {
    assert_eq!(steps(ticks(), true, -0.5, 1.0), Some(vec![(5.0, 0.0), (10.0, 0.0)]));
    assert_eq!(steps(ticks(), true, 2.0, 4.5), Some(vec![(40.0, 0.0), (10.0, 0.0)]));
    let dataset = dataset(ticks(), true);
    let session = dataset.session();
    let track = WheelAngleInterpolator::of(&session.runs[0], session.robot).expect("a track");
    let (mut cursor, mut intervals) = (track.cursor(), Vec::new());
    assert!(cursor.intervals(-0.25, 2.0, &mut intervals) && cursor.intervals(2.0, 4.5, &mut intervals));
    let sum = intervals.iter().map(|interval| interval.wheel_rad).reduce(|a, b| a.zip_with(b, |a, b| a + b));
    // Counted on: 2.5 before the first row, 60 in the log, 10 after its last.
    assert_eq!(sum, Some(Wheels { left: 72.5, right: -10.0 }));
    assert!(intervals.windows(2).all(|pair| pair[0].t_s + pair[0].dt_s == pair[1].t_s));
    assert!(!cursor.intervals(2.0, 5.1, &mut intervals));
}

#[test]
fn twists_and_speeds_are_rebuilt_into_wheels_and_angles_are_taken_as_they_are() {
    let twist = WheelLog::Twist { v_mps: vec![9.0, 1.0, 0.0, 0.0], omega_radps: vec![9.0, 0.0, 0.4, 0.0] };
    // A metre on wheels of 0.1 m and 0.2 m radius, then 0.4 rad over 0.5 m.
    let expected = [(10.0, 5.0), (-1.0, 0.5)];
    let speeds = WheelLog::Speeds(Wheels { left: vec![9.0, 1.0, -0.1, 0.0], right: vec![9.0, 1.0, 0.1, 0.0] });
    for log in [twist, speeds] {
        let found = steps(log, true, 0.0, 2.0).expect("spanned");
        for (found, expected) in found.iter().zip(expected) {
            assert!((found.0 - expected.0).abs() < 1e-14 && (found.1 - expected.1).abs() < 1e-14, "{found:?}");
        }
    }
    let angles = WheelLog::Angles(Wheels { left: vec![1.0, 2.5, 3.0, 3.0], right: vec![0.0; 4] });
    assert_eq!(steps(angles, true, 0.0, 1.0), Some(vec![(1.5, 0.0)]));
}
