//! What sessions hold for the likelihood: distances, places of runs and extents, as they are on paper.

use dataset::{Displacement, MapDistortion, TruthSigma};

use super::*;
use crate::segment::Start;

/// Radians that the wheels of a run roll, whichever way, at 80 mm for each: 23 and 24.5.
fn distance_m() -> f64 {
    let rolled = |rad: &[f64]| rad.iter().map(|rad| rad.abs()).sum::<f64>();
    0.5 * 0.08 * (rolled(&LEFT_RAD) + rolled(&RIGHT_RAD))
}

#[test]
fn a_runs_distance_goes_on_from_the_one_before_in_its_session() {
    let mut first = dataset_of(3, true);
    let second = dataset_of(2, true);
    let of = |first: &Dataset| -> Vec<(f64, (usize, usize))> {
        let records = Records::of(&[first.session(), second.session()]);
        records.segments.iter().map(|segment| (segment.session_m, segment.run)).collect()
    };
    let one = distance_m();
    let runs = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1)];
    let close = |found: &[(f64, (usize, usize))], on_paper: [f64; 5]| {
        // Roundings of dozens of turns.
        let near = found.iter().zip(on_paper).all(|((found, _), on_paper)| (found - on_paper).abs() < 1e-12);
        near && found.iter().map(|(_, run)| *run).eq(runs)
    };
    let found = of(&first);
    assert!(close(&found, [0.0, one, 2.0 * one, 0.0, one]), "{found:?}");
    // A run that states it says so to those after it. Rejects a statement that is of its own run alone.
    first.runs[1].session_m = Some(100.0);
    let found = of(&first);
    assert!(close(&found, [0.0, 100.0, 100.0 + one, 0.0, one]), "{found:?}");
}

#[test]
fn runs_that_say_nothing_are_unused() {
    let mut dataset = dataset_of(4, true);
    dataset.runs[1].truth.truncate(1);
    dataset.runs[2].truth.clear();
    dataset.runs[3].truth.truncate(2);
    let records = Records::of(&[dataset.session(), dataset.session()]);
    assert_eq!(records.unused, [(0, 1), (0, 2), (1, 1), (1, 2)]);
    assert_eq!(records.ids, [["run-0", "run-1", "run-2", "run-3"]; 2]);
    assert_eq!((records.measurements(), records.segments.len()), (2 * (7 + 2), 4));
    // Every two seconds; the second segment has two.
    let at = [(0, 3), (1, 1), (1, 2), (4, 0)].map(|(segment, at)| records.measurement_s(segment, at));
    assert_eq!(at, [Some(6.0), Some(2.0), None, None]);
    // A gyroscope is a measurement; poses beside it are counted once.
    let with_gyro = partial::dataset(partial::GYRO, |_, _| {});
    let records = Records::of(&[with_gyro.session()]);
    assert!(records.unused.is_empty() && records.is_partial() && records.has_partial() && records.has_gyro());
    let without = partial::dataset(partial::NO_GYRO, |_, _| {});
    let records = Records::of(&[without.session()]);
    assert_eq!(records.unused, [(0, 0), (0, 1), (0, 2), (0, 3)]);
    assert!(!records.is_partial() && !records.has_partial() && !records.has_gyro() && !records.is_gyro_scale_stated());
    assert_eq!(records.measurements(), 0);
    // Tape and the distance from a wall are distances; the heading along a wall is none.
    let measured = |add: &dyn Fn(&mut Run, &[Pose])| {
        let dataset = partial::dataset(partial::NO_GYRO, add);
        Records::of(&[dataset.session()]).has_distances()
    };
    assert!(measured(&|run, poses| partial::tape(run, poses, [0, 3], 0.0)));
    assert!(measured(&|run, poses| partial::wall(run, poses, 3, [true, false], 0.0)));
    assert!(!measured(&|run, poses| partial::wall(run, poses, 3, [false, true], 0.0)));
}

#[test]
fn what_one_session_states_of_map_and_gyroscope_holds_for_all() {
    let (plain, mut stated) = (dataset_of(1, true), dataset_of(1, true));
    let map = MapDistortion { sigma_xy_m: 0.02, sigma_theta_rad: 0.01, length_m: 2.0 };
    stated.truth_noise.map = Some(map);
    stated.truth_noise.gyro.scale_sigma = Some(0.004);
    let records = Records::of(&[plain.session(), stated.session()]);
    assert_eq!((records.map, records.gyro_scale_sigma), (Some(map), Some(0.004)));
    assert!(records.is_gyro_scale_stated() && records.gyro_scale_prior_sigma() == 0.004);
}

#[test]
fn a_scale_is_common_where_every_session_says_so_and_every_row_states_its_precision() {
    let stated = TruthSigma { sigma_xy_m: Some(0.01), sigma_theta_rad: Some(0.02), covariance: None };
    let of = |row: TruthSigma, scale| {
        let mut dataset = dataset_of(2, true);
        dataset.truth_noise.covariance_scale = scale;
        // What a run does not measure it need not state.
        dataset.runs[1].truth.clear();
        let run = &mut dataset.runs[0];
        run.truth_sigma = Some(vec![stated; run.truth.len()]);
        run.truth_sigma.as_mut().expect("stated")[3] = row;
        dataset
    };
    let [common, separate] = [dataset::CovarianceScale::Common, dataset::CovarianceScale::Separate];
    let is_common = |datasets: &[&Dataset]| {
        Records::of(&datasets.iter().map(|dataset| dataset.session()).collect::<Vec<_>>()).common_scale
    };
    let whole = of(stated, common);
    assert!(is_common(&[&whole]) && is_common(&[&whole, &whole]));
    assert!(!is_common(&[&whole, &of(stated, separate)]));
    assert!(!is_common(&[&of(TruthSigma { sigma_xy_m: None, ..stated }, common)]));
    assert!(!is_common(&[&of(TruthSigma { sigma_theta_rad: None, ..stated }, common)]));
    let covariance = dataset::PoseCovariance::stated([1e-4, 0.0, 0.0, 1e-4, 0.0, 4e-4]).expect("possible");
    assert!(is_common(&[&of(TruthSigma { covariance, ..TruthSigma::UNKNOWN }, common)]));
    let mut without = whole.clone();
    without.runs[0].truth_sigma = None;
    assert!(!is_common(&[&without]));
}

#[test]
fn rows_count_by_the_square_of_their_precision_over_the_reference() {
    let mut dataset = dataset_of(1, true);
    let (truth_noise, run) = (&mut dataset.truth_noise, &mut dataset.runs[0]);
    (truth_noise.sigma_xy_m, truth_noise.sigma_theta_rad) = (Some(0.01), Some(0.02));
    let stated = |xy_m, theta_rad| TruthSigma { sigma_xy_m: xy_m, sigma_theta_rad: theta_rad, ..TruthSigma::UNKNOWN };
    let mut rows = vec![TruthSigma::UNKNOWN; run.truth.len()];
    (rows[1], rows[2], rows[3]) =
        (stated(Some(0.03), Some(0.01)), stated(Some(0.005), None), stated(Some(0.0), Some(0.0)));
    run.truth_sigma = Some(rows);
    let records = Records::of(&[dataset.session()]);
    let found: Vec<[f64; 2]> = records.segments[0].measurements.iter().map(|of| of.variance_factor).collect();
    let on_paper = [[1.0, 1.0], [9.0, 0.25], [0.25, 1.0], [1.0, 1.0], [1.0, 1.0]];
    let close = |[a, b]: [f64; 2], [c, d]: [f64; 2]| (a - c).abs() < 1e-12 && (b - d).abs() < 1e-12;
    assert!(found.iter().zip(on_paper).all(|(found, on_paper)| close(*found, on_paper)), "{found:?}");
    assert!(records.segments[0].measurements.iter().all(|of| of.shape.is_none()));
}

/// Straights of 1 m, a turn on the spot by a quarter, and 2 m: by a sensor that looks to the left by 0.3 rad.
#[test]
fn a_sensors_heading_is_that_between_measured_and_dead_reckoned_motions() {
    let model = Model { m_per_rad: Wheels::both(0.1), separation_m: 0.4, ..CENTRED_MODEL };
    let spin_rad = 0.5 * std::f64::consts::PI * 0.4 / 0.2;
    let log = |sensor_rad: f64, with_headings: bool| {
        let mut dataset = dataset_of(1, true);
        let (left, right) =
            (vec![0.0, 10.0, 10.0 - spin_rad, 30.0 - spin_rad], vec![0.0, 10.0, 10.0 + spin_rad, 30.0 + spin_rad]);
        let run = &mut dataset.runs[0];
        run.odometry.t_s = vec![0.0, 1.0, 2.0, 3.0].into();
        run.odometry.wheels = WheelLog::Angles(Wheels { left, right });
        let quarter = 0.5 * std::f64::consts::PI;
        let poses = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, quarter), (1.0, 2.0, quarter)];
        let of = |(second, (x_m, y_m, theta_rad)): (usize, (f64, f64, f64))| {
            TruthSample::new(second as f64, x_m, y_m, with_headings.then_some(theta_rad + sensor_rad))
        };
        run.truth = poses.into_iter().enumerate().map(of).collect();
        dataset
    };
    for sensor_rad in [0.0, 0.3, -2.5] {
        let dataset = log(sensor_rad, true);
        let found = Records::of(&[dataset.session()]).sensor_heading_rad(&model);
        assert!((found - sensor_rad).abs() < 1e-12, "{found} {sensor_rad}");
    }
    // Backwards, and across: a product that is 0 is a direction too.
    for (end, on_paper) in [([-1.0, 0.0], std::f64::consts::PI), ([0.0, 1.0], 0.5 * std::f64::consts::PI)] {
        let mut dataset = log(0.0, true);
        dataset.runs[0].truth.truncate(2);
        dataset.runs[0].truth[1] = TruthSample::new(1.0, end[0], end[1], Some(0.0));
        let found = Records::of(&[dataset.session()]).sensor_heading_rad(&model);
        assert!((found.abs() - on_paper).abs() < 1e-12, "{found} {on_paper}");
    }
    let without = log(0.3, false);
    assert_eq!(Records::of(&[without.session()]).sensor_heading_rad(&model), 0.0);
    // The farthest from the first pose is √5 m away.
    let dataset = log(0.3, true);
    let extent_m = Records::of(&[dataset.session()]).extent_m();
    assert!((extent_m - 5.0_f64.sqrt()).abs() < 1e-12, "{extent_m}");
    // Mean squares over segments, whose starts are not the room's origin.
    let mut two = log(0.3, true);
    two.runs.push(two.runs[0].clone());
    two.runs[1].truth.truncate(3);
    for sample in &mut two.runs[1].truth {
        sample.x_m += 7.0;
        sample.y_m -= 5.0;
    }
    let extent_m = Records::of(&[two.session()]).extent_m();
    assert!((extent_m - 3.0_f64.sqrt()).abs() < 1e-12, "{extent_m}");
}

/// A straight of 1 m that is measured where it leads, and an arc that is measured to lead 0.5 rad to the
/// right of where it does.
#[test]
fn arcs_count_for_a_sensors_heading_by_their_chords_and_loops_do_not() {
    let model = Model { m_per_rad: Wheels::both(0.1), separation_m: 0.4, ..CENTRED_MODEL };
    let found = |turn_rad: f64, length_m: f64| {
        let mut dataset = dataset_of(1, true);
        let run = &mut dataset.runs[0];
        run.odometry.t_s = vec![0.0, 1.0, 2.0].into();
        let (left, right) = (length_m - 0.2 * turn_rad, length_m + 0.2 * turn_rad);
        let angles = Wheels { left: vec![0.0, 10.0, 10.0 + 10.0 * left], right: vec![0.0, 10.0, 10.0 + 10.0 * right] };
        run.odometry.wheels = WheelLog::Angles(angles);
        let chord_m = length_m * (0.5 * turn_rad).sin() / (0.5 * turn_rad);
        let (sin, cos) = (0.5 * turn_rad - 0.5).sin_cos();
        run.truth = vec![
            TruthSample::new(0.0, 0.0, 0.0, Some(0.0)),
            TruthSample::new(1.0, 1.0, 0.0, Some(0.0)),
            TruthSample::new(2.0, 1.0 + chord_m * cos, chord_m * sin, Some(turn_rad)),
        ];
        (Records::of(&[dataset.session()]).sensor_heading_rad(&model), chord_m)
    };
    // Of 4 rad the chord is 0.45 of the arc, of 5 rad 0.24: 0.3 is the least. Chords count by their squares.
    let (heading_rad, chord_m) = found(4.0, 2.0);
    let weight = chord_m * chord_m;
    let on_paper = (weight * 0.5_f64.sin()).atan2(1.0 + weight * 0.5_f64.cos());
    assert!((heading_rad - on_paper).abs() < 1e-12, "{heading_rad} {on_paper}");
    assert!(found(5.0, 2.0).0.abs() < 1e-12, "{}", found(5.0, 2.0).0);
}

#[test]
fn displacements_begin_at_the_angles_of_their_wheels() {
    let mut dataset = selection::displacement_dataset(&[4], 0.0, 1);
    let WheelLog::Angles(angles) = &mut dataset.runs[0].odometry.wheels else { unreachable!("the helper logs angles") };
    angles.left.iter_mut().for_each(|rad| *rad += 5.0);
    angles.right.iter_mut().for_each(|rad| *rad -= 3.0);
    let records = Records::of(&[dataset.session()]);
    let turned = |of: &[f64], segment: usize| of[..segment].iter().sum::<f64>();
    for (number, segment) in records.segments.iter().enumerate() {
        let on_paper = Wheels { left: 5.0 + turned(&LEFT_RAD, number), right: -3.0 + turned(&RIGHT_RAD, number) };
        assert_eq!(segment.wheel_rad, on_paper, "{number}");
        assert_eq!((segment.intervals.len(), segment.measurements[0].after), (1, 1));
        assert_eq!(segment.intervals[0].wheel_rad, Wheels { left: LEFT_RAD[number], right: RIGHT_RAD[number] });
    }
}

#[test]
fn displacements_that_end_where_the_next_begins_are_continued() {
    let mut dataset = selection::displacement_dataset(&[4, 2], 0.0, 1);
    // The third begins a little later, and its rounding is none.
    let run = &mut dataset.runs[0];
    (run.displacements[2].t0_s, run.displacements[3].t0_s) = (2.25, 3.0 + 1e-10);
    let records = Records::of(&[dataset.session()]);
    let continues: Vec<bool> = (0..7).map(|segment| records.continues(segment)).collect();
    assert_eq!(continues, [false, true, false, true, false, true, false]);
    assert!(records.segments.iter().all(|segment| segment.start == Start::Origin));
    assert!(records.go_by_row_lengths());
    assert!(!Records::of(&[dataset_of(1, true).session()]).go_by_row_lengths());
    // In a series all lags count, by 0.7 for each further one; across runs none.
    let weights = [(0, 1, 1), (0, 2, 2), (0, 3, 3), (3, 4, 1), (1, 1, 1), (1, 1, 2)];
    let found = weights.map(|(segment, next, lag)| records.weight_of_pair(segment, next, lag));
    let on_paper = [1.0, 0.7, 0.49, 0.0, 1.0, 0.0];
    assert!(found.iter().zip(on_paper).all(|(found, on_paper)| (found - on_paper).abs() < 1e-12), "{found:?}");
    let of = &dataset.runs[0].displacements[0];
    let Displacement { dx_m, dy_m, dtheta_rad, .. } = of;
    let measured = &records.segments[0].measurements[0];
    assert_eq!((measured.x_m, measured.y_m, measured.theta_rad), (*dx_m, *dy_m, Some(*dtheta_rad)));
}

#[test]
fn the_distance_between_measurements_is_the_mean_of_both_wheels() {
    let dataset = dataset_of(2, true);
    let records = Records::of(&[dataset.session()]);
    let model = Model { m_per_rad: Wheels::both(0.08), ..MODEL };
    // Six motions of each run, of seven measurements.
    let found = records.distance_between_measurements_m(&model);
    let motions = records.measurements() as f64;
    assert!((found / (2.0 * distance_m() / motions) - 1.0).abs() < 1e-12, "{found} {motions}");
}

#[test]
fn a_wheel_changes_its_speed_before_the_measurement_that_sees_it() {
    // Rows every second, measurements every two: the left wheel is twice as fast from 9 s on.
    let mut dataset = dataset_of(1, true);
    let angle = |rate: f64| (0..=12).map(|k| f64::from(k) + rate * f64::from((k - 9).max(0))).collect::<Vec<f64>>();
    dataset.runs[0].odometry.wheels = WheelLog::Angles(Wheels { left: angle(1.0), right: angle(0.0) });
    let changes = |dataset: &Dataset| Records::of(&[dataset.session()]).segments[0].changes_of_speed();
    let only_the_fifth = [false, false, false, false, true, false];
    let found = changes(&dataset);
    assert_eq!(found[found.len() - 6..], only_the_fifth, "{found:?}");
    // A change by less than a fifth of the fastest speed is none.
    dataset.runs[0].odometry.wheels = WheelLog::Angles(Wheels { left: angle(0.2), right: angle(0.0) });
    assert!(changes(&dataset).iter().all(|change| !change));
}
