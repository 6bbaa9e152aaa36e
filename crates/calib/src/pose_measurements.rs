//! An outside instrument's poses of a run: measurements at a spacing, and how the wheels turned between them.
//!
//! Twenty measurements a second carry little more information on the wheels than one a metre: the errors of
//! the instrument's clock and of a start from standstill are in all of them.

use dataset::{NominalRobot, RunView, Session};
use kinematics::{DriveGeometry, Pose, Wheels, unwrap_near};

use crate::estimate::{CalibError, Rejected};
use estimation::WheelAngleInterpolator;

/// How far the nominal robot moves from measurement to measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spacing {
    /// Travel of its centre, metres, …
    pub(crate) every_m: f64,
    /// … or turn, whichever comes first, radians.
    pub(crate) every_rad: f64,
}

impl Spacing {
    /// From the first measurement within the log to the last one.
    pub(crate) const ENDS: Self = Self { every_m: f64::INFINITY, every_rad: f64::INFINITY };
}

/// A later measurement.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PoseMeasurement {
    /// Turns of the wheels since the measurement before, row by row, radians.
    pub(crate) wheel_rad: Vec<Wheels<f64>>,
    /// The measured pose in the room; whole turns since the start are counted.
    pub(crate) pose: Pose,
}

/// The pose measurements of one run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PoseMeasurements<'a> {
    /// The run's id.
    pub(crate) run: &'a str,
    /// The first measurement within the log.
    pub(crate) start: Pose,
    /// Those after it, the last within the log included.
    pub(crate) later: Vec<PoseMeasurement>,
}

impl<'a> PoseMeasurements<'a> {
    /// The pose measurements of a run; `None` when fewer than two poses lie within its log, or the log has
    /// gaps.
    pub(crate) fn at(
        run: &RunView<'a>,
        track: &WheelAngleInterpolator<'_>,
        nominal: &DriveGeometry,
        spacing: Spacing,
    ) -> Option<Self> {
        let poses = run.observed_poses();
        let spanned = |pair: &[(f64, Pose)]| track.spans(pair[0].0, pair[1].0);
        let begins = poses.windows(2).position(spanned).filter(|_| run.info().continuous)?;
        let within = 2 + poses[begins + 1..].windows(2).take_while(|pair| spanned(pair)).count();
        let (mut from_s, start) = poses[begins];
        let (mut last_s, mut theta_rad) = (from_s, start.theta_rad);
        let (mut distance_m, mut turn_rad, mut later) = (0.0, 0.0, Vec::new());
        for (number, &(t_s, measured)) in poses[begins..begins + within].iter().enumerate().skip(1) {
            let mut turned_rad = 0.0;
            for rad in track.steps(last_s, t_s)? {
                let step = nominal.increment(nominal.m_per_rad().zip_with(rad, |m_per_rad, rad| m_per_rad * rad));
                distance_m += step.distance_m.abs();
                turn_rad += step.turn_rad.abs();
                turned_rad += step.turn_rad;
            }
            last_s = t_s;
            // Whole turns come from the wheels, a pose at a time.
            theta_rad = unwrap_near(measured.theta_rad, theta_rad + turned_rad);
            if distance_m >= spacing.every_m || turn_rad >= spacing.every_rad || number + 1 == within {
                later.push(PoseMeasurement {
                    wheel_rad: track.steps(from_s, t_s)?,
                    pose: Pose { theta_rad, ..measured },
                });
                (from_s, distance_m, turn_rad) = (t_s, 0.0, 0.0);
            }
        }
        Some(Self { run: &run.info().id, start, later })
    }

    /// The pose measurements of every run of all sessions that has two poses or more, and the runs whose
    /// poses cannot be used.
    ///
    /// # Errors
    /// [`CalibError`] when a robot's nominal values are no drive, or no run is left.
    pub(crate) fn of_all(
        method: &'static str,
        sessions: &[Session<'a>],
        spacing: Spacing,
    ) -> Result<(Vec<Self>, Vec<Rejected>), CalibError> {
        let (mut measurements, mut rejected) = (Vec::new(), Vec::new());
        for session in sessions {
            let nominal = session.robot.geometry().map_err(|source| CalibError::NotADrive { method, source })?;
            for run in session.runs.iter().filter(|run| run.observed_ends().is_some()) {
                let Some(track) = WheelAngleInterpolator::of(run, session.robot) else { continue };
                match Self::at(run, &track, &nominal, spacing) {
                    Some(found) => measurements.push(found),
                    None => rejected.push(Rejected { run: run.info().id.clone(), why: NO_MEASUREMENTS.to_owned() }),
                }
            }
        }
        if measurements.is_empty() {
            let first = rejected.first().map(|rejected| format!("; {}: {}", rejected.run, rejected.why));
            let why = format!("{NO_POSES}{}", first.unwrap_or_default());
            return Err(CalibError::NotApplicable { method, why });
        }
        Ok((measurements, rejected))
    }
}

/// The first and the last measured pose of a run, and how the wheels turned in between.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EndPoses {
    pub(crate) start: Pose,
    /// Whole turns since the start are counted.
    pub(crate) end: Pose,
    wheel_rad: Vec<Wheels<f64>>,
}

impl EndPoses {
    /// The first and the last measurement within the log; `None` as for [`PoseMeasurements::at`].
    pub(crate) fn of(run: &RunView<'_>, robot: &NominalRobot, nominal: &DriveGeometry) -> Option<Self> {
        let PoseMeasurements { start, mut later, .. } =
            PoseMeasurements::at(run, &WheelAngleInterpolator::of(run, robot)?, nominal, Spacing::ENDS)?;
        let PoseMeasurement { wheel_rad, pose } = later.pop()?;
        Some(Self { start, end: pose, wheel_rad })
    }

    /// Turn of each wheel, radians.
    pub(crate) fn turned_rad(&self) -> Wheels<f64> {
        self.wheel_rad.iter().fold(Wheels::both(0.0), |sum, rad| sum.zip_with(*rad, |sum, rad| sum + rad))
    }

    /// The end of the run by dead reckoning from the origin, by the midpoint rule (paper, eq. 3).
    pub(crate) fn dead_reckoned(&self, geometry: &DriveGeometry) -> Pose {
        self.wheel_rad.iter().fold(Pose::IDENTITY, |pose, rad| {
            pose * geometry.increment(geometry.m_per_rad().zip_with(*rad, |m_per_rad, rad| m_per_rad * rad)).midpoint()
        })
    }
}

const NO_POSES: &str = "no run has the robot's pose at two instants (truth.csv with headings, or two marked points) and wheels that are logged";
const NO_MEASUREMENTS: &str = "its log has gaps, or does not span two of its poses";

#[cfg(test)]
mod tests {
    use super::*;
    use dataset::{Dataset, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog};

    /// Wheels of 1 m circumference, 0.25 m a second straight for 8 s, then on the spot by a radian a second
    /// for 20 s; poses every half second, and one farther outside of the log on either side than its rows
    /// reach, headings wrapped.
    fn dataset(continuous: bool) -> Dataset {
        let rows = 29;
        let (metre, spin) = (1.0, 0.25);
        let mut angles = Wheels { left: vec![0.0], right: vec![0.0] };
        for row in 1..rows {
            let travel_m = if row <= 8 { (0.25, 0.25) } else { (-0.5 * spin, 0.5 * spin) };
            let rad = std::f64::consts::TAU / metre;
            angles.left.push(angles.left[row - 1] + travel_m.0 * rad);
            angles.right.push(angles.right[row - 1] + travel_m.1 * rad);
        }
        let within = (0..56).map(|k| 0.25 + 0.5 * f64::from(k));
        let truth = [-0.75].into_iter().chain(within).chain([29.0]).map(|t_s: f64| {
            let turned = (t_s - 8.0).clamp(0.0, 20.0);
            TruthSample::new(t_s, 0.25 * t_s.clamp(0.0, 8.0), 0.0, Some(kinematics::wrap_to_pi(turned + 3.0)))
        });
        let odometry =
            Odometry { t_s: (0..29).map(f64::from).collect(), wheels: WheelLog::Angles(angles), ..Odometry::default() };
        let info = RunInfo { id: "a".to_owned(), continuous, ..RunInfo::default() };
        let diameter_m = metre / std::f64::consts::PI;
        Dataset {
            provenance: Provenance::default(),
            robot: NominalRobot {
                left_wheel_diameter_m: diameter_m,
                right_wheel_diameter_m: diameter_m,
                wheel_separation_m: 0.25,
                ticks_per_rev: None,
                counter_bits: None,
            },
            truth_noise: TruthNoise::default(),
            points: Vec::new(),
            runs: vec![Run { info, odometry, truth: truth.collect(), ..Run::default() }],
        }
    }

    #[test]
    fn measurements_are_spaced_end_with_the_log_and_count_whole_turns() {
        let dataset = dataset(true);
        let spacing = Spacing { every_m: 0.5, every_rad: 4.0 };
        let (measurements, rejected) = PoseMeasurements::of_all("test", &[dataset.session()], spacing).expect("poses");
        assert!(rejected.is_empty());
        let measurements = &measurements[0];
        // The first pose within the log is at 0.25 s; every 2 s, or every 4 s of turning, the last one at
        // 27.75 s.
        assert_eq!(measurements.start.x_m, 0.0625);
        let xs: Vec<f64> = measurements.later.iter().take(4).map(|measurement| measurement.pose.x_m).collect();
        assert_eq!(xs, [0.5625, 1.0625, 1.5625, 2.0]);
        let last = measurements.later.last().expect("measurements");
        assert!((last.pose.theta_rad - (3.0 + 19.75)).abs() < 1e-12, "{}", last.pose.theta_rad);
        let turned: f64 = measurements
            .later
            .iter()
            .flat_map(|measurement| &measurement.wheel_rad)
            .map(|rad| rad.right - rad.left)
            .sum();
        // 19.75 rad over 0.25 m on wheels of 1/2π m radius.
        assert!((turned / std::f64::consts::TAU * 1.0 / 0.25 - 19.75).abs() < 1e-12);
        // From end to end.
        assert_eq!(
            PoseMeasurements::of_all("test", &[dataset.session()], Spacing::ENDS).expect("poses").0[0].later.len(),
            1
        );
    }

    #[test]
    fn a_log_with_gaps_and_one_that_begins_after_its_poses_are_rejected() {
        let spacing = Spacing { every_m: 0.5, every_rad: 4.0 };
        let mut late = dataset(true);
        late.runs[0].odometry.t_s.iter_mut().for_each(|t_s| *t_s += 100.0);
        for dataset in [dataset(false), late] {
            let why = PoseMeasurements::of_all("test", &[dataset.session()], spacing)
                .expect_err("no measurements")
                .to_string();
            assert!(
                why.contains("two instants") && why.ends_with("a: its log has gaps, or does not span two of its poses"),
                "{why}"
            );
        }
    }
}
