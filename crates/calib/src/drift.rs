//! Drift of dead reckoning under a calibration, measured against the outside instrument.
//!
//! Each run starts from its first truth pose, is dead-reckoned (`trajectory.rs`) and is compared at the
//! truth's instants; between two rows of the log the pose is interpolated along the chord. Instants outside
//! of the log are left out. `without_start.rs` has runs without measured poses.

use dataset::{RunView, Session};
use kinematics::{Pose, wrap_to_pi};
use serde::Serialize;

use crate::named_calibration::NamedCalibration;
use crate::pose_error::{PathErrors, PoseErrorOptions, PoseErrorStatistics, PoseErrors};
use crate::starts_by::StartsBy;
use crate::trajectory::{AugmentedCalibration, RunPath, Trajectory, at};

/// Drift of every run under one calibration.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CalibrationDrift {
    /// The calibration's name; `nominal` for what the robot believes.
    pub name: String,
    /// Where the place and the latency of the instrument are from; `None` where it is at the drive's centre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mounting_from: Option<String>,
    /// Run by run.
    pub runs: Vec<RunDrift>,
    /// Largest position error at any instant of any run, metres.
    pub max_position_m: Option<f64>,
    /// Largest heading error at any instant of any run, radians.
    pub max_heading_rad: Option<f64>,
    /// Largest position error at a run's end, metres.
    pub max_final_position_m: Option<f64>,
    /// Largest heading error at a run's end, radians.
    pub max_final_heading_rad: Option<f64>,
    /// Mean position error at the runs' ends, metres.
    pub mean_final_position_m: Option<f64>,
    /// Mean heading error at the runs' ends, radians.
    pub mean_final_heading_rad: Option<f64>,
    /// 100 · sum of final position errors / sum of lengths.
    pub drift_percent: Option<f64>,
    /// Absolute pose errors of all poses of all runs, each run aligned by itself.
    pub ape: Option<PoseErrorStatistics>,
    /// Relative pose errors of all pairs of all runs.
    pub rpe: Option<PoseErrorStatistics>,
    /// Why something is null.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_null: Option<String>,
}

/// Drift of one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunDrift {
    /// The session, where several are evaluated together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dataset: Option<String>,
    /// The run's id.
    pub run: String,
    /// Path length of the drive's centre by the odometry, metres; turns on the spot have none.
    pub length_m: f64,
    /// Largest position error, metres.
    pub max_position_m: Option<f64>,
    /// Largest heading error, radians.
    pub max_heading_rad: Option<f64>,
    /// Position error at the last truth instant, metres.
    pub final_position_m: Option<f64>,
    /// Heading error at the last truth instant, radians.
    pub final_heading_rad: Option<f64>,
    /// Absolute pose errors.
    pub ape: Option<PoseErrorStatistics>,
    /// Relative pose errors.
    pub rpe: Option<PoseErrorStatistics>,
    /// How it starts without a measured pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub starts_by: Option<StartsBy>,
    /// The errors themselves, for the statistics over all runs.
    #[serde(skip)]
    path_errors: Option<PathErrors>,
    /// Why something is null.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why_null: Option<&'static str>,
}

/// What of runs is told besides their drift.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EvaluationOptions {
    /// Each run carries its session's name.
    pub name_runs: bool,
    /// How pose errors are taken, where they are wanted.
    pub pose_errors: Option<PoseErrorOptions>,
}

/// Evaluates dead reckoning of all sessions under one calibration, or under each session's own nominal values
/// when there is none.
///
/// `name_runs` adds each session's name to its runs.
#[must_use]
pub fn evaluate(sessions: &[Session<'_>], calibration: Option<&NamedCalibration>, name_runs: bool) -> CalibrationDrift {
    let augmented = calibration.cloned().map(AugmentedCalibration::from);
    let options = EvaluationOptions { name_runs, pose_errors: None };
    let runs = sessions.iter().flat_map(|session| evaluate_runs(session, augmented.as_ref(), &options, &mut 0.0));
    CalibrationDrift::of_runs(calibration, runs.collect())
}

/// The runs of one session under one calibration or extended model, or under its nominal values.
///
/// `driven_m` is the distance driven in the session before, metres, and grows by these runs: some effects
/// grow with it.
#[must_use]
pub fn evaluate_runs(
    session: &Session<'_>,
    calibration: Option<&AugmentedCalibration>,
    options: &EvaluationOptions,
    driven_m: &mut f64,
) -> Vec<RunDrift> {
    dead_reckoned(session, calibration, options, driven_m, |_, _| ()).into_iter().map(|(drift, _)| drift).collect()
}

/// The same with each run's path, which is what drifts: one dead reckoning gives both. `None` where the
/// calibration has no geometry for this robot.
#[must_use]
pub fn evaluate_runs_and_paths(
    session: &Session<'_>,
    calibration: Option<&AugmentedCalibration>,
    options: &EvaluationOptions,
    driven_m: &mut f64,
) -> Vec<(RunDrift, Option<RunPath>)> {
    dead_reckoned(session, calibration, options, driven_m, RunPath::of)
}

/// The drift of every run, and what is kept of its trajectory.
fn dead_reckoned<T>(
    session: &Session<'_>,
    calibration: Option<&AugmentedCalibration>,
    options: &EvaluationOptions,
    driven_m: &mut f64,
    keep: impl Fn(&RunView<'_>, &Trajectory) -> T,
) -> Vec<(RunDrift, Option<T>)> {
    let of = |run| {
        let (mut drift, kept) = match Trajectory::under(session, run, calibration, driven_m) {
            Some(trajectory) => {
                let trajectory = trajectory.beside_parts_of_poses(run, calibration.map(|of| &of.calibration));
                let kept = keep(run, &trajectory);
                (run_drift(run, trajectory, options.pose_errors.as_ref()), Some(kept))
            }
            None => (unknown(run, 0.0, "the calibration has no value that this robot's geometry needs"), None),
        };
        drift.dataset = options.name_runs.then(|| session.name.to_owned());
        (drift, kept)
    };
    session.runs.iter().map(of).collect()
}

/// One run along a path that something else dead-reckoned, measured as under a calibration: `path` makes it
/// from the pose at the log's first row and the distance driven in the session before, metres.
///
/// Both begin at the same pose and meet the first measurement; the length is that under the calibration.
#[must_use]
pub fn evaluate_path(
    session: &Session<'_>,
    run: &RunView<'_>,
    calibration: &AugmentedCalibration,
    options: &EvaluationOptions,
    driven_m: &mut f64,
    path: impl FnOnce(Pose, f64) -> Option<Vec<(f64, Pose)>>,
) -> RunDrift {
    let before_m = *driven_m;
    let Some(mut trajectory) = Trajectory::under(session, run, Some(calibration), driven_m) else {
        return unknown(run, 0.0, "the calibration has no value that this robot's geometry needs");
    };
    trajectory = trajectory.beside_parts_of_poses(run, Some(&calibration.calibration));
    let (Ok(moved), Some((_, first)), Some((t_s, measured))) =
        (trajectory.moved, trajectory.log.first(), trajectory.measured.first().copied())
    else {
        return run_drift(run, trajectory, options.pose_errors.as_ref());
    };
    let Some(log) = path(moved * *first, before_m) else {
        return unknown(run, trajectory.length_m, "its wheels are not logged as counts");
    };
    let log_start_s = log.first().map_or(t_s, |(start_s, _)| *start_s);
    let to_first = |there: Pose| measured * there.inverse();
    let no_overlap = "the truth does not overlap the odometry in time";
    trajectory.moved = at(&log, t_s.max(log_start_s), &mut 0).map(to_first).ok_or(no_overlap);
    trajectory.log = log;
    run_drift(run, trajectory, options.pose_errors.as_ref())
}

impl CalibrationDrift {
    /// Whether it drifts by at most so many per cent; a drift that is no number, or not known, does not.
    #[must_use]
    pub fn is_at_most(&self, percent: f64) -> bool {
        self.drift_percent.is_some_and(|drift| drift <= percent)
    }

    /// The drift of runs that were evaluated under one calibration.
    #[must_use]
    pub fn of_runs(calibration: Option<&NamedCalibration>, runs: Vec<RunDrift>) -> Self {
        let name = calibration.map_or_else(|| "nominal".to_owned(), |calibration| calibration.name.clone());
        summarise(name, runs)
    }
}

fn unknown(run: &RunView<'_>, length_m: f64, why: &'static str) -> RunDrift {
    RunDrift {
        dataset: None,
        run: run.info().id.clone(),
        length_m,
        max_position_m: None,
        max_heading_rad: None,
        final_position_m: None,
        final_heading_rad: None,
        ape: None,
        rpe: None,
        starts_by: None,
        path_errors: None,
        why_null: Some(why),
    }
}

fn run_drift(run: &RunView<'_>, trajectory: Trajectory, pose_errors: Option<&PoseErrorOptions>) -> RunDrift {
    let Trajectory { log, length_m, measured, moved, starts_by } = trajectory;
    let has_headings = starts_by != Some(StartsBy::FirstTenth);
    let moved = match moved {
        Ok(moved) => moved,
        Err(why) => return unknown(run, length_m, why),
    };
    let identity = moved == Pose::IDENTITY;
    let (mut row, mut largest, mut last) = (0, None::<(f64, f64)>, None);
    let (mut reference, mut estimate) = (Vec::new(), Vec::new());
    for (t_s, measured) in &measured {
        let Some(dead_reckoned) = at(&log, *t_s, &mut row) else { continue };
        let dead_reckoned = if identity { dead_reckoned } else { moved * dead_reckoned };
        let position_m = dead_reckoned.position().distance_m(measured.position());
        let heading_rad = wrap_to_pi(dead_reckoned.theta_rad - measured.theta_rad).abs();
        let (max_position_m, max_heading_rad) = largest.unwrap_or((0.0, 0.0));
        largest = Some((position_m.max(max_position_m), heading_rad.max(max_heading_rad)));
        last = Some((position_m, heading_rad));
        if pose_errors.is_some() {
            reference.push(*measured);
            estimate.push(dead_reckoned);
        }
    }
    if largest.is_none() {
        return unknown(run, length_m, "the truth does not overlap the odometry in time");
    }
    // Sums and squares follow.
    let is_number = |value: f64| (value * value).is_finite();
    let ends = [largest, last].into_iter().flatten().flat_map(|(position_m, heading_rad)| [position_m, heading_rad]);
    if !ends.chain([length_m]).all(is_number) {
        return unknown(run, 0.0, "its lengths are beyond the range of numbers: look for a wrong unit or count");
    }
    let path_errors = pose_errors
        .map(|options| PathErrors::of(&reference, &estimate, options))
        .map(|errors| if has_headings { errors } else { errors.of_positions() });
    let heading = |of: Option<(f64, f64)>| of.filter(|_| has_headings).map(|(_, heading_rad)| heading_rad);
    let statistics = |of: fn(&PathErrors) -> &Result<PoseErrors, &'static str>| {
        path_errors.as_ref().map(|errors| PoseErrorStatistics::of(of(errors).as_ref().map_err(|why| *why)))
    };
    RunDrift {
        dataset: None,
        run: run.info().id.clone(),
        length_m,
        max_position_m: largest.map(|largest| largest.0),
        max_heading_rad: heading(largest),
        final_position_m: last.map(|last| last.0),
        final_heading_rad: heading(last),
        ape: statistics(|errors| &errors.absolute),
        rpe: statistics(|errors| &errors.relative),
        starts_by,
        path_errors,
        why_null: None,
    }
}

fn summarise(name: String, runs: Vec<RunDrift>) -> CalibrationDrift {
    let values = |of: fn(&RunDrift) -> Option<f64>| runs.iter().filter_map(of).collect::<Vec<f64>>();
    let largest = |of| values(of).into_iter().reduce(f64::max);
    let mean = |of| {
        let values = values(of);
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    };
    let measured = || runs.iter().filter(|run| run.final_position_m.is_some());
    let length_m: f64 = measured().map(|run| run.length_m).sum();
    let final_m: f64 = measured().filter_map(|run| run.final_position_m).sum();
    let drift_percent = (length_m > 0.0 && measured().next().is_some()).then(|| 100.0 * final_m / length_m);
    let why_null = if measured().next().is_none() {
        runs.iter().find_map(|run| run.why_null).map(str::to_owned)
    } else if drift_percent.is_none() {
        Some("the runs have no length: turns on the spot only".to_owned())
    } else {
        None
    };
    let pooled = |of: fn(&PathErrors) -> &Result<PoseErrors, &'static str>| {
        let mut each = runs.iter().filter_map(|run| run.path_errors.as_ref()).map(of).peekable();
        each.peek()?;
        let (mut all, mut why) = (PoseErrors::default(), None);
        for errors in each {
            match errors {
                Ok(errors) => all.extend(errors),
                Err(first) => why = why.or(Some(*first)),
            }
        }
        let known = if all.translation_m.is_empty() { why.map_or(Ok(&all), Err) } else { Ok(&all) };
        Some(PoseErrorStatistics::of(known))
    };
    CalibrationDrift {
        name,
        mounting_from: None,
        ape: pooled(|errors| &errors.absolute),
        rpe: pooled(|errors| &errors.relative),
        max_position_m: largest(|run| run.max_position_m),
        max_heading_rad: largest(|run| run.max_heading_rad),
        max_final_position_m: largest(|run| run.final_position_m),
        max_final_heading_rad: largest(|run| run.final_heading_rad),
        mean_final_position_m: mean(|run| run.final_position_m),
        mean_final_heading_rad: mean(|run| run.final_heading_rad),
        drift_percent,
        why_null,
        runs,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dataset::{Dataset, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog};
    use kinematics::Wheels;

    /// A straight metre in ten rows on wheels of 1 mm a tick, whose truth is 2 % longer and stamped between
    /// the rows.
    fn dataset(truth: Vec<TruthSample>) -> Dataset {
        let ticks: Vec<i64> = (0..=10).map(|k| 100 * k).collect();
        let run = Run {
            info: RunInfo { id: "run-01".to_owned(), ..RunInfo::default() },
            odometry: Odometry {
                t_s: (0..=10).map(f64::from).collect(),
                wheels: WheelLog::Ticks(Wheels::both(ticks)),
                ..Odometry::default()
            },
            truth,
            ..Run::default()
        };
        Dataset {
            provenance: Provenance::default(),
            robot: NominalRobot {
                left_wheel_diameter_m: 1.0 / std::f64::consts::PI,
                right_wheel_diameter_m: 1.0 / std::f64::consts::PI,
                wheel_separation_m: 0.3,
                ticks_per_rev: Some(1000.0),
                counter_bits: None,
            },
            truth_noise: TruthNoise::default(),
            points: Vec::new(),
            runs: vec![run],
        }
    }

    fn truth(theta_rad: Option<f64>) -> Vec<TruthSample> {
        [0.0, 2.5, 10.0, 11.0].map(|t_s| TruthSample::new(t_s, 5.0, 1.0 + 0.102 * t_s, theta_rad)).to_vec()
    }

    #[test]
    fn drift_is_measured_from_the_first_truth_pose_at_the_truths_instants() {
        let dataset = dataset(truth(Some(std::f64::consts::FRAC_PI_2)));
        let drift = evaluate(&[dataset.session()], None, false);
        let run = &drift.runs[0];
        // 2 % of a metre at the end; the sample at 11 s is after the log's end and left out. A few roundings.
        assert!((run.final_position_m.expect("poses") - 0.02).abs() < 1e-14);
        assert!((run.max_position_m.expect("poses") - 0.02).abs() < 1e-14);
        assert!((run.length_m - 1.0).abs() < 1e-14);
        assert!((drift.drift_percent.expect("length") - 2.0).abs() < 1e-12);
        assert!(run.max_heading_rad.expect("poses") < 1e-15);
    }

    #[test]
    fn between_rows_the_pose_is_interpolated() {
        let dataset = dataset(truth(Some(std::f64::consts::FRAC_PI_2))[..2].to_vec());
        let drift = evaluate(&[dataset.session()], None, false);
        assert!((drift.runs[0].final_position_m.expect("poses") - 0.005).abs() < 1e-14);
    }

    #[test]
    fn truth_that_begins_late_starts_the_odometry_there() {
        let dataset = dataset(truth(Some(std::f64::consts::FRAC_PI_2))[1..].to_vec());
        let drift = evaluate(&[dataset.session()], None, false);
        assert!((drift.runs[0].final_position_m.expect("poses") - 0.015).abs() < 1e-14);
    }

    #[test]
    fn a_calibration_with_the_right_scale_does_not_drift_and_a_mounted_instrument_is_taken_into_account() {
        let mut values: std::collections::BTreeMap<String, f64> =
            [("left_m_per_tick".to_owned(), 1.02e-3), ("right_m_per_tick".to_owned(), 1.02e-3)].into();
        values.insert("sensor_theta_rad".to_owned(), 0.2);
        let calibration = NamedCalibration::new("right".to_owned(), values);
        let dataset = dataset(truth(Some(std::f64::consts::FRAC_PI_2 + 0.2)));
        let drift = evaluate(&[dataset.session()], Some(&calibration), true);
        assert!(drift.max_position_m.expect("poses") < 1e-14);
        assert!(drift.max_heading_rad.expect("poses") < 1e-15);
        assert_eq!(drift.runs[0].dataset.as_deref(), Some("dataset"));
    }

    #[test]
    fn what_the_truth_cannot_give_is_null_with_a_reason() {
        // Positions of a robot that stands have no heading to start from.
        let standing = [0.0, 5.0, 10.0].map(|t_s| TruthSample::new(t_s, 5.0, 1.0, None)).to_vec();
        for (dataset, reason) in [(dataset(standing), "does not move"), (dataset(Vec::new()), "no absolute truth")] {
            let drift = evaluate(&[dataset.session()], None, false);
            assert_eq!((drift.drift_percent, drift.max_position_m), (None, None));
            assert!(drift.why_null.expect("a reason").contains(reason));
            assert!(drift.runs[0].why_null.expect("a reason").contains(reason));
        }
    }

    #[test]
    fn positions_alone_drift_from_the_heading_of_their_first_tenth() {
        // Along y, 2 % longer than by the counts, in steps of a twentieth.
        let positions = (0..=20).map(|k| TruthSample::new(0.5 * f64::from(k), 5.0, 1.0 + 0.051 * f64::from(k), None));
        let dataset = dataset(positions.collect());
        let options = EvaluationOptions { name_runs: false, pose_errors: Some(PoseErrorOptions::default()) };
        let runs = evaluate_runs(&dataset.session(), None, &options, &mut 0.0);
        // The mean of the first tenth, at a twentieth, is where the path is laid on.
        assert!((runs[0].final_position_m.expect("positions") - 0.02 * 0.95).abs() < 1e-12, "{:?}", runs[0]);
        assert_eq!((runs[0].final_heading_rad, runs[0].max_heading_rad), (None, None));
        let ape = runs[0].ape.as_ref().expect("wanted");
        assert!(ape.translation_m.is_some() && ape.rotation_rad.is_none(), "{ape:?}");
        assert!(runs[0].rpe.as_ref().expect("wanted").why_null.is_some());
    }

    #[test]
    fn motions_alone_are_chained_and_what_none_of_them_saw_is_the_paths() {
        let mut dataset = dataset(Vec::new());
        // Two of 0.4 m, each 2 % longer, and 0.2 m between them that nothing saw; one begins too early.
        dataset.runs[0].displacements = [(0.0, 4.0, 0.408), (3.0, 5.0, 9.0), (6.0, 10.0, 0.408)]
            .map(|(t0_s, t1_s, dx_m)| dataset::Displacement { t0_s, t1_s, dx_m, dy_m: 0.0, dtheta_rad: 0.0 })
            .to_vec();
        let drift = evaluate(&[dataset.session()], None, false);
        assert!((drift.drift_percent.expect("chained") - 1.6).abs() < 1e-9, "{drift:?}");
        assert!(drift.runs[0].final_heading_rad.expect("chained") < 1e-12);
    }
}
