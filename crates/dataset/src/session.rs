//! Borrowed views of a dataset: what estimators take. A subset of the runs (training, held out) copies
//! nothing.

use kinematics::{
    Branching, Count, DriveGeometry, Elementary, Frame, Odometry as DeadReckoner, Point, Pose, Rule, Twist, Wheels,
    unwrap_near,
};

use crate::record::{Dataset, MarkedPoint, NominalRobot, Odometry, Run, RunInfo, TruthNoise, WheelLog};

/// One robot's session: its nominal values and some of its runs.
#[derive(Debug, Clone)]
pub struct Session<'a> {
    /// The dataset's name, for messages.
    pub name: &'a str,
    /// Nominal values.
    pub robot: &'a NominalRobot,
    /// Precision of the outside instrument.
    pub truth_noise: TruthNoise,
    /// Marked points of the robot.
    pub points: &'a [MarkedPoint],
    /// The runs.
    pub runs: Vec<RunView<'a>>,
}

impl Dataset {
    /// A view of all runs.
    #[must_use]
    pub fn session(&self) -> Session<'_> {
        let runs = self.runs.iter().map(|run| RunView { run, points: &self.points }).collect();
        Session { runs, ..self.session_of(|_| false) }
    }

    /// A view of the runs that `keep` accepts.
    #[must_use]
    pub fn session_of(&self, keep: impl Fn(&RunInfo) -> bool) -> Session<'_> {
        Session {
            name: self.provenance.name.as_deref().unwrap_or("dataset"),
            robot: &self.robot,
            truth_noise: self.truth_noise,
            points: &self.points,
            runs: self
                .runs
                .iter()
                .filter(|run| keep(&run.info))
                .map(|run| RunView { run, points: &self.points })
                .collect(),
        }
    }
}

/// A view of one run, with the marked points that its readings speak of.
#[derive(Debug, Clone, Copy)]
pub struct RunView<'a> {
    run: &'a Run,
    points: &'a [MarkedPoint],
}

impl WheelLog {
    /// As [`RunView::reported_speed_m_s`], by a geometry.
    pub(crate) fn reported_speed_m_s(&self, geometry: &DriveGeometry, row: usize) -> Option<Wheels<f64>> {
        match self {
            Self::Speeds(speeds) => Some(Wheels { left: *speeds.left.get(row)?, right: *speeds.right.get(row)? }),
            Self::Twist { v_mps, omega_radps } => {
                let twist = Twist { v_m_s: *v_mps.get(row)?, omega_rad_s: *omega_radps.get(row)? };
                Some(geometry.wheel_speed_m_s(twist))
            }
            Self::Ticks(_) | Self::Angles(_) => None,
        }
    }
}

impl<'a> RunView<'a> {
    /// Id, protocol and covariates.
    #[must_use]
    pub const fn info(&self) -> &'a RunInfo {
        &self.run.info
    }

    /// What the robot counted.
    #[must_use]
    pub const fn odometry(&self) -> &'a Odometry {
        &self.run.odometry
    }

    /// The run's records.
    #[must_use]
    pub const fn run(&self) -> &'a Run {
        self.run
    }

    /// The turn of each wheel from the first row to the last, radians, or `None` when the run has no row.
    ///
    /// A robot that reports only speeds or its twist has its wheels rebuilt from the nominal geometry.
    #[must_use]
    pub fn wheel_turn_rad(&self, robot: &NominalRobot) -> Option<Wheels<f64>> {
        fn ends<C: Count>(column: &[C]) -> Option<f64> {
            Some(column.last()?.since(*column.first()?))
        }
        match &self.run.odometry.wheels {
            WheelLog::Ticks(ticks) => {
                let rad_per_tick = std::f64::consts::TAU / robot.ticks_per_rev?;
                Some(Wheels { left: ends(&ticks.left)? * rad_per_tick, right: ends(&ticks.right)? * rad_per_tick })
            }
            WheelLog::Angles(angles) => Some(Wheels { left: ends(&angles.left)?, right: ends(&angles.right)? }),
            WheelLog::Speeds(_) | WheelLog::Twist { .. } => {
                let angles = self.angles_by_rates_rad(robot)?;
                Some(Wheels { left: *angles.left.last()?, right: *angles.right.last()? })
            }
        }
    }

    /// The counts of each wheel from the first row to the last; `None` when the robot does not report ticks.
    #[must_use]
    pub fn ticks(&self) -> Option<Wheels<f64>> {
        match &self.run.odometry.wheels {
            WheelLog::Ticks(ticks) => Some(Wheels {
                left: ticks.left.last()?.since(*ticks.left.first()?),
                right: ticks.right.last()?.since(*ticks.right.first()?),
            }),
            WheelLog::Angles(_) | WheelLog::Speeds(_) | WheelLog::Twist { .. } => None,
        }
    }

    /// Mean distance that the wheels roll from the first row to the last, forward and backward, metres by the
    /// nominal values; 0 where they say nothing of it.
    #[must_use]
    pub fn rolled_m(&self, robot: &NominalRobot) -> f64 {
        fn turned<C: Count>(column: &[C]) -> f64 {
            column.windows(2).map(|pair| pair[1].since(pair[0]).abs()).sum()
        }
        let turned_rad = match &self.run.odometry.wheels {
            WheelLog::Ticks(ticks) => {
                let rad_per_tick = robot.ticks_per_rev.map_or(0.0, |ticks| std::f64::consts::TAU / ticks);
                ticks.as_ref().map(|column| rad_per_tick * turned(column))
            }
            WheelLog::Angles(angles) => angles.as_ref().map(|column| turned(column)),
            WheelLog::Speeds(_) | WheelLog::Twist { .. } => {
                self.angles_by_rates_rad(robot).map_or(Wheels::both(0.0), |angles| angles.map(|column| turned(&column)))
            }
        };
        0.25 * (turned_rad.left * robot.left_wheel_diameter_m + turned_rad.right * robot.right_wheel_diameter_m)
    }

    /// The contact speeds that a row reports, m/s, for a robot that reports speeds or its twist.
    #[must_use]
    pub fn reported_speed_m_s(&self, robot: &NominalRobot, row: usize) -> Option<Wheels<f64>> {
        self.run.odometry.wheels.reported_speed_m_s(&robot.geometry().ok()?, row)
    }

    /// Wheel angles at the rows by the nominal geometry, radians since the first, of a robot that reports
    /// speeds or its twist: a row's speeds hold over the interval that ends there. Where rows are missing,
    /// they hold over the last sampling period; before it the wheels went on from the speeds of the row
    /// before, which change steadily.
    #[must_use]
    pub fn angles_by_rates_rad(&self, robot: &NominalRobot) -> Option<Wheels<Vec<f64>>> {
        let m_per_rad = robot.geometry().ok()?.m_per_rad();
        let t_s = &self.run.odometry.t_s;
        let regular = if self.run.info.continuous { t_s.sampling_period() } else { None };
        let regular = regular.filter(|period| period.is_certain() && !period.is_bunched);
        let is_row_missing = |row: usize| regular.is_some_and(|of| of.numbers[row] - of.numbers[row - 1] > 1);
        let period_s = regular.map_or(0.0, |period| period.period_s);
        let mut angle_rad = Wheels::both(0.0);
        let mut before_m_s: Option<Wheels<f64>> = None;
        let mut angles = Wheels { left: Vec::with_capacity(t_s.len()), right: Vec::with_capacity(t_s.len()) };
        for row in 0..t_s.len() {
            let speed_m_s = self.reported_speed_m_s(robot, row)?;
            if let Some(before_m_s) = before_m_s {
                let row_s = t_s[row] - t_s[row - 1];
                let missing_s = if is_row_missing(row) { (row_s - period_s).max(0.0) } else { 0.0 };
                let travel_m =
                    speed_m_s.zip_with(before_m_s, |now, before| now * row_s - 0.5 * missing_s * (now - before));
                let turned_rad = travel_m.zip_with(m_per_rad, |travel_m, m_per_rad| travel_m / m_per_rad);
                angle_rad = angle_rad.zip_with(turned_rad, |angle, turn| angle + turn);
            }
            before_m_s = Some(speed_m_s);
            angles.left.push(angle_rad.left);
            angles.right.push(angle_rad.right);
        }
        Some(angles)
    }

    /// Dead reckons the run from `start` and calls `visit` with time and pose at every row; `start` is the
    /// pose at the first row.
    ///
    /// `m_per_rad` and `wheel_separation_m` are the geometry to be used; the nominal robot gives the ticks of
    /// a turn and, for a robot that reports only speeds or its twist, the geometry from which its wheels are
    /// rebuilt.
    pub fn dead_reckon(
        &self,
        robot: &NominalRobot,
        geometry: &DriveGeometry,
        rule: Rule,
        start: Pose,
        mut visit: impl FnMut(f64, Pose),
    ) {
        let mut times = self.run.odometry.t_s.iter();
        let mut with_time = |pose| {
            if let Some(&t_s) = times.next() {
                visit(t_s, pose);
            }
        };
        let reckoner =
            |m_per_count| DeadReckoner { m_per_count, wheel_separation_m: geometry.wheel_separation_m(), rule };
        match &self.run.odometry.wheels {
            WheelLog::Ticks(ticks) => {
                let Some(Ok(m_per_count)) = robot.ticks_per_rev.map(|ticks| geometry.m_per_count(ticks)) else {
                    return;
                };
                let columns = Wheels { left: &ticks.left[..], right: &ticks.right[..] };
                reckoner(m_per_count).for_each_pose(start, columns, &mut with_time);
            }
            WheelLog::Angles(angles) => {
                let columns = Wheels { left: &angles.left[..], right: &angles.right[..] };
                reckoner(geometry.m_per_rad()).for_each_pose(start, columns, &mut with_time);
            }
            WheelLog::Speeds(_) | WheelLog::Twist { .. } => {
                let Some(angles) = self.angles_by_rates_rad(robot) else { return };
                let columns = Wheels { left: &angles.left[..], right: &angles.right[..] };
                reckoner(geometry.m_per_rad()).for_each_pose(start, columns, &mut with_time);
            }
        }
    }

    /// The instrument's poses of the run as (time, pose): from the truth where it has headings, else from the
    /// marked points read at one instant. Empty when neither gives poses.
    #[must_use]
    pub fn observed_poses(&self) -> Vec<(f64, Pose)> {
        let from_truth: Vec<_> = self
            .run
            .truth
            .iter()
            .filter_map(|sample| Some((sample.t_s, Pose::new(sample.x_m, sample.y_m, sample.theta_rad()?))))
            .collect();
        if from_truth.is_empty() { self.poses_from_points().collect() } else { from_truth }
    }

    /// The first and the last observed pose, where there are two.
    #[must_use]
    pub fn observed_ends(&self) -> Option<(Pose, Pose)> {
        let heading = |sample: &crate::TruthSample| {
            sample.theta_rad().map(|theta_rad| Pose::new(sample.x_m, sample.y_m, theta_rad))
        };
        let mut poses = self.run.truth.iter().filter_map(heading);
        if let Some(first) = poses.next() {
            return Some((first, poses.next_back()?));
        }
        let mut poses = self.poses_from_points().map(|(_, pose)| pose);
        poses.next().zip(poses.last())
    }

    /// The body's pose at every instant at which at least two marked points were read: the rigid motion that
    /// fits them best (least squares, in closed form in the plane). Headings continue without jumps of whole
    /// turns.
    fn poses_from_points(&self) -> impl Iterator<Item = (f64, Pose)> {
        let mut previous_rad = None;
        self.run.point_readings.chunk_by(|a, b| a.t_s == b.t_s).filter_map(move |readings| {
            let pairs =
                readings.iter().filter_map(|reading| Some((self.points.get(reading.point)?.body, reading.room)));
            let mut pose = fit_rigid(pairs)?;
            if let Some(previous_rad) = previous_rad {
                pose.theta_rad = unwrap_near(pose.theta_rad, previous_rad);
            }
            previous_rad = Some(pose.theta_rad);
            Some((readings[0].t_s, pose))
        })
    }
}

/// `room_from_body` of least squared error over pairs of points; `None` for fewer than two distinct points.
#[must_use]
pub fn fit_rigid(pairs: impl Iterator<Item = (Point, Point)> + Clone) -> Option<Pose> {
    let mut sums = RigidSums::default();
    pairs.clone().for_each(|(body, room)| sums.add(body, room));
    let mut moments = sums.moments();
    pairs.for_each(|(body, room)| moments.add(body, room));
    let [x_m, y_m, theta_rad] = moments.pose(&Branching);
    // NaN where there is none.
    (!theta_rad.is_nan()).then_some(Pose::new(x_m, y_m, theta_rad))
}

/// As points read at one instant do: the pose `room_from_body` (x, y, heading) that carries two body points
/// onto room points with the least squared error, by given elementary functions; NaN where they coincide.
#[inline(always)]
#[must_use]
pub fn fit_two_points(elementary: &impl Elementary, [a, b]: [(Point, Point); 2]) -> [f64; 3] {
    let mut sums = RigidSums::default();
    sums.add(a.0, a.1);
    sums.add(b.0, b.1);
    let mut moments = sums.moments();
    moments.add(a.0, a.1);
    moments.add(b.0, b.1);
    moments.pose(elementary)
}

/// Sums of points on the body and in the room.
#[derive(Debug, Clone, Copy, Default)]
struct RigidSums {
    count: f64,
    body: Point,
    room: Point,
}

impl RigidSums {
    #[inline(always)]
    fn add(&mut self, body: Point, room: Point) {
        self.count += 1.0;
        self.body = Point::new(self.body.x_m + body.x_m, self.body.y_m + body.y_m);
        self.room = Point::new(self.room.x_m + room.x_m, self.room.y_m + room.y_m);
    }

    /// About the means, of no pair yet.
    #[inline(always)]
    fn moments(self) -> RigidMoments {
        let Self { count, body, room } = self;
        RigidMoments {
            count,
            body: Point::new(body.x_m / count, body.y_m / count),
            room: Point::new(room.x_m / count, room.y_m / count),
            dot: 0.0,
            cross: 0.0,
        }
    }
}

/// Sums of products of points on the body and in the room, about their means.
#[derive(Debug, Clone, Copy)]
struct RigidMoments {
    count: f64,
    body: Point,
    room: Point,
    dot: f64,
    cross: f64,
}

impl RigidMoments {
    #[inline(always)]
    fn add(&mut self, body: Point, room: Point) {
        let (bx, by) = (body.x_m - self.body.x_m, body.y_m - self.body.y_m);
        let (rx, ry) = (room.x_m - self.room.x_m, room.y_m - self.room.y_m);
        self.dot += bx * rx + by * ry;
        self.cross += bx * ry - by * rx;
    }

    /// The pose; NaN for fewer than two distinct points.
    #[inline(always)]
    fn pose<E: Elementary>(&self, elementary: &E) -> [f64; 3] {
        let Self { count, body, room, dot, cross } = *self;
        let theta_rad = elementary.atan2(cross, dot);
        let turned = Frame::by(elementary, Pose::new(0.0, 0.0, theta_rad)) * body;
        E::choose(
            (count < 2.0) | ((dot == 0.0) & (cross == 0.0)),
            || [f64::NAN; 3],
            || [room.x_m - turned.x_m, room.y_m - turned.y_m, theta_rad],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{PointReading, Provenance, TruthSample};

    fn robot() -> NominalRobot {
        NominalRobot {
            left_wheel_diameter_m: 0.16,
            right_wheel_diameter_m: 0.16,
            wheel_separation_m: 0.363,
            ticks_per_rev: Some(500.0),
            counter_bits: None,
        }
    }

    fn dataset(run: Run) -> Dataset {
        let point = |id: &str, y_m| MarkedPoint { id: id.into(), body: Point::new(0.0, y_m) };
        Dataset {
            provenance: Provenance::default(),
            robot: robot(),
            truth_noise: TruthNoise::default(),
            points: vec![point("left", 0.25), point("right", -0.2)],
            runs: vec![run],
        }
    }

    #[test]
    fn rates_go_on_steadily_over_rows_that_are_missing() {
        // Both wheels at k/100 m/s in row k, of 0.1 s; row 20 is missing.
        let rows: Vec<u32> = (0..60).filter(|row| *row != 20).collect();
        let speeds: Vec<f64> = rows.iter().map(|row| 0.01 * f64::from(*row)).collect();
        let of = |continuous| {
            let mut run = Run::default();
            run.info.continuous = continuous;
            run.odometry.t_s = rows.iter().map(|row| 0.1 * f64::from(*row)).collect();
            run.odometry.wheels = WheelLog::Speeds(Wheels::both(speeds.clone()));
            let dataset = dataset(run);
            let angles = dataset.session().runs[0].angles_by_rates_rad(&dataset.robot).expect("speeds");
            // Metres over the gap, and over the row behind it.
            [angles.left[20] - angles.left[19], angles.left[21] - angles.left[20]].map(|rad| 0.08 * rad)
        };
        // At 0.21 m/s for a tenth of a second, and at the mean of that and 0.19 m/s for the one before.
        let [over_gap_m, behind_m] = of(true);
        assert!((over_gap_m - (0.021 + 0.020)).abs() < 1e-12 && (behind_m - 0.022).abs() < 1e-12, "{over_gap_m}");
        // In a log with gaps a row is as long as it is.
        let [over_gap_m, behind_m] = of(false);
        assert!((over_gap_m - 0.042).abs() < 1e-12 && (behind_m - 0.022).abs() < 1e-12, "{over_gap_m}");
    }

    #[test]
    fn a_pose_is_recovered_from_its_marked_points_and_headings_do_not_jump() {
        let mut run = Run::default();
        let poses: Vec<_> = (0..40).map(|k| Pose::new(0.1 * f64::from(k), 1.0, 0.4 * f64::from(k) - 1.0)).collect();
        let marks = dataset(Run::default()).points;
        for (k, pose) in poses.iter().enumerate() {
            for (point, mark) in marks.iter().enumerate() {
                run.point_readings.push(PointReading { t_s: k as f64, point, room: *pose * mark.body });
            }
        }
        let dataset = dataset(run);
        let observed = dataset.session().runs[0].observed_poses();
        assert_eq!(observed.len(), poses.len());
        for ((_, observed), pose) in observed.iter().zip(&poses) {
            // Half a metre of lever and a few roundings.
            assert!(observed.position().distance_m(pose.position()) < 1e-14);
            assert!((observed.theta_rad - pose.theta_rad).abs() < 1e-13, "{} {}", observed.theta_rad, pose.theta_rad);
        }
    }

    #[test]
    fn one_point_or_coinciding_points_give_no_pose() {
        assert_eq!(fit_rigid([(Point::new(0.0, 1.0), Point::new(2.0, 2.0))].into_iter()), None);
        let same = (Point::new(0.0, 1.0), Point::new(2.0, 2.0));
        assert_eq!(fit_rigid([same, same].into_iter()), None);
    }

    #[test]
    fn a_twist_log_is_rebuilt_into_wheels_that_drive_the_same_way() {
        let mut run = Run::default();
        run.odometry.t_s = (0..=100).map(|k| 0.05 * f64::from(k)).collect();
        run.odometry.wheels = WheelLog::Twist { v_mps: vec![0.3; 101], omega_radps: vec![-0.2; 101] };
        let dataset = dataset(run);
        let session = dataset.session();
        let geometry = robot().geometry().expect("valid");
        let mut last = (0.0, Pose::IDENTITY);
        session.runs[0]
            .dead_reckon(&robot(), &geometry, Rule::ExactArc, Pose::IDENTITY, |t_s, pose| last = (t_s, pose));
        let exact = kinematics::Increment { distance_m: 1.5, turn_rad: -1.0 }.arc();
        assert_eq!(last.0, 5.0);
        assert!((session.runs[0].rolled_m(&robot()) - 1.5).abs() < 1e-13);
        assert!(last.1.position().distance_m(exact.position()) < 1e-13);
        assert!((last.1.theta_rad - exact.theta_rad).abs() < 1e-13);
    }

    #[test]
    fn position_only_truth_gives_no_poses() {
        let run = Run {
            truth: vec![TruthSample::new(0.0, 0.0, 0.0, None), TruthSample::new(1.0, 1.0, 0.0, None)],
            ..Run::default()
        };
        let dataset = dataset(run);
        assert!(dataset.session().runs[0].observed_poses().is_empty());
        assert!(dataset.session().runs[0].observed_ends().is_none());
    }
}
