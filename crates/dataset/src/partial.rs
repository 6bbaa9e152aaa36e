//! Partial measurements: what a tape measure, a wall or a place that is come back to says of two instants or
//! of one, without a pose; and what is known of a gyroscope.

/// The robot stood at `t1_s` so, seen from where it stood at `t0_s` (`revisit.csv`). A part that was not
/// measured is `None`; of a turn the whole turns count for nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Revisit {
    /// Start, seconds from the run's start.
    pub t0_s: f64,
    /// End, seconds from the run's start.
    pub t1_s: f64,
    /// Ahead of the robot as it stood at `t0_s`, metres.
    pub dx_m: Option<f64>,
    /// To its left, metres.
    pub dy_m: Option<f64>,
    /// Turn, radians.
    pub dtheta_rad: Option<f64>,
    /// Standard deviation of each of the two coordinates, metres.
    pub sigma_xy_m: Option<f64>,
    /// Standard deviation of the turn, radians.
    pub sigma_theta_rad: Option<f64>,
}

/// The straight distance between the robot's places at two instants (`distance.csv`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TapeDistance {
    /// Start, seconds from the run's start.
    pub t0_s: f64,
    /// End, seconds from the run's start.
    pub t1_s: f64,
    /// Distance, metres.
    pub distance_m: f64,
    /// Its standard deviation, metres.
    pub sigma_m: f64,
}

/// Distance and heading of the robot along a straight wall (`wall.csv`). The heading is zero where the robot
/// drives along the wall with the wall on its left; the distance is that of the drive's centre.
#[derive(Debug, Clone, PartialEq)]
pub struct WallReading {
    /// Seconds from the run's start.
    pub t_s: f64,
    /// Which wall: its place and direction are found for each run.
    pub wall: String,
    /// Distance from the wall, metres.
    pub distance_m: Option<f64>,
    /// Heading along the wall, radians, counter-clockwise.
    pub heading_rad: Option<f64>,
    /// Standard deviation of the distance, metres.
    pub sigma_m: Option<f64>,
    /// Standard deviation of the heading, radians.
    pub sigma_rad: Option<f64>,
}

/// The robot's heading in the room without a position (`truth.csv` with empty `x_m,y_m`): a compass, or the
/// sun. The direction that it counts from may be any; it is found for each run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadingReading {
    /// Seconds from the run's start.
    pub t_s: f64,
    /// Heading, radians, counter-clockwise, wrapped or not.
    pub theta_rad: f64,
    /// Its standard deviation, radians.
    pub sigma_rad: f64,
}

/// A gyroscope's yaw rate at an instant of its own (`gyro.csv`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GyroSample {
    /// Seconds from the run's start, by the robot's clock.
    pub t_s: f64,
    /// Yaw rate, rad/s.
    pub omega_radps: f64,
}

/// What is known of the gyroscope whose yaw rate stands in `odometry.csv`: `[gyro]` of `dataset.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GyroNoise {
    /// Standard deviation of its relative scale; `None`: its scale is not known.
    pub scale_sigma: Option<f64>,
    /// Angle random walk, rad/√s; `None` is unknown, and then taken from the log.
    pub noise_rad_per_sqrt_s: Option<f64>,
    /// Random walk of its bias, rad/s per √s; `None` is unknown.
    pub bias_walk_radps_per_sqrt_s: Option<f64>,
    /// A row has the rate at its instant instead of the mean over the interval that ends there.
    pub is_instantaneous: bool,
}

/// The sensor that readings of walls are of, where it does not stand in the drive's centre: `[lidar]` of
/// `dataset.toml`. Its place on the robot is found for each run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LidarExtrinsics {
    /// Its heading on the robot, radians, near which the fit starts; `None` is unknown.
    pub yaw_rad: Option<f64>,
}
