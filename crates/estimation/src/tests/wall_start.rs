//! Where the filter begins with walls and a lidar: where they are, for a robot that is as its dataset says,
//! by readings without errors.

use dataset::{Dataset, LidarExtrinsics};
use kinematics::{Pose, wrap_to_pi};
use nalgebra::DVector;

use super::partial::{M_PER_RAD, NO_GYRO, SEPARATION_M, dataset, wall};
use crate::Records;
use crate::wall_start::{Lidar, SeenByLidar, WallDistance, WallStart};

const BODY_FROM_LIDAR: Pose = Pose::new(0.21, -0.12, 2.9);

/// The wall of [`wall`].
const DIRECTION_RAD: f64 = 0.1;
const OFFSET_M: f64 = 2.0;

/// What Newton steps leave of a metre or a radian once they have converged: the last of them is the square of
/// the one before. A sum or a derivative with a wrong sign ends millimetres or more away.
const CONVERGED: f64 = 1e-6;

/// A log of a robot that its dataset knows, with readings from its centre or from a lidar.
fn log(parts: [bool; 2], lidar: Option<LidarExtrinsics>) -> Dataset {
    let mut dataset = dataset(NO_GYRO, |run, poses| {
        let body_from_seen = if lidar.is_some() { BODY_FROM_LIDAR } else { Pose::IDENTITY };
        let seen_from: Vec<Pose> = poses.iter().map(|pose| *pose * body_from_seen).collect();
        for row in (0..=280).step_by(5) {
            wall(run, &seen_from, row, parts, 0.0);
        }
    });
    dataset.robot.left_wheel_diameter_m = 2.0 * M_PER_RAD.left;
    dataset.robot.right_wheel_diameter_m = 2.0 * M_PER_RAD.right;
    dataset.robot.wheel_separation_m = SEPARATION_M;
    dataset.truth_noise.lidar = lidar;
    dataset
}

fn starts(dataset: &Dataset) -> Vec<WallStart> {
    let records = Records::of(&[dataset.session()]);
    records.partial.iter().map(|of| of.walls.clone()).collect()
}

#[test]
fn walls_seen_from_the_drives_centre_begin_where_they_are() {
    for parts in [[true, true], [true, false]] {
        for WallStart { walls, lidar } in starts(&log(parts, None)) {
            let [wall] = walls[..] else { panic!("{walls:?}") };
            let off_rad = wrap_to_pi(wall.direction_rad - DIRECTION_RAD);
            assert!(off_rad.abs() < CONVERGED && (wall.offset_m - OFFSET_M).abs() < CONVERGED, "{parts:?} {wall:?}");
            assert_eq!(lidar, None);
        }
    }
    // Headings alone say nothing of the offset.
    for WallStart { walls, .. } in starts(&log([false, true], None)) {
        assert!((walls[0].direction_rad - DIRECTION_RAD).abs() < CONVERGED, "{walls:?}");
        assert_eq!(walls[0].offset_m, 0.0);
    }
}

#[test]
fn a_lidar_begins_where_it_is_whether_its_yaw_is_stated_or_not() {
    let Pose { x_m, y_m, theta_rad: yaw_rad } = BODY_FROM_LIDAR;
    let (sin, cos) = yaw_rad.sin_cos();
    // R(−β) l.
    let lever_m = [cos * x_m + sin * y_m, cos * y_m - sin * x_m];
    for stated in [None, Some(2.7)] {
        for start in starts(&log([true, true], Some(LidarExtrinsics { yaw_rad: stated }))) {
            let (wall, lidar) = (start.walls[0], start.lidar.expect("a lidar"));
            let off = [
                wrap_to_pi(wall.direction_rad - (DIRECTION_RAD - yaw_rad)),
                wall.offset_m - OFFSET_M,
                lidar.lever_m[0] - lever_m[0],
                lidar.lever_m[1] - lever_m[1],
                wrap_to_pi(lidar.yaw_rad - yaw_rad),
            ];
            assert!(off.iter().all(|off| off.abs() < CONVERGED), "{stated:?}: {off:?}");
        }
    }
}

/// Where the filter begins, derivatives are those of the distance: by the pose, the wall and the lidar.
#[test]
fn derivatives_of_a_distance_are_its_central_differences_where_the_filter_begins() {
    // A pose, a wall and a lidar in the state, behind something else.
    let (pose, wall, at) = (1, 4, 6);
    let start = Lidar { lever_m: [0.3, -0.2], yaw_rad: 0.7 };
    let direction_rad = -0.4;
    let with_lidar = DVector::from_row_slice(&[5.0, 1.2, -0.8, 0.9, direction_rad, 2.0, 0.3, -0.2, start.yaw_rad]);
    let without = DVector::from_row_slice(&[5.0, 1.2, -0.8, 0.9, direction_rad, 2.0]);
    let seen = SeenByLidar { at, start, direction_rad };
    for (lidar, state) in [(Some(seen), with_lidar), (None, without)] {
        let distance = WallDistance { pose, wall, lidar };
        let mut by = DVector::zeros(state.len());
        distance.predicted(&state, &mut by);
        for index in 0..state.len() {
            let step = 1e-6;
            let moved = |by: f64| {
                let mut state = state.clone();
                state[index] += by;
                // The distance on paper: o − n·p − (l'ₓ sin u + l'ᵧ cos u) with u = θ − (ψ − β).
                let yaw_rad = if lidar.is_some() { state[at + 2] } else { 0.0 };
                let (sin, cos) = (state[wall] + yaw_rad).sin_cos();
                let (sin_u, cos_u) = (state[pose + 2] - state[wall]).sin_cos();
                let lever_m = if lidar.is_some() { [state[at], state[at + 1]] } else { [0.0, 0.0] };
                state[wall + 1] + sin * state[pose] - cos * state[pose + 1] - lever_m[0] * sin_u - lever_m[1] * cos_u
            };
            let numeric = (moved(step) - moved(-step)) / (2.0 * step);
            // Roundings of 1e-16 over a step of 1e-6.
            assert!((by[index] - numeric).abs() < 1e-8, "{index}: {} {numeric}", by[index]);
        }
        let mut unused = DVector::zeros(state.len());
        let plain = distance.predicted(&state, &mut unused);
        let (sin, cos) = (direction_rad + if lidar.is_some() { start.yaw_rad } else { 0.0 }).sin_cos();
        let (sin_u, cos_u) = (0.9_f64 - direction_rad).sin_cos();
        let lever_m = if lidar.is_some() { start.lever_m } else { [0.0; 2] };
        let expected = 2.0 + sin * 1.2 + cos * 0.8 - lever_m[0] * sin_u - lever_m[1] * cos_u;
        assert!((plain - expected).abs() < 1e-12, "{plain} {expected}");
    }
}
