//! Along a log: dead reckoning with terms, and the filter that goes through it row by row.

use std::f64::consts::FRAC_PI_2;

use calib::methods::augmented_kalman::AugmentedKalman;
use calib::{
    AugmentedCalibration, EvaluationOptions, NamedCalibration, RunPath, corrected_run, evaluate_runs_and_paths,
};
use dataset::Dataset;
use kinematics::Pose;
use model_term::{Interval, Measurement, ModelTerm, TermParameter};

use crate::log::{DIAMETER_M, Log, SEPARATION_M};

/// Both wheels travel farther by a share, and measurements are where the robot is a while later.
#[derive(Clone)]
struct Farther;

impl ModelTerm for Farther {
    fn parameters(&self) -> &[TermParameter] {
        const SHARE: TermParameter = TermParameter { name: "share", unit: "1", prior_sigma: 1.0 };
        const AHEAD: TermParameter = TermParameter { name: "ahead_s", unit: "s", prior_sigma: 1.0 };
        &[SHARE, AHEAD]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        gradient[0] = interval.change(interval.travel_m);
    }

    fn measurement(&mut self, measurement: &Measurement<'_>, gradient: &mut [Pose]) {
        gradient[1] = Pose::new(measurement.twist.v_m_s, 0.0, measurement.twist.omega_rad_s);
    }
}

const BODY_FROM_SENSOR: Pose = Pose::new(0.12, -0.05, 0.3);

/// A log whose instrument stands beside the axle.
fn log() -> Dataset {
    let mut dataset = Log { body_from_sensor: BODY_FROM_SENSOR, ..Log::exact() }.dataset();
    for run in &mut dataset.runs {
        run.info.continuous = true;
    }
    dataset
}

/// The robot with wheels smaller by a share.
fn robot(smaller_by: f64) -> NamedCalibration {
    let values = [
        ("left_wheel_diameter_m", DIAMETER_M.left / (1.0 + smaller_by)),
        ("right_wheel_diameter_m", DIAMETER_M.right / (1.0 + smaller_by)),
        ("wheel_separation_m", SEPARATION_M),
        ("sensor_x_m", BODY_FROM_SENSOR.x_m),
        ("sensor_y_m", BODY_FROM_SENSOR.y_m),
        ("sensor_theta_rad", BODY_FROM_SENSOR.theta_rad),
    ];
    NamedCalibration::new("x".to_owned(), values.map(|(key, value)| (key.to_owned(), value)).into())
}

fn paths(dataset: &Dataset, calibration: &AugmentedCalibration) -> Vec<RunPath> {
    let options = EvaluationOptions { name_runs: true, pose_errors: None };
    let found = evaluate_runs_and_paths(&dataset.session(), Some(calibration), &options, &mut 0.0);
    found.into_iter().map(|(_, path)| path.expect("a path")).collect()
}

/// The largest difference of the poses at the rows and at the measurements, metres and radians.
fn apart(one: &[RunPath], other: &[RunPath]) -> f64 {
    let mut largest = 0.0_f64;
    for (one, other) in one.iter().zip(other) {
        assert_eq!((one.rows.len(), one.measured.len()), (other.rows.len(), other.measured.len()));
        let at = |path: &RunPath| path.at_measured.iter().map(|pose| pose.expect("within the log")).collect::<Vec<_>>();
        let (one_at, other_at) = (at(one), at(other));
        let pairs = one.rows.iter().zip(&other.rows).chain(one.measured.iter().zip(&other.measured));
        for (a, b) in pairs.chain(one_at.iter().zip(&other_at)) {
            let off = a.to(*b);
            largest = largest.max(off.x_m.hypot(off.y_m)).max(off.theta_rad.abs());
        }
    }
    largest
}

/// Rows of 0.04 rad, of which a plain calibration takes the chord for the arc: 7·10⁻⁵ of 4 m.
const OF_CHORDS_M: f64 = 3e-4;

#[test]
fn a_term_that_makes_wheels_roll_farther_is_larger_wheels() {
    let dataset = log();
    let plain = paths(&dataset, &robot(0.0).into());
    let with = |smaller_by: f64, term_values: [f64; 2]| {
        let terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(Farther)];
        let calibration = robot(smaller_by);
        paths(&dataset, &AugmentedCalibration { calibration, terms, term_values: term_values.into() })
    };
    for share in [0.0, 0.02] {
        let off = apart(&with(share, [share, 0.0]), &plain);
        assert!(off < OF_CHORDS_M, "{share}: {off}");
    }
    // Without the term the wheels are too small, by centimetres.
    assert!(apart(&with(0.02, [0.0, 0.0]), &plain) > 0.02);
}

#[test]
fn what_a_term_adds_to_measurements_is_taken_out_of_them_as_a_latency_is() {
    let late_s = 0.03;
    let mut late = Log { body_from_sensor: BODY_FROM_SENSOR, latency_s: late_s, ..Log::exact() }.dataset();
    late.runs.iter_mut().for_each(|run| run.info.continuous = true);
    let largest_m = |term_values: [f64; 2], latency_s: f64| {
        let mut calibration = robot(0.0);
        calibration.values.insert("latency_s".to_owned(), latency_s);
        let terms: Vec<Box<dyn ModelTerm>> = vec![Box::new(Farther)];
        let paths = paths(&late, &AugmentedCalibration { calibration, terms, term_values: term_values.into() });
        let off_m = |path: &RunPath| {
            let pairs = path.at_measured.iter().zip(&path.measured).filter_map(|(at, seen)| Some((*at)?.to(*seen)));
            pairs.map(|off| off.x_m.hypot(off.y_m)).fold(0.0, f64::max)
        };
        paths.iter().map(off_m).fold(0.0, f64::max)
    };
    let (by_latency_m, by_term_m, by_none_m) =
        (largest_m([0.0; 2], late_s), largest_m([0.0, -late_s], 0.0), largest_m([0.0; 2], 0.0));
    // Some centimetres; at corners a rate is that of both sides, which leaves a part of them.
    assert!(by_none_m > 0.02, "{by_none_m}");
    assert!(by_latency_m < 0.2 * by_none_m && by_term_m < 0.2 * by_none_m, "{by_latency_m} {by_term_m} {by_none_m}");
}

/// The way up a slope is shorter: what is driven depends on the heading in the room.
#[derive(Clone)]
struct Uphill;

impl ModelTerm for Uphill {
    fn parameters(&self) -> &[TermParameter] {
        const SLOPE: TermParameter = TermParameter { name: "slope", unit: "1", prior_sigma: 1.0 };
        &[SLOPE]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let share = -interval.world_from_body.theta_rad.cos();
        gradient[0] = interval.change(interval.travel_m.map(|travel_m| share * travel_m));
    }
}

#[test]
fn a_path_depends_on_where_it_starts_if_a_term_does_and_nothing_says_where() {
    let mut dataset = log();
    dataset.runs[9].truth.clear();
    let session = dataset.session();
    let depends = |run: usize, term: Box<dyn ModelTerm>, value: f64| {
        let term_values = vec![value; term.parameters().len()];
        let calibration = AugmentedCalibration { calibration: robot(0.0), terms: vec![term], term_values };
        let corrected = corrected_run(&session, &session.runs[run], &calibration, &mut 0.0).expect("a log");
        assert_eq!(corrected.starts_at_identity_why.is_some(), run == 9);
        corrected.depends_on_start
    };
    assert!(depends(9, Box::new(Uphill), 0.05));
    assert!(!depends(9, Box::new(Uphill), 0.0) && !depends(9, Box::new(Farther), 0.05));
    assert!(!depends(8, Box::new(Uphill), 0.05), "the first measured pose says where it starts");
}

#[test]
fn the_filter_counts_what_the_nominal_robot_drove() {
    let dataset = Log::exact().dataset();
    let followed = AugmentedKalman::DEFAULT.follow(&[dataset.session()]).expect("poses");
    // Straights, squares of 4 m and circles of 0.6 m; whole and half spins, squares and circles turn.
    let distance_m = (1.0 + 1.1 + 0.9 + 1.05) + 4.0 * 4.0 + 4.0 * 0.6 * 4.0 * FRAC_PI_2;
    let turn_rad = 4.0 * FRAC_PI_2 * 3.0 + 8.0 * 4.0 * FRAC_PI_2;
    let last = followed.last().expect("measurements");
    // The last row's travel of each of the 16 runs may be behind the last measurement: some centimetres.
    assert!((last.distance_m / distance_m - 1.0).abs() < 0.02, "{} of {distance_m}", last.distance_m);
    assert!((last.turn_rad / turn_rad - 1.0).abs() < 0.02, "{} of {turn_rad}", last.turn_rad);
    assert_eq!(last.measurements, followed.len());
    let runs: std::collections::BTreeSet<&str> = followed.iter().map(|step| step.run.as_str()).collect();
    assert_eq!(runs.len(), dataset.runs.len());
    for pair in followed.windows(2) {
        assert!(pair[0].distance_m <= pair[1].distance_m && pair[0].turn_rad <= pair[1].turn_rad);
    }
    // What is known of the parameters grows.
    assert!(last.sigma_m.amax() < 0.1 * followed[0].sigma_m.amax(), "{:?}", last.sigma_m);
}
