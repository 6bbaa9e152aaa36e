//! Where the filter begins with the walls of a run, and with the lidar that sees them: the nominal drive and
//! the readings tell it near enough to linearise there.
//!
//! A wall is the line n·p = o with n = (−sin ψ, cos ψ). A lidar stands at l on the robot with the yaw β. The
//! heading that it measures is u = θ − (ψ − β), and the distance
//! d = o − n·p − (l'ₓ sin u + l'ᵧ cos u), with l' = R(−β) l. Spins tell l' and no β, which is the reason for
//! l' in the place of l: β only says where the drive's centre moves to along the wall's normal.

use dataset::LidarExtrinsics;
use kinematics::{Pose, sin_cos, wrap_to_pi};
use nalgebra::{DMatrix, DVector};

use crate::model::Model;
use crate::partial_observation::{Observation, Place, Quantity};
use crate::segment::Segment;
use crate::settings::PARTIAL;

/// A wall by its direction, less the lidar's yaw where there is one, and its distance from the segment's
/// start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wall {
    pub(crate) direction_rad: f64,
    pub(crate) offset_m: f64,
}

/// A lidar on the robot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Lidar {
    /// Its place seen from the drive's centre along its own axes, metres.
    pub(crate) lever_m: [f64; 2],
    /// Its heading on the robot, radians.
    pub(crate) yaw_rad: f64,
}

/// Walls, and the lidar where the readings are not of the drive's centre.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WallStart {
    pub(crate) walls: Vec<Wall>,
    pub(crate) lidar: Option<Lidar>,
}

/// A distance with what it was seen from.
struct SeenDistance {
    wall: usize,
    pose: Pose,
    /// Heading along the wall, radians.
    heading_rad: f64,
    distance_m: f64,
    variance_m2: f64,
}

impl WallStart {
    /// So many walls by the nominal drive: their directions from a heading where one was measured, else from
    /// the distances alone, by least squares from several directions. The lidar's yaw is near the stated one,
    /// or it is the best of several.
    pub(crate) fn of(
        segment: &Segment<'_>,
        places: &[Place],
        observations: &[Observation],
        walls: usize,
        nominal: &Model,
        lidar: Option<LidarExtrinsics>,
    ) -> Self {
        let mut poses = nominal_poses(segment, places, nominal);
        let start = |poses: &[Pose]| (0..walls).map(|wall| start_wall(wall, poses, observations)).collect::<Vec<_>>();
        let Some(lidar) = lidar else { return Self { walls: start(&poses), lidar: None } };
        turn_to_headings(&mut poses, walls, observations);
        let walls = start(&poses);
        let heading_rad = |place: usize, wall: usize| {
            let is_it = |of: &&Observation| of.to == place && of.quantity == Quantity::WallHeading(wall);
            let at = observations.partition_point(|of| of.to < place);
            observations[at..].iter().take_while(|of| of.to == place).find(is_it).map(|of| of.value)
        };
        let seen = observations.iter().filter_map(|of| {
            let Quantity::WallDistance(wall) = of.quantity else { return None };
            let by_drive = poses[of.to].theta_rad - walls[wall].direction_rad;
            let heading_rad = heading_rad(of.to, wall).unwrap_or(by_drive);
            Some(SeenDistance { wall, pose: poses[of.to], heading_rad, distance_m: of.value, variance_m2: of.variance })
        });
        let seen: Vec<SeenDistance> = seen.collect();
        let yaws_rad = match lidar.yaw_rad {
            Some(yaw_rad) => vec![yaw_rad],
            None => directions_rad().collect(),
        };
        let fits = yaws_rad.into_iter().map(|yaw_rad| fitted_lidar(yaw_rad, &walls, &seen));
        match fits.min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((start, _)) => start,
            None => Self { walls, lidar: Some(Lidar::default()) },
        }
    }
}

/// The directions that are tried.
fn directions_rad() -> impl Iterator<Item = f64> {
    (0..PARTIAL.wall_start_directions)
        .map(|k| std::f64::consts::TAU * f64::from(k) / f64::from(PARTIAL.wall_start_directions))
}

fn nominal_poses(segment: &Segment<'_>, places: &[Place], nominal: &Model) -> Vec<Pose> {
    let (mut pose, mut after) = (Pose::IDENTITY, 0);
    let of_place = |place: &Place| {
        for interval in &segment.intervals[after..place.after] {
            pose = pose * nominal.increment(interval.wheel_rad).arc();
        }
        after = place.after;
        pose
    };
    places.iter().map(of_place).collect()
}

/// Turns the path at every heading along a wall that was seen before, so that a nominal drive which turns too
/// little or too much does not add up.
fn turn_to_headings(poses: &mut [Pose], walls: usize, observations: &[Observation]) {
    let mut directions_rad: Vec<Option<f64>> = vec![None; walls];
    let mut headings = observations.iter().filter(|of| matches!(of.quantity, Quantity::WallHeading(_))).peekable();
    let mut before: Option<(Pose, Pose)> = None;
    for (place, pose) in poses.iter_mut().enumerate() {
        let nominal = *pose;
        if let Some((nominal_before, turned_before)) = before {
            *pose = turned_before * nominal_before.to(nominal);
        }
        while let Some(of) = headings.next_if(|of| of.to == place) {
            let Quantity::WallHeading(wall) = of.quantity else { continue };
            match directions_rad[wall] {
                Some(direction_rad) => pose.theta_rad += wrap_to_pi(direction_rad + of.value - pose.theta_rad),
                None => directions_rad[wall] = Some(pose.theta_rad - of.value),
            }
        }
        before = Some((nominal, *pose));
    }
}

fn start_wall(wall: usize, poses: &[Pose], observations: &[Observation]) -> Wall {
    let distances: Vec<(Pose, f64)> = observations
        .iter()
        .filter(|of| of.quantity == Quantity::WallDistance(wall))
        .map(|of| (poses[of.to], of.value))
        .collect();
    let heading = observations.iter().find(|of| of.quantity == Quantity::WallHeading(wall));
    match heading.map(|of| poses[of.to].theta_rad - of.value) {
        Some(direction_rad) => fitted_offset(direction_rad, &distances).0,
        None => directions_rad()
            .map(|direction_rad| turned_to_fit(direction_rad, &distances))
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map_or(Wall { direction_rad: 0.0, offset_m: 0.0 }, |(wall, _)| wall),
    }
}

/// The wall of a direction that fits distances from it best, and the sum of the squares that are left, m².
fn fitted_offset(direction_rad: f64, distances: &[(Pose, f64)]) -> (Wall, f64) {
    let (sin, cos) = direction_rad.sin_cos();
    let offsets_m = || distances.iter().map(|(pose, distance_m)| distance_m - sin * pose.x_m + cos * pose.y_m);
    let offset_m = offsets_m().sum::<f64>() / distances.len().max(1) as f64;
    (Wall { direction_rad, offset_m }, offsets_m().map(|of| (of - offset_m).powi(2)).sum())
}

/// The same with the direction turned by Newton steps on the variance of the offsets.
fn turned_to_fit(mut direction_rad: f64, distances: &[(Pose, f64)]) -> (Wall, f64) {
    for _ in 0..PARTIAL.wall_start_steps {
        let (wall, _) = fitted_offset(direction_rad, distances);
        let (sin, cos) = direction_rad.sin_cos();
        let slope_m = |pose: &Pose| -cos * pose.x_m - sin * pose.y_m;
        let mean_m = distances.iter().map(|(pose, _)| slope_m(pose)).sum::<f64>() / distances.len().max(1) as f64;
        let (mut gradient, mut curvature) = (0.0, 0.0);
        for (pose, distance_m) in distances {
            let off_m = distance_m - sin * pose.x_m + cos * pose.y_m - wall.offset_m;
            gradient += off_m * (slope_m(pose) - mean_m);
            curvature += (slope_m(pose) - mean_m).powi(2);
        }
        if curvature <= 0.0 {
            break;
        }
        direction_rad -= gradient / curvature;
    }
    fitted_offset(direction_rad, distances)
}

/// The offsets of the walls and the lidar that fit the distances from a yaw on, by Gauss–Newton steps, and
/// the weighted sum of the squares that are left.
fn fitted_lidar(yaw_rad: f64, walls: &[Wall], seen: &[SeenDistance]) -> (WallStart, f64) {
    let lever = walls.len();
    let yaw = lever + 2;
    let mut values = DVector::zeros(yaw + 1);
    values[yaw] = yaw_rad;
    for (wall, of) in walls.iter().enumerate() {
        values[wall] = of.offset_m;
    }
    let mut by = DVector::zeros(yaw + 1);
    let residual_m = |values: &DVector<f64>, of: &SeenDistance, by: &mut DVector<f64>| {
        by.fill(0.0);
        let (sin, cos) = sin_cos(walls[of.wall].direction_rad + values[yaw]);
        let (sin_u, cos_u) = sin_cos(of.heading_rad);
        by[of.wall] = 1.0;
        (by[lever], by[lever + 1]) = (-sin_u, -cos_u);
        by[yaw] = cos * of.pose.x_m + sin * of.pose.y_m;
        let lidar_m = values[lever] * sin_u + values[lever + 1] * cos_u;
        of.distance_m - (values[of.wall] + sin * of.pose.x_m - cos * of.pose.y_m - lidar_m)
    };
    let prior_sigma = |row: usize| match row {
        row if row < lever => PARTIAL.wall_offset_sigma_m,
        row if row < yaw => PARTIAL.lidar_place_sigma_m,
        _ => PARTIAL.wall_direction_sigma_rad,
    };
    for _ in 0..PARTIAL.wall_start_steps {
        // What the readings do not determine hardly moves.
        let mut information =
            DMatrix::from_fn(
                yaw + 1,
                yaw + 1,
                |row, column| {
                    if row == column { prior_sigma(row).powi(-2) } else { 0.0 }
                },
            );
        let mut gradient = DVector::zeros(yaw + 1);
        for of in seen {
            let off_m = residual_m(&values, of, &mut by);
            information.ger(of.variance_m2.recip(), &by, &by, 1.0);
            gradient.axpy(off_m / of.variance_m2, &by, 1.0);
        }
        let Some(root) = information.cholesky() else { break };
        values += root.solve(&gradient);
    }
    let cost = seen.iter().map(|of| residual_m(&values, of, &mut by).powi(2) / of.variance_m2).sum();
    let walls = walls.iter().zip(values.iter()).map(|(wall, offset_m)| Wall { offset_m: *offset_m, ..*wall });
    let lidar = Lidar { lever_m: [values[lever], values[lever + 1]], yaw_rad: values[yaw] };
    (WallStart { walls: walls.collect(), lidar: Some(lidar) }, cost)
}

/// A distance from a wall as a function of a filter's state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WallDistance {
    /// Where the copy of the pose stands in the state, and where the wall.
    pub(crate) pose: usize,
    pub(crate) wall: usize,
    pub(crate) lidar: Option<SeenByLidar>,
}

/// What a lidar adds to it. While little is known of the lidar its state wanders: derivatives are those of
/// where the filter begins (first-estimates Jacobians, Huang, Mourikis & Roumeliotis 2010).
#[derive(Debug, Clone, Copy)]
pub(crate) struct SeenByLidar {
    /// Where the lidar stands in the state.
    pub(crate) at: usize,
    pub(crate) start: Lidar,
    /// The wall's direction less the lidar's yaw, where the filter begins.
    pub(crate) direction_rad: f64,
}

impl WallDistance {
    /// The distance that a state predicts, with its derivatives.
    pub(crate) fn predicted(self, state: &DVector<f64>, by: &mut DVector<f64>) -> f64 {
        let Self { pose, wall, lidar } = self;
        let (x_m, y_m) = (state[pose], state[pose + 1]);
        let start_rad = lidar.map_or(state[wall], |lidar| lidar.direction_rad + lidar.start.yaw_rad);
        let (sin, cos) = sin_cos(start_rad);
        let along_m = cos * x_m + sin * y_m;
        // n = (−sin, cos); offset − n·p.
        (by[pose], by[pose + 1]) = (sin, -cos);
        (by[wall], by[wall + 1]) = (along_m, 1.0);
        let distance_m = state[wall + 1] + sin * x_m - cos * y_m;
        let Some(SeenByLidar { at, start, .. }) = lidar else { return distance_m };
        let turned_rad = state[wall] + state[at + 2] - start_rad;
        let (sin_u, cos_u) = sin_cos(state[pose + 2] - state[wall]);
        let [ahead_m, left_m] = start.lever_m;
        let by_turn = left_m * sin_u - ahead_m * cos_u;
        by[pose + 2] = by_turn;
        by[wall] -= by_turn;
        (by[at], by[at + 1], by[at + 2]) = (-sin_u, -cos_u, along_m);
        distance_m + turned_rad * along_m - state[at] * sin_u - state[at + 1] * cos_u
    }
}
