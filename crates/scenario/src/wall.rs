//! A lidar in front of a straight wall as an instrument: its errors, its place on the robot, and the wall's
//! in the room.

use kinematics::Pose;
use serde::{Deserialize, Serialize};

/// A lidar that sees one straight wall: its distance from it and its heading along it, at a fixed rate.
///
/// With the lidar's pose (x, y, θ) in the room, the wall's direction φ and its distance w from the room's
/// origin, the distance is w + x sin φ − y cos φ and the heading θ − φ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Readings per second.
    pub rate_hz: f64,
    /// Standard deviation of a distance, metres; 0 = not measured.
    pub sigma_m: f64,
    /// Standard deviation of a heading, radians; 0 = not measured.
    pub sigma_rad: f64,
    /// Distance beyond which the lidar does not see the wall, metres.
    pub range_m: f64,
    /// Distance of the wall from the room's origin, about which runs start, metres.
    pub wall_distance_m: f64,
    /// Direction of the wall in the room, radians: a robot that drives so has the wall on its left.
    pub wall_direction_rad: f64,
    /// Where the lidar is on the robot, ahead of the axle, metres.
    pub lever_x_m: f64,
    /// Where the lidar is on the robot, to the left of the centre, metres.
    pub lever_y_m: f64,
    /// How the lidar's frame is turned on the robot, radians.
    pub lever_theta_rad: f64,
    /// How long the robot stands before and after each run, seconds.
    pub still_s: f64,
}

impl Wall {
    /// Where the lidar is on the robot: ahead, to the left, metres, and turned, radians.
    #[must_use]
    pub const fn lever(&self) -> [f64; 3] {
        [self.lever_x_m, self.lever_y_m, self.lever_theta_rad]
    }

    /// Is the lidar anywhere else than in the drive's centre, looking ahead?
    #[must_use]
    pub fn has_lever(&self) -> bool {
        self.lever().iter().any(|part| *part != 0.0)
    }

    /// Distance of the wall to the left of a lidar's pose in the room, metres; below 0 where it is behind.
    #[must_use]
    pub fn distance_m(&self, lidar: Pose) -> f64 {
        let (sin, cos) = self.wall_direction_rad.sin_cos();
        self.wall_distance_m + sin * lidar.x_m - cos * lidar.y_m
    }

    /// Does the lidar see the wall at a distance, metres?
    #[must_use]
    pub fn is_seen(&self, distance_m: f64) -> bool {
        distance_m > 0.0 && distance_m <= self.range_m
    }

    /// Keys whose values must be finite, and their values.
    pub(crate) const fn finite(&self) -> [(&'static str, f64); 4] {
        [
            ("instrument.wall_direction_rad", self.wall_direction_rad),
            ("instrument.lever_x_m", self.lever_x_m),
            ("instrument.lever_y_m", self.lever_y_m),
            ("instrument.lever_theta_rad", self.lever_theta_rad),
        ]
    }
}
