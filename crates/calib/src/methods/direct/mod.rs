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

mod formulas;
mod lanes;

use dataset::{LANES, PointReading, Protocol, Replicates, RunView, Session};
use kinematics::{Branching, DriveGeometry, Point, Side, Wheels};
use motion_programs::Schedule;

use formulas::{Marks, NAME, Spin, WHEELBASE, calibration, check_marks, not_applicable, outermost, outlier, outside_m};

use crate::estimate::{CalibError, Calibration, Method, Parameter, Rejected, nominal};
use crate::pose_measurements::EndPoses;
use crate::robust::{MedianMad, Summary, mean};
use crate::settings::{MAD_CUT, MIN_SPIN_RAD};

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

impl<'s, 'a> MarkReader<'s, 'a> {
    fn new(session: &'s Session<'a>) -> Result<Self, CalibError> {
        let geometry = session.robot.geometry().map_err(|source| CalibError::NotADrive { method: NAME, source })?;
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
        check_marks(body)?;
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

impl Direct {
    /// The method as the table of contents offers it.
    pub const DEFAULT: Self = Self { outliers: MedianMad { cut: MAD_CUT } };

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
                    marks.spin(&Branching, &reader.geometry, wheel_rad, m_per_rad);
                if turn_rad.abs() > MIN_SPIN_RAD {
                    let stated_sigma = marks.stated_sigma_m(value / turn_rad, mark_sigma_m);
                    values.push((RunValue { run, value, stated_sigma }, slope));
                }
            }
        }
        Ok(values)
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
            rejected.push(outlier(&self.outliers, value.run, of));
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
        NAME
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
        let (robot, _) = nominal(NAME, sessions)?;
        let straights = Self::straight_values(sessions)?;
        if straights.left.is_empty() || straights.right.is_empty() {
            return Err(not_applicable(
                "no run with protocol = \"straight\" has its ends measured: drive straight runs and read two marks or the pose at both ends".to_owned(),
            ));
        }
        let mut runs_rejected = Vec::new();
        let mut radius = Wheels::both(None);
        for side in Side::BOTH {
            (_, radius[side]) = self.filter(straights[side].iter(), side.name(), &mut runs_rejected);
        }
        let (Some(left), Some(right)) = (radius.left, radius.right) else {
            return Err(not_applicable("no straight run is left".to_owned()));
        };
        let m_per_rad = Wheels { left: left.mean, right: right.mean };

        let spins = Self::spin_values(sessions, m_per_rad)?;
        let (keep, base) = self.filter(spins.iter().map(|(value, _)| value), WHEELBASE, &mut runs_rejected);
        let Some(base) = base else {
            return Err(CalibError::Unobservable {
                method: NAME,
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

    fn calibrate_lanes(&self, replicates: &Replicates) -> [Option<Result<Calibration, CalibError>>; LANES] {
        lanes::calibrations(&self.outliers, replicates)
    }
}
