//! Walls that a lidar sees which stands anywhere on the robot, and readings that are outliers.

use dataset::{Dataset, LidarExtrinsics, Run, TruthSample, WallReading, WheelLog};
use kinematics::Pose;

use super::partial::{
    M_PER_RAD, NO_GYRO, NOISELESS, SEPARATION_M, SIGMA_M, SIGMA_RAD, dataset, equations, errors, fitted, noise,
    nominal, tape, wall,
};
use crate::{Column, PartialOutliers};

/// Where the lidar stands: off the axle, and mounted backwards.
const BODY_FROM_LIDAR: Pose = Pose::new(0.21, -0.12, 2.9);

/// Readings of a wall from the lidar's own place, at every fifth row.
fn seen_by_lidar(run: &mut Run, poses: &[Pose]) {
    let lidar: Vec<Pose> = poses.iter().map(|pose| *pose * BODY_FROM_LIDAR).collect();
    for row in (0..=280).step_by(5) {
        wall(run, &lidar, row, [true, true], 0.5 * (12.9898 * row as f64).sin());
    }
}

pub(super) fn log(lidar: Option<LidarExtrinsics>) -> Dataset {
    let mut dataset = dataset(NO_GYRO, |run, poses| {
        seen_by_lidar(run, poses);
        tape(run, poses, [20, 120], 0.0);
    });
    dataset.truth_noise.lidar = lidar;
    dataset
}

#[test]
fn a_lidar_anywhere_on_the_robot_determines_it_as_a_nuisance() {
    let unknown = log(Some(LidarExtrinsics::default()));
    let near = log(Some(LidarExtrinsics { yaw_rad: Some(2.7) }));
    for dataset in [&unknown, &near] {
        let fit = fitted(dataset);
        assert!(fit.unobservable.is_empty(), "{:?}", fit.unobservable);
        // Readings are off by up to half of 2 mm and 1 mrad.
        assert!(errors(&fit).iter().all(|error| error.abs() < 10.0 * NOISELESS), "{:?}", errors(&fit));
        assert_eq!(fit.partial_outliers(), []);
    }
    // Taken for readings of the drive's centre they give another robot, or are rejected.
    let wrong = log(None);
    let fit = fitted(&wrong);
    let is_off = errors(&fit).iter().any(|error| error.abs() > 30.0 * NOISELESS);
    assert!(is_off || !fit.partial_outliers().is_empty(), "{:?}", errors(&fit));
}

#[test]
fn a_lidar_of_unknown_yaw_measures_no_length_in_a_straight() {
    let straights = |lidar: Option<LidarExtrinsics>| {
        let mut dataset = dataset(NO_GYRO, |run, poses| {
            seen_by_lidar(run, poses);
            let last = poses.iter().position(|pose| pose.theta_rad.abs() > 0.5).unwrap_or(poses.len());
            let end_s = run.odometry.t_s[last - 1];
            run.walls.retain(|of| of.t_s < end_s);
            run.odometry.t_s.truncate(last);
            let WheelLog::Angles(angles) = &mut run.odometry.wheels else { panic!("angles") };
            angles.left.truncate(last);
            angles.right.truncate(last);
        });
        dataset.truth_noise.lidar = lidar;
        dataset
    };
    let counted = |lidar| fitted(&straights(lidar)).records.partial[0].partial_measurements();
    // Heading and distance of each reading where they are of the drive's centre, headings alone otherwise.
    assert_eq!(counted(None), 2 * counted(Some(LidarExtrinsics::default())));
}

#[test]
fn gradients_with_a_lidar_are_those_of_the_cost() {
    let dataset = log(Some(LidarExtrinsics { yaw_rad: Some(2.9) }));
    let (mut model, noise) = (nominal(), noise());
    (model.m_per_rad, model.separation_m) = (M_PER_RAD, SEPARATION_M);
    let found = equations(&dataset, &model, &noise);
    for column in Column::GEOMETRY {
        let step = 1e-6;
        let cost = |by: f64| {
            let mut moved = model.clone();
            moved.advance(column, by);
            equations(&dataset, &moved, &noise).cost()
        };
        let numeric = (cost(step) - cost(-step)) / (2.0 * step);
        let analytic = found.gradient[column.index()];
        // What linearising at the state in force leaves, as without a lidar. Rejects a lever whose derivative
        // by the heading or by the wall's direction has the other sign.
        let scale = found.information[(column.index(), column.index())].sqrt();
        assert!((numeric - analytic).abs() < 0.02 * scale, "{column:?}: {numeric} {analytic} of {scale}");
    }
}

#[test]
fn a_reading_ten_standard_deviations_off_is_rejected_and_moves_nothing() {
    let with = |add: fn(&mut WallReading)| {
        dataset(NO_GYRO, move |run, poses| {
            for row in (0..=280).step_by(10) {
                wall(run, poses, row, [true, true], 0.0);
            }
            tape(run, poses, [20, 120], 0.0);
            if run.info.id == "run-2" {
                add(&mut run.walls[19]);
            }
        })
    };
    let sound = with(|_| {});
    let turned = with(|of| of.heading_rad = of.heading_rad.map(|heading_rad| heading_rad + 10.0 * SIGMA_RAD));
    let far = with(|of| of.distance_m = of.distance_m.map(|distance_m| distance_m - 10.0 * SIGMA_M));
    let sound_errors = errors(&fitted(&sound));
    for (dataset, kind) in [(turned, "headings along walls"), (far, "distances from walls")] {
        let fit = fitted(&dataset);
        // 29 readings of two scalars each, and a tape.
        let expected = PartialOutliers { run: (0, 2), rejected: vec![(kind, 1)], of: 59 };
        assert_eq!(fit.partial_outliers(), [expected]);
        let moved = errors(&fit).iter().zip(sound_errors).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // The noise of the fits differs by what their last steps leave.
        assert!(moved < NOISELESS, "{moved}");
        let ungated = fit.refit_ungated().expect("a fit");
        assert_eq!(ungated.partial_outliers(), []);
    }
}

#[test]
fn tapes_that_all_contradict_poses_are_no_outliers() {
    // Tapes that say 2 % more, twenty of their standard deviations or more, beside exact poses.
    let beside_poses = |is_long: fn(&Run) -> bool| {
        dataset(NO_GYRO, move |run, poses| {
            let measured =
                |(row, at): (usize, &Pose)| TruthSample::new(run.odometry.t_s[row], at.x_m, at.y_m, Some(at.theta_rad));
            run.truth = poses.iter().enumerate().step_by(10).map(measured).collect();
            tape(run, poses, [20, 120], 0.0);
            if is_long(run) {
                run.distances.iter_mut().for_each(|of| of.distance_m *= 1.02);
            }
        })
    };
    let rejected = |is_long| fitted(&beside_poses(is_long)).partial_outliers().len();
    // Rejects a gate that takes all of them out: what contradicts the poses would be in no fit.
    assert_eq!((rejected(|_| true), rejected(|run| run.info.id == "run-2")), (0, 1));
}

#[test]
fn a_robot_that_is_displaced_goes_on_from_its_new_place() {
    let moved_by_hand = dataset(NO_GYRO, |run, poses| {
        // A turn by hand of 0.3 rad in the middle of a straight: two readings in a row are off.
        let turned: Vec<Pose> = poses.iter().map(|pose| Pose::new(pose.x_m, pose.y_m, pose.theta_rad + 0.3)).collect();
        for row in (0..=280).step_by(10) {
            wall(run, if row < 80 { poses } else { &turned }, row, [false, true], 0.0);
        }
        tape(run, poses, [20, 70], 0.0);
    });
    let fit = fitted(&moved_by_hand);
    let rejected: Vec<_> = fit.partial_outliers().into_iter().map(|of| of.rejected).collect();
    // The first reading behind the turn; the second starts anew.
    assert_eq!(rejected, vec![vec![("headings along walls", 1)]; 4]);
    assert!(errors(&fit).iter().all(|error| error.abs() < 10.0 * NOISELESS), "{:?}", errors(&fit));
}
