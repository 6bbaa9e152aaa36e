//! `direct`: the paper's method, straight runs for the sensitivities and spins for the wheelbase.
//!
//! Model: each wheel rolls C metres a count; the contacts are B apart. A straight run of small turn Δθ moves
//! the mark beside a wheel along a chord, from which the wheel's arc follows (6); C = S/ΔN (9). A spin by θ
//! gives B = (C_R ΔN_R − C_L ΔN_L)/θ, the signed form of (12) and (13).
//! Assumptions: constant wheel speeds within a run; marks on the axle's line. Where the dataset has poses
//! instead of marks, the wheel contacts serve as marks.
//! Observability: all three parameters; needs straights and spins. The estimates are means over the runs that
//! the outlier rule leaves, wheel by wheel. Two departures from the print, both derived in docs/paper.md:
//! chords and spins are signed (the printed (6) is off by ±0.03 % backward at m = 50 mm, the printed (14)
//! holds counter-clockwise only), and the turn is a two-argument arctangent instead of the arcsine of (8),
//! which folds beyond ±90°.
//! Reference: Navarro, Benet, Ríos, Bueno, eq. (6)–(9), (12)–(14).

mod lanes;

use dataset::{MarkedPoint, NominalRobot, PointReading, Protocol, Replicates, RunView, Session};
use kinematics::{Branching, DriveGeometry, Elementary, Point, Side, Wheels};
use motion_programs::Schedule;

use crate::estimate::{CalibError, Calibration, Covariance, Method, Parameter, Rejected, drive, nominal};
use crate::pose_measurements::EndPoses;
use crate::robust::{MedianMad, Summary, mean};
use crate::settings::{MAD_CUT, MAX_MARK_OFFSET_M, MIN_SPIN_RAD};

/// The method with its outlier rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direct {
    /// Which values are atypical.
    pub outliers: MedianMad,
}

/// The value of one run, with its id.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunValue<'a> {
    /// The run.
    pub run: &'a str,
    /// The value, in the unit of its parameter.
    pub value: f64,
    /// Its standard deviation by the instrument's stated precision alone; 0 when none is stated.
    pub stated_sigma: f64,
}

/// Standard deviation of one coordinate of a mark, by the instrument's statement, metres; 0 when it states
/// none.
fn mark_sigma_m(session: &Session<'_>) -> f64 {
    session.truth_noise.sigma_xy_m.unwrap_or(0.0)
}

/// What of a session the marks of every run need.
struct MarkReader<'s, 'a> {
    session: &'s Session<'a>,
    geometry: DriveGeometry,
    /// The outermost marked points and where they are on the robot.
    outermost: Option<Wheels<(usize, Point)>>,
}

/// The two marks of a run at its start and its end, in the room.
struct Marks {
    start: Wheels<Point>,
    end: Wheels<Point>,
    /// Distance of each mark outside its wheel's contact, metres (m2 left, m1 right).
    outside_m: Wheels<f64>,
}

impl Marks {
    /// Turn between start and end, the multiple of whole turns nearest to `about_rad` (paper, eq. 8 and 14).
    #[inline(always)]
    fn turn_rad(&self, elementary: &impl Elementary, about_rad: f64) -> f64 {
        let Self { start, end, .. } = self;
        let (x0, y0) = (start.left.x_m - start.right.x_m, start.left.y_m - start.right.y_m);
        let (x1, y1) = (end.left.x_m - end.right.x_m, end.left.y_m - end.right.y_m);
        elementary.unwrap_near(elementary.atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1), about_rad)
    }

    /// Metres per radian of each wheel on a straight run: (6) and (9), signed with the direction of travel,
    /// as backward runs have negative chords and negative counts.
    #[inline(always)]
    fn m_per_rad(&self, elementary: &impl Elementary, wheel_rad: Wheels<f64>) -> Wheels<f64> {
        let Self { start, end, outside_m } = self;
        let turn_rad = self.turn_rad(elementary, 0.0);
        let chord_over_arc = elementary.sinc(0.5 * turn_rad);
        let left_m = start.left.distance_m(end.left) * wheel_rad.left.signum();
        let right_m = start.right.distance_m(end.right) * wheel_rad.right.signum();
        Wheels {
            left: (left_m / chord_over_arc + outside_m.left * turn_rad) / wheel_rad.left,
            right: (right_m / chord_over_arc - outside_m.right * turn_rad) / wheel_rad.right,
        }
    }

    /// The wheelbase by a spin with its slopes by each wheel's metres per radian, and the robot's turn:
    /// (14), whole turns by the counts and the sensitivities already found.
    #[inline(always)]
    fn spin(
        &self,
        elementary: &impl Elementary,
        geometry: &DriveGeometry,
        (wheel_rad, m_per_rad): (Wheels<f64>, Wheels<f64>),
    ) -> Spin {
        let travel_m = Wheels { left: wheel_rad.left * m_per_rad.left, right: wheel_rad.right * m_per_rad.right };
        let turn_rad = self.turn_rad(elementary, geometry.increment(travel_m).turn_rad);
        Spin {
            turn_rad,
            wheel_separation_m: (travel_m.right - travel_m.left) / turn_rad,
            slope: Wheels { left: -wheel_rad.left / turn_rad, right: wheel_rad.right / turn_rad },
        }
    }
}

impl Marks {
    /// Standard deviation of the wheelbase by a spin, which moves by `by_turn_m` a radian of the robot's
    /// turn: two marks across the axle, read at both ends, give the turn to 2σ/w.
    #[inline(always)]
    fn stated_sigma_m(&self, by_turn_m: f64, mark_sigma_m: f64) -> f64 {
        by_turn_m.abs() * 2.0 * mark_sigma_m / self.start.left.distance_m(self.start.right)
    }
}

/// What a spin gives.
struct Spin {
    turn_rad: f64,
    wheel_separation_m: f64,
    slope: Wheels<f64>,
}

impl<'s, 'a> MarkReader<'s, 'a> {
    fn new(session: &'s Session<'a>) -> Result<Self, CalibError> {
        let geometry =
            session.robot.geometry().map_err(|source| CalibError::NotADrive { method: Direct::NAME, source })?;
        Ok(Self { session, geometry, outermost: outermost(session.points) })
    }

    /// The runs of one protocol, each with its wheels' turns and its marks, where both were measured.
    fn runs(&self, protocol: Protocol) -> impl Iterator<Item = Result<(&'a str, Wheels<f64>, Marks), CalibError>> {
        let runs = self.session.runs.iter().filter(move |run| run.info().protocol == Some(protocol));
        runs.filter_map(|run| {
            let measured = self.measured(run).transpose()?;
            Some(measured.map(|(wheel_rad, marks)| (run.info().id.as_str(), wheel_rad, marks)))
        })
    }

    /// The wheels' turns between the first and the last measurement, and the marks then.
    fn measured(&self, run: &RunView<'_>) -> Result<Option<(Wheels<f64>, Marks)>, CalibError> {
        let half_m = 0.5 * self.geometry.wheel_separation_m();
        let readings = &run.run().point_readings;
        if readings.is_empty() {
            // Poses: the contacts themselves are the marks. What the wheels turned before and after was not
            // measured.
            return Ok(EndPoses::of(run, self.session.robot, &self.geometry).map(|ends| {
                let contacts = Wheels { left: Point::new(0.0, half_m), right: Point::new(0.0, -half_m) };
                let (start, end) = (contacts.map(|p| ends.start * p), contacts.map(|p| ends.end * p));
                (ends.turned_rad(), Marks { start, end, outside_m: Wheels::both(0.0) })
            }));
        }
        let Some(outermost) = self.outermost else { return Ok(None) };
        let body = outermost.map(|(_, body)| body);
        Direct::check_marks(body)?;
        let start = outermost.map(|(point, _)| readings.iter().find(|reading| reading.point == point));
        let end = outermost.map(|(point, _)| readings.iter().rfind(|reading| reading.point == point));
        let both =
            |marks: Wheels<Option<&PointReading>>| Some(Wheels { left: marks.left?.room, right: marks.right?.room });
        let (Some(start), Some(end)) = (both(start), both(end)) else { return Ok(None) };
        // Marks are read while the robot stands, before and after all that its log has.
        let Some(wheel_rad) = run.wheel_turn_rad(self.session.robot) else { return Ok(None) };
        Ok(Some((wheel_rad, Marks { start, end, outside_m: outside_m(body, half_m) })))
    }
}

/// Distance of each mark outside its wheel's contact, metres.
fn outside_m(body: Wheels<Point>, half_m: f64) -> Wheels<f64> {
    Wheels { left: body.left.y_m - half_m, right: -body.right.y_m - half_m }
}

/// The outermost marked points, left and right: which, and where they are on the robot.
fn outermost(points: &[MarkedPoint]) -> Option<Wheels<(usize, Point)>> {
    let points = || points.iter().map(|point| point.body).enumerate();
    let by_y = |a: &(usize, Point), b: &(usize, Point)| a.1.y_m.total_cmp(&b.1.y_m);
    let ends = points().max_by(by_y).zip(points().min_by(by_y));
    ends.map(|(left, right)| Wheels { left, right })
}

impl Direct {
    /// Refuses marks that (6) does not hold for.
    fn check_marks(body: Wheels<Point>) -> Result<(), CalibError> {
        if body.left.y_m <= 0.0 || body.right.y_m >= 0.0 {
            return Err(Direct::not_applicable("it needs one marked point on each side of the robot".to_owned()));
        }
        if body.left.x_m.abs().max(body.right.x_m.abs()) > MAX_MARK_OFFSET_M {
            return Err(Direct::not_applicable("its marked points must stand on the axle's line (x_m = 0)".to_owned()));
        }
        Ok(())
    }
}

impl Direct {
    /// The method as the table of contents offers it.
    pub const DEFAULT: Self = Self { outliers: MedianMad { cut: MAD_CUT } };

    const NAME: &'static str = "direct";

    fn not_applicable(why: String) -> CalibError {
        CalibError::NotApplicable { method: Self::NAME, why }
    }

    /// Metres per radian of each wheel from every straight run: C of (9) with the wheel's turn in place of
    /// its pulses.
    ///
    /// # Errors
    /// [`CalibError::NotApplicable`] when marks are where (6) does not hold.
    pub fn straight_values<'a>(sessions: &[Session<'a>]) -> Result<Wheels<Vec<RunValue<'a>>>, CalibError> {
        let most = sessions.iter().map(|session| session.runs.len()).sum();
        let mut values = Wheels { left: Vec::with_capacity(most), right: Vec::with_capacity(most) };
        for session in sessions {
            // Both ends of a chord are read.
            let chord_sigma_m = 2_f64.sqrt() * mark_sigma_m(session);
            for measured in MarkReader::new(session)?.runs(Protocol::Straight) {
                let (run, wheel_rad, marks) = measured?;
                let m_per_rad = marks.m_per_rad(&Branching, wheel_rad);
                for side in Side::BOTH {
                    if wheel_rad[side] != 0.0 {
                        let stated_sigma = chord_sigma_m / wheel_rad[side].abs();
                        values[side].push(RunValue { run, value: m_per_rad[side], stated_sigma });
                    }
                }
            }
        }
        Ok(values)
    }

    /// The wheelbase from every spin, metres, given metres per radian of each wheel; with it the two wheels'
    /// turns over the robot's (∂B/∂C).
    ///
    /// # Errors
    /// [`CalibError::NotApplicable`] when marks are where (14) does not hold.
    pub fn spin_values<'a>(
        sessions: &[Session<'a>],
        m_per_rad: Wheels<f64>,
    ) -> Result<Vec<(RunValue<'a>, Wheels<f64>)>, CalibError> {
        let mut values = Vec::with_capacity(sessions.iter().map(|session| session.runs.len()).sum());
        for session in sessions {
            let mark_sigma_m = mark_sigma_m(session);
            let reader = MarkReader::new(session)?;
            for measured in reader.runs(Protocol::Spin) {
                let (run, wheel_rad, marks) = measured?;
                let Spin { turn_rad, wheel_separation_m: value, slope } =
                    marks.spin(&Branching, &reader.geometry, (wheel_rad, m_per_rad));
                if turn_rad.abs() > MIN_SPIN_RAD {
                    let stated_sigma = marks.stated_sigma_m(value / turn_rad, mark_sigma_m);
                    values.push((RunValue { run, value, stated_sigma }, slope));
                }
            }
        }
        Ok(values)
    }

    /// An outlier among the values of a quantity.
    fn rejected(&self, run: &str, of: &str) -> Rejected {
        let why = format!("{of}: more than {} robust standard deviations from the median", self.outliers.cut);
        Rejected { run: run.to_owned(), why }
    }

    /// Which values are no outliers, and their summary; outliers are added to `rejected`.
    fn filter<'v, 'a: 'v>(
        &self,
        values: impl ExactSizeIterator<Item = &'v RunValue<'a>> + Clone,
        of: &str,
        rejected: &mut Vec<Rejected>,
    ) -> (Vec<bool>, Option<Summary>) {
        let numbers: Vec<f64> = values.clone().map(|value| value.value).collect();
        let stated_sigma = values.clone().map(|value| value.stated_sigma).fold(0.0, f64::max);
        let keep = self.outliers.keep(&numbers, stated_sigma);
        for (value, _) in values.zip(&keep).filter(|(_, keep)| !**keep) {
            rejected.push(self.rejected(value.run, of));
        }
        let summary = Summary::of(retained(numbers.iter().copied(), &keep));
        (keep, summary)
    }
}

/// The values that are no outliers.
fn retained<'v>(
    values: impl Iterator<Item = f64> + Clone + 'v,
    keep: &'v [bool],
) -> impl Iterator<Item = f64> + Clone + 'v {
    values.zip(keep).filter(|(_, keep)| **keep).map(|(value, _)| value)
}

impl Method for Direct {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn about(&self) -> &'static str {
        "the paper's: straight runs give both sensitivities, spins the wheelbase (points or poses at both ends)"
    }

    /// The paper's runs: 500 mm forward and backward, about a turn each way. It gives no number of spins; 30
    /// are ours.
    fn protocol(&self) -> Vec<Schedule> {
        vec![
            Schedule::Straights { length_m: 0.5, runs: 82 },
            Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 30 },
        ]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, _) = nominal(Self::NAME, sessions)?;
        let straights = Self::straight_values(sessions)?;
        if straights.left.is_empty() || straights.right.is_empty() {
            return Err(Self::not_applicable(
                "no run with protocol = \"straight\" has its ends measured: drive straight runs and read two marks or the pose at both ends".to_owned(),
            ));
        }
        let mut runs_rejected = Vec::new();
        let mut radius = Wheels::both(None);
        for side in Side::BOTH {
            (_, radius[side]) = self.filter(straights[side].iter(), side.name(), &mut runs_rejected);
        }
        let (Some(left), Some(right)) = (radius.left, radius.right) else {
            return Err(Self::not_applicable("no straight run is left".to_owned()));
        };
        let m_per_rad = Wheels { left: left.mean, right: right.mean };

        let spins = Self::spin_values(sessions, m_per_rad)?;
        let (keep, base) = self.filter(spins.iter().map(|(value, _)| value), "wheelbase", &mut runs_rejected);
        let Some(base) = base else {
            return Err(CalibError::Unobservable {
                method: Self::NAME,
                parameter: Parameter::WheelSeparation,
                why: "no run with protocol = \"spin\" has its ends measured: add spins of about 360 degrees in each direction"
                    .to_owned(),
            });
        };

        let slope =
            Wheels::from_sides(|side| mean(retained(spins.iter().map(|(_, slope)| slope[side]), &keep)).unwrap_or(0.0));
        let runs_used = straights.left.len().max(straights.right.len()) + spins.len();
        Ok(Calibration { runs_used, runs_rejected, ..calibration(&robot, Wheels { left, right }, base, slope)? })
    }

    fn calibrate_replicates(&self, replicates: &Replicates) -> Vec<Result<Calibration, CalibError>> {
        lanes::calibrate(self, replicates)
    }
}

/// A calibration by the means of each wheel's metres per radian and of the wheelbase, whose mean moves by
/// `slope` with them.
fn calibration(
    robot: &NominalRobot,
    m_per_rad: Wheels<Summary>,
    base: Summary,
    slope: Wheels<f64>,
) -> Result<Calibration, CalibError> {
    let Wheels { left, right } = m_per_rad;
    let covariance = covariance(left.mean_variance(), right.mean_variance(), base.mean_variance(), slope);
    let geometry = drive(Direct::NAME, m_per_rad.map(|m_per_rad| 2.0 * m_per_rad.mean), base.mean)?;
    Ok(Calibration { covariance, ..Calibration::new(Direct::NAME, geometry, robot.ticks_per_rev) })
}

/// Covariance of both diameters and the base: the base inherits the radii's errors through `slope` and has
/// its own scatter.
fn covariance(left: Option<f64>, right: Option<f64>, base: Option<f64>, slope: Wheels<f64>) -> Option<Covariance> {
    let (left, right, base) = (left?, right?, base?);
    let base_var = base + slope.left * slope.left * left + slope.right * slope.right * right;
    Some(Covariance::from_row_slice(
        3,
        3,
        &[
            4.0 * left,
            0.0,
            2.0 * slope.left * left,
            0.0,
            4.0 * right,
            2.0 * slope.right * right,
            2.0 * slope.left * left,
            2.0 * slope.right * right,
            base_var,
        ],
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::{Increment, Pose, sinc};

    fn marks_after(increment: Increment, outside_m: Wheels<f64>) -> Marks {
        let half_m = 0.5 * 0.363;
        let start_pose = Pose::new(0.3, -0.2, 0.8);
        let body = Wheels {
            left: Point::new(0.0, half_m + outside_m.left),
            right: Point::new(0.0, -half_m - outside_m.right),
        };
        let end_pose = start_pose * increment.arc();
        Marks { start: body.map(|p| start_pose * p), end: body.map(|p| end_pose * p), outside_m }
    }

    #[test]
    fn paper_eq_6_the_arc_of_a_wheel_follows_from_the_chord_of_its_mark_forward_and_backward() {
        let outside_m = Wheels { left: 0.05, right: 0.07 };
        for distance_m in [0.5, -0.5] {
            for turn_rad in [0.0, 0.02, -0.02] {
                let increment = Increment { distance_m, turn_rad };
                let marks = marks_after(increment, outside_m);
                let measured_rad = marks.turn_rad(&Branching, 0.0);
                assert!((measured_rad - turn_rad).abs() < 1e-14);
                let arc_m =
                    Wheels { left: distance_m - 0.5 * 0.363 * turn_rad, right: distance_m + 0.5 * 0.363 * turn_rad };
                for side in Side::BOTH {
                    let chord_m = marks.start[side].distance_m(marks.end[side]) * distance_m.signum();
                    let outward = if side == Side::Left { 1.0 } else { -1.0 };
                    let found_m = chord_m / sinc(0.5 * measured_rad) + outward * outside_m[side] * measured_rad;
                    assert!((found_m - arc_m[side]).abs() < 1e-14, "{side:?} {distance_m} {turn_rad}");
                }
            }
        }
    }

    #[test]
    fn paper_eq_6_unsigned_is_off_backward() {
        // With chords unsigned a backward run takes the mark's offset the wrong way: 2·m·Δθ of 500 mm; ±0.03
        // % at m = 50 mm means Δθ = 1.5 mrad, the turn that the paper's wheels (1.0334 and 1.0322) make over
        // 500 pulses: 0.6/363 = 1.65 mrad.
        let marks = marks_after(Increment { distance_m: -0.5, turn_rad: 1.65e-3 }, Wheels::both(0.05));
        let arc_m: f64 = -0.5 - 0.5 * 0.363 * 1.65e-3;
        let chord_m = marks.start.left.distance_m(marks.end.left);
        let unsigned_m = chord_m / sinc(0.5 * 1.65e-3) + 0.05 * 1.65e-3;
        let error = unsigned_m / arc_m.abs() - 1.0;
        assert!((error.abs() - 3.3e-4).abs() < 1e-5, "{error}");
    }

    #[test]
    fn paper_eq_8_and_14_do_not_fold_and_hold_both_ways_round() {
        for turn_rad in [2.0, -2.0, 6.49, -6.49, 12.6] {
            let marks = marks_after(Increment { distance_m: 0.001, turn_rad }, Wheels::both(0.05));
            assert!((marks.turn_rad(&Branching, turn_rad * 0.97) - turn_rad).abs() < 1e-13, "{turn_rad}");
        }
    }
}
