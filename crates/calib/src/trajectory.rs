//! Dead reckoning of a run's whole log under a calibration, from where the instrument first measured the
//! robot.
//!
//! A plain calibration is integrated by the midpoint rule (paper, eq. 3). With terms of an extended model the
//! motion of an interval is that of the likelihood: an arc of counts and terms together. Terms and latency of
//! the instrument are taken out of what it measured, as the extrinsics of a calibration are.

use std::borrow::Cow;

use dataset::{RunView, Session};
use estimation::{LogDeadReckoning, LogPose, Model};
use kinematics::{DriveGeometry, Pose, Rule};
use model_term::ModelTerm;

use crate::named_calibration::NamedCalibration;
use crate::settings::{SAME_PLACE_M, TIME_TOLERANCE_S};
use crate::starts_by::StartsBy;

/// A calibration, and mean terms with their values where it is an extended model.
#[derive(Clone)]
pub struct AugmentedCalibration {
    /// Geometry and extrinsics.
    pub calibration: NamedCalibration,
    /// The terms, in their initial states.
    pub terms: Vec<Box<dyn ModelTerm>>,
    /// Values of the terms' parameters, in order.
    pub term_values: Vec<f64>,
}

impl From<NamedCalibration> for AugmentedCalibration {
    fn from(calibration: NamedCalibration) -> Self {
        Self { calibration, terms: Vec::new(), term_values: Vec::new() }
    }
}

impl AugmentedCalibration {
    /// The same with the instrument of a session ([`NamedCalibration::in_session`]).
    #[must_use]
    pub fn in_session(&self, session: &str) -> Cow<'_, Self> {
        if self.calibration.own_instruments.is_empty() {
            return Cow::Borrowed(self);
        }
        Cow::Owned(Self { calibration: self.calibration.clone().in_session(session), ..self.clone() })
    }

    fn model(&self, geometry: &DriveGeometry) -> Model {
        Model {
            body_from_sensor: self.calibration.body_from_sensor(),
            // Stamps are set back by it before.
            latency_s: 0.0,
            term_values: self.term_values.clone(),
            ..Model::of(geometry, 0)
        }
    }
}

impl std::fmt::Debug for AugmentedCalibration {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { calibration, term_values, .. } = self;
        formatter
            .debug_struct("AugmentedCalibration")
            .field("calibration", calibration)
            .field("term_values", term_values)
            .finish_non_exhaustive()
    }
}

/// A run's log as dead reckoning sees it.
pub(crate) struct Trajectory {
    /// Poses at the rows, and at the measurements where there are terms.
    pub(crate) log: Vec<(f64, Pose)>,
    /// Length of the path between them, metres.
    pub(crate) length_m: f64,
    /// Poses of the robot that the instrument measured.
    pub(crate) measured: Vec<(f64, Pose)>,
    /// What takes the log to the first of them, or why there is nothing to start from.
    pub(crate) moved: Result<Pose, &'static str>,
    /// How the run starts without a measured pose.
    pub(crate) starts_by: Option<StartsBy>,
}

/// A run's poses at the rows of its log, for other programs.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectedRun {
    /// Time from the run's start, seconds, and pose of the drive's centre, row by row.
    pub poses: Vec<(f64, Pose)>,
    /// Length of the path, metres.
    pub length_m: f64,
    /// Why the poses begin at the identity and not where the instrument first measured the robot.
    pub starts_at_identity_why: Option<&'static str>,
    /// They would differ if they began elsewhere: terms depend on heading or place in the room, and nothing
    /// says where the run starts.
    pub depends_on_start: bool,
}

/// Dead reckoning of a run under a calibration, at the rows of its log; from the first measured pose, or from
/// the identity where there is none. `driven_m` is as in [`crate::evaluate_runs`].
#[must_use]
pub fn corrected_run(
    session: &Session<'_>,
    run: &RunView<'_>,
    calibration: &AugmentedCalibration,
    driven_m: &mut f64,
) -> Option<CorrectedRun> {
    let before_m = *driven_m;
    let Trajectory { log, length_m, moved, .. } = Trajectory::under(session, run, Some(calibration), driven_m)?;
    let depends_on_start = moved.is_err() && depends_on_start(session, run, calibration, before_m);
    let mut rows_s = run.odometry().t_s.iter().peekable();
    let is_row = |(t_s, _): &(f64, Pose)| rows_s.next_if(|row_s| **row_s == *t_s).is_some();
    let by = moved.unwrap_or_default();
    let poses: Vec<(f64, Pose)> = log
        .into_iter()
        .filter(is_row)
        .map(|(t_s, pose)| (t_s, if by == Pose::IDENTITY { pose } else { by * pose }))
        .collect();
    (!poses.is_empty()).then_some(CorrectedRun {
        poses,
        length_m,
        starts_at_identity_why: moved.err(),
        depends_on_start,
    })
}

/// A run seen from above under one calibration: where dead reckoning and the instrument have the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct RunPath {
    /// Dead-reckoned poses at the rows of the log.
    pub rows: Vec<Pose>,
    /// Poses of the robot that the instrument measured.
    pub measured: Vec<Pose>,
    /// Their instants, seconds on the log's clock.
    pub measured_t_s: Vec<f64>,
    /// The dead-reckoned poses at the same instants; `None` outside of the log.
    pub at_measured: Vec<Option<Pose>>,
}

impl RunPath {
    /// From the first measured pose, or from the identity where there is none.
    pub(crate) fn of(run: &RunView<'_>, trajectory: &Trajectory) -> Self {
        let Trajectory { log, measured, moved, .. } = trajectory;
        let by = moved.unwrap_or_default();
        let mut row = 0;
        let at_measured = measured.iter().map(|(t_s, _)| at(log, *t_s, &mut row).map(|pose| by * pose)).collect();
        let mut rows_s = run.odometry().t_s.iter().peekable();
        let is_row = |(t_s, _): &&(f64, Pose)| rows_s.next_if(|row_s| **row_s == *t_s).is_some();
        let rows = log.iter().filter(is_row).map(|(_, pose)| by * *pose).collect();
        let (measured_t_s, measured) = measured.iter().copied().unzip();
        Self { rows, measured, measured_t_s, at_measured }
    }
}

/// Whether a run that begins at the identity ends elsewhere on it when it begins at another pose.
fn depends_on_start(
    session: &Session<'_>,
    run: &RunView<'_>,
    calibration: &AugmentedCalibration,
    driven_m: f64,
) -> bool {
    let end = |start: Pose| {
        let geometry = calibration.calibration.geometry(session.robot, session.robot.geometry().ok()?)?;
        let log = LogDeadReckoning::of(run, session.robot, &[], driven_m)?;
        let poses = log.poses(&calibration.model(&geometry), &mut calibration.terms.clone(), start);
        Some(start.to(poses.last()?.world_from_body))
    };
    let ends = [Pose::IDENTITY, Pose::new(1.0, 1.0, 1.0)].map(end);
    let [Some(one), Some(other)] = ends else { return false };
    !calibration.terms.is_empty() && one.position().distance_m(other.position()) > SAME_PLACE_M
}

impl Trajectory {
    /// Under a calibration, or the nominal values; `None` where it has no geometry for this robot.
    pub(crate) fn under(
        session: &Session<'_>,
        run: &RunView<'_>,
        calibration: Option<&AugmentedCalibration>,
        driven_m: &mut f64,
    ) -> Option<Self> {
        let nominal = session.robot.geometry().ok()?;
        let Some(augmented) = calibration else { return Some(Self::plain(session, run, nominal, None)) };
        let geometry = augmented.calibration.geometry(session.robot, nominal)?;
        Some(if augmented.terms.is_empty() {
            Self::plain(session, run, geometry, Some(&augmented.calibration))
        } else {
            Self::augmented(session, run, geometry, augmented, driven_m)
        })
    }

    /// Under a geometry, and the instrument of a calibration.
    fn plain(
        session: &Session<'_>,
        run: &RunView<'_>,
        geometry: DriveGeometry,
        calibration: Option<&NamedCalibration>,
    ) -> Self {
        let body_from_sensor = calibration.map_or(Pose::IDENTITY, NamedCalibration::body_from_sensor);
        let of_body = |(t_s, world_from_sensor): (f64, Pose)| (t_s, world_from_sensor * body_from_sensor.inverse());
        let measured: Vec<(f64, Pose)> = seen(run, calibration).into_iter().map(of_body).collect();
        let start = measured.first().map(|(_, world_from_body)| *world_from_body);
        let mut log = Vec::with_capacity(run.odometry().t_s.len());
        let visit = |t_s, pose| log.push((t_s, pose));
        run.dead_reckon(session.robot, &geometry, Rule::Midpoint, start.unwrap_or_default(), visit);
        let moved = match log.first() {
            None => Err("the run has no odometry"),
            // The start pose holds at the first truth instant, which may be later than the log's first row.
            Some((log_start_s, _)) => match measured.first() {
                None => Ok(Pose::IDENTITY),
                Some((first_s, start)) if *first_s > log_start_s + TIME_TOLERANCE_S => at(&log, *first_s, &mut 0)
                    .map(|dead_reckoned| *start * dead_reckoned.inverse())
                    .ok_or("the truth does not overlap the odometry in time"),
                Some(_) => Ok(Pose::IDENTITY),
            },
        };
        Self::of(run, log, measured, moved)
    }

    /// Under a geometry, terms, and an instrument with extrinsics and latency. `driven_m` is the distance
    /// driven in the session, and grows by this run.
    fn augmented(
        session: &Session<'_>,
        run: &RunView<'_>,
        geometry: DriveGeometry,
        augmented: &AugmentedCalibration,
        driven_m: &mut f64,
    ) -> Self {
        *driven_m = run.run().session_m.unwrap_or(*driven_m);
        let mut terms = augmented.terms.clone();
        let body_from_sensor = augmented.calibration.body_from_sensor();
        let model = augmented.model(&geometry);
        let seen = seen(run, Some(&augmented.calibration));
        let log_start_s = run.odometry().t_s.first().copied().unwrap_or(f64::NEG_INFINITY);
        // The first measurement holds at the log's first row where it was before it.
        let seen_s: Vec<f64> = seen
            .iter()
            .enumerate()
            .map(|(number, (t_s, _))| if number == 0 { t_s.max(log_start_s) } else { *t_s })
            .collect();
        let Some(log) = LogDeadReckoning::of(run, session.robot, &seen_s, *driven_m) else {
            return Self::of(run, Vec::new(), Vec::new(), Err("the run has no odometry"));
        };
        *driven_m += log.distance_m();
        let of_body = |world_from_sensor: Pose, offset: Pose| world_from_sensor * (offset * body_from_sensor).inverse();
        let start = seen.first().map(|(_, first)| of_body(*first, Pose::IDENTITY)).unwrap_or_default();
        let mut poses = log.poses(&model, &mut terms, start);
        let mut moved = Ok(Pose::IDENTITY);
        if let Some(((_, first), first_s)) = seen.first().zip(seen_s.first()) {
            let to_first = |poses: &[LogPose]| {
                let there = poses.iter().find(|pose| (pose.t_s - first_s).abs() <= TIME_TOLERANCE_S)?;
                Some(of_body(*first, there.offset.unwrap_or_default()) * there.world_from_body.inverse())
            };
            moved = to_first(&poses).ok_or("the truth does not overlap the odometry in time");
            if let Ok(by) = moved {
                // From where the log began: terms may depend on heading and place in the room.
                poses = log.poses(&model, &mut terms, by * start);
                moved = to_first(&poses).ok_or("the truth does not overlap the odometry in time");
            }
        }
        let mut row = 0;
        let measured = seen.iter().zip(&seen_s).map(|((measured_s, world_from_sensor), t_s)| {
            while row + 1 < poses.len() && poses[row].t_s < t_s - TIME_TOLERANCE_S {
                row += 1;
            }
            (*measured_s, of_body(*world_from_sensor, poses[row].offset.unwrap_or_default()))
        });
        let measured = measured.collect();
        let log = poses.iter().map(|pose| (pose.t_s, pose.world_from_body)).collect();
        Self::of(run, log, measured, moved)
    }

    fn of(
        run: &RunView<'_>,
        log: Vec<(f64, Pose)>,
        measured: Vec<(f64, Pose)>,
        moved: Result<Pose, &'static str>,
    ) -> Self {
        let distance_m = |pair: &[(f64, Pose)]| pair[1].1.position().distance_m(pair[0].1.position());
        let length_m = log.windows(2).map(distance_m).fold(0.0, |length_m, step_m| length_m + step_m);
        let moved = match measured.first() {
            None if run.run().truth.is_empty() => Err(
                "no absolute truth: wheel speeds, a gyro and partial measurements give no drift, and displacements no start pose",
            ),
            None => Err("position-only truth gives no start heading"),
            Some(_) => moved,
        };
        Self { log, length_m, measured, moved, starts_by: None }
    }
}

/// What the instrument measured, at the instants by the log's clock: stamps are set back by the latency that
/// a calibration has. Of what was measured before the log's first row, the last holds there.
fn seen(run: &RunView<'_>, calibration: Option<&NamedCalibration>) -> Vec<(f64, Pose)> {
    let mut seen = run.observed_poses();
    let latency_s = calibration.map_or(0.0, NamedCalibration::latency_s);
    if latency_s != 0.0 {
        let start_s = run.odometry().t_s.first().copied().unwrap_or(f64::NEG_INFINITY);
        seen.iter_mut().for_each(|(t_s, _)| *t_s -= latency_s);
        let before = seen.iter().take_while(|(t_s, _)| *t_s < start_s).count();
        seen.drain(..before.saturating_sub(1));
        if let Some((t_s, _)) = seen.first_mut().filter(|_| before > 0) {
            *t_s = start_s;
        }
    }
    seen
}

/// The dead-reckoned pose at an instant, `row` being a cursor that only moves forward; `None` outside of the
/// log.
pub(crate) fn at(log: &[(f64, Pose)], t_s: f64, row: &mut usize) -> Option<Pose> {
    while *row + 1 < log.len() && log[*row + 1].0 <= t_s + TIME_TOLERANCE_S {
        *row += 1;
    }
    let (row_s, pose) = *log.get(*row)?;
    if (t_s - row_s).abs() <= TIME_TOLERANCE_S {
        return Some(pose);
    }
    let (next_s, next) = *log.get(*row + 1)?;
    if t_s < row_s {
        return None;
    }
    let share = (t_s - row_s) / (next_s - row_s);
    let between = |a: f64, b: f64| a + share * (b - a);
    Some(Pose::new(between(pose.x_m, next.x_m), between(pose.y_m, next.y_m), between(pose.theta_rad, next.theta_rad)))
}
