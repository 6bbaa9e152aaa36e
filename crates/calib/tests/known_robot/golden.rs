//! Every number that the crate makes of logs with errors, against those that it made before: `golden.txt`.
//!
//! A change that moves a number shows here, whatever it moves. `scatter.rs` and `exact.rs` say that the
//! numbers are right.

use std::fmt::Write;

use calib::methods::{censi::Censi, linear, umbmark};
use calib::{
    Alignment, AugmentedCalibration, CalibrationReport, Delta, DeltaUnit, EvaluationOptions, METHODS, Method,
    MethodReport, Names, Parameter, PoseErrorOptions, compare, corrected_run, evaluate_runs_and_paths, nominal_value,
    path_covariances,
};
use dataset::{Dataset, Protocol};
use kinematics::Pose;

use crate::golden_numbers::assert_unmoved;
use crate::log::Log;

/// The logs: poses; ticks with an instrument beside the axle whose stamps are late, and one run of another
/// robot; marks at both ends.
fn sets() -> [(&'static str, Dataset); 3] {
    let beside =
        Log { body_from_sensor: Pose::new(0.12, -0.05, 0.3), latency_s: 0.03, is_ticks: true, ..Log::noisy(2) };
    let mut beside = beside.dataset();
    let faulty = &mut beside.runs[1];
    for sample in &mut faulty.truth {
        sample.x_m *= 1.1;
        sample.y_m *= 1.1;
    }
    let mut marks = Log { is_marks: true, ..Log::noisy(3) }.dataset();
    // A mark that was misread by what is stated of readings.
    marks.truth_noise.sigma_xy_m = Some(0.03);
    marks.runs[2].point_readings[3].room.x_m += 0.05;
    [("poses", Log::noisy(1).dataset()), ("beside", beside), ("marks", marks)]
}

/// Runs of some protocols alone.
fn only(set: &Dataset, protocols: &[Protocol]) -> Dataset {
    let runs = set.runs.iter().filter(|run| run.info.protocol.is_some_and(|of| protocols.contains(&of)));
    Dataset { runs: runs.cloned().collect(), ..set.clone() }
}

fn all_methods() -> Vec<(String, &'static dyn Method)> {
    const GENERAL: linear::Linear =
        linear::Linear { form: linear::Form::General, readings: linear::Readings::EndPoses };
    const ALL_POSES: linear::Linear = linear::Linear { form: linear::Form::Physical, readings: linear::Readings::All };
    const BY_Y: umbmark::Umbmark = umbmark::Umbmark { form: umbmark::Form::Y };
    let mut all: Vec<(String, &'static dyn Method)> =
        METHODS.iter().map(|method| (method.name().to_owned(), *method)).collect();
    all.push(("linear, general form".to_owned(), &GENERAL));
    all.push(("linear, all poses".to_owned(), &ALL_POSES));
    all.push(("umbmark, y form".to_owned(), &BY_Y));
    all
}

fn calibrations(text: &mut String) -> std::fmt::Result {
    let sets = sets();
    for (name, set) in &sets {
        for (of, method) in all_methods() {
            let found = method.calibrate(&[set.session()]);
            writeln!(text, "{name}: {of}: {found:?}")?;
            let mut report = MethodReport::new(method.name(), &found, &set.robot);
            for of_scale in [false, true] {
                report.withhold_undetermined(of_scale);
                writeln!(text, "{name}: {of}: report: {} {report:?}", report.determines_anything())?;
            }
        }
    }
    let [(_, poses), (_, beside), _] = &sets;
    let parts = [
        &[Protocol::Straight][..],
        &[Protocol::Spin],
        &[Protocol::SquareCw, Protocol::SquareCcw],
        &[Protocol::CircleCcw, Protocol::CircleCw],
        &[],
    ];
    for protocols in parts {
        let part = only(beside, protocols);
        for (of, method) in all_methods() {
            writeln!(text, "{protocols:?}: {of}: {:?}", method.calibrate(&[part.session()]))?;
        }
    }
    for (of, method) in all_methods() {
        writeln!(text, "two sessions: {of}: {:?}", method.calibrate(&[poses.session(), beside.session()]))?;
    }
    writeln!(text, "trimmed: {:?}", Censi::DEFAULT.trimmed(&Censi::DEFAULT.samples(&[beside.session()])))
}

/// The calibration of a method as a file would have it.
fn named(set: &Dataset, name: &str) -> AugmentedCalibration {
    let method = calib::method(name).expect("a method");
    let report = MethodReport::new(name, &method.calibrate(&[set.session()]), &set.robot);
    let report = CalibrationReport { dataset: Names::default(), trained_on: Vec::new(), methods: vec![report] };
    report.calibrations().pop().expect("one").into()
}

fn drifts(text: &mut String) -> std::fmt::Result {
    let [(_, poses), (_, beside), (_, marks)] = &sets();
    let joint = named(beside, "joint");
    for (alignment, all_pairs, value, unit) in [
        (Alignment::None, false, 3.0, DeltaUnit::Frames),
        (Alignment::Se2, true, 20.0, DeltaUnit::Degrees),
        (Alignment::None, false, 0.2, DeltaUnit::Radians),
        (Alignment::Se2, true, 0.2, DeltaUnit::Metres),
        (Alignment::None, false, 0.25, DeltaUnit::Metres),
    ] {
        let delta = Delta::new(value, unit, all_pairs, 0.1).expect("a step");
        let pose_errors = Some(PoseErrorOptions { alignment, delta });
        let options = EvaluationOptions { name_runs: all_pairs, pose_errors };
        writeln!(text, "{} {}", delta.describe(), alignment.name())?;
        for set in [poses, beside, marks] {
            let paths = evaluate_runs_and_paths(&set.session(), Some(&joint), &options, &mut 0.0);
            let drifts: Vec<_> = paths.iter().map(|(drift, _)| drift.clone()).collect();
            let mut drift = calib::CalibrationDrift::of_runs(Some(&joint.calibration), drifts);
            // A straight, a spin, a square and a circle.
            drift.runs = [0, 5, 9, 13].map(|run| drift.runs[run].clone()).into();
            writeln!(text, "drift: {}", toml::to_string(&drift).expect("it has a form").replace('\n', "; "))?;
            let last = paths.last().and_then(|(_, path)| path.as_ref());
            let ends = last.map(|path| (path.rows.last(), path.measured.first(), path.at_measured.last()));
            writeln!(text, "path: {ends:?}")?;
        }
    }
    let session = beside.session();
    for run in &session.runs {
        let corrected = corrected_run(&session, run, &joint, &mut 0.0);
        let corrected = corrected.map(|run| (run.length_m, run.poses[0], run.poses[run.poses.len() - 1], run.poses));
        let noise = calib::OdometryNoise {
            wheel_sigma_m_per_sqrt_m: 1e-3,
            turn_sigma_rad_per_sqrt_rad: 2e-3,
            is_assumed: false,
        };
        let covariances = corrected.as_ref().map(|(_, _, _, poses)| path_covariances(poses, 0.3, &noise));
        let last = covariances.and_then(|all| all.last().copied());
        writeln!(
            text,
            "corrected: {:?} {last:?}",
            corrected.map(|(length_m, first, last, _)| (length_m, first, last))
        )?;
    }
    let sessions = [poses.session(), beside.session(), marks.session()];
    let methods = ["direct", "umbmark"].map(|name| calib::method(name).expect("a method"));
    writeln!(text, "compared: {:?}", compare(&sessions, &[joint], &methods, || ()))?;
    let keys = Parameter::ESTIMATED.into_iter().chain(Parameter::EXTRINSICS).map(Parameter::key);
    let unequal = dataset::NominalRobot { left_wheel_diameter_m: 0.16, ..poses.robot };
    writeln!(text, "stated: {:?}", keys.map(|key| nominal_value(&unequal, key)).collect::<Vec<_>>())
}

#[test]
fn regress_no_number_of_a_calibration_or_a_drift_moves() {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/known_robot/golden.txt");
    let mut text = String::new();
    calibrations(&mut text).and_then(|()| drifts(&mut text)).expect("written");
    assert_unmoved(&file, &text);
}
