//! The instruments: the paper's floor grid, motion capture, poses in a map, a tachometer beside each wheel, a
//! gyroscope, a tape measure, a lidar in front of a wall, and marks of where a run began.

use dataset::{
    ExtraChannel, MarkedPoint, PointReading, Revisit, Run, TapeDistance, TruthSample, TruthSigma, WallReading,
    WheelSpeed,
};
use effects::{Address, Stream, StreamName};
use kinematics::{Branching, Elementary, Frame, Point, Pose, Wheels, wrap_to_pi};
use scenario::{Instrument, Slam, Wall};

use crate::slam::SlamErrors;

/// Standstills closer than this are one, seconds.
const SAME_INSTANT_S: f64 = 1e-9;

const READING: StreamName = StreamName::new("instrument reading");

/// An instrument of the scenario, at work in one run after the other.
#[derive(Debug)]
pub(crate) struct Observer {
    instrument: Instrument,
    /// Where it stands in the scenario's list.
    position: u64,
    name: StreamName,
    stream: Stream,
    samples: u32,
    /// What each wheel's contact had gone at the last measurement, metres.
    ground_m: Wheels<f64>,
    /// Where the robot stood at the run's start and last, and when, seconds.
    stood: Option<[(f64, Pose); 2]>,
    /// The gyroscope's last row: its instant, seconds, the true heading, radians, and the bias, rad/s.
    gyro_row: Option<(f64, f64, f64)>,
    /// The errors of poses in a map.
    slam: Option<SlamErrors>,
}

/// A tape is laid between places that are farther apart than this, metres; a robot is back where it is
/// nearer.
pub const TAPE_FROM_M: f64 = 0.3;

/// Least turn of a run whose return is measured, radians.
pub const MIN_RETURN_TURN_RAD: f64 = 1.0;

impl Observer {
    /// The instrument at a position in the scenario's list, in the run of an address.
    pub(crate) fn new(instrument: Instrument, position: u64, address: &Address) -> Self {
        let name = READING.nth(position);
        Self {
            instrument,
            position,
            name,
            stream: address.stream(name),
            samples: 0,
            ground_m: Wheels::both(0.0),
            stood: None,
            gyro_row: None,
            slam: match instrument {
                Instrument::Slam(slam) => Some(SlamErrors::new(slam, position)),
                _ => None,
            },
        }
    }

    pub(crate) const fn instrument(&self) -> &Instrument {
        &self.instrument
    }

    /// The name of its stream.
    pub(crate) const fn name(&self) -> StreamName {
        self.name
    }

    /// The floor grid that it reads marks on, where it is one.
    pub(crate) const fn floor_grid(&self) -> Option<FloorGrid> {
        match self.instrument {
            Instrument::FloorGrid { resolution_m, reading_sigma_m } => {
                Some(FloorGrid { resolution_m, reading_sigma_m })
            }
            _ => None,
        }
    }

    /// Another run begins, the first of a session or a later one; its draws come from `stream`.
    #[inline]
    pub(crate) fn restart(&mut self, stream: impl Fn(StreamName) -> Stream, is_first: bool) {
        self.stream = stream(self.name);
        self.samples = 0;
        self.ground_m = Wheels::both(0.0);
        (self.stood, self.gyro_row) = (None, None);
        if let Some(slam) = &mut self.slam {
            slam.restart(stream, is_first);
        }
    }

    /// When the instrument next measures by itself, seconds; the floor grid never does.
    pub(crate) fn next_measurement_s(&self) -> f64 {
        match self.instrument {
            Instrument::FloorGrid { .. }
            | Instrument::Gyro { .. }
            | Instrument::Tape { .. }
            | Instrument::Revisit { .. } => f64::INFINITY,
            Instrument::MotionCapture { rate_hz, .. }
            | Instrument::Slam(Slam { rate_hz, .. })
            | Instrument::Wall(Wall { rate_hz, .. })
            | Instrument::Tachometer { rate_hz, .. } => f64::from(self.samples) / rate_hz,
        }
    }

    /// Does the instrument measure the robot unasked?
    pub(crate) const fn free_running(&self) -> bool {
        matches!(
            self.instrument,
            Instrument::MotionCapture { .. }
                | Instrument::Slam(_)
                | Instrument::Wall(_)
                | Instrument::Tachometer { .. }
        )
    }

    /// A measurement at the moving robot at [`Self::next_measurement_s`], whose contacts have gone so far
    /// over the ground.
    pub(crate) fn measurement(&mut self, t_s: f64, world_from_body: Frame, ground_m: Wheels<f64>, run: &mut Run) {
        if let Instrument::Tachometer { rate_hz, sigma_m_s } = self.instrument {
            let mut speed = |now_m, before_m| (now_m - before_m) * rate_hz + sigma_m_s * self.stream.normal();
            // The first sample, at standstill, has nothing before it.
            let speed_m_s = ground_m.zip_with(self.ground_m, &mut speed);
            run.wheel_reference.push(WheelSpeed { t_s, speed_m_s });
            self.samples += 1;
            self.ground_m = ground_m;
            return;
        }
        if let Instrument::Slam(slam) = self.instrument {
            self.pose_in_map(&slam, t_s, world_from_body.pose(), run);
            return;
        }
        if let Instrument::Wall(wall) = self.instrument {
            self.wall(&wall, t_s, world_from_body, run);
            return;
        }
        let Instrument::MotionCapture {
            sigma_xy_m,
            sigma_theta_rad,
            latency_s,
            lever_x_m,
            lever_y_m,
            lever_theta_rad,
            ..
        } = self.instrument
        else {
            return;
        };
        let stream = &mut self.stream;
        self.samples += 1;
        let world_from_marker = world_from_body * Pose::new(lever_x_m, lever_y_m, lever_theta_rad);
        run.truth.push(TruthSample::new(
            t_s + latency_s,
            world_from_marker.x_m + sigma_xy_m * stream.normal(),
            world_from_marker.y_m + sigma_xy_m * stream.normal(),
            Some(world_from_marker.theta_rad + sigma_theta_rad * stream.normal()),
        ));
    }

    /// Distance from the wall and heading along it, where the lidar sees it.
    fn wall(&mut self, wall: &Wall, t_s: f64, world_from_body: Frame, run: &mut Run) {
        self.samples += 1;
        let [ahead_m, left_m, turned_rad] = wall.lever();
        let lidar = world_from_body * Pose::new(ahead_m, left_m, turned_rad);
        let distance_m = wall.distance_m(lidar);
        // Drawn whether it is seen or not: what is not seen moves no other draw.
        let [distance, heading] = self.stream.normals();
        if !wall.is_seen(distance_m) {
            return;
        }
        let heading_rad = wrap_to_pi(lidar.theta_rad - wall.wall_direction_rad);
        let measured = |sigma: f64, value: f64| (sigma > 0.0).then_some(value);
        run.walls.push(WallReading {
            t_s,
            wall: format!("wall_{}", self.position),
            distance_m: measured(wall.sigma_m, distance_m + wall.sigma_m * distance),
            heading_rad: measured(wall.sigma_rad, wrap_to_pi(heading_rad + wall.sigma_rad * heading)),
            sigma_m: measured(wall.sigma_m, wall.sigma_m),
            sigma_rad: measured(wall.sigma_rad, wall.sigma_rad),
        });
    }

    /// A pose in the map, with the standard deviations that its row states.
    fn pose_in_map(&mut self, slam: &Slam, t_s: f64, world_from_body: Pose, run: &mut Run) {
        self.samples += 1;
        let Some(errors) = &mut self.slam else { return };
        let seen = errors.pose(t_s, world_from_body);
        let [dx, dy] = self.stream.normals();
        run.truth.push(TruthSample::new(
            t_s,
            seen.x_m + slam.sigma_xy_m * dx,
            seen.y_m + slam.sigma_xy_m * dy,
            Some(seen.theta_rad + slam.sigma_theta_rad * self.stream.normal()),
        ));
        if slam.stated_over_true > 0.0 {
            let [xy_m, theta_rad] = slam.sigma().map(|sigma| Some(slam.stated_over_true * sigma));
            let stated = TruthSigma { sigma_xy_m: xy_m, sigma_theta_rad: theta_rad, covariance: None };
            run.truth_sigma.get_or_insert_default().push(stated);
        }
    }

    /// Does the instrument need every row or standstill of a run to be driven?
    pub(crate) const fn follows_run(&self) -> bool {
        matches!(self.instrument, Instrument::Gyro { .. } | Instrument::Tape { .. } | Instrument::Revisit { .. })
    }

    /// A row of the log at an instant and true heading: the gyroscope's mean rate since the row before.
    pub(crate) fn row(&mut self, t_s: f64, theta_rad: f64, run: &mut Run) {
        let Instrument::Gyro { noise_rad_per_sqrt_s, bias_radps, bias_walk_radps_per_sqrt_s, scale, .. } =
            self.instrument
        else {
            return;
        };
        let [noise, walk] = self.stream.normals();
        let (rate_radps, bias_radps) = match self.gyro_row {
            Some((before_s, before_rad, before_radps)) if t_s > before_s => {
                let dt_s = t_s - before_s;
                let turned_radps = (1.0 + scale) * (theta_rad - before_rad) / dt_s;
                let bias_radps = before_radps + bias_walk_radps_per_sqrt_s * dt_s.sqrt() * walk;
                (turned_radps + bias_radps + noise_rad_per_sqrt_s / dt_s.sqrt() * noise, bias_radps)
            }
            // The first row has no interval before it.
            _ => (bias_radps, bias_radps),
        };
        self.gyro_row = Some((t_s, theta_rad, bias_radps));
        run.odometry.extra.entry(ExtraChannel::GyroYawRate).or_default().push(rate_radps);
    }

    /// The robot stands: the tape from the last standstill, and the marks of the run's start where it is back
    /// there.
    pub(crate) fn stands(&mut self, t_s: f64, pose: Pose, run: &mut Run) {
        let Some([(first_s, first), (before_s, before)]) = self.stood else {
            self.stood = Some([(t_s, pose); 2]);
            return;
        };
        if t_s <= before_s + SAME_INSTANT_S {
            return;
        }
        self.stood = Some([(first_s, first), (t_s, pose)]);
        match self.instrument {
            Instrument::Tape { sigma_m } => {
                let distance_m = before.position().distance_m(pose.position());
                if distance_m > TAPE_FROM_M {
                    let distance_m = distance_m + sigma_m * self.stream.normal();
                    run.distances.push(TapeDistance { t0_s: before_s, t1_s: t_s, distance_m, sigma_m });
                }
            }
            Instrument::Revisit { sigma_xy_m, sigma_theta_rad } => {
                let moved = first.to(pose);
                let turned_rad = (pose.theta_rad - first.theta_rad).abs();
                if moved.x_m.hypot(moved.y_m) > TAPE_FROM_M || turned_rad < MIN_RETURN_TURN_RAD {
                    return;
                }
                let [dx, dy] = self.stream.normals();
                let dtheta = self.stream.normal();
                let measured = |sigma: f64, value: f64| (sigma > 0.0).then_some(value);
                run.revisits.push(Revisit {
                    t0_s: first_s,
                    t1_s: t_s,
                    dx_m: measured(sigma_xy_m, moved.x_m + sigma_xy_m * dx),
                    dy_m: measured(sigma_xy_m, moved.y_m + sigma_xy_m * dy),
                    // Nobody counts whole turns who looks at a mark.
                    dtheta_rad: measured(sigma_theta_rad, wrap_to_pi(moved.theta_rad) + sigma_theta_rad * dtheta),
                    sigma_xy_m: measured(sigma_xy_m, sigma_xy_m),
                    sigma_theta_rad: measured(sigma_theta_rad, sigma_theta_rad),
                });
            }
            _ => {}
        }
    }

    /// A reading of the standing robot's marks on the floor grid.
    #[inline]
    pub(crate) fn read_standing(
        &mut self,
        t_s: f64,
        world_from_body: Frame,
        points: &[MarkedPoint],
        readings: &mut Vec<PointReading>,
    ) {
        let Some(grid) = self.floor_grid() else { return };
        readings.reserve(points.len());
        for (point, mark) in points.iter().enumerate() {
            let [x_m, y_m] = grid.reading(&Branching, world_from_body * mark.body, self.stream.normals());
            let room = Point::new(x_m, y_m);
            readings.push(PointReading { t_s, point, room });
        }
    }
}

/// A floor grid that marks are read on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FloorGrid {
    pub(crate) resolution_m: f64,
    pub(crate) reading_sigma_m: f64,
}

impl FloorGrid {
    /// A mark as read, x and y in metres, by two draws.
    #[inline(always)]
    pub(crate) fn reading(&self, elementary: &impl Elementary, room: Point, [dx, dy]: [f64; 2]) -> [f64; 2] {
        let read_m = [room.x_m + self.reading_sigma_m * dx, room.y_m + self.reading_sigma_m * dy];
        if self.resolution_m > 0.0 {
            let [x_m, y_m] = read_m;
            [self.nearest_m(elementary, x_m), self.nearest_m(elementary, y_m)]
        } else {
            read_m
        }
    }

    /// A coordinate's nearest line of the grid, metres.
    #[inline(always)]
    fn nearest_m(&self, elementary: &impl Elementary, m: f64) -> f64 {
        elementary.round(m / self.resolution_m) * self.resolution_m
    }
}
