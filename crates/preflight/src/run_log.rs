//! A run as the checks see it: wheel angles over time without impossible rows, and what the instrument saw.

use dataset::{Displacement, NominalRobot, Protocol, Run, RunSpans, RunView, TruthSample, WheelLog};
use kinematics::{Side, Wheels};

use crate::settings::CHECKS;

/// A run's records in one form.
#[derive(Debug, Clone)]
pub(crate) struct RunLog {
    pub(crate) id: String,
    /// When it began on the session's clock, seconds.
    pub(crate) start_s: f64,
    pub(crate) protocol: Option<Protocol>,
    pub(crate) turn_rad: Option<f64>,
    pub(crate) continuous: bool,
    pub(crate) t_s: Vec<f64>,
    /// Radians by the stated ticks of a turn.
    pub(crate) wheels: Wheels<Vec<f64>>,
    /// Radians of a count; 0 where wheels are not counted.
    pub(crate) count_rad: f64,
    /// A robot that reports only speeds or its twist.
    pub(crate) has_rates: bool,
    /// Poses or positions.
    pub(crate) truth: Vec<TruthSample>,
    pub(crate) displacements: Vec<Displacement>,
    /// Spans of the log and of the measurements, where both are of the same time, seconds
    /// ([`RunSpans::comparable_s`]).
    pub(crate) spans_s: Option<[f64; 2]>,
    /// What tapes, walls, returns and a gyroscope say of the motion between two instants.
    pub(crate) partial: Vec<PartialRow>,
}

/// What is measured of the motion between two instants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    /// Its length.
    Length,
    /// Its length along the normal of a wall.
    WallLength,
    /// Its turn.
    Turn,
    /// Its turn, times the scale of a gyroscope.
    GyroTurn,
}

/// A partial measurement and its standard deviation, metres or radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PartialRow {
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
    pub(crate) part: Part,
    pub(crate) sigma: f64,
}

/// What each wheel rolls for a radian by the stated robot, metres.
pub(crate) fn m_per_rad(robot: &NominalRobot) -> Wheels<f64> {
    Wheels { left: 0.5 * robot.left_wheel_diameter_m, right: 0.5 * robot.right_wheel_diameter_m }
}

/// The partial measurements of a run; two readings of a wall are one of the motion between them.
fn partial(run: &Run) -> Vec<PartialRow> {
    let row = |from_s: f64, to_s: f64, part: Part, sigma: f64| PartialRow { from_s, to_s, part, sigma };
    let mut rows: Vec<PartialRow> =
        run.distances.iter().map(|of| row(of.t0_s, of.t1_s, Part::Length, of.sigma_m)).collect();
    for of in &run.revisits {
        let sigma = of.dtheta_rad.and(of.sigma_theta_rad);
        rows.extend(sigma.map(|sigma| row(of.t0_s, of.t1_s, Part::Turn, sigma)));
    }
    for (number, of) in run.walls.iter().enumerate() {
        let Some(before) = run.walls[..number].iter().rev().find(|before| before.wall == of.wall) else { continue };
        let sigmas = [(before.sigma_rad, of.sigma_rad, Part::Turn), (before.sigma_m, of.sigma_m, Part::WallLength)];
        for (a, b, part) in sigmas {
            rows.extend(a.zip(b).map(|(a, b)| row(before.t_s, of.t_s, part, a.hypot(b))));
        }
    }
    for pair in run.headings.windows(2) {
        rows.push(row(pair[0].t_s, pair[1].t_s, Part::Turn, pair[0].sigma_rad.hypot(pair[1].sigma_rad)));
    }
    if let (true, [from_s, .., to_s]) = (run.has_gyro(), &run.odometry.t_s[..]) {
        // A minute of a consumer gyroscope whose bias was seen.
        rows.push(row(*from_s, *to_s, Part::GyroTurn, CHECKS.gyro_turn_sigma_rad));
    }
    rows
}

impl RunLog {
    /// A run's records; `None` where the log has no row or the wheels have no angle.
    pub(crate) fn of(run: &RunView<'_>, robot: &NominalRobot) -> Option<Self> {
        let odometry = run.odometry();
        let (wheels, count_rad) = match &odometry.wheels {
            WheelLog::Ticks(ticks) => {
                let count_rad = std::f64::consts::TAU / robot.ticks_per_rev?;
                let angles = ticks.as_ref().map(|ticks| ticks.iter().map(|count| *count as f64 * count_rad).collect());
                (angles, count_rad)
            }
            WheelLog::Angles(angles) => (angles.clone(), 0.0),
            WheelLog::Speeds(_) | WheelLog::Twist { .. } => (run.angles_by_rates_rad(robot)?, 0.0),
        };
        if odometry.t_s.is_empty() {
            return None;
        }
        let mut truth = run.run().truth.clone();
        if truth.is_empty() {
            let sample =
                |(t_s, pose): (f64, kinematics::Pose)| TruthSample::new(t_s, pose.x_m, pose.y_m, Some(pose.theta_rad));
            truth = run.observed_poses().into_iter().map(sample).collect();
        }
        Some(Self {
            id: run.info().id.clone(),
            start_s: run.info().start_s.unwrap_or(0.0),
            protocol: run.info().protocol,
            turn_rad: run.info().settings.turn_rad,
            continuous: run.info().continuous,
            t_s: odometry.t_s.to_vec(),
            wheels,
            count_rad,
            has_rates: matches!(odometry.wheels, WheelLog::Speeds(_) | WheelLog::Twist { .. }),
            truth,
            displacements: run.run().displacements.clone(),
            spans_s: RunSpans::of(run.run()).comparable_s(),
            partial: partial(run.run()),
        })
    }

    /// Does nothing but partial measurements see it?
    pub(crate) fn is_seen_in_part(&self) -> bool {
        self.truth.is_empty() && self.displacements.is_empty() && !self.partial.is_empty()
    }

    /// The wheels' angles if rates are of the instant.
    pub(crate) fn with_instant_rates(&self, run: &RunView<'_>, robot: &NominalRobot) -> Option<Self> {
        self.has_rates.then_some(())?;
        Some(Self { wheels: by_instant_rates_rad(&self.t_s, run, robot)?, ..self.clone() })
    }

    /// Whether the instrument sees headings.
    pub(crate) fn sees_headings(&self) -> bool {
        !self.displacements.is_empty() || self.truth.iter().any(|sample| sample.theta_rad().is_some())
    }

    /// What lies between two instants alone.
    pub(crate) fn keep(&mut self, from_s: f64, to_s: f64) {
        let rows = self.t_s.partition_point(|t_s| *t_s < from_s)..self.t_s.partition_point(|t_s| *t_s <= to_s);
        self.t_s = self.t_s[rows.clone()].to_vec();
        self.wheels = self.wheels.as_ref().map(|angles| angles[rows.clone()].to_vec());
        let lies = |t_s: f64| (from_s..=to_s).contains(&t_s);
        self.truth.retain(|sample| lies(sample.t_s));
        self.displacements.retain(|of| lies(of.t0_s) && lies(of.t1_s));
        self.partial.retain(|of| lies(of.from_s) && lies(of.to_s));
    }

    /// All times by a factor.
    pub(crate) fn scale_time(&mut self, factor: f64) {
        self.t_s.iter_mut().for_each(|t_s| *t_s *= factor);
        self.spans_s.iter_mut().for_each(|[logged_s, _]| *logged_s *= factor);
        for of in self.partial.iter_mut().filter(|of| of.part == Part::GyroTurn) {
            (of.from_s, of.to_s) = (factor * of.from_s, factor * of.to_s);
        }
        self.scale_truth_time(factor);
    }

    /// Times of the instrument by a factor.
    pub(crate) fn scale_truth_time(&mut self, factor: f64) {
        self.truth.iter_mut().for_each(|sample| sample.t_s *= factor);
        for displacement in &mut self.displacements {
            displacement.t0_s *= factor;
            displacement.t1_s *= factor;
        }
        self.spans_s.iter_mut().for_each(|[_, measured_s]| *measured_s *= factor);
        // A gyroscope rides on the robot and has the log's time.
        for of in self.partial.iter_mut().filter(|of| of.part != Part::GyroTurn) {
            (of.from_s, of.to_s) = (factor * of.from_s, factor * of.to_s);
        }
    }

    /// The wheels' angles at an instant; `None` beyond the log.
    pub(crate) fn angles_at(&self, t_s: f64) -> Option<Wheels<f64>> {
        let (first_s, last_s) = (*self.t_s.first()?, *self.t_s.last()?);
        let slack_s = if self.t_s.len() > 1 { 0.5 * (last_s - first_s) / (self.t_s.len() - 1) as f64 } else { 0.0 };
        if !(first_s - slack_s..=last_s + slack_s).contains(&t_s) {
            return None;
        }
        if self.t_s.len() < 2 {
            return Some(Wheels { left: self.wheels.left[0], right: self.wheels.right[0] });
        }
        let row = self.t_s.partition_point(|row_s| *row_s <= t_s).clamp(1, self.t_s.len() - 1) - 1;
        let share = ((t_s - self.t_s[row]) / (self.t_s[row + 1] - self.t_s[row])).clamp(0.0, 1.0);
        Some(Wheels::from_sides(|side: Side| {
            let angles = &self.wheels[side];
            angles[row] + share * (angles[row + 1] - angles[row])
        }))
    }

    /// What the wheels turn by between two instants, radians.
    pub(crate) fn turned(&self, from_s: f64, to_s: f64) -> Option<Wheels<f64>> {
        Some(self.angles_at(to_s)?.zip_with(self.angles_at(from_s)?, |to, from| to - from))
    }

    /// Both wheels' turning without regard to its direction, radians.
    pub(crate) fn turning(&self) -> Wheels<f64> {
        self.wheels.as_ref().map(|angles| angles.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum())
    }
}

/// Wheel angles by the nominal wheels from a log of speeds or twists of the rows' instants.
fn by_instant_rates_rad(t_s: &[f64], run: &RunView<'_>, robot: &NominalRobot) -> Option<Wheels<Vec<f64>>> {
    let m_per_rad = robot.geometry().ok()?.m_per_rad();
    let rate = |row: usize| {
        let speed_m_s = run.reported_speed_m_s(robot, row)?;
        Some(speed_m_s.zip_with(m_per_rad, |speed, m_per_rad| speed / m_per_rad))
    };
    let mut angle = Wheels::both(0.0);
    let mut angles = Wheels { left: Vec::with_capacity(t_s.len()), right: Vec::with_capacity(t_s.len()) };
    for row in 0..t_s.len() {
        if row > 0 {
            let mean = rate(row)?.zip_with(rate(row - 1)?, |a, b| 0.5 * (a + b));
            angle = angle.zip_with(mean, |angle, rate| angle + rate * (t_s[row] - t_s[row - 1]));
        }
        angles.left.push(angle.left);
        angles.right.push(angle.right);
    }
    Some(angles)
}
